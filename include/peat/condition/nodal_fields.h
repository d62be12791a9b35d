#pragma once

#include <peat/grid/active_nodes.h>

#include <deal.II/base/tensor.h>

#include <string>
#include <vector>

namespace peat {
/// A piece of a body's surface: where it is, how large, and which nodes feel what acts on it.
template <int dim>
struct SurfacePoint
{
  static constexpr unsigned int n_nodes = 1 << dim;
  dealii::Point<dim> initial_position;
  dealii::Point<dim> position;
  dealii::Tensor<1, dim> area; ///< outward normal times area [m^(dim-1)]
  std::array<std::uint32_t, n_nodes> node;
  std::array<double, n_nodes> N;
};

template <int dim>
using Surface = std::vector<SurfacePoint<dim>>;

/// What a step knows on the active nodes, one row a node; the columns of `sums` are those of the points'
/// kernels.
template <int dim>
struct NodalFields
{
  double time = 0.; ///< at the start of the step [s]
  double dt = 0.;   ///< [s]

  unsigned int n_sums = 0;           ///< columns of sums
  std::vector<double> sums;          ///< see Sums
  std::vector<double> force;         ///< external forces other than gravity [N], dim columns
  std::vector<double> velocity;      ///< at the start of the step [m/s], dim columns
  std::vector<double> acceleration;  ///< [m/s^2], dim columns
  std::vector<double> new_velocity;  ///< at the end of the step [m/s], dim columns
  std::vector<double> pressure_load; ///< - closed integral of pbar N n [N], dim columns; saturated scenes
  std::vector<double> flux;          ///< w = kappa R [m/s], dim columns; saturated scenes
};
} // namespace peat
