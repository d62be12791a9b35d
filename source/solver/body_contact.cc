#include <peat/solver/body_contact.h>

#include <deal.II/base/mpi.h>

#include <cmath>

namespace peat {
template <int dim>
BodyContact<dim>::BodyContact(const ContactParameters<dim> &parameters, const SchemeParameters &scheme,
                              const Grid<dim> &grid, const Scene<dim> &scene, Continuum<dim> &first,
                              Continuum<dim> &second, std::vector<std::size_t> first_bodies,
                              std::vector<std::size_t> second_bodies)
    : ContactPair<dim>(parameters, scheme, grid, scene), first(first), second(second),
      first_bodies(std::move(first_bodies)), second_bodies(std::move(second_bodies))
{
  this->alpha = ContactPair<dim>::biot_coefficient(first.is_saturated() ? first : second, scene);
}

template <int dim>
std::vector<const Body<dim> *> BodyContact<dim>::pointers(const std::vector<std::size_t> &bodies) const
{
  std::vector<const Body<dim> *> result;
  for (const std::size_t b : bodies)
    result.push_back(this->scene.bodies[b].get());
  return result;
}

template <int dim>
void BodyContact<dim>::match_nodes()
{
  const ActiveNodes<dim> &nodes = first.nodes(), &other = second.nodes();
  sites.clear();
  places.clear();
  site_of_node.assign(nodes.size(), no_index);
  std::vector<std::uint32_t> site_of_other(other.size(), no_index);
  for (std::uint32_t i = 0; i < nodes.size(); ++i) {
    const std::uint32_t j = other.index_of(nodes.grid_node(i));
    if (j == no_index)
      continue;
    site_of_node[i] = site_of_other[j] = sites.size();
    ContactSite<dim> site;
    site.first = i;
    site.second = j;
    site.counts = nodes.is_owned(i);
    site.x = nodes.position(i);
    sites.push_back(site);
    places.push_back(site.x);
  }
  near[0].choose(nodes, this->scheme.basis, pointers(first_bodies), site_of_node);
  near[1].choose(other, this->scheme.basis, pointers(second_bodies), std::move(site_of_other));
  planes.reinit(sites.size());
  for (unsigned int side = 0; side < 2; ++side)
    noted[side].reinit(continuum(side).nodes());
}

template <int dim>
void BodyContact<dim>::begin(const double dt)
{
  this->step_length = dt;
  this->now = {};
  if (!this->parallel && sites.empty())
    return;
  if (this->parameters.law->ties())
    take_all_nodes();
  else {
    for (unsigned int side = 0; side < 2; ++side)
      near[side].collect(continuum(side).nodes());
    find_normals();
    find_gaps();
    find_surfaces();
  }
  for (ContactSite<dim> &site : sites) {
    site.impulse = Vector();
    site.mode = ContactMode::open;
    if (site.acts)
      site.relative_velocity = this->velocity(first.fields().velocity, site.first_surface) -
                               this->velocity(second.fields().velocity, site.second_surface);
  }
}

template <int dim>
typename BodyContact<dim>::Vector BodyContact<dim>::compliance_of(const ContactSite<dim> &site) const
{
  return this->compliance(first, site.first_surface) + this->compliance(second, site.second_surface);
}

template <int dim>
typename BodyContact<dim>::Response BodyContact<dim>::respond_at(const ContactSite<dim> &site,
                                                                 const Vector &compliance) const
{
  Vector relative = this->velocity(first.fields().new_velocity, site.first_surface) -
                    this->velocity(second.fields().new_velocity, site.second_surface);
  for (unsigned int d = 0; d < dim; ++d)
    relative[d] += compliance[d] * site.impulse[d];
  std::pair<double, double> fluid = {0., 0.};
  if (first.is_saturated())
    fluid = this->fluid_force(first, site.first_surface, site.normal, site.area);
  if (second.is_saturated()) {
    const auto other = this->fluid_force(second, site.second_surface, -site.normal, site.area);
    const double share = first.is_saturated() ? 0.5 : 1.;
    fluid.first = (1. - share) * fluid.first + share * other.first;
    fluid.second = (1. - share) * fluid.second + share * other.second;
  }
  fluid.first -= fluid.second * (site.impulse * site.normal);
  return this->respond(site, relative, compliance, fluid);
}

template <int dim>
double BodyContact<dim>::solve()
{
  double largest = 0.;
  for (ContactSite<dim> &site : sites) {
    if (!site.counts || !site.acts)
      continue;
    const Vector compliance = compliance_of(site);
    const Response response = respond_at(site, compliance);
    site.mode = this->kept_mode(response);
    const Vector change = response.impulse - site.impulse;
    if (change.norm_square() == 0.)
      continue;
    site.impulse = response.impulse;
    this->push(noted[0], site.first_surface, -change);
    this->push(noted[1], site.second_surface, change);
    for (unsigned int d = 0; d < dim; ++d)
      largest = std::max(largest, compliance[d] * std::abs(change[d]));
  }
  this->give_impulses(first, noted[0]);
  this->give_impulses(second, noted[1]);
  return largest;
}

template <int dim>
double BodyContact<dim>::outdated_change()
{
  double largest = 0.;
  for (const ContactSite<dim> &site : sites) {
    if (!site.counts || !site.acts)
      continue;
    const Vector compliance = compliance_of(site);
    const Response response = respond_at(site, compliance);
    for (unsigned int d = 0; d < dim; ++d)
      largest = std::max(largest, compliance[d] * std::abs(response.impulse[d] - site.impulse[d]));
  }
  return largest;
}

template <int dim>
void BodyContact<dim>::hold()
{
  held_sites.clear();
  for (std::uint32_t s = 0; s < sites.size(); ++s) {
    const ContactSite<dim> &site = sites[s];
    if (!site.counts || !site.acts || site.mode == ContactMode::open)
      continue;
    ContactPair<dim>::hold(s, compliance_of(site));
    this->note_held_nodes(site, first, site.first_surface, noted[0]);
    this->note_held_nodes(site, second, site.second_surface, noted[1]);
  }
  this->mark_held_nodes(first, noted[0]);
  this->mark_held_nodes(second, noted[1]);
}

template <int dim>
void BodyContact<dim>::restrain_motion()
{
  for (const std::uint32_t s : held_sites) {
    ContactSite<dim> &site = sites[s];
    const Vector relative = this->velocity(first.response().acceleration, site.first_surface) -
                            this->velocity(second.response().acceleration, site.second_surface);
    const Vector force = this->reaction(site, relative);
    site.reaction += force;
    this->push(noted[0], site.first_surface, -force);
    this->push(noted[1], site.second_surface, force);
  }
  this->give_reactions(first, noted[0]);
  this->give_reactions(second, noted[1]);
}

template <int dim>
void BodyContact<dim>::restrain_flux()
{
  for (const std::uint32_t s : held_sites)
    if (const ContactSite<dim> &site = sites[s]; site.closes_flux) {
      this->note_flux_reaction(first, site.first_surface, site.normal, noted[0]);
      this->note_flux_reaction(second, site.second_surface, -site.normal, noted[1]);
    }
  this->give_flux_reactions(first, noted[0]);
  this->give_flux_reactions(second, noted[1]);
}

template <int dim>
void BodyContact<dim>::take_reactions()
{
  for (const std::uint32_t s : held_sites) {
    ContactSite<dim> &site = sites[s];
    const Vector impulse = this->step_length * site.reaction;
    site.impulse += impulse;
    this->push(noted[0], site.first_surface, -impulse);
    this->push(noted[1], site.second_surface, impulse);
  }
  this->give_impulses(first, noted[0]);
  this->give_impulses(second, noted[1]);
}

template <int dim>
void BodyContact<dim>::finish(Ledger<dim> &book)
{
  // Nodes beside the edge of a body, which it hardly reaches, see none of its surface that could overlap
  // [faces of cells].
  constexpr double least_area = 1e-3;
  std::vector<double> sums(dim + 2, 0.);
  double gap = std::numeric_limits<double>::infinity();
  for (const ContactSite<dim> &site : sites) {
    if (!site.counts || !site.acts)
      continue;
    if (site.area >= least_area * std::pow(this->grid.smallest_cell_size(), dim - 1.))
      gap = std::min(gap, site.gap);
    if (site.impulse.norm_square() == 0.)
      continue;
    const Vector end = this->velocity(first.fields().new_velocity, site.first_surface) -
                       this->velocity(second.fields().new_velocity, site.second_surface);
    book.contact_dissipation += site.impulse * (0.5 * (site.relative_velocity + end));
    for (unsigned int d = 0; d < dim; ++d)
      sums[d] -= site.impulse[d] / this->step_length;
    sums[dim] += site.impulse * site.normal / this->step_length;
    sums[dim + 1] += site.area;
  }
  if (this->parallel) {
    dealii::Utilities::MPI::sum(sums, this->communicator, sums);
    gap = dealii::Utilities::MPI::min(gap, this->communicator);
  }
  for (unsigned int d = 0; d < dim; ++d)
    this->now.force[d] = sums[d];
  this->now.normal_force = sums[dim];
  this->now.area = sums[dim + 1];
  this->now.gap = gap;
}

template <int dim>
void BodyContact<dim>::mark_nodes(const Continuum<dim> &continuum, std::vector<char> &count) const
{
  for (const ContactSite<dim> &site : sites)
    if (&continuum == &first)
      ++count[site.first];
    else if (&continuum == &second)
      ++count[site.second];
}

template <int dim>
void BodyContact<dim>::note_late_forces()
{
  for (const ContactSite<dim> &site : sites)
    if (site.counts && site.impulse.norm_square() > 0.) {
      const Vector impulse = this->late_impulse(site);
      this->push(noted[0], site.first_surface, -impulse);
      this->push(noted[1], site.second_surface, impulse);
    }
  this->give_late_forces(first, noted[0]);
  this->give_late_forces(second, noted[1]);
}

template <int dim>
void BodyContact<dim>::constrain_flux()
{
  for (const ContactSite<dim> &site : sites)
    if (site.counts && this->is_covered(site)) {
      this->note_flux(first, site.first_surface, site.normal, noted[0]);
      this->note_flux(second, site.second_surface, -site.normal, noted[1]);
    }
  this->change_flux(first, noted[0]);
  this->change_flux(second, noted[1]);
}

template <int dim>
void BodyContact<dim>::constrain_carrying_velocity()
{
  for (const ContactSite<dim> &site : sites) {
    if (!site.counts || site.impulse.norm_square() == 0.)
      continue;
    const Vector compliance =
        this->compliance(first, site.first_surface) + this->compliance(second, site.second_surface);
    const Vector relative = this->velocity(first.carrying_velocity(), site.first_surface) -
                            this->velocity(second.carrying_velocity(), site.second_surface);
    double normal_compliance = 0.;
    for (unsigned int d = 0; d < dim; ++d)
      normal_compliance += site.normal[d] * site.normal[d] * compliance[d];
    const double closing = relative * site.normal - std::max(site.gap, 0.) / this->step_length;
    if (closing <= 0. || normal_compliance == 0.)
      continue;
    const Vector impulse = closing / normal_compliance * site.normal;
    this->push(noted[0], site.first_surface, -impulse);
    this->push(noted[1], site.second_surface, impulse);
  }
  this->change_carrying_velocity(first, noted[0]);
  this->change_carrying_velocity(second, noted[1]);
}

template <int dim>
void BodyContact<dim>::persist(Archive &archive)
{
  archive.begin("contact of bodies");
  archive(planes);
}

template class BodyContact<2>;
template class BodyContact<3>;
} // namespace peat
