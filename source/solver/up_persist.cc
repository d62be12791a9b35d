#include <peat/solver/up_solver.h>

#include "persist_algebra.h"

namespace peat {
template <int dim>
void UpSolver<dim>::persist(Archive &archive)
{
  archive.begin("implicit steps");
  archive(contact);
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

  archive(now, mode, damped_steps_left, next_step, first_step_done, change_scale, residual_scale,
          fluid_scale_before, nodal.time, nodal.dt, book, done);
  for (BlockVector *vector : {&rate, &second, &total, &change})
    persist_values(archive, *vector);
  persist_values(archive, mass_diagonal);
  if (moved.size() > 0) {
    persist_values(archive, moved);
    state.moved = moved;
  }

  // Where the matrix still serves it is that of a linear problem, which depends on its level alone, and so
  // does its preconditioner: both are made again. Else the next step assembles another, but it may keep the
  // preconditioner; multigrid is then made of values of today first, for its patterns.
  bool serves = matrix_is_valid, is_near = matrix_is_near;
  archive(serves, is_near, matrix_level);
  const bool keeps = is_near && !serves;
  if (archive.is_loading() && (serves || (keeps && !linear_solver.would_be_direct(unknowns.n_unknowns()))))
    assemble(matrix_level, true);
  linear_solver.persist(archive, matrix, keeps);
  matrix_is_valid = serves;
  matrix_is_near = is_near;
}

template void UpSolver<2>::persist(Archive &);
template void UpSolver<3>::persist(Archive &);
} // namespace peat
