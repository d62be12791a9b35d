#pragma once

#include <peat/simulation/case.h>
#include <peat/solver/scene.h>
#include <peat/solver/scheme.h>

#include <limits>
#include <string>
#include <vector>

namespace peat {
/// What a dynamic stage of material points would cost with one scheme.
struct SchemeEstimate
{
  Scheme scheme = Scheme::explicit_steps;
  std::string why_not; ///< it does not apply; nothing else is then known. "": it does
  double dt = 0.;      ///< typical step [s]
  double n_steps = 0.;
  double cost = std::numeric_limits<double>::infinity();    ///< in explicit steps
  std::string limit;                                        ///< what binds the step
  double largest_step = std::numeric_limits<double>::max(); ///< [s] that is accurate; semi-implicit
};

/// What the loads ask of implicit steps in a stage.
struct Demand
{
  /// Something changes faster than a wave passes the bodies, or moves at the start: waves run.
  bool waves = false;
  std::string why;      ///< they do
  double crossing = 0.; ///< period of the gravest undrained wave of the bodies [s]
  double changes = 0.;  ///< sum over the loads of total variation over range
};

/// Looks at the loads as functions of time, and at the bodies' velocities. Collective.
template <int dim>
Demand demand(const Case<dim> &parameters, const StageParameters &stage, const Scene<dim> &scene,
              const Grid<dim> &grid, double start);

/// The three schemes in the order of their costs, those that do not apply last. Collective.
template <int dim>
std::vector<SchemeEstimate> estimate_schemes(const Case<dim> &parameters, const StageParameters &stage,
                                             const Scene<dim> &scene, const Grid<dim> &grid,
                                             const Demand &asked);

/// "semi-implicit: 4.1e3 steps of 2e-5 s (skeleton wave in 'soil'), cost 1.2e4"
std::string describe(const SchemeEstimate &estimate);
} // namespace peat
