#include <peat/solver/body_contact.h>

#include <deal.II/base/mpi.h>

namespace peat {
template <int dim>
BodyContact<dim>::BodyContact(const ContactParameters<dim> &parameters, const SchemeParameters &scheme,
                              const Grid<dim> &grid, const Scene<dim> &scene, Continuum<dim> &first,
                              Continuum<dim> &second, std::vector<std::size_t> first_bodies,
                              std::vector<std::size_t> second_bodies)
    : ContactPair<dim>(parameters, grid.communicator()), scheme(scheme), grid(grid), scene(scene),
      first(first), second(second), first_bodies(std::move(first_bodies)),
      second_bodies(std::move(second_bodies)),
      parallel(dealii::Utilities::MPI::n_mpi_processes(grid.communicator()) > 1)
{
  this->seepage_inertia = scheme.seepage_inertia;
  this->alpha = ContactPair<dim>::biot_coefficient(first.is_saturated() ? first : second, scene);
}

template <int dim>
std::vector<const Body<dim> *> BodyContact<dim>::pointers(const std::vector<std::size_t> &bodies) const
{
  std::vector<const Body<dim> *> result;
  for (const std::size_t b : bodies)
    result.push_back(scene.bodies[b].get());
  return result;
}

template <int dim>
void BodyContact<dim>::match_nodes()
{
  const ActiveNodes<dim> &nodes = first.nodes(), &other = second.nodes();
  sites.clear();
  places.clear();
  std::array<std::vector<std::uint32_t>, 2> site_of_node;
  site_of_node[0].assign(nodes.size(), no_index);
  site_of_node[1].assign(other.size(), no_index);
  for (std::uint32_t i = 0; i < nodes.size(); ++i) {
    const std::uint32_t j = other.index_of(nodes.grid_node(i));
    if (j == no_index)
      continue;
    site_of_node[0][i] = site_of_node[1][j] = sites.size();
    ContactSite<dim> site{};
    site.first = i;
    site.second = j;
    site.counts = nodes.is_owned(i);
    site.x = nodes.position(i);
    sites.push_back(site);
    places.push_back(site.x);
  }
  near[0].choose(nodes, scheme.basis, pointers(first_bodies), std::move(site_of_node[0]));
  near[1].choose(other, scheme.basis, pointers(second_bodies), std::move(site_of_node[1]));
  planes.reinit(sites.size());
}

template <int dim>
template <typename Combine>
void BodyContact<dim>::over_ranks(std::vector<double> &values, const unsigned int n_columns,
                                  const Continuum<dim> &side, const Combine &combine) const
{
  const bool is_first = &side == &first;
  all_nodes.assign(side.nodes().size() * std::size_t(n_columns), 0.);
  for (std::size_t s = 0; s < sites.size(); ++s)
    std::copy_n(&values[s * n_columns], n_columns,
                &all_nodes[std::size_t(is_first ? sites[s].first : sites[s].second) * n_columns]);
  combine(all_nodes.data());
  for (std::size_t s = 0; s < sites.size(); ++s)
    std::copy_n(&all_nodes[std::size_t(is_first ? sites[s].first : sites[s].second) * n_columns], n_columns,
                &values[s * n_columns]);
}

template <int dim>
void BodyContact<dim>::add_over_ranks(std::vector<double> &values, const unsigned int n_columns,
                                      const Continuum<dim> &side) const
{
  if (parallel)
    over_ranks(values, n_columns, side, [&](double *data) { side.nodes().sum_over_ranks(data, n_columns); });
}

template <int dim>
void BodyContact<dim>::max_over_ranks(std::vector<double> &values, const Continuum<dim> &side) const
{
  if (parallel)
    over_ranks(values, 1, side, [&](double *data) { side.nodes().max_over_ranks(data, 1); });
}

template <int dim>
void BodyContact<dim>::begin(double, const double dt)
{
  step_length = dt;
  this->now = {};
  if (!parallel && sites.empty())
    return;
  for (unsigned int side = 0; side < 2; ++side)
    near[side].collect(continuum(side).nodes());
  find_normals();
  find_gaps();
  for (ContactSite<dim> &site : sites) {
    site.impulse = Vector();
    site.relative_velocity = this->node_velocity(first.fields().velocity, site.first) -
                             this->node_velocity(second.fields().velocity, site.second);
  }
}

template <int dim>
void BodyContact<dim>::find_normals()
{
  using Normal = typename ContactParameters<dim>::Normal;
  for (unsigned int side = 0; side < 2; ++side) {
    auto &gradient = volume_gradient[side];
    gradient.assign(sites.size() * dim, 0.);
    for (const auto &entry : near[side].entries())
      for (unsigned int d = 0; d < dim; ++d)
        gradient[std::size_t(entry.site) * dim + d] += near[side].points()[entry.point].volume * entry.dN[d];
    add_over_ranks(gradient, dim, continuum(side));
  }
  const Normal method = this->parameters.normal;
  if (method == Normal::regression)
    planes.fit(
        near[0], near[1], places, grid.smallest_cell_size(),
        [&](std::vector<double> &sums) { add_over_ranks(sums, SeparatingPlanes<dim>::n_sums, first); },
        [&](const bool converged) {
          return parallel ? dealii::Utilities::MPI::min(int(converged), this->communicator) == 1 : converged;
        });
  for (std::size_t s = 0; s < sites.size(); ++s) {
    Vector g[2];
    for (unsigned int side = 0; side < 2; ++side)
      for (unsigned int d = 0; d < dim; ++d)
        g[side][d] = volume_gradient[side][s * dim + d];
    // sum V grad N points out of a body.
    Vector n = method == Normal::prescribed   ? this->parameters.direction
               : method == Normal::regression ? planes.normal(s)
                                              : g[0] - g[1];
    n = n.norm() > 0. ? n / n.norm() : n;
    sites[s].normal = n;
    sites[s].area = std::max(0., std::min(g[0] * n, -(g[1] * n)));
  }
}

template <int dim>
void BodyContact<dim>::find_gaps()
{
  const double far = std::numeric_limits<double>::max();
  // How far the first body reaches along the normal, and the second against it.
  std::array<std::vector<double>, 2> edge;
  for (unsigned int side = 0; side < 2; ++side) {
    const double sign = side == 0 ? 1. : -1.;
    edge[side].assign(sites.size(), -far);
    for (const auto &entry : near[side].entries()) {
      const auto &point = near[side].points()[entry.point];
      const Vector &n = sites[entry.site].normal;
      if (point.depth == 0.)
        continue;
      edge[side][entry.site] =
          std::max(edge[side][entry.site], sign * ((point.x - sites[entry.site].x) * n) + point.reach(n));
    }
    max_over_ranks(edge[side], continuum(side));
  }
  for (std::size_t s = 0; s < sites.size(); ++s)
    sites[s].gap = edge[0][s] == -far || edge[1][s] == -far ? far : -edge[0][s] - edge[1][s];
}

template <int dim>
double BodyContact<dim>::solve()
{
  const double dt = step_length;
  double largest = 0.;
  for (ContactSite<dim> &site : sites) {
    const Vector compliance_first = this->node_compliance(first, site.first),
                 compliance_second = this->node_compliance(second, site.second),
                 compliance = compliance_first + compliance_second;
    if (first.mass(site.first) == 0. || second.mass(site.second) == 0. ||
        (site.normal.norm_square() == 0. && !this->parameters.law->ties()))
      continue;
    Vector relative = this->node_velocity(first.fields().new_velocity, site.first) -
                      this->node_velocity(second.fields().new_velocity, site.second);
    for (unsigned int d = 0; d < dim; ++d)
      relative[d] += compliance[d] * site.impulse[d];
    std::pair<double, double> fluid = {0., 0.};
    if (first.is_saturated())
      fluid = this->fluid_force(first, site.first, site.normal, site.area, dt);
    if (second.is_saturated()) {
      const auto other = this->fluid_force(second, site.second, -site.normal, site.area, dt);
      const double share = first.is_saturated() ? 0.5 : 1.;
      fluid.first = (1. - share) * fluid.first + share * other.first;
      fluid.second = (1. - share) * fluid.second + share * other.second;
    }
    fluid.first -= fluid.second * (site.impulse * site.normal);
    const auto response = this->respond(site, relative, compliance, fluid, dt);
    const Vector change = response.impulse - site.impulse;
    if (change.norm_square() == 0.)
      continue;
    site.impulse = response.impulse;
    this->push(first, site.first, -change, dt);
    this->push(second, site.second, change, dt);
    for (unsigned int d = 0; d < dim; ++d)
      largest = std::max(largest, compliance[d] * std::abs(change[d]));
  }
  return largest;
}

template <int dim>
void BodyContact<dim>::finish(Ledger<dim> &book)
{
  std::vector<double> sums(dim + 2, 0.);
  double gap = std::numeric_limits<double>::infinity();
  for (const ContactSite<dim> &site : sites) {
    if (!site.counts || first.mass(site.first) == 0. || second.mass(site.second) == 0.)
      continue;
    gap = std::min(gap, site.gap);
    if (site.impulse.norm_square() == 0.)
      continue;
    const Vector end = this->node_velocity(first.fields().new_velocity, site.first) -
                       this->node_velocity(second.fields().new_velocity, site.second);
    book.contact_dissipation += site.impulse * (0.5 * (site.relative_velocity + end));
    for (unsigned int d = 0; d < dim; ++d)
      sums[d] -= site.impulse[d] / step_length;
    sums[dim] += site.impulse * site.normal / step_length;
    sums[dim + 1] += site.area;
  }
  if (parallel) {
    dealii::Utilities::MPI::sum(sums, this->communicator, sums);
    gap = dealii::Utilities::MPI::min(gap, this->communicator);
  }
  for (unsigned int d = 0; d < dim; ++d)
    this->now.force[d] = sums[d];
  this->now.normal_force = sums[dim];
  this->now.area = sums[dim + 1];
  this->now.gap = gap < std::numeric_limits<double>::max() ? gap : std::numeric_limits<double>::infinity();
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
void BodyContact<dim>::constrain_flux()
{
  for (const ContactSite<dim> &site : sites)
    if (site.impulse * site.normal > 0.) {
      this->set_flux(first, site.first, site.normal, site.area);
      this->set_flux(second, site.second, -site.normal, site.area);
    }
}

template <int dim>
void BodyContact<dim>::constrain_carrying_velocity()
{
  for (const ContactSite<dim> &site : sites) {
    if (site.impulse.norm_square() == 0.)
      continue;
    const Vector compliance_first = this->node_compliance(first, site.first),
                 compliance_second = this->node_compliance(second, site.second);
    const Vector relative = this->node_velocity(first.carrying_velocity(), site.first) -
                            this->node_velocity(second.carrying_velocity(), site.second);
    double normal_compliance = 0.;
    for (unsigned int d = 0; d < dim; ++d)
      normal_compliance += site.normal[d] * site.normal[d] * (compliance_first[d] + compliance_second[d]);
    const double closing = relative * site.normal - std::max(site.gap, 0.) / step_length;
    if (closing <= 0. || normal_compliance == 0.)
      continue;
    for (unsigned int d = 0; d < dim; ++d) {
      const double impulse = closing / normal_compliance * site.normal[d];
      first.carrying_velocity()[std::size_t(site.first) * dim + d] -= compliance_first[d] * impulse;
      second.carrying_velocity()[std::size_t(site.second) * dim + d] += compliance_second[d] * impulse;
    }
  }
}

template class BodyContact<2>;
template class BodyContact<3>;
} // namespace peat
