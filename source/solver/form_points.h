#pragma once

#include <peat/material/mixture.h>
#include <peat/material/tensor.h>
#include <peat/points/body.h>
#include <peat/solver/space.h>
#include <peat/solver/up_form.h>
#include <peat/transfer/weights.h>

// What the weak form needs of the points of a cell: their data and the shape functions at eight of them.

namespace peat {
/// Up to eight points of a cell: their data and the shape functions at them. Lanes without a point have no
/// volume and no mass.
template <int dim, unsigned int reach>
class FormPoints
{
public:
  static constexpr unsigned int n_nodes = dim == 2 ? reach * reach : reach * reach * reach;
  static constexpr unsigned int n_pressures = Space<dim>::n_pressures;
  static constexpr unsigned int n_stress = dim == 2 ? 4 : 6;

  FormPoints(const Grid<dim> &grid, const Body<dim> &body, const Slice &slice, const std::uint32_t begin);

  unsigned int n;
  Lanes volume, mass;
  std::array<Lanes, n_nodes> N;
  std::array<std::array<Lanes, dim>, n_nodes> dN;
  std::array<Lanes, n_pressures> M; ///< shape functions of the pressure
  std::array<std::array<Lanes, dim>, n_pressures> dM;

  Lanes load(const int column) const
  {
    Lanes result;
    for (unsigned int l = 0; l < n_lanes; ++l)
      result[l] = row[l][column];
    return result;
  }
  void store(const int column, const Lanes x) const
  {
    for (unsigned int l = 0; l < n; ++l)
      const_cast<double *>(row[l])[column] = x[l];
  }
  StressLanes stress(const Layout &layout) const
  {
    StressLanes result = {};
    for (unsigned int c = 0; c < n_stress; ++c)
      result[c] = load(layout.stress + c);
    return result;
  }
  void store(Body<dim> &, const Layout &layout, const StressLanes &stress, const Lanes *state) const
  {
    for (unsigned int c = 0; c < n_stress; ++c)
      store(layout.stress + c, stress[c]);
    for (unsigned int c = 0; c < layout.n_state; ++c)
      store(layout.state + c, state[c]);
  }
  Lanes porosity(const Layout &layout, const Mixture &mixture) const
  {
    return layout.porosity >= 0 ? load(layout.porosity) : broadcast(mixture.porosity());
  }
  const dealii::Point<dim> &position(const Body<dim> &body, const unsigned int l) const
  {
    return body.position(handle[l]);
  }

  /// Component d of a nodal field.
  Lanes value(const double *field, const unsigned int d) const
  {
    Lanes result = {};
    for (unsigned int i = 0; i < n_nodes; ++i)
      result += N[i] * field[i * dim + d];
    return result;
  }
  GradientLanes gradient(const double *field) const
  {
    GradientLanes result = {};
    for (unsigned int i = 0; i < n_nodes; ++i)
      for (unsigned int d = 0; d < dim; ++d)
        for (unsigned int e = 0; e < dim; ++e)
          result[3 * d + e] += dN[i][e] * field[i * dim + d];
    return result;
  }
  Lanes pressure(const double *field) const
  {
    Lanes result = {};
    for (unsigned int i = 0; i < n_pressures; ++i)
      result += M[i] * field[i];
    return result;
  }
  Lanes pressure_slope(const double *field, const unsigned int d) const
  {
    Lanes result = {};
    for (unsigned int i = 0; i < n_pressures; ++i)
      result += dM[i][d] * field[i];
    return result;
  }

  /// Refer slopes and volumes to a configuration that has moved on by F: grad N <- F^-T grad N, V <- det F V.
  void push_forward(const GradientLanes &inverse_of_F, Lanes det_F);

