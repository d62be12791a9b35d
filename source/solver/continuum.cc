#include <peat/solver/continuum.h>

#include <peat/material/mixture.h>

#include <algorithm>

namespace peat {
static_assert(Sums<2>::mass == 0 && Sums<3>::mass == 0, "NodalFields::mass()");

template <int dim>
Continuum<dim>::Continuum(const SchemeParameters &scheme, const Grid<dim> &grid, Scene<dim> &scene,
                          std::vector<std::size_t> bodies)
    : scheme(scheme), grid(grid), scene(scene), members(std::move(bodies)),
      remapped(scheme.stress_update == SchemeParameters::StressUpdate::modified_last),
      active(grid, static_cast<unsigned int>(scheme.basis))
{
  for (std::size_t b = 0; b < members.size(); ++b) {
    const Material &material = body(b).material();
    saturated = saturated || material.mixture();
    kernels.push_back(Kernels<dim>::make(scheme.basis, material.mixture() != nullptr));
    filter_rates.push_back(material.mixture()
                               ? scheme.pressure_filter *
                                     material.mixture()->undrained_speed(material.initial_modulus()) /
                                     grid.smallest_cell_size()
                               : 0.);
  }
  nodal.n_sums = Sums<dim>::n_columns(saturated);
  for (const std::size_t b : members)
    if (const Material &material = scene.bodies[b]->material(); material.mixture())
      wave_time = std::max(wave_time, grid.smallest_cell_size() /
                                          material.mixture()->undrained_speed(material.initial_modulus()));
  for (const auto &[name, tracers] : scene.surfaces)
    if (holds_body(name))
      surfaces.push_back(name);
  for (const auto &condition : scene.conditions)
    if (condition->surface_of().empty() || holds_body(condition->surface_of())) {
      conditions.push_back(condition->copy());
      has_loads = has_loads || condition->has_body_force();
      for (unsigned int d = 0; d < dim; ++d)
        has_ties = has_ties || condition->ties(d);
    }
  has_loads = has_loads || !surfaces.empty();
  if (scheme.basis == Basis::q1)
    extension = std::make_unique<NodeExtension<dim>>();
  if (scheme.implicit_pressure && saturated)
    make_implicit_pressure();
}

template <int dim>
void Continuum<dim>::make_implicit_pressure()
{
  double alpha = 0.;
  for (std::size_t b = 0; b < members.size(); ++b)
    if (const Mixture *mixture = body(b).material().mixture()) {
      alpha = mixture->biot_coefficient();
      // What an earlier stage left is not the rate of the step before.
      for (std::uint32_t p = 0; p < body(b).n_local_points(); ++p)
        body(b).row(p)[body(b).layout().pressure_rate] = 0.;
    }
  for (const auto &condition : conditions) {
    using Fluid = typename Condition<dim>::Fluid;
    constrains_flux =
        constrains_flux || condition->fluid() == Fluid::flux || condition->fluid() == Fluid::impermeable;
  }
  pressure = std::make_unique<ImplicitPressure<dim>>(active, tried, alpha, scheme.seepage_inertia,
                                                     scheme.pressure_stabilisation, extension.get());
  first_increment.resize(members.size());
}

template <int dim>
bool Continuum<dim>::holds_body(const std::string &name) const
{
  return std::any_of(members.begin(), members.end(),
                     [&](const std::size_t b) { return scene.bodies[b]->name() == name; });
}

template <int dim>
std::vector<CellId> Continuum<dim>::occupied_cells() const
{
  std::vector<CellId> occupied;
  for (std::size_t b = 0; b < members.size(); ++b)
    for (const Slice &slice : body(b).slices())
      occupied.push_back(slice.cell);
  std::sort(occupied.begin(), occupied.end());
  occupied.erase(std::unique(occupied.begin(), occupied.end()), occupied.end());
  return occupied;
}

template <int dim>
double Continuum<dim>::late_share() const
{
  // Steps that follow waves are longer than this, those that follow the diffusion of pressure may be a
  // hundredth of it.
  constexpr double part_of_wave_time = 0.2;
  return std::min(1., nodal.dt / (part_of_wave_time * wave_time));
}

template <int dim>
double Continuum<dim>::felt_acceleration(const std::size_t row, const double share) const
{
  const double m = nodal.mass(row / dim);
  if (share == 1. || m == 0. || prescribed[row])
    return nodal.acceleration[row];
  const double late = late_contact_force[row] / m;
  return nodal.acceleration[row] - late + share * (late + unfelt_velocity[row] / nodal.dt);
}

template <int dim>
void Continuum<dim>::points_to_nodes(const double time, const double dt)
{
  last_dt = nodal.dt;
  nodal.time = time;
  nodal.dt = dt;
  std::fill(nodal.sums.begin(), nodal.sums.end(), 0.);
  if (pressure)
    pressure->sums.clear();
  for (std::size_t b = 0; b < members.size(); ++b) {
    CellSums *sums = nullptr;
    if (pressure && body(b).material().mixture()) {
      sums = &pressure->sums;
      first_increment[b] = sums->storage.size();
    }
    kernels[b]->scatter(body(b), active, pressure_update(b), nodal.sums.data(), nodal.n_sums, sums);
  }
  active.sum_over_ranks(nodal.sums.data(), nodal.n_sums);
  if (extension)
    extend_nodes();
}

template <int dim>
PressureUpdate Continuum<dim>::pressure_update(const std::size_t member) const
{
  PressureUpdate update;
  update.cell_means = scheme.pressure_of_cells;
  update.filter = 1. - std::exp(-filter_rates[member] * nodal.dt);
  if (!pressure)
    return update;
  update.last_step = last_dt;
  update.reach = extrapolation();
  return update;
}

template <int dim>
const Surface<dim> &Continuum<dim>::surface(const Condition<dim> &condition) const
{
  static const Surface<dim> none;
  return condition.surface_of().empty() ? none : scene.surfaces.at(condition.surface_of()).surface();
}

template <int dim>
void Continuum<dim>::add_loads()
{
  for (const std::string &name : surfaces) {
    Tracers<dim> &pieces = scene.surfaces.at(name);
    pieces.settle(scene.body(name), active);
    pieces.locate(active);
  }
  std::fill(nodal.force.begin(), nodal.force.end(), 0.);
  std::fill(nodal.pressure_load.begin(), nodal.pressure_load.end(), 0.);
  for (const auto &condition : conditions)
    condition->add_loads(active, surface(*condition), nodal);
  if (has_loads)
    active.sum_over_ranks(nodal.force.data(), dim);
  if (saturated)
    active.sum_over_ranks(nodal.pressure_load.data(), dim);
  if (extension && has_loads)
    extension->fold(nodal.force.data(), dim, 0, dim);
  if (extension && saturated)
    extension->fold(nodal.pressure_load.data(), dim, 0, dim);

  const double origin[3] = {0., 0., 0.};
  for (unsigned int d = 0; d < dim; ++d)
    gravity_now[d] = scene.gravity.value(origin, nodal.time, d);
}

template <int dim>
void Continuum<dim>::find_velocities()
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
void Continuum<dim>::solve_momentum()
{
  using S = Sums<dim>;
  const bool touches = !nodal.contact_force.empty(); // in the step before
  for (std::size_t i = 0; i < active.size(); ++i) {
    const double *sum = &nodal.sums[i * nodal.n_sums];
    const double m = sum[S::mass];
    const double inverse = m > 0. ? 1. / m : 0.;
    for (unsigned int d = 0; d < dim; ++d) {
      const std::size_t row = i * dim + d;
      const double v = nodal.velocity[row];
      double a =
          (sum[S::force + d] + (has_loads ? nodal.force[row] : 0.)) * inverse + gravity_now[d] * (m > 0.);
      // What contact bears is no force out of balance.
      if (scheme.local_damping > 0. && !(touches && nodal.contact_force[row] != 0.))
        a -= scheme.local_damping * std::copysign(a, v) * (v != 0.);
      nodal.acceleration[row] = a;
      nodal.new_velocity[row] = v + nodal.dt * a;
    }
  }
}

template <int dim>
dealii::Tensor<1, dim> Continuum<dim>::total_momentum() const
{
  dealii::Tensor<1, dim> total;
  for (std::size_t i = 0; i < active.size(); ++i)
    if (active.is_owned(i))
      for (unsigned int d = 0; d < dim; ++d)
        total[d] += nodal.sums[i * nodal.n_sums + Sums<dim>::mass] * nodal.velocity[i * dim + d];
  return total;
}

template <int dim>
void Continuum<dim>::constrain_motion(Ledger<dim> &book)
{
  // Only where points take the grid's velocity does a node's prescribed velocity change their momentum at
  // once.
  const double share = 1. - scheme.retention(nodal.dt);
  const auto before = share > 0. ? total_momentum() : dealii::Tensor<1, dim>();
  for (const auto &condition : conditions)
    condition->constrain_motion(active, nodal);
  for (auto *field : {&nodal.velocity, &nodal.acceleration, &nodal.new_velocity})
    tie(*field);
  if (share > 0.)
    book.impulse += share * (total_momentum() - before);
}

template <int dim>
void Continuum<dim>::tie(std::vector<double> &motion) const
{
  if (has_ties)
    for (const auto &condition : conditions)
      condition->tie(active, nodal, motion);
}

template <int dim>
void Continuum<dim>::solve_darcy()
{
  if (!saturated)
    return;
  using S = Sums<dim>;
  const double inertia = scheme.seepage_inertia ? 1. : 0.;
  const double share = nodal.contact_force.empty() ? 1. : late_share();
  for (std::size_t i = 0; i < active.size(); ++i) {
    const double *sum = &nodal.sums[i * nodal.n_sums];
    const double inverse = sum[S::resistance] > 0. ? 1. / sum[S::resistance] : 0.;
    for (unsigned int d = 0; d < dim; ++d) {
      const std::size_t row = i * dim + d;
      nodal.flux[row] =
          inverse * (sum[S::pressure_force + d] + nodal.pressure_load[row] +
                     sum[S::fluid_inertia] * (gravity_now[d] - inertia * felt_acceleration(row, share)));
    }
  }
  for (const std::size_t row : closed_rows)
    nodal.flux[row] = 0.;
  for (const auto &condition : conditions)
    condition->constrain_flux(active, surface(*condition), nodal);
}

template <int dim>
void Continuum<dim>::find_freedom()
{
  // Conditions act on the flux node by node, in a linear way: what they make of unit vectors says how.
  const std::vector<double> flux = nodal.flux;
  std::array<std::vector<double>, dim + 1> images;
  for (unsigned int c = 0; c <= dim; ++c) {
    std::fill(nodal.flux.begin(), nodal.flux.end(), 0.);
    for (std::size_t row = c; row < nodal.flux.size() && c < dim; row += dim)
      nodal.flux[row] = 1.;
    for (const std::size_t row : closed_rows)
      nodal.flux[row] = 0.;
    for (const auto &condition : conditions)
      condition->constrain_flux(active, surface(*condition), nodal);
    images[c] = nodal.flux;
  }
  nodal.flux = flux;
  freedom.walls.clear();
  for (std::size_t i = 0; i < active.size(); ++i) {
    dealii::Tensor<2, dim> map;
    bool tilted = false;
    for (unsigned int d = 0; d < dim; ++d)
      for (unsigned int c = 0; c < dim; ++c) {
        map[d][c] = images[c][i * dim + d] - images[dim][i * dim + d];
        tilted = tilted || (c != d ? map[d][c] != 0. : map[d][c] != 0. && map[d][c] != 1.);
      }
    for (unsigned int d = 0; d < dim; ++d)
      freedom.flows[i * dim + d] = tilted || map[d][d] == 1.;
    if (tilted)
      freedom.walls.emplace_back(i, map);
  }
}

template <int dim>
void Continuum<dim>::couple_nodes()
{
  tried.acceleration.assign(active.size() * dim, 0.);
  if (!pressure)
    return;
  tried.flux.assign(active.size() * dim, 0.);
  tried.conductance.assign(active.size() * dim, 0.);
  tried.held.assign(active.size() * dim, 0);
}

template <int dim>
void Continuum<dim>::begin_pressure()
{
  if (!pressure)
    return;
  last_outflow = pressure->fluid_outflow();
  last_squeezed = pressure->fluid_squeezed();
  if (constrains_flux)
    find_freedom();
  pressure->begin();
}

template <int dim>
void Continuum<dim>::prepare_pressure()
{
  if (pressure)
    pressure->prepare(freedom, gravity_now, nodal);
}

template <int dim>
void Continuum<dim>::take_pressure()
{
  if (!pressure)
    return;
  pressure->update(nodal);
  tie(nodal.acceleration);
  tie(nodal.new_velocity);
}

template <int dim>
void Continuum<dim>::finish_pressure()
{
  if (pressure)
    pressure->finish(nodal);
}

template <int dim>
void Continuum<dim>::book_fluid(Ledger<dim> &book) const
{
  if (!pressure) {
    book.fluid_outflow += step_findings.fluid_outflow;
    book.fluid_squeezed += step_findings.fluid_squeezed;
    return;
  }
  // Points have the pressure of the end of the step, extrapolated; so must what they are held against.
  const double now = extrapolation(), before = last_dt > 0. ? 0.5 : 0.;
  book.fluid_outflow += now * pressure->fluid_outflow() - before * last_outflow;
  const bool small_strain = body(0).layout().porosity < 0;
  if (small_strain)
    book.fluid_squeezed += now * pressure->fluid_squeezed() - before * last_squeezed;
}

template <int dim>
void Continuum<dim>::advance_points()
{
  // A node with little mass has large accelerations. A point that it reaches feels them by the node's weight,
  // but the gradient of its velocity would feel them in full, and bring them back to the node.
  if (scheme.affine)
    find_small_nodes();
  if (!nodal.contact_force.empty() && has_late_force())
    for (std::size_t row = 0; row < unfelt_velocity.size(); ++row)
      if (const double m = mass(row / dim); m > 0. && !prescribed[row])
        unfelt_velocity[row] =
            (1. - late_share()) * (unfelt_velocity[row] + nodal.dt * late_contact_force[row] / m);
  if (!nodal.contact_force.empty() && !has_late_force())
    std::fill(unfelt_velocity.begin(), unfelt_velocity.end(), 0.);
  if (!remapped)
    return;
  const VelocityUpdate update{nodal.dt, scheme.retention(nodal.dt)};
  const char *spin_only = scheme.affine ? near_small_node.data() : nullptr;
  std::fill(mapped_velocity.begin(), mapped_velocity.end(), 0.);
  const double *a = seen_by_points(nodal.acceleration, seen_acceleration).data();
  const double *v = seen_by_points(nodal.new_velocity, seen_velocity).data();
  for (std::size_t b = 0; b < members.size(); ++b)
    kernels[b]->advance_and_remap(body(b), active, a, v, spin_only, update, mapped_velocity.data());
  active.sum_over_ranks(mapped_velocity.data(), dim);
  if (extension)
    extension->fold_momentum(mapped_velocity.data(), dim, 0);
  for (std::size_t i = 0; i < active.size(); ++i) {
    const double m = mass(i);
    for (unsigned int d = 0; d < dim; ++d)
      mapped_velocity[i * dim + d] *= m > 0. ? 1. / m : 0.;
  }
  for (const auto &condition : conditions)
    condition->constrain_velocity(active, nodal.time + nodal.dt, nodal.dt, mapped_velocity);
  tie(mapped_velocity);
}

template <int dim>
void Continuum<dim>::deform_points()
{
  step_findings = {};
  const VelocityUpdate update{nodal.dt, scheme.retention(nodal.dt)};
  const double *w = seen_by_points(nodal.flux, seen_flux).data();
  const double *v = seen_by_points(carrying_velocity(), seen_velocity).data();
  const double *a = remapped ? nullptr : seen_by_points(nodal.acceleration, seen_acceleration).data();
  const char *spin_only = scheme.affine ? near_small_node.data() : nullptr;
  for (std::size_t b = 0; b < members.size(); ++b) {
    PressureUpdate pressures = pressure_update(b);
    if (pressure && body(b).material().mixture())
      pressures.increments = pressure->increments() + first_increment[b];
    if (remapped)
      kernels[b]->deform(body(b), active, v, w, spin_only, nodal.dt, pressures, step_findings);
    else
      kernels[b]->advance_and_deform(body(b), active, a, v, w, spin_only, update, pressures, step_findings);
  }
}

template <int dim>
void Continuum<dim>::book_balances(Ledger<dim> &book) const
{
  using S = Sums<dim>;
  const std::vector<double> &end_velocity = remapped ? mapped_velocity : nodal.new_velocity;
  double external = 0., gravity = 0., dissipation = 0., seepage = 0.;
  for (std::size_t i = 0; i < active.size(); ++i) {
    if (!active.is_owned(i))
      continue;
    const double *sum = &nodal.sums[i * nodal.n_sums];
    for (unsigned int d = 0; d < dim; ++d) {
      const std::size_t row = i * dim + d;
      const double v = 0.5 * (nodal.velocity[row] + end_velocity[row]);
      const double force = sum[S::mass] * nodal.acceleration[row] - sum[S::force + d] -
                           (nodal.contact_force.empty() ? 0. : nodal.contact_force[row]);
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
  book_fluid(book);
  book.external_work += nodal.dt * external;
  book.gravity_work += nodal.dt * gravity;
  book.seepage_dissipation += nodal.dt * dissipation;
  book.seepage_work += nodal.dt * seepage;
}

template <int dim>
void Continuum<dim>::move_tracers()
{
  const bool extended = extension && !extension->is_empty();
  const std::vector<double> &velocity = extended ? seen_velocity : carrying_velocity();
  if (extended && saturated)
    nodal.flux = seen_flux; // for pictures
  for (const std::string &name : surfaces)
    scene.surfaces.at(name).move(velocity, nodal.dt, scene.body(name).material().law().finite_strain(),
                                 active);
  if (scene.probes) {
    scene.probes->locate(active, members);
    scene.probes->move(velocity, nodal.dt, false, active);
  }
}

template <int dim>
void Continuum<dim>::persist(Archive &archive)
{
  archive.begin("continuum");
  archive(nodal.time, nodal.dt, nodal.contact_force, near_small_node, steps_to_small_nodes, unfelt_velocity);
  if (pressure)
    archive(*pressure);
}

template class Continuum<2>;
template class Continuum<3>;
} // namespace peat
