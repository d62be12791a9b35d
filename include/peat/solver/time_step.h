#pragma once

#include <peat/points/body.h>

#include <string>

namespace peat {
/// A stable step and what limits it.
struct StableStep
{
  double dt;
  std::string limit; ///< e.g. "wave in 'ground'"
};

/// Largest stable step of the explicit scheme over all bodies and ranks: waves, pressure diffusion, moving
/// points, and cells that are filled in part. Collective.
///
/// With implicit pressures only the skeleton's wave limits the step: Mixture::semi_implicit_speed() stands
/// for c_u, and D is zero.
///
/// Equation: Mixture::stable_step(), h/(c + |v|) for dry bodies, both with the factors that slivers of
/// material at a body's edge ask for (theory.md, stable step).
template <int dim>
StableStep stable_step(const std::vector<std::unique_ptr<Body<dim>>> &bodies, const Grid<dim> &grid,
                       bool seepage_inertia, bool implicit_pressure = false);
} // namespace peat
