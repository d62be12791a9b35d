#include <peat/solver/up_solver.h>

#include "persist_algebra.h"

namespace peat {
template <int dim>
void UpSolver<dim>::persist(Archive &archive)
{
  archive.begin("implicit steps");
  archive & contact;
  if (archive.is_loading()) {
    // As prepare(), but surfaces have settled already, and the sites of contact are those of the last choice.
    number_unknowns();
    for (auto &[name, tracers] : scene.surfaces)
      tracers.locate(active);
    survey_nodes();
    boundary.locate(active, small_nodes.unused());
  }
  contact.persist_nodes(archive, active, boundary.constraints());
  if (archive.is_loading())
    resize();

  archive & now & mode & damped_steps_left & next_step & first_step_done & change_scale & residual_scale &
      fluid_scale_before & nodal.time & nodal.dt & book & done;
  for (BlockVector *vector : {&rate, &second, &total, &change})
    persist_values(archive, *vector);
  persist_values(archive, mass_diagonal);
  if (moved.size() > 0) {
    persist_values(archive, moved);
    state.moved = moved;
  }

  // The matrix itself is assembled again. Where it still serves it is that of a linear problem, and depends on
  // its level alone; the vectors of a step do not matter to it.
  bool serves = matrix_is_valid;
  archive & serves & matrix_is_near & matrix_level;
  linear_solver.persist(archive, matrix);
  if (archive.is_loading() && serves)
    assemble(matrix_level, true);
}

template void UpSolver<2>::persist(Archive &);
template void UpSolver<3>::persist(Archive &);
} // namespace peat
