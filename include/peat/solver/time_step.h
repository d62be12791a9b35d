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
/// Equation: Mixture::stable_step(), h/(c + |v|) for dry bodies. Where a node may have to move a small piece
/// alone, phi < 1 times that of a full cell, the wave limit takes the factor min(1, 1.39 sqrt(phi)) and the
/// diffusion limit min(1, 1.95 phi) (fitted to the spectral radius of columns whose last cell is filled in
/// part).
template <int dim>
StableStep stable_step(const std::vector<std::unique_ptr<Body<dim>>> &bodies, const Grid<dim> &grid,
                       bool seepage_inertia);
} // namespace peat
