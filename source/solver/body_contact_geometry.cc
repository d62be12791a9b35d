#include <peat/solver/body_contact.h>

#include <deal.II/base/mpi.h>

namespace peat {
namespace {
/// Slope, in directions normal to n, of the heights along n of places with this covariance [m^2].
template <int dim>
dealii::Tensor<1, dim> slope(const dealii::Tensor<2, dim> &covariance, const dealii::Tensor<1, dim> &n,
                             const double ridge)
{
  // The system is that of the tangential plane; along n it says 0 = 0.
  dealii::Tensor<2, dim> P, A;
  for (unsigned int d = 0; d < dim; ++d)
    for (unsigned int e = 0; e < dim; ++e)
      P[d][e] = (d == e) - n[d] * n[e];
  A = P * covariance * P;
  for (unsigned int d = 0; d < dim; ++d)
    A[d][d] += ridge;
  return P * (invert(A) * (P * (covariance * n)));
}

/// Points that reach less far than the foremost one of their strip by this do not show where the surface is
/// [cell sizes].
constexpr double strip_range = 0.06;
/// Where bodies are farther apart than this, their gap need not be known well [cell sizes].
constexpr double near_range = 0.25;
} // namespace

template <int dim>
template <typename Combine>
void BodyContact<dim>::over_ranks(std::vector<double> &values, const unsigned int n_columns,
                                  const unsigned int side, const Combine &combine)
{
  nodal_values.assign(continuum(side).nodes().size() * std::size_t(n_columns), 0.);
  for (std::size_t s = 0; s < sites.size(); ++s)
    std::copy_n(&values[s * n_columns], n_columns,
                &nodal_values[std::size_t(node(sites[s], side)) * n_columns]);
  combine(nodal_values.data());
  for (std::size_t s = 0; s < sites.size(); ++s)
    std::copy_n(&nodal_values[std::size_t(node(sites[s], side)) * n_columns], n_columns,
                &values[s * n_columns]);
}

template <int dim>
void BodyContact<dim>::add_over_ranks(std::vector<double> &values, const unsigned int n_columns,
                                      const unsigned int side)
{
  if (this->parallel)
    over_ranks(values, n_columns, side,
               [&](double *data) { continuum(side).nodes().sum_over_ranks(data, n_columns); });
}

template <int dim>
void BodyContact<dim>::find_volume_gradients()
{
  for (unsigned int side = 0; side < 2; ++side) {
    auto &gradient = volume_gradient[side];
    gradient.assign(sites.size() * dim, 0.);
    for (const auto &entry : near[side].entries())
      for (unsigned int d = 0; d < dim; ++d)
        gradient[std::size_t(entry.site) * dim + d] += near[side].points()[entry.point].volume * entry.dN[d];
    add_over_ranks(gradient, dim, side);
  }
}

template <int dim>
typename BodyContact<dim>::Vector BodyContact<dim>::outward(const unsigned int side,
                                                            const std::size_t s) const
{
  Vector g;
  for (unsigned int d = 0; d < dim; ++d)
    g[d] = volume_gradient[side][s * dim + d];
  return g;
}

template <int dim>
void BodyContact<dim>::find_normals()
{
  using Normal = typename ContactParameters<dim>::Normal;
  find_volume_gradients();
  const Normal method = this->parameters.normal;
  if (method == Normal::regression)
    planes.fit(
        near[0], near[1], places, this->grid.smallest_cell_size(),
        [&](std::vector<double> &sums) { add_over_ranks(sums, SeparatingPlanes<dim>::n_sums, 0); },
        [&](const bool converged) {
          return this->parallel ? dealii::Utilities::MPI::min(int(converged), this->communicator) == 1
                                : converged;
        });
  for (std::size_t s = 0; s < sites.size(); ++s) {
    const Vector n = method == Normal::prescribed   ? this->parameters.direction
                     : method == Normal::regression ? planes.normal(s)
                                                    : outward(0, s) - outward(1, s);
    sites[s].normal = n.norm() > 0. ? n / n.norm() : n;
  }
}

template <int dim>
template <typename List>
void BodyContact<dim>::find_edges(const std::array<const List *, 2> &lists)
{
  constexpr double far = ContactPair<dim>::far;
  for (unsigned int side = 0; side < 2; ++side) {
    const double sign = side == 0 ? 1. : -1.;
    edge[side].assign(sites.size(), -far);
    for (const auto &entry : *lists[side]) {
      const auto &point = near[side].points()[entry.point];
      const Vector &n = sites[entry.site].normal;
      if (point.depth == 0.)
        continue;
      edge[side][entry.site] =
          std::max(edge[side][entry.site], sign * ((point.x - sites[entry.site].x) * n) + point.reach(n));
    }
    if (this->parallel)
      over_ranks(edge[side], 1, side, [&](double *data) { continuum(side).nodes().max_over_ranks(data, 1); });
  }
}

template <int dim>
bool BodyContact<dim>::find_near_sites()
{
  const double h = this->grid.smallest_cell_size();
  bool any = false;
  is_near.resize(sites.size());
  for (std::size_t s = 0; s < sites.size(); ++s)
    any = (is_near[s] = sites[s].gap < near_range * h) || any;
  if (this->parallel)
    any = dealii::Utilities::MPI::max(int(any), this->communicator) == 1;
  for (unsigned int side = 0; side < 2 && any; ++side) {
    near_entries[side].clear();
    for (const auto &entry : near[side].entries())
      if (is_near[entry.site] && near[side].points()[entry.point].depth > 0.)
        near_entries[side].push_back(entry);
  }
  return any;
}

template <int dim>
unsigned int BodyContact<dim>::strip(const ContactSite<dim> &site, const dealii::Point<dim> &x,
                                     const double width)
{
  unsigned int axis = 0;
  for (unsigned int d = 1; d < dim; ++d)
    if (std::abs(site.normal[d]) > std::abs(site.normal[axis]))
      axis = d;
  unsigned int result = 0;
  for (unsigned int d = 0; d < dim; ++d)
    if (d != axis) {
      const double place = std::floor((x[d] - site.x[d]) / width) + strips_per_axis / 2;
      result = result * strips_per_axis + std::min(std::max(place, 0.), strips_per_axis - 1.);
    }
  return result;
}

template <int dim>
void BodyContact<dim>::find_moments()
{
  const double h = this->grid.smallest_cell_size();
  for (unsigned int side = 0; side < 2; ++side) {
    const double sign = side == 0 ? 1. : -1.;
    auto &sums = moments[side];
    sums.assign(sites.size() * n_moments, 0.);
    // Points behind others may know how far they are from another face of the body, and not from this one.
    foremost.assign(sites.size() * n_strips, -ContactPair<dim>::far);
    const Entries &entries = near_entries[side];
    strip_of_entry.resize(entries.size());
    heights.resize(entries.size());
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const auto &point = near[side].points()[entries[i].point];
      const ContactSite<dim> &site = sites[entries[i].site];
      heights[i] = sign * ((point.x - site.x) * site.normal) + point.reach(site.normal);
      strip_of_entry[i] = entries[i].site * n_strips + strip(site, point.x, 0.5 * h);
      foremost[strip_of_entry[i]] = std::max(foremost[strip_of_entry[i]], heights[i]);
    }
    if (this->parallel)
      over_ranks(foremost, n_strips, side,
                 [&](double *data) { continuum(side).nodes().max_over_ranks(data, n_strips); });
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const auto &entry = entries[i];
      const double w =
          entry.N *
          std::max(0., 1. - (edge[side][entry.site] - heights[i]) / (ContactSite<dim>::surface_range * h)) *
          std::max(0., 1. - (foremost[strip_of_entry[i]] - heights[i]) / (strip_range * h));
      if (w == 0.)
        continue;
      const Vector &n = sites[entry.site].normal;
      Vector place = near[side].points()[entry.point].x - sites[entry.site].x;
      place += (sign * heights[i] - place * n) * n;
      double *sum = &sums[entry.site * std::size_t(n_moments)];
      *sum++ += w;
      for (unsigned int d = 0; d < dim; ++d)
        *sum++ += w * place[d];
      for (unsigned int d = 0; d < dim; ++d)
        for (unsigned int e = 0; e < dim; ++e)
          *sum++ += w * place[d] * place[e];
    }
    add_over_ranks(sums, n_moments, side);
    for (std::size_t s = 0; s < sites.size(); ++s) {
      double *sum = &sums[s * n_moments];
      if (!(*sum > 0.))
        continue;
      for (unsigned int i = 1; i < n_moments; ++i)
        sum[i] /= sum[0];
      for (unsigned int d = 0; d < dim; ++d)
        for (unsigned int e = 0; e < dim; ++e)
          sum[1 + dim + d * dim + e] -= sum[1 + d] * sum[1 + e];
    }
  }
}

