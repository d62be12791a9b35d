#include <peat/solver/rigid_sites.h>

#include <deal.II/base/mpi.h>

namespace peat {
namespace {
/// Nodes are chosen this far from the rigid body's surface [cell sizes], and anew when it has moved by a part
/// of it.
constexpr double margin = 2.;
constexpr double renewal = 0.5;
/// A line of the mesh meets the rigid body if it does not pass it at more than this [cell sizes].
constexpr double influence = 0.5 + 1e-9;
} // namespace

template <int dim>
RigidSites<dim>::RigidSites(const Grid<dim> &grid, const Basis basis, const RigidBody<dim> &rigid,
                            std::vector<const Body<dim> *> bodies, std::vector<ContactSite<dim>> &sites)
    : grid(grid), basis(basis), rigid(rigid), bodies(std::move(bodies)),
      parallel(dealii::Utilities::MPI::n_mpi_processes(grid.communicator()) > 1), sites(sites)
{}

template <int dim>
void RigidSites<dim>::choose(const ActiveNodes<dim> &nodes)
{
  const double reach = margin * grid.smallest_cell_size();
  const Bounds<dim> bounds = rigid.bounds();
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t i = 0; i < nodes.size(); ++i) {
    const auto &x = nodes.position(i);
    bool inside = true;
    for (unsigned int d = 0; d < dim; ++d)
      inside = inside && x[d] > bounds.lower[d] - reach && x[d] < bounds.upper[d] + reach;
    if (inside && rigid.distance(x) <= reach)
      chosen.push_back(i);
  }
  take(nodes, chosen);
  corners_of_choice = corners();
}

template <int dim>
void RigidSites<dim>::take(const ActiveNodes<dim> &nodes, const std::vector<std::uint32_t> &chosen)
{
  sites.clear();
  site_of_node.assign(nodes.size(), no_index);
  for (const std::uint32_t i : chosen) {
    site_of_node[i] = sites.size();
    ContactSite<dim> site;
    site.second = i;
    site.counts = nodes.is_owned(i);
    sites.push_back(site);
  }
  near.choose(nodes, basis, bodies, site_of_node);
}

template <int dim>
void RigidSites<dim>::persist(Archive &archive, const ActiveNodes<dim> &nodes)
{
  std::vector<std::uint32_t> chosen;
  for (const ContactSite<dim> &site : sites)
    chosen.push_back(site.second);
  archive(chosen, corners_of_choice);
  if (archive.is_loading())
    take(nodes, chosen);
}

template <int dim>
typename RigidSites<dim>::Corners RigidSites<dim>::corners() const
{
  const Bounds<dim> bounds = rigid.reference_shape().bounds();
  Corners result;
  for (unsigned int corner = 0; corner < (1u << dim); ++corner) {
    dealii::Point<dim> x;
    for (unsigned int d = 0; d < dim; ++d)
      x[d] = (corner >> d) & 1 ? bounds.upper[d] : bounds.lower[d];
    result[corner] = rigid.to_present(x);
  }
  return result;
}

template <int dim>
bool RigidSites<dim>::is_outdated() const
{
  double moved = 0.;
  const auto now_at = corners();
  for (std::size_t corner = 0; corner < now_at.size(); ++corner)
    moved = std::max(moved, now_at[corner].distance(corners_of_choice[corner]));
  return moved > renewal * grid.smallest_cell_size();
}

template <int dim>
void RigidSites<dim>::find(const ActiveNodes<dim> &nodes, const std::function<bool(std::uint32_t)> &has_mass)
{
  near.collect(nodes);
  find_gaps(nodes, has_mass);
  find_surfaces(nodes);
}

