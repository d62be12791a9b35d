#pragma once

#include <peat/simulation/case.h>
#include <peat/solver/explicit_mpm.h>

namespace peat {
/// Refuses what contradicts itself or does nothing, as far as it takes points and mesh to see it: bodies at
/// the same place, conditions that select nothing or of which two prescribe the same thing at the same place,
/// probes that are to follow material where there is none, a fixed step above the stable one. Throws
/// InputError on all ranks. Collective.
template <int dim>
void check_scene(const Case<dim> &parameters, const Scene<dim> &scene, const Grid<dim> &grid);
} // namespace peat