template <int dim>
void BodyContact<dim>::straighten_normals()
{
  const double h = this->grid.smallest_cell_size();
  for (std::size_t s = 0; s < sites.size(); ++s) {
    const double *sums[2] = {&moments[0][s * n_moments], &moments[1][s * n_moments]};
    if (!is_near[s] || !(sums[0][0] > 0.) || !(sums[1][0] > 0.))
      continue;
    dealii::Tensor<2, dim> covariance;
    for (unsigned int side = 0; side < 2; ++side)
      for (unsigned int d = 0; d < dim; ++d)
        for (unsigned int e = 0; e < dim; ++e)
          covariance[d][e] += sums[side][0] * sums[side][1 + dim + d * dim + e];
    // Where a node sees a single column of points they show no slope, and round-off must not make one.
    const double ridge = 1e-4 * h * h * (sums[0][0] + sums[1][0]);
    Vector &n = sites[s].normal;
    n -= slope(covariance, n, ridge);
    n /= n.norm();
  }
}

template <int dim>
double BodyContact<dim>::mean_gap(const std::size_t s, const double h) const
{
  const Vector &n = sites[s].normal;
  Vector mean[2], tilt[2];
  double width[2];
  for (unsigned int side = 0; side < 2; ++side) {
    const double *sum = &moments[side][s * n_moments];
    if (!(sum[0] > 0.))
      return -edge[0][s] - edge[1][s];
    dealii::Tensor<2, dim> covariance;
    width[side] = 1e-9 * h * h;
    for (unsigned int d = 0; d < dim; ++d) {
      mean[side][d] = sum[1 + d];
      for (unsigned int e = 0; e < dim; ++e)
        covariance[d][e] = sum[1 + dim + d * dim + e];
    }
    width[side] += trace(covariance) - n * covariance * n;
    tilt[side] = slope(covariance, n, 1e-2 * h * h);
  }
  // Where both are: the narrower one says where.
  const Vector place = (width[1] * mean[0] + width[0] * mean[1]) / (width[0] + width[1]);
  double height[2];
  for (unsigned int side = 0; side < 2; ++side)
    height[side] = mean[side] * n + tilt[side] * (place - mean[side]);
  return height[1] - height[0];
}

