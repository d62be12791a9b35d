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
/// Of points that are farther from the rigid body it does not matter how its surface bends [cell sizes].
constexpr double bending_range = 0.5;
/// Normals that differ by no more are equal but for round-off.
constexpr double aligned = 1e-9;
/// Points that are farther from the rigid body than the nearest one by this do not touch it with that one
/// [cell sizes].
constexpr double touch_range = 0.005;
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
typename RigidSites<dim>::Approach
RigidSites<dim>::approach(const typename NearPoints<dim>::PointData &point) const
{
  const Vector n = rigid.normal(point.x);
  const double distance = rigid.distance(point.x);
  // As of a plane normal to n: a convex body is nowhere nearer to the box than this.
  const Approach of_plane{distance - point.reach(n), n, point.x - distance * n};
  if (of_plane.gap > bending_range * grid.smallest_cell_size())
    return of_plane;
  dealii::Point<dim> corner = point.x;
  for (unsigned int d = 0; d < dim; ++d)
    if (std::abs(n[d]) > aligned)
      corner[d] -= std::copysign(point.depth * point.half_extent[d], n[d]);
  Approach found = at(corner);
  if ((n - found.normal).norm() <= aligned)
    return of_plane;
  // Where the surface bends, what is nearest to it may lie before the corner of the box: there the normal has
  // no part along the box.
  dealii::Point<dim> between = corner;
  for (unsigned int d = 0; d < dim; ++d)
    if (n[d] * found.normal[d] < 0.)
      between[d] = point.x[d] + (corner[d] - point.x[d]) * n[d] / (n[d] - found.normal[d]);
  if (between != corner)
    if (const Approach nearer = at(between); nearer.gap < found.gap)
      found = nearer;
  return found;
}

template <int dim>
typename RigidSites<dim>::Approach RigidSites<dim>::at(const dealii::Point<dim> &x) const
{
  const double gap = rigid.distance(x);
  const Vector n = rigid.normal(x);
  return {gap, n, x - gap * n};
}

template <int dim>
void RigidSites<dim>::find_gaps(const ActiveNodes<dim> &nodes,
                                const std::function<bool(std::uint32_t)> &has_mass)
{
  constexpr double far = ContactSite<dim>::far;
  const auto &points = near.points();
  approaches.assign(points.size(), Approach());
  for (std::size_t p = 0; p < points.size(); ++p)
    if (points[p].depth > 0.)
      approaches[p] = approach(points[p]);

  const std::size_t size = parallel ? nodes.size() : sites.size();
  nearest.assign(size, -far);
  for (const auto &entry : near.entries())
    if (approaches[entry.point].gap < far) {
      double &value = nearest[index_of(sites[entry.site])];
      value = std::max(value, -approaches[entry.point].gap);
    }
  if (parallel)
    nodes.max_over_ranks(nearest.data(), 1);

  // Means over the points near the surface, and over those that touch it: weights, gaps, normals and places;
  // and the volume gradient.
  sums.assign(size * n_columns, 0.);
  const double h = grid.smallest_cell_size();
  const double range = ContactSite<dim>::surface_range * h, slack = ContactSite<dim>::gap_slack * h;
  for (const auto &entry : near.entries()) {
    double *sum = values_of(sites[entry.site]);
    const auto &point = points[entry.point];
    for (unsigned int d = 0; d < dim; ++d)
      sum[gradient_column + d] += point.volume * entry.dN[d];
    const Approach &found = approaches[entry.point];
    if (found.gap == far)
      continue;
    const double above = found.gap + nearest[index_of(sites[entry.site])];
    const double w = entry.N * std::max(0., 1. - above / range);
    sum[0] += w;
    sum[1] += w * found.gap;
    const double w_touch = entry.N * std::max(0., 1. - above / (touch_range * h));
    sum[touch_column] += w_touch;
    for (unsigned int d = 0; d < dim; ++d) {
      sum[2 + d] += w * found.normal[d];
      sum[2 + dim + d] += w * found.place[d];
      sum[touch_column + 1 + d] += w_touch * found.normal[d];
      sum[touch_column + 1 + dim + d] += w_touch * found.place[d];
    }
  }
  if (parallel)
    nodes.sum_over_ranks(sums.data(), n_columns);
  for (ContactSite<dim> &site : sites) {
    const double *sum = values_of(site);
    site.gap = far;
    site.normal = Vector();
    if (!(sum[0] > 0.) || !has_mass(site.second))
      continue;
    // The least gap of all points that reach the node would be that of a surface which is in contact beside
    // it: a wheel would be held by the ground ahead of it. Within the slack it counts, as of flat surfaces.
    const double least = -nearest[index_of(site)], mean = sum[1] / sum[0];
    site.gap = least + std::max(0., mean - least - slack);
    // Forces act where and along what changes this gap when the rigid body moves (43c); else a wheel would
    // climb the ground ahead of it, and hop.
    const bool least_counts = mean - least <= slack;
    const double weight = least_counts ? sum[touch_column] : sum[0];
    const double *means = least_counts ? sum + touch_column + 1 : sum + 2;
    for (unsigned int d = 0; d < dim; ++d) {
      site.normal[d] = means[d];
      site.x[d] = means[dim + d] / weight;
    }
    if (site.normal.norm() > 0.)
      site.normal /= site.normal.norm();
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
      gradient[d] = values_of(sites[s])[gradient_column + d];
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
