#include <peat/solver/rigid_contact.h>

#include <deal.II/base/mpi.h>

#include <Eigen/Dense>

namespace peat {
namespace {
/// Nodes are chosen this far from the rigid body's surface [cell sizes], and anew when it has moved by a part
/// of it.
constexpr double margin = 2.;
constexpr double renewal = 0.5;
/// A node feels the rigid body if it is not farther from its surface than this [cell sizes]: then of the two
/// rows of nodes beside a surface the nearer one does, and of material below it only what belongs to that row
/// moves along.
constexpr double influence = 0.5 + 1e-9;
/// Points that are less than this farther than the nearest one have a say in a node's normal [cell sizes].
constexpr double normal_range = 0.25;
constexpr double far = std::numeric_limits<double>::max();
} // namespace

template <int dim>
RigidContact<dim>::RigidContact(const ContactParameters<dim> &parameters, const SchemeParameters &scheme,
                                const Grid<dim> &grid, const Scene<dim> &scene, RigidBody<dim> &rigid,
                                Continuum<dim> &continuum, std::vector<std::size_t> bodies,
                                const bool rigid_is_first)
    : ContactPair<dim>(parameters, grid.communicator()), scheme(scheme), grid(grid), scene(scene),
      rigid(rigid), continuum(continuum), bodies(std::move(bodies)), sign(rigid_is_first ? 1. : -1.),
      parallel(dealii::Utilities::MPI::n_mpi_processes(grid.communicator()) > 1)
{
  this->seepage_inertia = scheme.seepage_inertia;
  this->alpha = ContactPair<dim>::biot_coefficient(continuum, scene);
}

template <int dim>
void RigidContact<dim>::match_nodes()
{
  choose_nodes();
}

template <int dim>
void RigidContact<dim>::choose_nodes()
{
  const ActiveNodes<dim> &nodes = continuum.nodes();
  const double reach = margin * grid.smallest_cell_size();
  const Bounds<dim> bounds = rigid.bounds();
  sites.clear();
  site_of_node.assign(nodes.size(), no_index);
  for (std::uint32_t i = 0; i < nodes.size(); ++i) {
    const auto &x = nodes.position(i);
    bool inside = true;
    for (unsigned int d = 0; d < dim; ++d)
      inside = inside && x[d] > bounds.lower[d] - reach && x[d] < bounds.upper[d] + reach;
    if (!inside || rigid.distance(x) > reach)
      continue;
    site_of_node[i] = sites.size();
    ContactSite<dim> site{};
    site.first = no_index;
    site.second = i;
    site.counts = nodes.is_owned(i);
    sites.push_back(site);
  }
  std::vector<const Body<dim> *> pointers;
  for (const std::size_t b : bodies)
    pointers.push_back(scene.bodies[b].get());
  near.choose(nodes, scheme.basis, pointers, site_of_node);
  corners_of_choice = corners();
}

template <int dim>
std::vector<dealii::Point<dim>> RigidContact<dim>::corners() const
{
  const Bounds<dim> bounds = rigid.reference_shape().bounds();
  std::vector<dealii::Point<dim>> result;
  for (unsigned int corner = 0; corner < (1u << dim); ++corner) {
    dealii::Point<dim> x;
    for (unsigned int d = 0; d < dim; ++d)
      x[d] = (corner >> d) & 1 ? bounds.upper[d] : bounds.lower[d];
    result.push_back(rigid.to_present(x));
  }
  return result;
}

template <int dim>
void RigidContact<dim>::begin(double, const double dt)
{
  step_length = dt;
  this->now = {};
  double moved = 0.;
  const auto now_at = corners();
  for (std::size_t corner = 0; corner < now_at.size(); ++corner)
    moved = std::max(moved, now_at[corner].distance(corners_of_choice[corner]));
  if (moved > renewal * grid.smallest_cell_size())
    choose_nodes();
  if (!parallel && sites.empty())
    return;
  near.collect(continuum.nodes());
  find_gaps();
  for (ContactSite<dim> &site : sites) {
    site.impulse = Vector();
    site.relative_velocity =
        rigid.velocity_at(site.x) - this->node_velocity(continuum.fields().velocity, site.second);
  }
}

template <int dim>
void RigidContact<dim>::find_gaps()
{
  const ActiveNodes<dim> &nodes = continuum.nodes();
  const auto &points = near.points();
  std::vector<Vector> normals(points.size());
  std::vector<double> gaps(points.size(), far);
  for (std::size_t p = 0; p < points.size(); ++p)
    if (points[p].depth > 0.) {
      normals[p] = rigid.normal(points[p].x);
      gaps[p] = rigid.distance(points[p].x) - points[p].reach(normals[p]);
    }

  // -gap, so that ranks agree on the largest.
  std::vector<double> nearest(nodes.size(), -far);
  for (const auto &entry : near.entries())
    if (gaps[entry.point] < far) {
      double &value = nearest[sites[entry.site].second];
      value = std::max(value, -gaps[entry.point]);
    }
  if (parallel)
    nodes.max_over_ranks(nearest.data(), 1);

  // Normal, place, and volume gradient.
  constexpr unsigned int n_columns = 1 + 3 * dim;
  std::vector<double> sums(nodes.size() * n_columns, 0.);
  const double range = normal_range * grid.smallest_cell_size();
  for (const auto &entry : near.entries()) {
    const std::uint32_t i = sites[entry.site].second;
    double *sum = &sums[std::size_t(i) * n_columns];
    const auto &point = points[entry.point];
    for (unsigned int d = 0; d < dim; ++d)
      sum[1 + 2 * dim + d] += point.volume * entry.dN[d];
    if (gaps[entry.point] == far)
      continue;
    const double w = entry.N * std::max(0., 1. - (gaps[entry.point] + nearest[i]) / range);
    sum[0] += w;
    for (unsigned int d = 0; d < dim; ++d) {
      sum[1 + d] += w * normals[entry.point][d];
      sum[1 + dim + d] += w * (point.x[d] - rigid.distance(point.x) * normals[entry.point][d]);
    }
  }
  if (parallel)
    nodes.sum_over_ranks(sums.data(), n_columns);
  for (ContactSite<dim> &site : sites) {
    const double *sum = &sums[std::size_t(site.second) * n_columns];
    const bool feels =
        sum[0] > 0. && rigid.distance(nodes.position(site.second)) <= influence * grid.smallest_cell_size();
    site.gap = feels ? -nearest[site.second] : far;
    Vector gradient;
    for (unsigned int d = 0; d < dim; ++d) {
      site.normal[d] = sum[1 + d];
      site.x[d] = sum[0] > 0. ? sum[1 + dim + d] / sum[0] : nodes.position(site.second)[d];
      gradient[d] = sum[1 + 2 * dim + d];
    }
    site.normal = site.normal.norm() > 0. ? site.normal / site.normal.norm() : site.normal;
    site.area = std::max(0., -(gradient * site.normal));
  }
}

template <int dim>
void RigidContact<dim>::respond_to(const Generalised &motion, std::vector<Response> &responses,
                                   std::vector<double> &wrench, std::vector<double> &slope) const
{
  wrench.assign(n_motions, 0.);
  slope.assign(n_motions * n_motions, 0.);
  for (std::size_t s = 0; s < sites.size(); ++s) {
    const ContactSite<dim> &site = sites[s];
    responses[s] = {};
    if (site.gap == far || continuum.mass(site.second) == 0.)
      continue;
    const Vector compliance = this->node_compliance(continuum, site.second);
    Vector relative =
        rigid.velocity_at(site.x, motion) - this->node_velocity(continuum.fields().new_velocity, site.second);
    for (unsigned int d = 0; d < dim; ++d)
      relative[d] += compliance[d] * site.impulse[d];
    auto fluid = this->fluid_force(continuum, site.second, -site.normal, site.area, step_length);
    fluid.first -= fluid.second * (site.impulse * site.normal);
    const Response response = responses[s] = this->respond(site, relative, compliance, fluid, step_length);
    if (!site.counts || response.kind == Response::Kind::open)
      continue;
    const Generalised push = rigid.wrench(response.impulse, site.x);
    double normal_compliance = 0.;
    for (unsigned int d = 0; d < dim; ++d)
      normal_compliance += site.normal[d] * site.normal[d] * compliance[d];
    for (unsigned int j = 0; j < n_motions; ++j) {
      wrench[j] += push[j];
      Generalised unit;
      unit[j] = 1.;
      const Vector v = rigid.velocity_at(site.x, unit);
      Vector change = (v * site.normal) / normal_compliance * site.normal;
      if (response.kind == Response::Kind::sticks) {
        for (unsigned int d = 0; d < dim; ++d)
          change[d] = compliance[d] > 0. ? v[d] / compliance[d] : 0.;
      } else
        change += response.slip_ratio * (v * site.normal) / normal_compliance * response.slip_direction;
      const Generalised column = rigid.wrench(change, site.x);
      for (unsigned int i = 0; i < n_motions; ++i)
        slope[i * n_motions + j] += column[i];
    }
  }
  if (parallel) {
    dealii::Utilities::MPI::sum(wrench, this->communicator, wrench);
    dealii::Utilities::MPI::sum(slope, this->communicator, slope);
  }
}

template <int dim>
typename RigidContact<dim>::Generalised RigidContact<dim>::find_motion(std::vector<Response> &responses) const
{
  // q = q_0 - M^-1 sum of wrenches(q): piecewise linear in the motion q, by Newton's method.
  constexpr unsigned int most_iterations = 50;
  using Matrix = Eigen::Matrix<double, n_motions, n_motions>;
  using Column = Eigen::Matrix<double, n_motions, 1>;
  Matrix inverse_mass;
  const auto M = rigid.inverse_mass();
  for (unsigned int i = 0; i < n_motions; ++i)
    for (unsigned int j = 0; j < n_motions; ++j)
      inverse_mass(i, j) = M[i][j];
  std::vector<double> wrench, slope;
  Generalised motion = rigid.motion(), given;
  for (const ContactSite<dim> &site : sites)
    if (site.counts)
      given += rigid.wrench(site.impulse, site.x);
  std::vector<double> before(n_motions);
  for (unsigned int i = 0; i < n_motions; ++i)
    before[i] = given[i];
  if (parallel)
    dealii::Utilities::MPI::sum(before, this->communicator, before);
  Column start;
  const Column taken = inverse_mass * Eigen::Map<const Column>(before.data());
  for (unsigned int i = 0; i < n_motions; ++i)
    start(i) = motion[i] + taken(i);
  for (unsigned int iteration = 0; iteration < most_iterations; ++iteration) {
    respond_to(motion, responses, wrench, slope);
    if (inverse_mass.isZero())
      break;
    Column q;
    for (unsigned int i = 0; i < n_motions; ++i)
      q(i) = motion[i];
    const Column residual = q - start + inverse_mass * Eigen::Map<const Column>(wrench.data());
    Matrix jacobian;
    for (unsigned int i = 0; i < n_motions; ++i)
      for (unsigned int j = 0; j < n_motions; ++j)
        jacobian(i, j) = slope[i * n_motions + j];
    jacobian = Matrix::Identity() + inverse_mass * jacobian;
    const Column change = jacobian.partialPivLu().solve(residual);
    if (change.norm() <= 1e-14 * (q.norm() + start.norm()))
      break;
    for (unsigned int i = 0; i < n_motions; ++i)
      motion[i] -= change(i);
  }
  return motion;
}

template <int dim>
double RigidContact<dim>::solve()
{
  if (!parallel && sites.empty())
    return 0.;
  std::vector<Response> responses(sites.size());
  find_motion(responses);
  double largest = 0.;
  Generalised reaction;
  for (std::size_t s = 0; s < sites.size(); ++s) {
    ContactSite<dim> &site = sites[s];
    const Vector change = responses[s].impulse - site.impulse;
    if (change.norm_square() == 0.)
      continue;
    site.impulse = responses[s].impulse;
    this->push(continuum, site.second, change, step_length);
    if (site.counts)
      reaction -= rigid.wrench(change, site.x);
    const Vector compliance = this->node_compliance(continuum, site.second);
    for (unsigned int d = 0; d < dim; ++d)
      largest = std::max(largest, compliance[d] * std::abs(change[d]));
  }
  if (parallel) {
    std::vector<double> values(n_motions);
    for (unsigned int i = 0; i < n_motions; ++i)
      values[i] = reaction[i];
    dealii::Utilities::MPI::sum(values, this->communicator, values);
    for (unsigned int i = 0; i < n_motions; ++i)
      reaction[i] = values[i];
  }
  if (reaction.norm_square() > 0.)
    rigid.add_impulse(reaction);
  return largest;
}

template <int dim>
void RigidContact<dim>::finish(Ledger<dim> &book)
{
  constexpr unsigned int n = dim + 2;
  std::vector<double> sums(n + n_motions, 0.);
  double gap = far;
  for (const ContactSite<dim> &site : sites) {
    if (!site.counts || continuum.mass(site.second) == 0.)
      continue;
    gap = std::min(gap, site.gap);
    if (site.impulse.norm_square() == 0.)
      continue;
    const Vector rigid_velocity = rigid.velocity_at(site.x);
    const Vector end = rigid_velocity - this->node_velocity(continuum.fields().new_velocity, site.second);
    book.contact_dissipation += site.impulse * (0.5 * (site.relative_velocity + end));
    if (rigid.is_prescribed()) {
      const Vector start =
          site.relative_velocity + this->node_velocity(continuum.fields().velocity, site.second);
      book.external_work += site.impulse * (0.5 * (start + rigid_velocity));
      for (unsigned int d = 0; d < dim; ++d)
        book.impulse[d] += site.impulse[d];
      book.gross_impulse += site.impulse.norm();
    }
    for (unsigned int d = 0; d < dim; ++d)
      sums[d] -= sign * site.impulse[d] / step_length;
    sums[dim] += site.impulse * site.normal / step_length;
    sums[dim + 1] += site.area;
    const Generalised wrench = rigid.wrench(site.impulse, site.x);
    for (unsigned int i = 0; i < n_motions; ++i)
      sums[n + i] -= wrench[i] / step_length;
  }
  if (parallel) {
    dealii::Utilities::MPI::sum(sums, this->communicator, sums);
    gap = dealii::Utilities::MPI::min(gap, this->communicator);
  }
  for (unsigned int d = 0; d < dim; ++d) {
    this->now.force[d] = sums[d];
    rigid.last_force[d] += sums[n + d];
  }
  for (unsigned int i = dim; i < n_motions; ++i)
    rigid.last_moment[i - dim] += sums[n + i];
  this->now.normal_force = sums[dim];
  this->now.area = sums[dim + 1];
  this->now.gap = gap < far ? gap : std::numeric_limits<double>::infinity();
}

template <int dim>
void RigidContact<dim>::mark_nodes(const Continuum<dim> &other, std::vector<char> &count) const
{
  if (&other == &continuum)
    for (const ContactSite<dim> &site : sites)
      ++count[site.second];
}

template <int dim>
void RigidContact<dim>::constrain_flux()
{
  for (const ContactSite<dim> &site : sites)
    if (site.impulse * site.normal > 0.)
      this->set_flux(continuum, site.second, -site.normal, site.area);
}

template <int dim>
void RigidContact<dim>::constrain_carrying_velocity()
{
  for (const ContactSite<dim> &site : sites) {
    if (site.impulse.norm_square() == 0.)
      continue;
    const Vector compliance = this->node_compliance(continuum, site.second);
    const Vector relative =
        rigid.velocity_at(site.x) - this->node_velocity(continuum.carrying_velocity(), site.second);
    double normal_compliance = 0.;
    for (unsigned int d = 0; d < dim; ++d)
      normal_compliance += site.normal[d] * site.normal[d] * compliance[d];
    const double closing = relative * site.normal - std::max(site.gap, 0.) / step_length;
    if (closing <= 0. || normal_compliance == 0.)
      continue;
    for (unsigned int d = 0; d < dim; ++d)
      continuum.carrying_velocity()[std::size_t(site.second) * dim + d] +=
          compliance[d] * closing / normal_compliance * site.normal[d];
  }
}

template class RigidContact<2>;
template class RigidContact<3>;
} // namespace peat