template <int dim>
void BodyContact<dim>::find_gaps()
{
  using Normal = typename ContactParameters<dim>::Normal;
  constexpr double far = ContactPair<dim>::far;
  using All = typename std::decay<decltype(near[0].entries())>::type;
  find_edges<All>({&near[0].entries(), &near[1].entries()});
  for (std::size_t s = 0; s < sites.size(); ++s) {
    const bool both = edge[0][s] > -far && edge[1][s] > -far && has_mass(sites[s]);
    sites[s].gap = both ? -edge[0][s] - edge[1][s] : far;
  }
  if (!find_near_sites())
    return;
  if (this->parameters.normal == Normal::regression) {
    find_moments();
    straighten_normals();
    find_edges<Entries>({&near_entries[0], &near_entries[1]});
  }
  find_moments();
  const double h = this->grid.smallest_cell_size();
  for (std::size_t s = 0; s < sites.size(); ++s)
    if (is_near[s]) {
      const double least = -edge[0][s] - edge[1][s];
      sites[s].gap = least + std::max(0., mean_gap(s, h) - least - ContactSite<dim>::gap_slack * h);
    }
}

template <int dim>
void BodyContact<dim>::take_all_nodes()
{
  for (ContactSite<dim> &site : sites) {
    site.acts = has_mass(site);
    site.first_surface = {{site.first, no_index, no_index}, {1., 0., 0.}, {}};
    site.second_surface = {{site.second, no_index, no_index}, {1., 0., 0.}, {}};
  }
  if (this->parameters.interface == ContactParameters<dim>::Interface::open ||
      !(first.is_saturated() || second.is_saturated()))
    return;
  // Fluid meets the interface where both bodies have a surface.
  for (unsigned int side = 0; side < 2; ++side)
    near[side].collect(continuum(side).nodes());
  find_volume_gradients();
  for (std::size_t s = 0; s < sites.size(); ++s) {
    ContactSite<dim> &site = sites[s];
    const Vector g[2] = {outward(0, s), outward(1, s)};
    const double size = (g[0] - g[1]).norm();
    site.normal = size > 0. ? (g[0] - g[1]) / size : Vector();
    const double own = g[0] * site.normal, others = -(g[1] * site.normal);
    site.area = site.acts && std::min(own, others) > 0.5 * std::max(own, others) ? std::min(own, others) : 0.;
    site.first_surface.area[0] = own;
    site.second_surface.area[0] = others;
  }
}

