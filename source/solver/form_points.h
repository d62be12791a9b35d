#pragma once

#include <peat/material/mixture.h>
#include <peat/points/body.h>
#include <peat/solver/space.h>
#include <peat/solver/up_form.h>
#include <peat/transfer/weights.h>

#include <Eigen/Core>

// What the weak form needs of the points of a cell: shape functions at eight of them, and the products of
// shape functions of all of them that make the cell's matrix.

namespace peat {
/// Up to eight points of a cell: their data and the shape functions at them. Lanes without a point have no
/// volume and no mass.
template <int dim, unsigned int reach>
class FormPoints
{
public:
  static constexpr unsigned int n_nodes = dim == 2 ? reach * reach : reach * reach * reach;
  static constexpr unsigned int n_pressures = Space<dim>::n_pressures;
  static constexpr unsigned int stress_index[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
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

  /// Porosity, and with `move` position, volume and extent, follow the displacement gradient of a step.
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
void FormPoints<dim, reach>::deform(Body<dim> &body, const GradientLanes &h, const double *U,
                                    const bool move) const
{
  const Layout &layout = body.layout();
  if (!body.material().law().finite_strain() && !move)
    return;
  Lanes J = 1. + h[0] + h[4] + h[8];
  if (layout.porosity >= 0)
    store(layout.porosity, 1. - (1. - load(layout.porosity)) / J);
  if (!move)
    return;
  for (unsigned int d = 0; d < dim; ++d) {
    const Lanes step = value(U, d);
    for (unsigned int l = 0; l < n; ++l)
      body.position(handle[l])[d] += step[l];
  }
  if (!body.material().law().finite_strain())
    return;
  store(layout.volume, load(layout.volume) * J);
  for (unsigned int d = 0; d < dim && layout.extent >= 0; ++d)
    store(layout.extent + d, load(layout.extent + d) * (1. + h[4 * d]));
}

/// The shape functions of all points of a cell as tall matrices, whose products make the cell's matrix.
template <int dim, unsigned int reach>
class StackedPoints
{
public:
  using Points = FormPoints<dim, reach>;
  static constexpr unsigned int n_nodes = Points::n_nodes, n_u = n_nodes * dim, n_p = Space<dim>::n_pressures;
  static constexpr unsigned int n_strain = dim == 2 ? 3 : 6;

  struct Coefficients
  {
    double alpha, fluid_density;
    Lanes storage, mobility;
  };

  /// Make room for a cell with so many points.
  void clear(const unsigned int n_points)
  {
    rows = 0;
    largest_compliance = 0.;
    if (B.rows() < n_points * n_strain) {
      B.setZero(n_points * n_strain, n_u);
      DB.setZero(n_points * n_strain, n_u);
      N.resize(n_points, n_nodes);
      mN.resize(n_points, n_nodes);
      divergence.resize(n_points, n_u);
      M.resize(n_points, n_p);
      storage.resize(n_points, n_p);
      coupling.resize(n_points, n_p);
      drained.resize(n_points, n_p);
      dM.resize(n_points * dim, n_p);
      mobility.resize(n_points * dim, n_p);
      drag.resize(n_points * dim, n_p);
    }
  }
  void add(const Points &points, const std::array<Lanes, 36> &tangent, const Coefficients &c,
           bool has_pressure);
  /// The cell's matrix: minus the derivative of the residual.
  void multiply(const TimeLevel &level, bool has_pressure, dealii::FullMatrix<double> &result);
  /// sum V alpha^2 / K N_p N_p with the drained bulk modulus K.
  Eigen::Matrix<double, n_p, n_p> pressure_mass() const
  {
    return M.topRows(rows).transpose() * drained.topRows(rows);
  }
  /// Compliance for the stabilisation [1/Pa]: the larger of 1/M (one-dimensional optimum) and 1/(4 G).
  double compliance() const { return largest_compliance; }

private:
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  unsigned int rows = 0; ///< points so far
  double largest_compliance = 0.;
  Matrix B, DB, N, mN, divergence, M, storage, coupling, drained, dM, mobility, drag;
  Matrix K, mass, Qc, S, H, G;
};

template <int dim, unsigned int reach>
void StackedPoints<dim, reach>::add(const Points &points, const std::array<Lanes, 36> &tangent,
                                    const Coefficients &c, const bool has_pressure)
{
  constexpr unsigned int component[6] = {0, 1, dim == 2 ? 3u : 2u, 3, 4, 5};
  constexpr unsigned int pairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};
  for (unsigned int l = 0; l < points.n; ++l, ++rows) {
    const double V = points.volume[l];
    largest_compliance =
        std::max({largest_compliance, 1. / tangent[0][l], tangent[21][l] > 0. ? 0.25 / tangent[21][l] : 0.});
    // Bulk modulus lambda + 2 mu / dim.
    const double bulk = (tangent[0][l] + (dim - 1) * tangent[1][l]) / dim;
    Eigen::Matrix<double, n_strain, n_strain> D;
    for (unsigned int a = 0; a < n_strain; ++a)
      for (unsigned int b = 0; b < n_strain; ++b)
        D(a, b) = V * tangent[6 * component[a] + component[b]][l];
    auto block = B.middleRows(rows * n_strain, n_strain);
    for (unsigned int i = 0; i < n_nodes; ++i) {
      N(rows, i) = points.N[i][l];
      mN(rows, i) = points.mass[l] * points.N[i][l];
      for (unsigned int a = 0; a < n_strain; ++a) {
        const auto &pair = pairs[component[a]];
        if (pair[0] == pair[1])
          block(a, i * dim + pair[0]) = points.dN[i][pair[0]][l];
        else {
          block(a, i * dim + pair[0]) = points.dN[i][pair[1]][l];
          block(a, i * dim + pair[1]) = points.dN[i][pair[0]][l];
        }
      }
      for (unsigned int d = 0; d < dim; ++d)
        divergence(rows, i * dim + d) = points.dN[i][d][l];
    }
    DB.middleRows(rows * n_strain, n_strain).noalias() = D * block;
    if (!has_pressure)
      continue;
    for (unsigned int i = 0; i < n_p; ++i) {
      M(rows, i) = points.M[i][l];
      storage(rows, i) = V * c.storage[l] * points.M[i][l];
      coupling(rows, i) = V * c.alpha * points.M[i][l];
      drained(rows, i) = V * c.alpha * c.alpha / bulk * points.M[i][l];
      for (unsigned int d = 0; d < dim; ++d) {
        const double slope = points.dM[i][d][l];
        dM(d * M.rows() + rows, i) = slope;
        mobility(d * M.rows() + rows, i) = V * c.mobility[l] * slope;
        drag(d * M.rows() + rows, i) = V * c.mobility[l] * c.fluid_density * slope;
      }
    }
  }
}

template <int dim, unsigned int reach>
void StackedPoints<dim, reach>::multiply(const TimeLevel &level, const bool has_pressure,
                                         dealii::FullMatrix<double> &result)
{
  K.noalias() = level.share * B.topRows(rows * n_strain).transpose() * DB.topRows(rows * n_strain);
  result = 0.;
  for (unsigned int i = 0; i < n_u; ++i)
    for (unsigned int j = 0; j < n_u; ++j)
      result(i, j) = K(i, j);
  if (level.acceleration > 0.) {
    mass.noalias() = level.acceleration * N.topRows(rows).transpose() * mN.topRows(rows);
    for (unsigned int i = 0; i < n_nodes; ++i)
      for (unsigned int j = 0; j < n_nodes; ++j)
        for (unsigned int d = 0; d < dim; ++d)
          result(i * dim + d, j * dim + d) += mass(i, j);
  }
  if (!has_pressure)
    return;

  const double scale = level.fluid_scale();
  Qc.noalias() = divergence.topRows(rows).transpose() * coupling.topRows(rows);
  S.noalias() = M.topRows(rows).transpose() * storage.topRows(rows);
  H.setZero(n_p, n_p);
  for (unsigned int d = 0; d < dim; ++d)
    H.noalias() += dM.middleRows(d * M.rows(), rows).transpose() * mobility.middleRows(d * M.rows(), rows);
  for (unsigned int j = 0; j < n_p; ++j) {
    for (unsigned int i = 0; i < n_u; ++i) {
      result(i, n_u + j) = -level.share * Qc(i, j);
      result(n_u + j, i) = scale * level.velocity * Qc(i, j);
    }
    for (unsigned int i = 0; i < n_p; ++i)
      result(n_u + i, n_u + j) = scale * (level.pressure_rate * S(i, j) + level.share * H(i, j));
  }
  if (!level.seepage_inertia || level.acceleration == 0.)
    return;
  for (unsigned int d = 0; d < dim; ++d) {
    G.noalias() = drag.middleRows(d * M.rows(), rows).transpose() * N.topRows(rows);
    for (unsigned int i = 0; i < n_p; ++i)
      for (unsigned int j = 0; j < n_nodes; ++j)
        result(n_u + i, j * dim + d) += scale * level.acceleration * G(i, j);
  }
}

/// Mean over the points of a cell by their volumes.
template <int dim>
double mean_pressure(const Body<dim> &body, const Slice &slice)
{
  double V = 0., Vp = 0.;
  for (std::uint32_t i = slice.begin; i < slice.end; ++i) {
    const double *row = body.row(body.handles()[i]);
    V += row[body.layout().volume];
    Vp += row[body.layout().volume] * row[body.layout().pressure];
  }
  return Vp / V;
}
} // namespace peat
