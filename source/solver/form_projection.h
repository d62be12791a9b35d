#pragma once

#include "form_points.h"

namespace peat {
/// The L2 projection Pi of what the points of a cell have onto the volumetric strains that the displacement
/// resolves without locking: linear functions for Q2, constants else (theory.md, eq. 37). Weights are the
/// points' volumes at the start of the step.
template <int dim, unsigned int reach>
class CellProjection
{
public:
  using Points = FormPoints<dim, reach>;
  static constexpr unsigned int n_functions = reach == 3 ? dim + 1 : 1;

  /// Orthogonal functions at the points of a slice, eight by eight. Where the points cannot tell a function
  /// from those before it, it is zero, and its norm is the volume.
  void reinit(const Grid<dim> &grid, const Body<dim> &body, const Slice &slice,
              const std::vector<Points> &points);

  /// values <- Pi(values), eight points by eight.
  void project(std::vector<Lanes> &values) const;

  /// psi_k at points.
  const std::array<Lanes, n_functions> &functions(const std::size_t batch) const { return psi[batch]; }
  /// Sum of V psi_k^2.
  const std::array<double, n_functions> &norms() const { return norm; }

private:
  double product(unsigned int k, unsigned int l) const;

  std::vector<Lanes> volume;
  std::vector<std::array<Lanes, n_functions>> psi;
  std::array<double, n_functions> norm;
};

template <int dim, unsigned int reach>
double CellProjection<dim, reach>::product(const unsigned int k, const unsigned int l) const
{
  Lanes total = {};
  for (std::size_t b = 0; b < psi.size(); ++b)
    total += volume[b] * psi[b][k] * psi[b][l];
  return sum(total);
}

template <int dim, unsigned int reach>
void CellProjection<dim, reach>::reinit(const Grid<dim> &grid, const Body<dim> &body, const Slice &slice,
                                        const std::vector<Points> &points)
{
  // Of the variance of a linear function in a full cell, 1/12.
  constexpr double distinguishable = 1e-8;
  volume.resize(points.size());
  psi.resize(points.size());
  for (std::size_t b = 0; b < points.size(); ++b) {
    volume[b] = points[b].volume;
    psi[b][0] = broadcast(1.);
    for (unsigned int k = 1; k < n_functions; ++k)
      for (unsigned int l = 0; l < n_lanes; ++l)
        psi[b][k][l] = (points[b].position(body, l)[k - 1] - grid.lower(slice.cell, k - 1)) /
                           grid.size(slice.cell, k - 1) -
                       0.5;
  }
  norm[0] = product(0, 0);
  for (unsigned int k = 1; k < n_functions; ++k) {
    // Twice is enough against round-off.
    for (unsigned int repetition = 0; repetition < 2; ++repetition)
      for (unsigned int l = 0; l < k; ++l) {
        const double share = product(k, l) / norm[l];
        for (auto &functions : psi)
          functions[k] -= share * functions[l];
      }
    norm[k] = product(k, k);
    if (norm[k] < distinguishable / 12. * norm[0]) {
      for (auto &functions : psi)
        functions[k] = Lanes{};
      norm[k] = norm[0];
    }
  }
}

template <int dim, unsigned int reach>
void CellProjection<dim, reach>::project(std::vector<Lanes> &values) const
{
  std::array<double, n_functions> coefficient;
  for (unsigned int k = 0; k < n_functions; ++k) {
    Lanes moment = {};
    for (std::size_t b = 0; b < values.size(); ++b)
      moment += volume[b] * psi[b][k] * values[b];
    coefficient[k] = sum(moment) / norm[k];
  }
  for (std::size_t b = 0; b < values.size(); ++b) {
    values[b] = Lanes{};
    for (unsigned int k = 0; k < n_functions; ++k)
      values[b] += coefficient[k] * psi[b][k];
  }
}
} // namespace peat
