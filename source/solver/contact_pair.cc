#include <peat/solver/contact_pair.h>

#include <peat/material/mixture.h>

#include <deal.II/base/mpi.h>

namespace peat {
template <int dim>
ContactPair<dim>::ContactPair(const ContactParameters<dim> &parameters, const SchemeParameters &scheme,
                              const Grid<dim> &grid, const Scene<dim> &scene)
    : parameters(parameters), scheme(scheme), grid(grid), scene(scene), communicator(grid.communicator()),
      parallel(dealii::Utilities::MPI::n_mpi_processes(grid.communicator()) > 1),
      touching(1e-9 * grid.smallest_cell_size())
{}

template <int dim>
typename ContactPair<dim>::Response
ContactPair<dim>::respond(const ContactSite<dim> &site, const Vector &relative, const Vector &compliance,
                          const std::pair<double, double> &fluid_force) const
{
  const ContactLaw &law = *parameters.law;
  const double dt = step_length;
  const Vector &n = site.normal;
  Response response;
  double normal_compliance = 0.;
  for (unsigned int d = 0; d < dim; ++d)
    normal_compliance += n[d] * n[d] * compliance[d];
  if (law.ties()) {
    response.mode = ContactMode::sticks;
    response.bears_shear = true;
    for (unsigned int d = 0; d < dim; ++d)
      response.impulse[d] = compliance[d] > 0. ? relative[d] / compliance[d] : 0.;
    return response;
  }
  if (normal_compliance == 0.)
    return response;

  // Surfaces that are apart may come as near as to touch at the end of the step.
  const double closing = relative * n;
  const double normal_impulse = (closing - std::max(site.gap, 0.) / dt) / normal_compliance;
  const double least = site.gap <= touching ? -law.tension_limit(site.area) * dt : 0.;
  if (normal_impulse <= least)
    return response;

  Vector stick;
  for (unsigned int d = 0; d < dim; ++d)
    stick[d] = compliance[d] > 0. ? (relative[d] - closing * n[d]) / compliance[d] : 0.;
  stick -= (stick * n) * n;
  const double wanted = stick.norm();
  double normal_force = normal_impulse / dt;
  if (law.on_effective_stress())
    normal_force -= fluid_force.first + fluid_force.second * normal_impulse;
  normal_force = std::max(0., normal_force);
  response.impulse = normal_impulse * n;
  const double bearable = dt * law.shear_limit(normal_force, site.area, false);
  if (wanted <= bearable) {
    response.mode = ContactMode::sticks;
    response.bears_shear = bearable > 0.;
    response.impulse += stick;
    return response;
  }
  const double shear = std::min(wanted, dt * law.shear_limit(normal_force, site.area, true));
  response.mode = ContactMode::slides;
  response.slip_direction = stick / wanted;
  response.slip_ratio =
      normal_force > 0. && shear < wanted
          ? dt * (law.shear_limit(normal_force, site.area, true) - law.shear_limit(0., site.area, true)) /
                (normal_force * dt)
          : 0.;
  response.impulse += shear * response.slip_direction;
  return response;
}

template <int dim>
typename ContactPair<dim>::Vector ContactPair<dim>::node_compliance(const Continuum<dim> &continuum,
                                                                    const std::uint32_t node)
{
  const double m = continuum.mass(node);
  Vector compliance;
  for (unsigned int d = 0; d < dim; ++d)
    compliance[d] = m > 0. && !continuum.is_prescribed(std::size_t(node) * dim + d) ? 1. / m : 0.;
  return compliance;
}

template <int dim>
typename ContactPair<dim>::Vector ContactPair<dim>::compliance(const Continuum<dim> &continuum,
                                                               const SurfaceNodes &surface)
{
  Vector sum;
  for (unsigned int k = 0; k < 3; ++k)
    if (surface.weight[k] > 0.)
      sum += surface.weight[k] * surface.weight[k] * node_compliance(continuum, surface.node[k]);
  return sum;
}

template <int dim>
typename ContactPair<dim>::Vector ContactPair<dim>::velocity(const std::vector<double> &field,
                                                             const SurfaceNodes &surface)
{
  Vector v;
  for (unsigned int k = 0; k < 3; ++k)
    if (surface.weight[k] > 0.)
      for (unsigned int d = 0; d < dim; ++d)
        v[d] += surface.weight[k] * field[std::size_t(surface.node[k]) * dim + d];
  return v;
}

template <int dim>
double ContactPair<dim>::outflow(const std::vector<double> &flux, const SurfaceNodes &surface,
                                 const Vector &n)
{
  double sum = 0.;
  for (unsigned int k = 0; k < 3; ++k)
    if (surface.area[k] != 0.)
      for (unsigned int d = 0; d < dim; ++d)
        sum += surface.area[k] * n[d] * flux[std::size_t(surface.node[k]) * dim + d];
  return sum;
}

template <int dim>
void ContactPair<dim>::push(NodalAdditions<dim> &noted, const SurfaceNodes &surface,
                            const Vector &impulse) const
{
  for (unsigned int k = 0; k < 3; ++k)
    if (surface.weight[k] > 0.)
      noted.note(surface.node[k], surface.weight[k] * impulse);
}

template <int dim>
void ContactPair<dim>::give_impulses(Continuum<dim> &continuum, NodalAdditions<dim> &noted) const
{
  NodalFields<dim> &fields = continuum.fields();
  noted.add_up(parallel, [&](const std::size_t row, const double impulse) {
    const double change = node_compliance(continuum, row / dim)[row % dim] * impulse;
    fields.new_velocity[row] += change;
    fields.acceleration[row] += change / step_length;
    fields.contact_force[row] += impulse / step_length;
  });
}

template <int dim>
typename ContactPair<dim>::Vector ContactPair<dim>::late_impulse(const ContactSite<dim> &site) const
{
  // Ties act through every step as what is within a body does. The flux that a normal impulse drives ends
  // at an impermeable interface in the same step.
  if (parameters.law->ties())
    return Vector();
  return parameters.interface == ContactParameters<dim>::Interface::impermeable
             ? site.impulse - (site.impulse * site.normal) * site.normal
             : site.impulse;
}

template <int dim>
void ContactPair<dim>::give_late_forces(Continuum<dim> &continuum, NodalAdditions<dim> &noted) const
{
  noted.add_up(parallel, [&](const std::size_t row, const double impulse) {
    if (continuum.is_saturated())
      continuum.late_force()[row] += impulse / step_length;
  });
}

template <int dim>
std::pair<double, double> ContactPair<dim>::fluid_force(const Continuum<dim> &continuum,
                                                        const SurfaceNodes &surface, const Vector &n,
                                                        const double area) const
{
  if (!continuum.is_saturated())
    return {0., 0.};
  if (parameters.interface == ContactParameters<dim>::Interface::drained)
    return {alpha * parameters.pressure * area, 0.};
  using S = Sums<dim>;
  const NodalFields<dim> &fields = continuum.fields();
  // Of all nodes that carry the interface: their sum is exact for hydrostatic pressures, where each alone is
  // not.
  double force = 0., per_impulse = 0.;
  for (unsigned int k = 0; k < 3; ++k) {
    if (surface.weight[k] == 0.)
      continue;
    const double *sum = &fields.sums[std::size_t(surface.node[k]) * fields.n_sums];
    const double inertia = scheme.seepage_inertia ? sum[S::fluid_inertia] : 0.;
    for (unsigned int d = 0; d < dim; ++d) {
      const std::size_t row = std::size_t(surface.node[k]) * dim + d;
      force += n[d] * (sum[S::pressure_force + d] + fields.pressure_load[row] +
                       sum[S::fluid_inertia] * continuum.gravity()[d] - inertia * fields.acceleration[row]);
    }
    per_impulse += surface.weight[k] * inertia / (sum[S::mass] * step_length);
  }
  return {alpha * force, alpha * per_impulse};
}

template <int dim>
void ContactPair<dim>::note_flux(const Continuum<dim> &continuum, const SurfaceNodes &surface,
                                 const Vector &n, NodalAdditions<dim> &noted) const
{
  if (!continuum.is_saturated())
    return;
  const NodalFields<dim> &fields = continuum.fields();
  const auto conductance = [&](const unsigned int k, const unsigned int d) {
    const double resistance =
        fields.sums[std::size_t(surface.node[k]) * fields.n_sums + Sums<dim>::resistance];
    return resistance > 0. && !continuum.closes_flux(std::size_t(surface.node[k]) * dim + d) ? 1. / resistance
                                                                                             : 0.;
  };
  // What acts on the interface from outside [Pa].
  double pressure = parameters.pressure;
  if (parameters.interface == ContactParameters<dim>::Interface::impermeable) {
    double by_unit = 0.;
    for (unsigned int k = 0; k < 3; ++k)
      if (surface.area[k] != 0.)
        for (unsigned int d = 0; d < dim; ++d)
          by_unit += surface.area[k] * surface.area[k] * n[d] * n[d] * conductance(k, d);
    pressure = by_unit > 0. ? outflow(fields.flux, surface, n) / by_unit : 0.;
  }
  for (unsigned int k = 0; k < 3; ++k)
    if (surface.area[k] != 0.) {
      Vector change;
      for (unsigned int d = 0; d < dim; ++d)
        change[d] = -pressure * surface.area[k] * conductance(k, d) * n[d];
      noted.note(surface.node[k], change);
    }
}

template <int dim>
void ContactPair<dim>::change_flux(Continuum<dim> &continuum, NodalAdditions<dim> &noted) const
{
  if (continuum.is_saturated())
    noted.add_up(parallel,
                 [&](const std::size_t row, const double change) { continuum.fields().flux[row] += change; });
}

template <int dim>
void ContactPair<dim>::change_carrying_velocity(Continuum<dim> &continuum, NodalAdditions<dim> &noted) const
{
  noted.add_up(parallel, [&](const std::size_t row, const double impulse) {
    continuum.carrying_velocity()[row] += node_compliance(continuum, row / dim)[row % dim] * impulse;
  });
}

template <int dim>
ContactMode ContactPair<dim>::kept_mode(const Response &response)
{
  return response.mode == ContactMode::sticks && !response.bears_shear ? ContactMode::slides : response.mode;
}

template <int dim>
void ContactPair<dim>::hold(const std::uint32_t s, const Vector &compliance)
{
  ContactSite<dim> &site = sites[s];
  double normal_compliance = 0.;
  for (unsigned int d = 0; d < dim; ++d) {
    normal_compliance += site.normal[d] * site.normal[d] * compliance[d];
    site.mass[d] = compliance[d] > 0. ? 1. / compliance[d] : 0.;
  }
  site.normal_mass = normal_compliance > 0. ? 1. / normal_compliance : 0.;
  site.closes_flux =
      parameters.interface == ContactParameters<dim>::Interface::impermeable && is_covered(site);
  held_sites.push_back(s);
}

template <int dim>
void ContactPair<dim>::note_held_nodes(const ContactSite<dim> &site, const Continuum<dim> &continuum,
                                       const SurfaceNodes &surface, NodalAdditions<dim> &noted) const
{
  if (!continuum.is_saturated() || (site.closes_flux && site.mode != ContactMode::sticks))
    return;
  Vector ones;
  for (unsigned int d = 0; d < dim; ++d)
    ones[d] = 1.;
  for (unsigned int k = 0; k < 3; ++k)
    if (surface.weight[k] > 0.)
      noted.note(surface.node[k], ones);
}

template <int dim>
void ContactPair<dim>::mark_held_nodes(Continuum<dim> &continuum, NodalAdditions<dim> &noted) const
{
  if (continuum.is_saturated())
    noted.add_up(parallel, [&](const std::size_t row, double) { continuum.response().held[row] = 1; });
}

template <int dim>
void ContactPair<dim>::forget_reactions()
{
  for (const std::uint32_t s : held_sites)
    sites[s].reaction = Vector();
}

template <int dim>
typename ContactPair<dim>::Vector ContactPair<dim>::reaction(const ContactSite<dim> &site,
                                                             const Vector &relative) const
{
  if (site.mode != ContactMode::sticks)
    return site.normal_mass * (relative * site.normal) * site.normal;
  Vector force;
  for (unsigned int d = 0; d < dim; ++d)
    force[d] = site.mass[d] * relative[d];
  return force;
}

template <int dim>
void ContactPair<dim>::give_reactions(Continuum<dim> &continuum, NodalAdditions<dim> &noted) const
{
  std::vector<double> &acceleration = continuum.response().acceleration;
  noted.add_up(parallel, [&](const std::size_t row, const double force) {
    acceleration[row] += node_compliance(continuum, row / dim)[row % dim] * force;
  });
}

template <int dim>
void ContactPair<dim>::note_flux_reaction(const Continuum<dim> &continuum, const SurfaceNodes &surface,
                                          const Vector &n, NodalAdditions<dim> &noted) const
{
  if (!continuum.is_saturated())
    return;
  const NodalResponse &response = continuum.response();
  const auto conductance = [&](const unsigned int k, const unsigned int d) {
    return response.conductance[std::size_t(surface.node[k]) * dim + d];
  };
  double sum = 0.;
  for (unsigned int k = 0; k < 3; ++k)
    if (surface.area[k] != 0.)
      for (unsigned int d = 0; d < dim; ++d)
        sum += surface.area[k] * surface.area[k] * n[d] * n[d] * conductance(k, d);
  if (sum == 0.)
    return;
  const double pressure = outflow(response.flux, surface, n) / sum;
  for (unsigned int k = 0; k < 3; ++k)
    if (surface.area[k] != 0.) {
      Vector change;
      for (unsigned int d = 0; d < dim; ++d)
        change[d] = -pressure * surface.area[k] * conductance(k, d) * n[d];
      noted.note(surface.node[k], change);
    }
}

template <int dim>
void ContactPair<dim>::give_flux_reactions(Continuum<dim> &continuum, NodalAdditions<dim> &noted) const
{
  if (continuum.is_saturated())
    noted.add_up(parallel, [&](const std::size_t row, const double change) {
      continuum.response().flux[row] += change;
    });
}

template <int dim>
double ContactPair<dim>::biot_coefficient(const Continuum<dim> &continuum, const Scene<dim> &scene)
{
  for (const std::size_t b : continuum.bodies())
    if (const Mixture *mixture = scene.bodies[b]->material().mixture())
      return mixture->biot_coefficient();
  return 0.;
}

template class ContactPair<2>;
template class ContactPair<3>;
} // namespace peat
