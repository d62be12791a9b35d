#include <peat/solver/explicit_mpm.h>

#include <peat/material/mixture.h>

#include <deal.II/base/mpi.h>

#include <sstream>

namespace peat {
template <int dim>
ExplicitMPM<dim>::ExplicitMPM(const SchemeParameters &scheme, const Grid<dim> &grid, Scene<dim> &scene,
                              const double start_time, const Ledger<dim> &carried)
    : scheme(scheme), grid(grid), scene(scene), saturated(scene.is_saturated()),
      has_loads(!scene.surfaces.empty() || scene.has_body_force()),
      active(grid, static_cast<unsigned int>(scheme.basis)), now(start_time), book(carried)
{
  for (const auto &body : scene.bodies) {
    const Material &material = body->material();
    kernels.push_back(Kernels<dim>::make(scheme.basis, material.mixture() != nullptr));
    filter_rates.push_back(material.mixture()
                               ? scheme.pressure_filter *
                                     material.mixture()->undrained_speed(material.initial_modulus()) /
                                     grid.smallest_cell_size()
                               : 0.);
  }
  nodal.n_sums = Sums<dim>::n_columns(saturated);
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
  steps_to_small_nodes = 0;

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
    renumber_flux();
    nodal.pressure_load.assign(n * dim, 0.);
  }
}

template <int dim>
void ExplicitMPM<dim>::renumber_flux()
{
  // Steps find the flux anew; this is for pictures between the steps. Another rank may know a node that is
  // new here: its value comes with a count.
  constexpr unsigned int n = dim + 1;
  std::vector<double> known(active.size() * n, 0.);
  for (std::size_t i = 0; i < active.size(); ++i)
    if (const std::uint32_t old = active.previous_index(i); old != no_index && !nodal.flux.empty()) {
      std::copy_n(&nodal.flux[std::size_t(old) * dim], dim, &known[i * n]);
      known[i * n + dim] = 1.;
    }
  active.sum_over_ranks(known.data(), n);
  nodal.flux.assign(active.size() * dim, 0.);
  for (std::size_t i = 0; i < active.size(); ++i)
    for (unsigned int d = 0; d < dim; ++d)
      nodal.flux[i * dim + d] = known[i * n + d] / std::max(1., known[i * n + dim]);
}

template <int dim>
double ExplicitMPM<dim>::node_volume(const std::size_t node) const
{
  const auto lattice = grid.node_lattice(active.grid_node(node));
  double volume = 1.;
  for (unsigned int d = 0; d < dim; ++d) {
    const auto &planes = grid.planes(d);
    const int i = lattice[d], last = planes.size() - 1;
    volume *= 0.5 * (planes[std::min(i + 1, last)] - planes[std::max(i - 1, 0)]);
  }
  return volume;
}

template <int dim>
void ExplicitMPM<dim>::find_small_nodes()
{
  if (steps_to_small_nodes-- > 0)
    return;
  steps_to_small_nodes = 100;
  // Mass that a node would have if it were as densely filled as the fullest node of its cells.
  std::vector<double> full_mass(active.size(), 0.);
  for (const CellId cell : active.occupied_cells()) {
    const std::uint32_t *cell_nodes = active.cell_nodes(cell);
    // By mass per volume of the mesh around a node, so that nodes on the mesh's faces are as heavy as others.
    double densest = 0.;
    for (unsigned int v = 0; v < (1u << dim); ++v) {
      const std::uint32_t i = cell_nodes[active.own_node(v)];
      densest = std::max(densest, nodal.sums[std::size_t(i) * nodal.n_sums] / node_volume(i));
    }
    for (unsigned int i = 0; i < active.nodes_per_cell(); ++i)
      full_mass[cell_nodes[i]] = std::max(full_mass[cell_nodes[i]], densest * node_volume(cell_nodes[i]));
  }
  active.max_over_ranks(full_mass.data(), 1);

  // Of a body that fills its cells a node on a face has half of it, one on an edge or corner an eighth at
  // least.
  constexpr double small_share = 0.1;
  std::vector<char> small(active.size(), 0);
  for (std::size_t i = 0; i < active.size(); ++i)
    small[i] = nodal.sums[i * nodal.n_sums + Sums<dim>::mass] < small_share * full_mass[i];
  near_small_node.assign(active.occupied_cells().size(), 0);
  for (std::size_t c = 0; c < near_small_node.size(); ++c) {
    const std::uint32_t *cell_nodes = active.cell_nodes(active.occupied_cells()[c]);
    for (unsigned int v = 0; v < (1u << dim); ++v)
      near_small_node[c] |= small[cell_nodes[active.own_node(v)]];
  }
}

template <int dim>
void ExplicitMPM<dim>::step(const double dt)
{
  nodal.time = now;
  nodal.dt = dt;
  points_to_nodes();
  add_loads();
  find_velocities();
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
    kernels[b]->scatter(*scene.bodies[b], active, pressure_update(b), nodal.sums.data(), nodal.n_sums);
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
  for (auto &[name, tracers] : scene.surfaces) {
    tracers.settle(scene.body(name), active);
    tracers.locate(active);
  }
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
void ExplicitMPM<dim>::find_velocities()
{
  using S = Sums<dim>;
  for (std::size_t i = 0; i < active.size(); ++i) {
    const double *sum = &nodal.sums[i * nodal.n_sums];
    const double inverse = sum[S::mass] > 0. ? 1. / sum[S::mass] : 0.;
    for (unsigned int d = 0; d < dim; ++d)
      nodal.velocity[i * dim + d] = sum[S::momentum + d] * inverse;
  }
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
      const double v = nodal.velocity[row];
      double a =
          (sum[S::force + d] + (has_loads ? nodal.force[row] : 0.)) * inverse + gravity_now[d] * (m > 0.);
      if (scheme.local_damping > 0.)
        a -= scheme.local_damping * std::copysign(a, v) * (v != 0.);
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
  // Only where points take the grid's velocity does a node's prescribed velocity change their momentum at
  // once.
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
  // A node with little mass has large accelerations. A point that it reaches feels them by the node's weight,
  // but the gradient of its velocity would feel them in full, and bring them back to the node.
  if (scheme.affine)
    find_small_nodes();
  const char *spin_only = scheme.affine ? near_small_node.data() : nullptr;
  if (scheme.stress_update == SchemeParameters::StressUpdate::last) {
    for (std::size_t b = 0; b < scene.bodies.size(); ++b)
      kernels[b]->advance_and_deform(*scene.bodies[b], active, a, v, w, spin_only, update, pressure_update(b),
                                     findings);
    return;
  }
  std::fill(carrying_velocity.begin(), carrying_velocity.end(), 0.);
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    kernels[b]->advance_and_remap(*scene.bodies[b], active, a, v, spin_only, update,
                                  carrying_velocity.data());
  active.sum_over_ranks(carrying_velocity.data(), dim);
  for (std::size_t i = 0; i < active.size(); ++i) {
    const double m = nodal.sums[i * nodal.n_sums + Sums<dim>::mass];
    for (unsigned int d = 0; d < dim; ++d)
      carrying_velocity[i * dim + d] *= m > 0. ? 1. / m : 0.;
  }
  for (const auto &condition : scene.conditions)
    condition->constrain_velocity(active, now + nodal.dt, nodal.dt, carrying_velocity);
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    kernels[b]->deform(*scene.bodies[b], active, carrying_velocity.data(), w, spin_only, nodal.dt,
                       pressure_update(b), findings);
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
  enum { not_finite, error, cells_changed, leaves_rank, n_flags };
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

template class ExplicitMPM<2>;
template class ExplicitMPM<3>;
} // namespace peat
