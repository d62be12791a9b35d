#include <peat/solver/contact_pair.h>

#include <peat/material/mixture.h>

namespace peat {
template <int dim>
typename ContactPair<dim>::Response
ContactPair<dim>::respond(const ContactSite<dim> &site, const Vector &relative, const Vector &compliance,
                          const std::pair<double, double> &fluid_force, const double dt) const
{
  const ContactLaw &law = *parameters.law;
  const Vector &n = site.normal;
  Response response;
  double normal_compliance = 0.;
  for (unsigned int d = 0; d < dim; ++d)
    normal_compliance += n[d] * n[d] * compliance[d];
  if (normal_compliance == 0.)
    return response;
  if (law.ties()) {
    response.kind = Response::Kind::sticks;
    for (unsigned int d = 0; d < dim; ++d)
      response.impulse[d] = compliance[d] > 0. ? relative[d] / compliance[d] : 0.;
    return response;
  }

  // Surfaces that are apart may come as near as to touch at the end of the step.
  const double closing = relative * n;
  const double normal_impulse = (closing - std::max(site.gap, 0.) / dt) / normal_compliance;
  const double least = site.gap <= 0. ? -law.tension_limit(site.area) * dt : 0.;
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
  if (wanted <= dt * law.shear_limit(normal_force, site.area, false)) {
    response.kind = Response::Kind::sticks;
    response.impulse += stick;
    return response;
  }
  const double shear = std::min(wanted, dt * law.shear_limit(normal_force, site.area, true));
  response.kind = Response::Kind::slides;
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
typename ContactPair<dim>::Vector ContactPair<dim>::node_velocity(const std::vector<double> &field,
                                                                  const std::uint32_t node)
{
  Vector v;
  for (unsigned int d = 0; d < dim; ++d)
    v[d] = field[std::size_t(node) * dim + d];
  return v;
}

template <int dim>
void ContactPair<dim>::push(Continuum<dim> &continuum, const std::uint32_t node, const Vector &impulse,
                            const double dt)
{
  const Vector compliance = node_compliance(continuum, node);
  NodalFields<dim> &fields = continuum.fields();
  for (unsigned int d = 0; d < dim; ++d) {
    const std::size_t row = std::size_t(node) * dim + d;
    const double change = compliance[d] * impulse[d];
    fields.new_velocity[row] += change;
    fields.acceleration[row] += change / dt;
    fields.contact_force[row] += impulse[d] / dt;
  }
}

template <int dim>
std::pair<double, double> ContactPair<dim>::fluid_force(const Continuum<dim> &continuum,
                                                        const std::uint32_t node, const Vector &n,
                                                        const double area, const double dt) const
{
  if (!continuum.is_saturated())
    return {0., 0.};
  if (parameters.interface == ContactParameters<dim>::Interface::drained)
    return {alpha * parameters.pressure * area, 0.};
  using S = Sums<dim>;
  const NodalFields<dim> &fields = continuum.fields();
  const double *sum = &fields.sums[std::size_t(node) * fields.n_sums];
  const double inertia = seepage_inertia ? sum[S::fluid_inertia] : 0.;
  double force = 0.;
  for (unsigned int d = 0; d < dim; ++d) {
    const std::size_t row = std::size_t(node) * dim + d;
    force += n[d] * (sum[S::pressure_force + d] + fields.pressure_load[row] +
                     sum[S::fluid_inertia] * continuum.gravity()[d] - inertia * fields.acceleration[row]);
  }
  const double m = continuum.mass(node);
  return {alpha * force, m > 0. ? alpha * inertia / (m * dt) : 0.};
}

template <int dim>
void ContactPair<dim>::set_flux(Continuum<dim> &continuum, const std::uint32_t node, const Vector &n,
                                const double area) const
{
  if (!continuum.is_saturated())
    return;
  NodalFields<dim> &fields = continuum.fields();
  double *w = &fields.flux[std::size_t(node) * dim];
  double change = 0.;
  if (parameters.interface == ContactParameters<dim>::Interface::impermeable)
    for (unsigned int d = 0; d < dim; ++d)
      change -= w[d] * n[d];
  else if (const double resistance = fields.sums[std::size_t(node) * fields.n_sums + Sums<dim>::resistance];
           resistance > 0.)
    change = -parameters.pressure * area / resistance;
  for (unsigned int d = 0; d < dim; ++d)
    w[d] += change * n[d];
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
