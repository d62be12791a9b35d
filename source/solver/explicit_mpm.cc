#include <peat/solver/explicit_mpm.h>

#include <peat/material/mixture.h>

#include <deal.II/base/mpi.h>

#include <sstream>

namespace peat {
template <int dim>
bool Scene<dim>::is_saturated() const
{
  for (const auto &body : bodies)
    if (body->material().mixture())
      return true;
  return false;
}

template <int dim>
dealii::types::particle_index Scene<dim>::n_global_points() const
{
  dealii::types::particle_index n = 0;
  for (const auto &body : bodies)
    n += body->n_global_points();
  return n;
}

template <int dim>
Body<dim> &Scene<dim>::body(const std::string &name) const
{
  for (const auto &body : bodies)
    if (body->name() == name)
      return *body;
  throw InputError("there is no body '" + name + "'");
}

template <int dim>
ExplicitMPM<dim>::ExplicitMPM(const SchemeParameters &scheme, const Grid<dim> &grid, Scene<dim> &scene,
                              const double start_time, const Ledger<dim> &carried)
    : scheme(scheme), grid(grid), scene(scene), saturated(scene.is_saturated()), has_loads(!scene.surfaces.empty()),
      active(grid, static_cast<unsigned int>(scheme.basis)), now(start_time), book(carried)
{
  for (const auto &body : scene.bodies) {
    const Material &material = body->material();
    kernels.push_back(Kernels<dim>::make(scheme.basis, material.mixture() != nullptr));
    filter_rates.push_back(material.mixture() ? scheme.pressure_filter *
                                                    material.mixture()->undrained_speed(material.initial_modulus()) /
                                                    grid.smallest_cell_size()
                                              : 0.);
  }
  nodal.n_sums = saturated ? Sums<dim>::n_saturated : Sums<dim>::n_dry;
}

template <int dim>
void ExplicitMPM<dim>::prepare()
{
  std::vector<CellId> occupied;
  for (const auto &body : scene.bodies)
    for (const Slice &slice : body->slices())
      occupied.push_back(slice.cell);
  std::sort(occupied.begin(), occupied.end());
  occupied.erase(std::unique(occupied.begin(), occupied.end()), occupied.end());
  active.rebuild(occupied);
  resize_fields();
  if (scheme.nodes_keep_velocity)
    renumber_kept_velocity();
  steps_to_aggregation = 0;

  std::vector<bool> open(2 * dim, false);
  for (const auto &condition : scene.conditions) {
    condition->select(active);
    for (const unsigned int boundary : condition->opened_boundaries())
      open[boundary] = true;
  }
  closed_rows.clear();
  if (saturated)
    for (unsigned int b = 0; b < 2 * dim; ++b)
      if (!open[b])
        for (const std::uint32_t i : active.on_boundary(b))
          closed_rows.push_back(std::size_t(i) * dim + b / 2);
}

template <int dim>
void ExplicitMPM<dim>::resize_fields()
{
  const std::size_t n = active.size();
  nodal.sums.resize(n * nodal.n_sums);
  for (auto *field : {&nodal.velocity, &nodal.acceleration, &nodal.new_velocity, &carrying_velocity})
    field->assign(n * dim, 0.);
  if (has_loads)
    nodal.force.assign(n * dim, 0.);
  if (saturated) {
    nodal.flux.assign(n * dim, 0.);
    nodal.pressure_load.assign(n * dim, 0.);
  }
}

template <int dim>
void ExplicitMPM<dim>::renumber_kept_velocity()
{
  std::vector<double> velocity(active.size() * dim, 0.);
  std::vector<char> known(active.size(), false);
  for (std::size_t i = 0; i < active.size(); ++i)
    if (const std::uint32_t old = active.previous_index(i); old < kept_is_known.size()) {
      known[i] = kept_is_known[old];
      for (unsigned int d = 0; d < dim; ++d)
        velocity[i * dim + d] = kept_velocity[std::size_t(old) * dim + d];
    }
  kept_velocity.swap(velocity);
  kept_is_known.swap(known);
}

template <int dim>
void ExplicitMPM<dim>::complete_kept_velocity()
{
  constexpr unsigned int n = dim + 1;
  std::vector<double> values(active.size() * n, 0.);
  const auto take_over = [&]() {
    active.sum_over_ranks(values.data(), n);
    for (std::size_t i = 0; i < active.size(); ++i)
      if (const double weight = values[i * n + dim]; weight > 0.) {
        kept_is_known[i] = true;
        for (unsigned int d = 0; d < dim; ++d)
          kept_velocity[i * dim + d] = values[i * n + d] / weight;
      }
  };
  // What any rank knows.
  for (std::size_t i = 0; i < active.size(); ++i)
    if (kept_is_known[i]) {
      for (unsigned int d = 0; d < dim; ++d)
        values[i * n + d] = kept_velocity[i * dim + d];
      values[i * n + dim] = 1.;
    }
  take_over();

  // Others begin with the mean of their cells' nodes that have one.
  const std::vector<char> known = kept_is_known;
  std::fill(values.begin(), values.end(), 0.);
  for (const CellId cell : active.occupied_cells()) {
    const std::uint32_t *cell_nodes = active.cell_nodes(cell);
    for (unsigned int k = 0; k < active.nodes_per_cell(); ++k)
      for (unsigned int j = 0; j < active.nodes_per_cell() && !known[cell_nodes[k]]; ++j)
        if (known[cell_nodes[j]]) {
          for (unsigned int d = 0; d < dim; ++d)
            values[cell_nodes[k] * n + d] += kept_velocity[std::size_t(cell_nodes[j]) * dim + d];
          values[cell_nodes[k] * n + dim] += 1.;
        }
  }
  take_over();
}

template <int dim>
double ExplicitMPM<dim>::fastest_on_any_rank() const
{
  return dealii::Utilities::MPI::max(findings.largest_speed, grid.communicator());
}

template <int dim>
void ExplicitMPM<dim>::aggregate_small_nodes()
{
  if (steps_to_aggregation > 0) {
    --steps_to_aggregation;
    return;
  }
  // Share of the mass of a cell's heaviest node: below that of the corner of a body that fills its cells, 1/8 in 3-D.
  constexpr double smallest_share = 0.1;
  active.separate();
  if (scheme.nodes_keep_velocity)
    complete_kept_velocity();
  points_to_nodes();
  active.aggregate(&nodal.sums[Sums<dim>::mass], nodal.n_sums, smallest_share);

  // Look again when points may have moved by a fiftieth of a cell.
  const double path = fastest_on_any_rank() * nodal.dt;
  const double n_steps = path > 0. ? 0.02 * grid.smallest_cell_size() / path : 100.;
  steps_to_aggregation = std::max(0., std::min(99., n_steps - 1.));
}

template <int dim>
void ExplicitMPM<dim>::step(const double dt)
{
  nodal.time = now;
  nodal.dt = dt;
  aggregate_small_nodes();
  points_to_nodes();
  add_loads();
  solve_momentum();
  constrain_motion();
  solve_darcy();
  nodes_to_points();
  book_balances();
  move_tracers();
  now += dt;
  relocate_points();
}

template <int dim>
void ExplicitMPM<dim>::points_to_nodes()
{
  std::fill(nodal.sums.begin(), nodal.sums.end(), 0.);
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    kernels[b]->scatter(*scene.bodies[b], active, scheme.nodes_keep_velocity ? kept_velocity.data() : nullptr,
                        pressure_update(b), nodal.sums.data(), nodal.n_sums);
  active.sum_over_ranks(nodal.sums.data(), nodal.n_sums);
}

template <int dim>
PressureUpdate ExplicitMPM<dim>::pressure_update(const std::size_t body) const
{
  return {scheme.pressure_of_cells, 1. - std::exp(-filter_rates[body] * nodal.dt)};
}

template <int dim>
const Surface<dim> &ExplicitMPM<dim>::surface(const Condition<dim> &condition) const
{
  static const Surface<dim> none;
  return condition.surface_of().empty() ? none : scene.surfaces.at(condition.surface_of()).surface();
}

template <int dim>
void ExplicitMPM<dim>::add_loads()
{
  for (auto &[name, tracers] : scene.surfaces)
    tracers.locate(active);
  std::fill(nodal.force.begin(), nodal.force.end(), 0.);
  std::fill(nodal.pressure_load.begin(), nodal.pressure_load.end(), 0.);
  for (const auto &condition : scene.conditions)
    condition->add_loads(active, surface(*condition), nodal);
  if (has_loads)
    active.sum_over_ranks(nodal.force.data(), dim);
  if (saturated)
    active.sum_over_ranks(nodal.pressure_load.data(), dim);

  const double origin[3] = {0., 0., 0.};
  for (unsigned int d = 0; d < dim; ++d)
    gravity_now[d] = scene.gravity.value(origin, now, d);
}

template <int dim>
void ExplicitMPM<dim>::solve_momentum()
{
  using S = Sums<dim>;
  for (std::size_t i = 0; i < active.size(); ++i) {
    const double *sum = &nodal.sums[i * nodal.n_sums];
    const double m = sum[S::mass];
    const double inverse = m > 0. ? 1. / m : 0.;
    for (unsigned int d = 0; d < dim; ++d) {
      const std::size_t row = i * dim + d;
      const double v = sum[S::momentum + d] * inverse + (scheme.nodes_keep_velocity ? kept_velocity[row] : 0.);
      double a = (sum[S::force + d] + (has_loads ? nodal.force[row] : 0.)) * inverse + gravity_now[d] * (m > 0.);
      if (scheme.local_damping > 0.)
        a -= scheme.local_damping * std::copysign(a, v) * (v != 0.);
      nodal.velocity[row] = v;
      nodal.acceleration[row] = a;
      nodal.new_velocity[row] = v + nodal.dt * a;
    }
  }
}

template <int dim>
dealii::Tensor<1, dim> ExplicitMPM<dim>::total_momentum() const
{
  dealii::Tensor<1, dim> total;
  for (std::size_t i = 0; i < active.size(); ++i)
    if (active.is_owned(i))
      for (unsigned int d = 0; d < dim; ++d)
        total[d] += nodal.sums[i * nodal.n_sums + Sums<dim>::mass] * nodal.velocity[i * dim + d];
  return total;
}

template <int dim>
void ExplicitMPM<dim>::constrain_motion()
{
  // Only where points take the grid's velocity does a node's prescribed velocity change their momentum at once.
  const double share = 1. - scheme.retention(nodal.dt);
  const auto before = share > 0. ? total_momentum() : dealii::Tensor<1, dim>();
  for (const auto &condition : scene.conditions)
    condition->constrain_motion(active, nodal);
  if (share > 0.)
    book.impulse += share * (total_momentum() - before);
}

template <int dim>
void ExplicitMPM<dim>::solve_darcy()
{
  if (!saturated)
    return;
  using S = Sums<dim>;
  const double inertia = scheme.seepage_inertia ? 1. : 0.;
  for (std::size_t i = 0; i < active.size(); ++i) {
    const double *sum = &nodal.sums[i * nodal.n_sums];
    const double inverse = sum[S::resistance] > 0. ? 1. / sum[S::resistance] : 0.;
    for (unsigned int d = 0; d < dim; ++d) {
      const std::size_t row = i * dim + d;
      nodal.flux[row] =
          inverse * (sum[S::pressure_force + d] + nodal.pressure_load[row] +
                     sum[S::fluid_inertia] * (gravity_now[d] - inertia * nodal.acceleration[row]));
    }
  }
  for (const std::size_t row : closed_rows)
    nodal.flux[row] = 0.;
  for (const auto &condition : scene.conditions)
    condition->constrain_flux(active, surface(*condition), nodal);
}

template <int dim>
void ExplicitMPM<dim>::nodes_to_points()
{
  findings = {};
  const VelocityUpdate update{nodal.dt, scheme.retention(nodal.dt)};
  const double *v = nodal.new_velocity.data(), *a = nodal.acceleration.data(), *w = nodal.flux.data();
  if (scheme.nodes_keep_velocity) {
    kept_velocity = nodal.new_velocity;
    for (std::size_t i = 0; i < active.size(); ++i)
      kept_is_known[i] = nodal.sums[i * nodal.n_sums + Sums<dim>::mass] > 0.;
  }
  if (scheme.stress_update == SchemeParameters::StressUpdate::last) {
    for (std::size_t b = 0; b < scene.bodies.size(); ++b)
      kernels[b]->advance_and_deform(*scene.bodies[b], active, a, v, w, update, pressure_update(b), findings);
    return;
  }
  std::fill(carrying_velocity.begin(), carrying_velocity.end(), 0.);
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    kernels[b]->advance_and_remap(*scene.bodies[b], active, a, v, update, carrying_velocity.data());
  active.sum_over_ranks(carrying_velocity.data(), dim);
  for (std::size_t i = 0; i < active.size(); ++i) {
    const double m = nodal.sums[i * nodal.n_sums + Sums<dim>::mass];
    for (unsigned int d = 0; d < dim; ++d)
      carrying_velocity[i * dim + d] *= m > 0. ? 1. / m : 0.;
  }
  for (const auto &condition : scene.conditions)
    condition->constrain_velocity(active, now + nodal.dt, nodal.dt, carrying_velocity);
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    kernels[b]->deform(*scene.bodies[b], active, carrying_velocity.data(), w, nodal.dt, pressure_update(b), findings);
}

template <int dim>
void ExplicitMPM<dim>::book_balances()
{
  using S = Sums<dim>;
  const bool remapped = scheme.stress_update == SchemeParameters::StressUpdate::modified_last;
  const std::vector<double> &end_velocity = remapped ? carrying_velocity : nodal.new_velocity;
  double external = 0., gravity = 0., dissipation = 0., seepage = 0.;
  for (std::size_t i = 0; i < active.size(); ++i) {
    if (!active.is_owned(i))
      continue;
    const double *sum = &nodal.sums[i * nodal.n_sums];
    for (unsigned int d = 0; d < dim; ++d) {
      const std::size_t row = i * dim + d;
      const double v = 0.5 * (nodal.velocity[row] + end_velocity[row]);
      const double force = sum[S::mass] * nodal.acceleration[row] - sum[S::force + d];
      external += force * v;
      gravity += sum[S::mass] * gravity_now[d] * v;
      book.impulse[d] += nodal.dt * force;
      book.gross_impulse += nodal.dt * std::abs(force);
      if (saturated) {
        dissipation += sum[S::resistance] * nodal.flux[row] * nodal.flux[row];
        seepage -= sum[S::pressure_force + d] * nodal.flux[row];
      }
    }
  }
  book.fluid_outflow += findings.fluid_outflow;
  book.fluid_squeezed += findings.fluid_squeezed;
  book.external_work += nodal.dt * external;
  book.gravity_work += nodal.dt * gravity;
  book.seepage_dissipation += nodal.dt * dissipation;
  book.seepage_work += nodal.dt * seepage;
}

template <int dim>
void ExplicitMPM<dim>::move_tracers()
{
  const bool remapped = scheme.stress_update == SchemeParameters::StressUpdate::modified_last;
  const std::vector<double> &velocity = remapped ? carrying_velocity : nodal.new_velocity;
  for (auto &[name, tracers] : scene.surfaces)
    tracers.move(velocity, nodal.dt, scene.body(name).material().law().finite_strain(), active);
  if (scene.probes) {
    scene.probes->locate(active);
    scene.probes->move(velocity, nodal.dt, false, active);
  }
}

template <int dim>
void ExplicitMPM<dim>::relocate_points()
{
  // What any rank finds concerns all: a change of cells or ranks is collective, and so is the end of a run.
  enum
  {
    not_finite,
    error,
    cells_changed,
    leaves_rank,
    n_flags
  };
  std::array<int, n_flags> flags = {!findings.finite, 0, 0, 0};
  std::string message;
  try {
    for (const auto &body : scene.bodies) {
      const auto relocation = body->relocate(now);
      flags[cells_changed] |= relocation.cells_changed;
      flags[leaves_rank] |= relocation.leaves_rank;
    }
  } catch (const NumericalError &exception) {
    flags[error] = 1;
    message = exception.what();
  }
  const bool parallel = dealii::Utilities::MPI::n_mpi_processes(grid.communicator()) > 1;
  if (parallel) {
    for (const auto &[name, tracers] : scene.surfaces)
      flags[leaves_rank] |= tracers.leaves_rank();
    flags[leaves_rank] |= scene.probes && scene.probes->leaves_rank();
    const std::array<int, n_flags> mine = flags;
    const int ierr = MPI_Allreduce(mine.data(), flags.data(), n_flags, MPI_INT, MPI_MAX, grid.communicator());
    AssertThrowMPI(ierr);
  }

  if (flags[not_finite]) {
    std::ostringstream text;
    text << "a stress, pressure or velocity is not finite, t = " << now << " s, step " << nodal.dt
         << " s; use a smaller 'Step factor'";
    throw NumericalError(text.str());
  }
  if (flags[error]) {
    const auto all = dealii::Utilities::MPI::all_gather(grid.communicator(), message);
    for (const std::string &one : all)
      if (!one.empty())
        throw NumericalError(one);
  }
  if (flags[leaves_rank] && parallel) {
    for (const auto &body : scene.bodies)
      body->synchronise(now);
    for (auto &[name, tracers] : scene.surfaces)
      tracers.migrate();
    if (scene.probes)
      scene.probes->migrate();
  }
  if (flags[leaves_rank] || flags[cells_changed])
    prepare();
}

template <int dim>
StableStep ExplicitMPM<dim>::stable_step() const
{
  return peat::stable_step<dim>(scene.bodies, grid, scheme.seepage_inertia);
}

template struct Scene<2>;
template struct Scene<3>;
template class ExplicitMPM<2>;
template class ExplicitMPM<3>;
} // namespace peat
