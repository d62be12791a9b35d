#include <peat/solver/contact_site.h>

namespace peat {
template <int dim>
void SiteLines<dim>::find(const ActiveNodes<dim> &nodes, std::uint32_t ContactSite<dim>::*node,
                          const std::vector<std::uint32_t> &site_of_node, const std::vector<double> &areas,
                          Sites &sites)
{
  constexpr double far = ContactSite<dim>::far;
  const Grid<dim> &grid = nodes.grid();
  // Neighbours that carry the same but for round-off.
  constexpr double slack = 1e-6;
  // Sites of an interface at 45 degrees to the mesh take the same of two axes that suit them equally.
  constexpr double preference = 1.2;
  const auto area = [&](const std::uint32_t site) { return site == no_index ? 0. : areas[site]; };
  for (std::uint32_t s = 0; s < sites.size(); ++s) {
    ContactSite<dim> &site = sites[s];
    site.line = {s, no_index, no_index};
    site.acts = site.gap < far && site.normal.norm_square() > 0. && areas[s] > 0.;
    if (!site.acts)
      continue;
    unsigned int axis = 0;
    for (unsigned int d = 1; d < dim; ++d)
      if (std::abs(site.normal[d]) > preference * std::abs(site.normal[axis]))
        axis = d;
    auto lattice = grid.node_lattice(nodes.grid_node(site.*node));
    for (const int step : {-1, 2}) {
      lattice[axis] += step;
      if (lattice[axis] < 0 || lattice[axis] > grid.n_cells(axis))
        continue;
      const NodeId grid_node = grid.node_at(lattice);
      const std::uint32_t i = grid_node == no_index ? no_index : nodes.index_of(grid_node);
      site.line[step < 0 ? 1 : 2] = i == no_index ? no_index : site_of_node[i];
    }
    site.acts = areas[s] >= (1. - slack) * std::max(area(site.line[1]), area(site.line[2]));
  }
  for (ContactSite<dim> &site : sites)
    site.shares_line = site.acts && site.line[1] != no_index && sites[site.line[1]].acts;
  for (ContactSite<dim> &site : sites)
    site.acts = site.acts && !site.shares_line;

  // Where lines along different axes meet, a node belongs to the site at it, else to that whose share is
  // larger; of equal ones to the one that comes first in space, on whatever rank.
  owner_of_site.assign(sites.size(), no_index);
  for (std::uint32_t s = 0; s < sites.size(); ++s)
    if (sites[s].acts)
      owner_of_site[s] = s;
  const auto comes_before = [&](const std::uint32_t a, const std::uint32_t b) {
    if (std::abs(areas[a] - areas[b]) > slack * areas[b])
      return areas[a] > areas[b];
    return grid.node_lattice(nodes.grid_node(sites[a].*node)) <
           grid.node_lattice(nodes.grid_node(sites[b].*node));
  };
  for (std::uint32_t s = 0; s < sites.size(); ++s)
    if (sites[s].acts)
      for (const unsigned int k : {1u, 2u})
        if (const std::uint32_t other = sites[s].line[k]; other != no_index && !sites[other].acts) {
          std::uint32_t &owner = owner_of_site[other];
          if (owner == no_index || comes_before(s, owner))
            owner = s;
        }
  for (std::uint32_t s = 0; s < sites.size(); ++s)
    for (std::uint32_t &other : sites[s].line)
      if (other != no_index && owner_of_site[other] != s)
        other = no_index;
}

template <int dim>
double SiteLines<dim>::weigh(const Sites &sites, const ContactSite<dim> &site,
                             std::uint32_t ContactSite<dim>::*node, const std::vector<double> &areas,
                             SurfaceNodes &surface)
{
  double sum = 0.;
  surface = {};
  for (unsigned int k = 0; k < 3; ++k)
    if (const std::uint32_t other = site.line[k]; other != no_index) {
      surface.node[k] = sites[other].*node;
      surface.weight[k] = surface.area[k] = std::max(0., areas[other]);
      sum += surface.weight[k];
    }
  for (double &weight : surface.weight)
    weight *= sum > 0. ? 1. / sum : 0.;
  return sum;
}

template class SiteLines<2>;
template class SiteLines<3>;
} // namespace peat