template <int dim>
void BodyContact<dim>::find_surfaces()
{
  // sum V grad N points out of a body.
  for (unsigned int side = 0; side < 2; ++side)
    areas[side].resize(sites.size());
  both_areas.resize(sites.size());
  for (std::size_t s = 0; s < sites.size(); ++s) {
    double g[2] = {0., 0.};
    for (unsigned int side = 0; side < 2; ++side)
      for (unsigned int d = 0; d < dim; ++d)
        g[side] += volume_gradient[side][s * dim + d] * sites[s].normal[d];
    areas[0][s] = g[0];
    areas[1][s] = -g[1];
  }
  // A node that hardly moves points of either body moves neither of the surfaces.
  for (const Continuum<dim> *small : {&first, &second})
    if (small->node_extension())
      for (unsigned int side = 0; side < 2; ++side)
        over_ranks(areas[side], 1, small == &second,
                   [&](double *data) { small->node_extension()->fold_areas(data); });
  for (std::size_t s = 0; s < sites.size(); ++s)
    both_areas[s] = has_mass(sites[s]) ? std::max(0., areas[0][s]) + std::max(0., areas[1][s]) : 0.;
  lines.find(first.nodes(), &ContactSite<dim>::first, site_of_node, both_areas, sites);
  for (ContactSite<dim> &site : sites)
    if (site.acts) {
      // The same weights in both bodies, so that equal and opposite impulses act at one place.
      SiteLines<dim>::weigh(sites, site, &ContactSite<dim>::first, both_areas, site.first_surface);
      SiteLines<dim>::weigh(sites, site, &ContactSite<dim>::second, both_areas, site.second_surface);
      double sum[2] = {0., 0.};
      for (const std::uint32_t other : site.line)
        if (other != no_index)
          for (unsigned int side = 0; side < 2; ++side)
            sum[side] += std::max(0., areas[side][other]);
      site.area = std::min(sum[0], sum[1]);
      site.acts = site.area > 0.;
    }
}

template void BodyContact<2>::take_all_nodes();
template void BodyContact<2>::find_normals();
template void BodyContact<2>::find_gaps();
template void BodyContact<2>::find_surfaces();
template void BodyContact<3>::take_all_nodes();
template void BodyContact<3>::find_normals();
template void BodyContact<3>::find_gaps();
template void BodyContact<3>::find_surfaces();
} // namespace peat
