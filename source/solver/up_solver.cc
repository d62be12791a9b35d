#include <peat/solver/up_solver.h>

#include <peat/material/mixture.h>

#include <deal.II/base/mpi.h>
#include <deal.II/lac/block_sparsity_pattern.h>
#include <deal.II/lac/sparsity_tools.h>

#include <sstream>

namespace peat {
namespace {
template <int dim>
bool is_linear(const Scene<dim> &scene)
{
  return std::all_of(scene.bodies.begin(), scene.bodies.end(), [](const auto &body) {
    return body->material().law().is_linear() && body->layout().porosity < 0;
  });
}

template <int dim>
bool has_finite_strain(const Scene<dim> &scene)
{
  return std::any_of(scene.bodies.begin(), scene.bodies.end(),
                     [](const auto &body) { return body->material().law().finite_strain(); });
}

/// Above nu = 0.45 multigrid on the whole stiffness becomes slow.
template <int dim>
bool is_nearly_incompressible(const Scene<dim> &scene)
{
  constexpr double lambda_over_mu = 9.;
  return std::any_of(scene.bodies.begin(), scene.bodies.end(), [](const auto &body) {
    std::array<Lanes, 36> tangent;
    body->material().initial_tangent(tangent);
    return tangent[1][0] > lambda_over_mu * tangent[21][0];
  });
}

bool same(const TimeLevel &a, const TimeLevel &b)
{
  const auto equal = [](const double x, const double y) { return std::abs(x - y) <= 1e-10 * std::abs(x); };
  return equal(a.share, b.share) && equal(a.velocity, b.velocity) && equal(a.acceleration, b.acceleration) &&
         equal(a.pressure_rate, b.pressure_rate) && equal(a.dt, b.dt) &&
         a.seepage_inertia == b.seepage_inertia;
}
} // namespace

template <int dim>
UpSolver<dim>::UpSolver(const ImplicitParameters &parameters, const LinearSolverParameters &linear_parameters,
                        const Method method, const Nodes displacement, const bool seepage_inertia,
                        const Grid<dim> &grid, Scene<dim> &scene, const double start_time,
                        const Ledger<dim> &carried)
    : parameters(parameters), method(method), seepage_inertia(seepage_inertia), grid(grid), scene(scene),
      linear(is_linear(scene)), finite_strain(has_finite_strain(scene)),
      nearly_incompressible(is_nearly_incompressible(scene)), unknowns(grid, displacement),
      active(grid, displacement == Nodes::gimp ? 4 : 2),
      // What is to rest under the explicit step must be in equilibrium without the projection.
      form(UpForm<dim>::make(unknowns, method != Method::points_at_rest)), small_nodes(unknowns),
      contact(unknowns, scene), boundary(unknowns, scene, contact, parameters.surface_penalty),
      linear_solver(linear_parameters, "an implicit step"), now(start_time), book(carried)
{}

template <int dim>
UpSolver<dim>::~UpSolver() = default;

template <int dim>
void UpSolver<dim>::number_unknowns()
{
  std::vector<CellId> solid, saturated;
  const auto sort = [](std::vector<CellId> &cells) {
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  };
  for (const auto &body : scene.bodies)
    for (const Slice &slice : body->slices()) {
      solid.push_back(slice.cell);
      if (body->material().mixture() && method != Method::points_at_rest)
        saturated.push_back(slice.cell);
    }
  for (const auto &body : scene.bodies) {
    body->accept_cells();
    form->survey(*body);
  }
  sort(solid);
  sort(saturated);
  unknowns.distribute(solid, saturated);
  active.rebuild(solid);
  contact.share_nodes(solid, active);
}

template <int dim>
void UpSolver<dim>::prepare()
{
  number_unknowns();
  for (auto &[name, tracers] : scene.surfaces) {
    if (method != Method::finite_elements)
      tracers.settle(scene.body(name), active);
    tracers.locate(active);
  }
  survey_nodes();
  boundary.locate(active, small_nodes.unused());
  contact.match_nodes(active, boundary.constraints());
  resize();
  project_start();
}

template <int dim>
void UpSolver<dim>::survey_nodes()
{
  if (method == Method::finite_elements)
    return;
  dealii::TrilinosWrappers::MPI::Vector mass(unknowns.owned()[0], grid.communicator());
  for (const auto &body : scene.bodies)
    form->sum_mass(*body, mass);
  mass.compress(dealii::VectorOperation::add);
  dealii::TrilinosWrappers::MPI::Vector all(unknowns.owned()[0], unknowns.relevant()[0], grid.communicator());
  all = mass;
  double speed = 0.;
  for (const auto &body : scene.bodies)
    speed = std::max(speed, std::sqrt(body->material().initial_modulus() / body->material().density()));
  small_nodes.survey(all, speed);
}

template <int dim>
void UpSolver<dim>::resize()
{
  const MPI_Comm communicator = grid.communicator();
  dealii::BlockDynamicSparsityPattern pattern(boundary.relevant());
  std::vector<typename Space<dim>::Index> list;
  for (const auto &body : scene.bodies)
    for (const Slice &slice : body->slices()) {
      const auto *u = unknowns.displacements(slice.cell);
      list.assign(u, u + unknowns.n_cell_nodes() * dim);
      if (body->material().mixture() && unknowns.has_pressure()) {
        const auto *p = unknowns.pressures(slice.cell);
        list.insert(list.end(), p, p + Space<dim>::n_pressures);
      }
      boundary.constraints().add_entries_local_to_global(list, pattern, true);
    }
  if (method != Method::finite_elements)
    small_nodes.for_each_line([&](const auto &nodes) {
      for (unsigned int d = 0; d < dim; ++d) {
        list = {nodes[0] + d, nodes[1] + d, nodes[2] + d};
        boundary.constraints().add_entries_local_to_global(list, pattern, true);
      }
    });
  contact.for_each_coupling([&](const auto &coupled) {
    boundary.constraints().add_entries_local_to_global(coupled, pattern, true);
  });
  dealii::IndexSet owned(unknowns.n_unknowns()), relevant(unknowns.n_unknowns());
  for (unsigned int b = 0; b < unknowns.n_blocks(); ++b) {
    owned.add_indices(unknowns.owned()[b], b * unknowns.first_pressure());
    relevant.add_indices(boundary.relevant()[b], b * unknowns.first_pressure());
  }
  // Unknowns on a rank's edge whose cells lie on other ranks have no entry yet, and need a diagonal.
  for (const auto index : owned)
    pattern.add(index, index);
  dealii::SparsityTools::distribute_sparsity_pattern(pattern, owned, communicator, relevant);
  linear_solver.reinit({}); // a preconditioner goes before its matrix
  matrix.clear();
  matrix.reinit(unknowns.owned(), pattern, communicator);
  matrix_is_valid = false;
  describe_unknowns();
  prepare_split();
  if (method == Method::finite_elements && finite_strain) {
    moved.reinit(unknowns.owned()[0], communicator);
    state.moved.reinit(unknowns.owned()[0], unknowns.relevant()[0], communicator);
  }

  for (BlockVector *vector : {&unknown, &correction, &residual, &right_side, &rate, &second, &total, &change})
    vector->reinit(unknowns.owned(), communicator);
  for (BlockVector *vector : {&state.unknown, &state.rate_history, &state.second_history, &ghosted_total,
                              &ghosted_rate, &ghosted_motion})
    vector->reinit(unknowns.owned(), unknowns.relevant(), communicator);
}

template <int dim>
void UpSolver<dim>::describe_unknowns()
{
  const dealii::IndexSet &owned = unknowns.owned()[0];
  DisplacementUnknowns description;
  description.dim = dim;
  description.positions.resize(owned.n_elements());
  description.components.resize(owned.n_elements());
  description.fixed.resize(owned.n_elements());
  for (const auto &node : unknowns.displacement_nodes())
    for (unsigned int d = 0; d < dim; ++d) {
      if (!owned.is_element(node.displacement[d]))
        continue;
      const auto i = owned.index_within_set(node.displacement[d]);
      for (unsigned int e = 0; e < dim; ++e)
        description.positions[i][e] = node.position[e];
      description.components[i] = d;
      description.fixed[i] = boundary.constraints().is_constrained(node.displacement[d]);
    }
  linear_solver.reinit(std::move(description));

  if (unknowns.has_pressure())
    pressure_mass.reinit(matrix.block(1, 1));
  mass_diagonal.reinit(owned, grid.communicator());
  for (const auto &body : scene.bodies)
    form->sum_inertia(*body, mass_diagonal);
  mass_diagonal.compress(dealii::VectorOperation::add);
  boundary.gather(mass_diagonal);
  const double largest = mass_diagonal.linfty_norm();
  for (const auto index : owned)
    if (mass_diagonal(index) == 0.)
      mass_diagonal(index) = largest;
  mass_diagonal.compress(dealii::VectorOperation::insert);
}

template <int dim>
void UpSolver<dim>::prepare_split()
{
  split.reset();
  const unsigned int n_psi = form->n_volumetric();
  if (!nearly_incompressible || n_psi == 0 || linear_solver.would_be_direct(unknowns.n_unknowns()))
    return;
  const MPI_Comm communicator = grid.communicator();
  unsigned long mine = 0, first = 0;
  for (const auto &body : scene.bodies)
    mine += body->slices().size() * n_psi;
  const int ierr = MPI_Exscan(&mine, &first, 1, MPI_UNSIGNED_LONG, MPI_SUM, communicator);
  AssertThrowMPI(ierr);
  if (dealii::Utilities::MPI::this_mpi_process(communicator) == 0)
    first = 0;
  dealii::IndexSet functions(dealii::Utilities::MPI::sum(mine, communicator));
  functions.add_range(first, first + mine);

  split = std::make_unique<VolumetricSplit>();
  split->first = first;
  const dealii::IndexSet &u = unknowns.owned()[0];
  dealii::TrilinosWrappers::SparsityPattern gradient(u, functions, boundary.relevant()[0], communicator);
  std::unique_ptr<dealii::TrilinosWrappers::SparsityPattern> projection;
  if (unknowns.has_pressure())
    projection = std::make_unique<dealii::TrilinosWrappers::SparsityPattern>(functions, unknowns.owned()[1],
                                                                             communicator);
  std::vector<typename Space<dim>::Index> pressures(Space<dim>::n_pressures), own(n_psi);
  for (const auto &body : scene.bodies)
    for (const Slice &slice : body->slices()) {
      for (auto &number : own)
        number = first++;
      const auto *cell = unknowns.displacements(slice.cell);
      for (unsigned int i = 0; i < unknowns.n_cell_nodes() * dim; ++i) {
        gradient.add_entries(cell[i], own.begin(), own.end());
        gradient.add_entries(equation_of(boundary.constraints(), cell[i]), own.begin(), own.end());
      }
      if (!projection || !body->material().mixture())
        continue;
      for (unsigned int i = 0; i < Space<dim>::n_pressures; ++i)
        pressures[i] = unknowns.pressures(slice.cell)[i] - unknowns.first_pressure();
      for (const auto number : own)
        projection->add_entries(number, pressures.begin(), pressures.end());
    }
  gradient.compress();
  split->gradient.reinit(gradient);
  if (projection) {
    projection->compress();
    split->projection.reinit(*projection);
  }
  split->shear.reinit(matrix.block(0, 0));
  split->volumetric_compliance.reinit(functions, communicator);
  split->shear_compliance.reinit(functions, communicator);
}

template <int dim>
void UpSolver<dim>::prepare_linear_solver(const TimeLevel &level, const bool coupled,
                                          const bool changed_little)
{
  PreconditionerData data;
  if (coupled && unknowns.has_pressure()) {
    pressure_mass.compress(dealii::VectorOperation::add);
    data.pressure_mass = &pressure_mass;
  }
  if (split && level.share > 0.) {
    data.shear = &split->shear;
    data.gradient = &split->gradient;
    data.volumetric_compliance = &split->volumetric_compliance;
    data.shear_compliance = &split->shear_compliance;
    data.n_psi_per_cell = form->n_volumetric();
    if (data.pressure_mass)
      data.projection = &split->projection;
  }
  if (level.acceleration > 0.) {
    // What the diagonal must be multiplied with to bound the mass matrix of these elements.
    const double bound = std::pow(unknowns.nodes() == Nodes::q2 ? 1.25 : 1.5, dim);
    inertia = mass_diagonal;
    inertia *= bound * level.acceleration;
    data.inertia = &inertia;
  }
  linear_solver.prepare(matrix, data,
                        changed_little ? LinearSolver::Reuse::preconditioner : LinearSolver::Reuse::pattern);
}

template <int dim>
VolumeLoads<dim> UpSolver<dim>::volume_loads(const double time) const
{
  VolumeLoads<dim> loads;
  const double origin[3] = {0., 0., 0.};
  for (unsigned int d = 0; d < dim; ++d)
    loads.gravity[d] = scene.gravity.value(origin, time, d);
  for (const auto &condition : scene.conditions) {
    if (condition->has_body_force())
      loads.forces.push_back(condition.get());
    if (condition->has_fluid_source())
      loads.fluids.push_back(condition.get());
  }
  return loads;
}

template <int dim>
TimeLevel UpSolver<dim>::level(const double time, const double dt) const
{
  TimeLevel level;
  level.time = time;
  level.dt = dt;
  level.seepage_inertia = seepage_inertia;
  return level;
}

template <int dim>
void UpSolver<dim>::assemble(const TimeLevel &level, const bool with_matrix)
{
  residual = 0.;
  if (with_matrix) {
    matrix = 0.;
    if (pressure_mass.m() > 0)
      pressure_mass = 0.;
    if (split)
      split->clear();
  }
  share_unknown();
  const VolumeLoads<dim> loads = volume_loads(level.time);
  gross = {};
  const double stabilisation = unknowns.nodes() == Nodes::q2 ? 0. : parameters.stabilisation;
  UpSystem system{boundary.constraints(), residual, gross};
  if (with_matrix) {
    system.matrix = &matrix;
    system.pressure_mass = pressure_mass.m() > 0 ? &pressure_mass : nullptr;
    system.split = level.share > 0. ? split.get() : nullptr;
  }
  for (const auto &body : scene.bodies)
    form->assemble(*body, level, state, loads, stabilisation, system);
  boundary.assemble(level, state, residual, with_matrix ? &matrix : nullptr);
  small_nodes.assemble(level, state, boundary.constraints(), residual, with_matrix ? &matrix : nullptr);
  contact.assemble(level, state, system);
  residual.compress(dealii::VectorOperation::add);
  right_side = residual;
  boundary.condense(right_side);
  if (!with_matrix)
    return;
  fill_empty_diagonal(level);
  // Points move little in a step: a factorisation serves the matrices of many.
  const bool changed_little = matrix_is_near && same(level, matrix_level);
  matrix_level = level;
  matrix_is_valid = matrix_is_near = true;
  prepare_linear_solver(level, level.velocity > 0., changed_little);
}

template <int dim>
void UpSolver<dim>::fill_empty_diagonal(const TimeLevel &level)
{
  matrix.compress(dealii::VectorOperation::add);
  for (unsigned int b = 0; b < unknowns.n_blocks(); ++b)
    for (const auto index : unknowns.owned()[b])
      if (matrix.block(b, b).diag_element(index) == 0.)
        matrix.block(b, b).set(index, index, b == 0 ? 1. : level.fluid_scale());
  matrix.compress(dealii::VectorOperation::insert);
  if (!split || level.share == 0.)
    return;
  split->compress();
  for (const auto index : unknowns.owned()[0])
    if (split->shear.diag_element(index) == 0.)
      split->shear.set(index, index, matrix.block(0, 0).diag_element(index));
  split->shear.compress(dealii::VectorOperation::insert);
}

template <int dim>
void UpSolver<dim>::share_unknown()
{
  state.unknown = unknown;
}

template <int dim>
bool UpSolver<dim>::needs_matrix(const TimeLevel &level) const
{
  return !matrix_is_valid || !linear || contact.changes_matrix() || !same(level, matrix_level);
}

template <int dim>
double UpSolver<dim>::residual_norm(const unsigned int block, const double tolerance) const
{
  constexpr double round_off = 1e-14;
  const double floor = round_off * dealii::Utilities::MPI::sum(gross[block], grid.communicator());
  const double scale = std::max(residual_scale[block], floor / tolerance);
  return scale > 0. ? right_side.block(block).l2_norm() / scale : 0.;
}

template <int dim>
double UpSolver<dim>::residual_size(const double tolerance) const
{
  double squared = 0.;
  for (unsigned int b = 0; b < unknowns.n_blocks(); ++b)
    squared += std::pow(residual_norm(b, tolerance), 2);
  return std::sqrt(squared);
}

template <int dim>
bool UpSolver<dim>::converged(const double tolerance) const
{
  for (unsigned int b = 0; b < unknowns.n_blocks(); ++b)
    if (!(residual_norm(b, tolerance) <= tolerance))
      return false;
  return true;
}

template <int dim>
void UpSolver<dim>::solve(const TimeLevel &level, const double start, const double end,
                          const double tolerance)
{
  boundary.prescribe(start, end, unknown);
  for (unsigned int iteration = 0;; ++iteration) {
    // Of a linear problem the matrix is needed once, at the first residual.
    const bool with_matrix = iteration == 0 ? needs_matrix(level) : !linear || contact.changes_matrix();
    assemble(level, with_matrix);
    for (unsigned int b = 0; b < unknowns.n_blocks(); ++b) {
      const double scale = std::abs(b == 1 ? level.fluid_scale() : 1.);
      // Forces and volumes that hold the prescribed unknowns belong to the scale, too.
      double size = (iteration == 0 ? right_side : residual).block(b).l2_norm();
      if (b == 0)
        size = contact.residual_scale(size);
      if (b == 1 && iteration == 0)
        residual_scale[1] *= scale / fluid_scale_before;
      residual_scale[b] = std::max(residual_scale[b], size);
    }
    fluid_scale_before = std::abs(level.fluid_scale());
    if (((iteration > 0 && converged(tolerance)) || right_side.l2_norm() == 0.) &&
        contact.is_balanced(tolerance))
      return;
    if (!std::isfinite(right_side.l2_norm()) ||
        iteration >= parameters.newton_iterations + contact.extra_iterations())
      give_up(iteration, start, end, tolerance);
    correction = 0.;
    const auto solve_system = [&](BlockVector &solution, const BlockVector &forces) {
      done.linear_iterations += linear_solver.solve(solution, forces);
      boundary.distribute(solution);
      ++done.linear_solves;
    };
    solve_system(correction, right_side);
    contact.correct(level, correction, solve_system);
    ++done.newton_iterations;
    unknown += correction;
    if (!linear)
      line_search(level, residual_size(tolerance));
    share_unknown();
    contact.augment(state);
  }
}

template <int dim>
void UpSolver<dim>::give_up(const unsigned int iterations, const double start, const double end,
                            const double tolerance) const
{
  std::ostringstream text;
  text << "the equations of the step from t = " << start << " s to " << end << " s have "
       << (std::isfinite(right_side.l2_norm()) ? "not been solved" : "no finite solution") << " after "
       << iterations << " iterations (residual of momentum " << residual_norm(0, tolerance);
  if (unknowns.has_pressure())
    text << ", of fluid mass " << residual_norm(1, tolerance);
  text << contact.unbalanced() << "); use shorter steps, or more 'Newton iterations'";
  throw NumericalError(text.str());
}

template <int dim>
void UpSolver<dim>::line_search(const TimeLevel &level, const double before)
{
  // Full steps unless they make things worse. Force and volume are no number together: a stage begins with
  // forces that are in balance and volumes that are not.
  constexpr unsigned int most_halvings = 5;
  double length = 1.;
  for (unsigned int k = 0; k < most_halvings; ++k) {
    assemble(level, false);
    const double after = residual_size(parameters.newton_tolerance);
    // Where sites touch or part it is the next iteration that knows their forces.
    if (std::isfinite(after) && (after <= before || contact.changes_matrix()))
      return;
    length *= 0.5;
    unknown.add(-length, correction);
    contact.retreat(length);
  }
}

template <int dim>
void UpSolver<dim>::accept(const TimeLevel &level, const bool moves)
{
  share_unknown();
  ghosted_rate = rate;
  bool all_finite = true;
  for (const auto &body : scene.bodies)
    form->update_points(*body, level, state, ghosted_rate, moves, all_finite);
  for (Scene<dim> *other : followers)
    for (const auto &body : other->bodies)
      form->update_points(*body, level, state, ghosted_rate, false, all_finite);
  const double dt = level.dt;
  contact.accept(dt);
  total += unknown;
  change += unknown;
  if (moved.size() > 0) {
    moved += unknown.block(0);
    state.moved = moved;
  }
  if (unknowns.has_pressure()) {
    change.block(1) -= second.block(1);
    second.block(1) = unknown.block(1);
  }
  int finite = all_finite;
  finite = dealii::Utilities::MPI::min(finite, grid.communicator());
  now += dt;
  nodal.time = now;
  nodal.dt = dt;
  if (!finite) {
    std::ostringstream text;
    text << "a stress, pressure or velocity is not finite, t = " << now << " s, step " << dt << " s";
    throw NumericalError(text.str());
  }
  if (moves || method == Method::finite_elements)
    move_tracers();
  if (moves)
    relocate_points();
}

template <int dim>
bool UpSolver<dim>::reach_changes()
{
  const auto before = small_nodes.unused();
  survey_nodes();
  return dealii::Utilities::MPI::max(int(small_nodes.unused() != before), grid.communicator());
}

template <int dim>
void UpSolver<dim>::relocate_points()
{
  int changed = 0, leaves = 0;
  std::string message;
  for (const auto &body : scene.bodies) {
    try {
      body->note_movers();
      const auto relocation = body->relocate(now);
      changed |= relocation.cells_changed;
      leaves |= relocation.leaves_rank;
    } catch (const NumericalError &error) {
      message = error.what();
    }
  }
  for (const std::string &one : dealii::Utilities::MPI::all_gather(grid.communicator(), message))
    if (!one.empty())
      throw NumericalError(one);
  if (dealii::Utilities::MPI::n_mpi_processes(grid.communicator()) > 1) {
    for (const auto &[name, tracers] : scene.surfaces)
      leaves |= tracers.leaves_rank();
    leaves |= scene.probes && scene.probes->leaves_rank();
    leaves = dealii::Utilities::MPI::max(leaves, grid.communicator());
    if (leaves) {
      for (const auto &body : scene.bodies)
        body->synchronise(now);
      for (auto &[name, tracers] : scene.surfaces)
        tracers.migrate();
      if (scene.probes)
        scene.probes->migrate();
    }
  }
  changed = dealii::Utilities::MPI::max(changed | leaves, grid.communicator());
  // Domains may reach nodes now that they did not reach before.
  if (!changed)
    changed = reach_changes() || contact.is_outdated() || boundary.cover_changes() || surfaces_change();
  if (changed)
    return prepare();
  for (const auto &body : scene.bodies)
    form->survey(*body);
  matrix_is_valid = false;
}

template class UpSolver<2>;
template class UpSolver<3>;
} // namespace peat