  /// Positions follow the displacement U of a step if they `move`; under finite strain porosities, volumes
  /// and, with `move`, extents follow its gradient.
  void deform(Body<dim> &body, const GradientLanes &gradient, const double *U, bool move) const;

private:
  std::array<const double *, n_lanes> row;
  std::array<std::uint32_t, n_lanes> handle;
};

template <int dim, unsigned int reach>
FormPoints<dim, reach>::FormPoints(const Grid<dim> &grid, const Body<dim> &body, const Slice &slice,
                                   const std::uint32_t begin)
    : n(std::min(n_lanes, slice.end - begin))
{
  for (unsigned int l = 0; l < n_lanes; ++l) {
    handle[l] = body.handles()[begin + std::min(l, n - 1)];
    row[l] = body.row(handle[l]);
  }
  const Layout &layout = body.layout();
  volume = load(layout.volume);
  mass = load(layout.mass);
  for (unsigned int l = n; l < n_lanes; ++l)
    volume[l] = mass[l] = 0.;

  Weights<dim, reach> w;
  Weights<dim, 2> wp;
  for (unsigned int d = 0; d < dim; ++d) {
    const CellInterval interval = CellInterval::of(grid, slice.cell, d);
    Lanes x;
    for (unsigned int l = 0; l < n_lanes; ++l)
      x[l] = body.position(handle[l])[d];
    evaluate_direction(x, reach == 4 ? load(layout.extent + d) : Lanes{}, interval, w[d]);
    evaluate_direction(x, Lanes{}, interval, wp[d]);
  }
  const auto product = [](const auto &weights, const unsigned int per_direction, unsigned int i,
                          const int slope_direction) {
    Lanes result = broadcast(1.);
    for (int d = 0; d < dim; ++d, i /= per_direction)
      result *=
          d == slope_direction ? weights[d].slope[i % per_direction] : weights[d].value[i % per_direction];
    return result;
  };
  for (unsigned int i = 0; i < n_nodes; ++i) {
    N[i] = product(w, reach, i, -1);
    for (int d = 0; d < dim; ++d)
      dN[i][d] = product(w, reach, i, d);
  }
  for (unsigned int i = 0; i < n_pressures; ++i) {
    M[i] = product(wp, 2, i, -1);
    for (int d = 0; d < dim; ++d)
      dM[i][d] = product(wp, 2, i, d);
  }
}

template <int dim, unsigned int reach>
void FormPoints<dim, reach>::push_forward(const GradientLanes &inverse_of_F, const Lanes det_F)
{
  const auto push = [&](std::array<Lanes, dim> &slope) {
    std::array<Lanes, dim> result;
    for (unsigned int d = 0; d < dim; ++d) {
      result[d] = inverse_of_F[d] * slope[0];
      for (unsigned int e = 1; e < dim; ++e)
        result[d] += inverse_of_F[3 * e + d] * slope[e];
    }
    slope = result;
  };
  for (auto &slope : dN)
    push(slope);
  for (auto &slope : dM)
    push(slope);
  volume *= det_F;
}

template <int dim, unsigned int reach>
void FormPoints<dim, reach>::deform(Body<dim> &body, const GradientLanes &h, const double *U,
                                    const bool move) const
{
  const Layout &layout = body.layout();
  if (move)
    for (unsigned int d = 0; d < dim; ++d) {
      const Lanes step = value(U, d);
      for (unsigned int l = 0; l < n; ++l)
        body.position(handle[l])[d] += step[l];
    }
  if (!body.material().law().finite_strain())
    return;
  const Lanes J = 1. + volume_change(h);
  if (layout.porosity >= 0)
    store(layout.porosity, 1. - (1. - load(layout.porosity)) / J);
  store(layout.volume, load(layout.volume) * J);
  // By the lengths of the domain's edges, which large rotations leave as they are.
  for (unsigned int d = 0; d < dim && move && layout.extent >= 0; ++d) {
    Lanes squared = {};
    for (unsigned int e = 0; e < dim; ++e)
      squared += (h[3 * e + d] + (e == d)) * (h[3 * e + d] + (e == d));
    store(layout.extent + d, load(layout.extent + d) * sqrt(squared));
  }
}
} // namespace peat