template <int dim>
void RigidSites<dim>::find_gaps(const ActiveNodes<dim> &nodes,
                                const std::function<bool(std::uint32_t)> &has_mass)
{
  constexpr double far = ContactSite<dim>::far;
  const auto &points = near.points();
  normals.assign(points.size(), Vector());
  distances.assign(points.size(), far);
  for (std::size_t p = 0; p < points.size(); ++p)
    if (points[p].depth > 0.) {
      normals[p] = rigid.normal(points[p].x);
      distances[p] = rigid.distance(points[p].x);
    }

  const std::size_t size = parallel ? nodes.size() : sites.size();
  nearest.assign(size, -far);
  for (const auto &entry : near.entries())
    if (distances[entry.point] < far) {
      const double gap = distances[entry.point] - points[entry.point].reach(normals[entry.point]);
      double &value = nearest[index_of(sites[entry.site])];
      value = std::max(value, -gap);
    }
  if (parallel)
    nodes.max_over_ranks(nearest.data(), 1);

  // Normal, place, and volume gradient.
  sums.assign(size * n_columns, 0.);
  const double range = ContactSite<dim>::surface_range * grid.smallest_cell_size();
  for (const auto &entry : near.entries()) {
    double *sum = values_of(sites[entry.site]);
    const auto &point = points[entry.point];
    for (unsigned int d = 0; d < dim; ++d)
      sum[1 + 2 * dim + d] += point.volume * entry.dN[d];
    if (distances[entry.point] == far)
      continue;
    const Vector &n = normals[entry.point];
    const double gap = distances[entry.point] - point.reach(n);
    const double w = entry.N * std::max(0., 1. - (gap + nearest[index_of(sites[entry.site])]) / range);
    sum[0] += w;
    for (unsigned int d = 0; d < dim; ++d) {
      sum[1 + d] += w * n[d];
      sum[1 + dim + d] += w * (point.x[d] - distances[entry.point] * n[d]);
    }
    sum[1 + 3 * dim] += w * gap;
  }
  if (parallel)
    nodes.sum_over_ranks(sums.data(), n_columns);
  for (ContactSite<dim> &site : sites) {
    const double *sum = values_of(site);
    site.gap = far;
    site.normal = Vector();
    if (!(sum[0] > 0.) || !has_mass(site.second))
      continue;
    for (unsigned int d = 0; d < dim; ++d) {
      site.normal[d] = sum[1 + d];
      site.x[d] = sum[1 + dim + d] / sum[0];
    }
    if (site.normal.norm() == 0.)
      continue;
    site.normal /= site.normal.norm();
    // The least gap of all points that reach the node would be that of a surface which is in contact beside
    // it: a wheel would be held by the ground ahead of it. Within the slack it counts, as of flat surfaces.
    const double least = -nearest[index_of(site)], mean = sum[1 + 3 * dim] / sum[0];
    site.gap = least + std::max(0., mean - least - ContactSite<dim>::gap_slack * grid.smallest_cell_size());
  }
}

template <int dim>
void RigidSites<dim>::find_surfaces(const ActiveNodes<dim> &nodes)
{
  areas.resize(sites.size());
  for (std::size_t s = 0; s < sites.size(); ++s) {
    // sum V grad N points out of the body.
    Vector gradient;
    for (unsigned int d = 0; d < dim; ++d)
      gradient[d] = values_of(sites[s])[1 + 2 * dim + d];
    areas[s] = -(gradient * sites[s].normal);
  }
  lines.find(nodes, &ContactSite<dim>::second, site_of_node, areas, sites);
  for (ContactSite<dim> &site : sites) {
    if (!site.acts)
      continue;
    site.area = SiteLines<dim>::weigh(sites, site, &ContactSite<dim>::second, areas, site.second_surface);
    dealii::Point<dim> crossing;
    for (unsigned int k = 0; k < 3; ++k)
      if (site.second_surface.weight[k] > 0.)
        crossing += site.second_surface.weight[k] * Vector(nodes.position(site.second_surface.node[k]));
    site.acts = rigid.distance(crossing) <= influence * grid.smallest_cell_size();
  }
}

template class RigidSites<2>;
template class RigidSites<3>;
} // namespace peat
