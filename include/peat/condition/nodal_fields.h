#pragma once

#include <peat/grid/active_nodes.h>
#include <peat/grid/surface.h>

#include <string>
#include <vector>

namespace peat {
/// What a step knows on the active nodes, one row a node; the columns of `sums` are those of the points'
/// kernels.
template <int dim>
struct NodalFields
{
  double time = 0.; ///< at the start of the step [s]
  double dt = 0.;   ///< [s]

  unsigned int n_sums = 0;                                                  ///< columns of sums
  std::vector<double> sums;                                                 ///< see Sums
  double mass(const std::size_t node) const { return sums[node * n_sums]; } ///< [kg]
  std::vector<double> force;         ///< external forces other than gravity [N], dim columns
  std::vector<double> contact_force; ///< by other bodies [N], dim columns; only with contacts
  std::vector<double> velocity;      ///< at the start of the step [m/s], dim columns
  std::vector<double> acceleration;  ///< [m/s^2], dim columns
  std::vector<double> new_velocity;  ///< at the end of the step [m/s], dim columns
  std::vector<double> pressure_load; ///< - closed integral of pbar N n [N], dim columns; saturated scenes
  std::vector<double> flux;          ///< w = kappa R [m/s], dim columns; saturated scenes
};
} // namespace peat
