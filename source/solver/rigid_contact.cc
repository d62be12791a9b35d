#include <peat/solver/rigid_contact.h>

#include <deal.II/base/mpi.h>

#include <Eigen/Dense>

namespace peat {
namespace {
template <int dim>
std::vector<const Body<dim> *> bodies_of(const Scene<dim> &scene, const std::vector<std::size_t> &places)
{
  std::vector<const Body<dim> *> bodies;
  for (const std::size_t b : places)
    bodies.push_back(scene.bodies[b].get());
  return bodies;
}

template <std::size_t n>
void add_over_ranks(std::array<double, n> &values, MPI_Comm communicator)
{
  const dealii::ArrayView<double> view(values.data(), n);
  dealii::Utilities::MPI::sum(dealii::ArrayView<const double>(view), communicator, view);
}
} // namespace

template <int dim>
RigidContact<dim>::RigidContact(const ContactParameters<dim> &parameters, const SchemeParameters &scheme,
                                const Grid<dim> &grid, const Scene<dim> &scene, RigidBody<dim> &rigid,
                                Continuum<dim> &continuum, const std::vector<std::size_t> &bodies,
                                const bool rigid_is_first, Generalised &tried_acceleration)
    : ContactPair<dim>(parameters, scheme, grid, scene), rigid(rigid), continuum(continuum),
      sign(rigid_is_first ? 1. : -1.), tried_acceleration(tried_acceleration),
      surface(grid, scheme.basis, rigid, bodies_of(scene, bodies), sites)
{
  this->alpha = ContactPair<dim>::biot_coefficient(continuum, scene);
}

template <int dim>
void RigidContact<dim>::match_nodes()
{
  surface.choose(continuum.nodes());
  noted.reinit(continuum.nodes());
}

template <int dim>
void RigidContact<dim>::begin(const double dt)
{
  this->step_length = dt;
  this->now = {};
  const ActiveNodes<dim> &nodes = continuum.nodes();
  if (surface.is_outdated())
    surface.choose(nodes);
  if (!this->parallel && sites.empty())
    return;
  surface.find(nodes, [&](const std::uint32_t node) { return continuum.mass(node) > 0.; });
  responses.resize(sites.size());
  for (ContactSite<dim> &site : sites) {
    site.impulse = Vector();
    site.mode = ContactMode::open;
    if (site.acts)
      site.relative_velocity =
          rigid.velocity_at(site.x) - this->velocity(continuum.fields().velocity, site.second_surface);
  }
}

template <int dim>
void RigidContact<dim>::respond_to(const Generalised &motion)
{
  wrench.assign(n_motions, 0.);
  slope.assign(n_motions * n_motions, 0.);
  for (std::size_t s = 0; s < sites.size(); ++s) {
    const ContactSite<dim> &site = sites[s];
    responses[s] = {};
    if (!site.counts || !site.acts)
      continue;
    const Vector compliance = this->compliance(continuum, site.second_surface);
    Vector relative = rigid.velocity_at(site.x, motion) -
                      this->velocity(continuum.fields().new_velocity, site.second_surface);
    for (unsigned int d = 0; d < dim; ++d)
      relative[d] += compliance[d] * site.impulse[d];
    auto fluid = this->fluid_force(continuum, site.second_surface, -site.normal, site.area);
    fluid.first -= fluid.second * (site.impulse * site.normal);
    const Response response = responses[s] = this->respond(site, relative, compliance, fluid);
    if (response.mode == ContactMode::open)
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
      if (response.mode == ContactMode::sticks) {
        for (unsigned int d = 0; d < dim; ++d)
          change[d] = compliance[d] > 0. ? v[d] / compliance[d] : 0.;
      } else
        change += response.slip_ratio * (v * site.normal) / normal_compliance * response.slip_direction;
      const Generalised column = rigid.wrench(change, site.x);
      for (unsigned int i = 0; i < n_motions; ++i)
        slope[i * n_motions + j] += column[i];
    }
  }
  if (this->parallel) {
    dealii::Utilities::MPI::sum(wrench, this->communicator, wrench);
    dealii::Utilities::MPI::sum(slope, this->communicator, slope);
  }
}

template <int dim>
void RigidContact<dim>::find_motion()
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
  Generalised motion = rigid.motion(), given;
  for (const ContactSite<dim> &site : sites)
    if (site.counts)
      given += rigid.wrench(site.impulse, site.x);
  std::array<double, n_motions> before;
  for (unsigned int i = 0; i < n_motions; ++i)
    before[i] = given[i];
  if (this->parallel)
    add_over_ranks(before, this->communicator);
  Column start;
  const Column taken = inverse_mass * Eigen::Map<const Column>(before.data());
  for (unsigned int i = 0; i < n_motions; ++i)
    start(i) = motion[i] + taken(i);
  for (unsigned int iteration = 0; iteration < most_iterations; ++iteration) {
    respond_to(motion);
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
}

template <int dim>
typename RigidContact<dim>::Generalised RigidContact<dim>::over_ranks(const Generalised &mine) const
{
  if (!this->parallel)
    return mine;
  std::array<double, n_motions> values;
  for (unsigned int i = 0; i < n_motions; ++i)
    values[i] = mine[i];
  add_over_ranks(values, this->communicator);
  Generalised sum;
  for (unsigned int i = 0; i < n_motions; ++i)
    sum[i] = values[i];
  return sum;
}

template <int dim>
double RigidContact<dim>::solve()
{
  if (!this->parallel && sites.empty())
    return 0.;
  find_motion();
  double largest = 0.;
  Generalised reaction;
  for (std::size_t s = 0; s < sites.size(); ++s) {
    ContactSite<dim> &site = sites[s];
    site.mode = this->kept_mode(responses[s]);
    const Vector change = responses[s].impulse - site.impulse;
    if (change.norm_square() == 0.)
      continue;
    site.impulse = responses[s].impulse;
    this->push(noted, site.second_surface, change);
    reaction -= rigid.wrench(change, site.x);
    const Vector compliance = this->compliance(continuum, site.second_surface);
    for (unsigned int d = 0; d < dim; ++d)
      largest = std::max(largest, compliance[d] * std::abs(change[d]));
  }
  this->give_impulses(continuum, noted);
  reaction = over_ranks(reaction);
  if (reaction.norm_square() > 0.)
    rigid.add_impulse(reaction);
  return largest;
}

template <int dim>
double RigidContact<dim>::outdated_change()
{
  if (!this->parallel && sites.empty())
    return 0.;
  respond_to(rigid.motion());
  double largest = 0.;
  for (std::size_t s = 0; s < sites.size(); ++s) {
    const ContactSite<dim> &site = sites[s];
    if (!site.counts || !site.acts)
      continue;
    const Vector compliance = this->compliance(continuum, site.second_surface);
    for (unsigned int d = 0; d < dim; ++d)
      largest = std::max(largest, compliance[d] * std::abs(responses[s].impulse[d] - site.impulse[d]));
  }
  return largest;
}

template <int dim>
void RigidContact<dim>::hold()
{
  held_sites.clear();
  for (std::uint32_t s = 0; s < sites.size(); ++s) {
    const ContactSite<dim> &site = sites[s];
    if (!site.counts || !site.acts || site.mode == ContactMode::open)
      continue;
    ContactPair<dim>::hold(s, this->compliance(continuum, site.second_surface));
    this->note_held_nodes(site, continuum, site.second_surface, noted);
  }
  this->mark_held_nodes(continuum, noted);
  if (!rigid.is_prescribed())
    find_common_mobility();
}

template <int dim>
void RigidContact<dim>::find_common_mobility()
{
  // A wrench f accelerates by b, and the sites, whose surfaces take part in the motion, react with -S b:
  // b = M^-1 (f - S b).
  slope.assign(n_motions * n_motions, 0.);
  for (const std::uint32_t s : held_sites) {
    const ContactSite<dim> &site = sites[s];
    for (unsigned int j = 0; j < n_motions; ++j) {
      Generalised unit;
      unit[j] = 1.;
      const Generalised column = rigid.wrench(this->reaction(site, rigid.velocity_at(site.x, unit)), site.x);
      for (unsigned int i = 0; i < n_motions; ++i)
        slope[i * n_motions + j] += column[i];
    }
  }
  if (this->parallel)
    dealii::Utilities::MPI::sum(slope, this->communicator, slope);
  using Matrix = Eigen::Matrix<double, n_motions, n_motions>;
  using Column = Eigen::Matrix<double, n_motions, 1>;
  const auto inverse_mass = rigid.inverse_mass();
  Matrix system;
  for (unsigned int i = 0; i < n_motions; ++i)
    for (unsigned int j = 0; j < n_motions; ++j) {
      system(i, j) = i == j;
      for (unsigned int k = 0; k < n_motions; ++k)
        system(i, j) += inverse_mass[i][k] * slope[k * n_motions + j];
    }
  const auto factors = system.partialPivLu();
  for (unsigned int j = 0; j < n_motions; ++j) {
    Column unit;
    for (unsigned int i = 0; i < n_motions; ++i)
      unit(i) = inverse_mass[i][j];
    const Column answer = factors.solve(unit);
    for (unsigned int i = 0; i < n_motions; ++i)
      common_mobility[i][j] = answer(i);
  }
}

template <int dim>
void RigidContact<dim>::restrain_motion()
{
  const auto &accelerations = continuum.response().acceleration;
  if (!rigid.is_prescribed()) {
    Generalised wrench;
    for (const std::uint32_t s : held_sites) {
      const ContactSite<dim> &site = sites[s];
      const Vector relative =
          rigid.velocity_at(site.x, tried_acceleration) - this->velocity(accelerations, site.second_surface);
      wrench -= rigid.wrench(this->reaction(site, relative), site.x);
    }
    tried_acceleration += common_mobility * over_ranks(wrench);
  }
  for (const std::uint32_t s : held_sites) {
    ContactSite<dim> &site = sites[s];
    const Vector relative =
        rigid.velocity_at(site.x, tried_acceleration) - this->velocity(accelerations, site.second_surface);
    const Vector force = this->reaction(site, relative);
    site.reaction += force;
    this->push(noted, site.second_surface, force);
  }
  this->give_reactions(continuum, noted);
}

template <int dim>
void RigidContact<dim>::restrain_flux()
{
  for (const std::uint32_t s : held_sites)
    if (const ContactSite<dim> &site = sites[s]; site.closes_flux)
      this->note_flux_reaction(continuum, site.second_surface, -site.normal, noted);
  this->give_flux_reactions(continuum, noted);
}

template <int dim>
void RigidContact<dim>::take_reactions()
{
  Generalised reaction;
  for (const std::uint32_t s : held_sites) {
    ContactSite<dim> &site = sites[s];
    const Vector impulse = this->step_length * site.reaction;
    site.impulse += impulse;
    this->push(noted, site.second_surface, impulse);
    reaction -= rigid.wrench(impulse, site.x);
  }
  this->give_impulses(continuum, noted);
  reaction = over_ranks(reaction);
  if (reaction.norm_square() > 0.)
    rigid.add_impulse(reaction);
}

template <int dim>
void RigidContact<dim>::finish(Ledger<dim> &book)
{
  constexpr unsigned int n = dim + 2;
  std::array<double, n + n_motions> sums = {};
  double gap = ContactPair<dim>::far;
  for (const ContactSite<dim> &site : sites) {
    if (!site.counts || !site.acts)
      continue;
    gap = std::min(gap, site.gap);
    if (site.impulse.norm_square() == 0.)
      continue;
    const Vector rigid_velocity = rigid.velocity_at(site.x);
    const Vector end = rigid_velocity - this->velocity(continuum.fields().new_velocity, site.second_surface);
    book.contact_dissipation += site.impulse * (0.5 * (site.relative_velocity + end));
    if (rigid.is_prescribed()) {
      const Vector start =
          site.relative_velocity + this->velocity(continuum.fields().velocity, site.second_surface);
      book.external_work += site.impulse * (0.5 * (start + rigid_velocity));
      for (unsigned int d = 0; d < dim; ++d)
        book.impulse[d] += site.impulse[d];
      book.gross_impulse += site.impulse.norm();
    }
    for (unsigned int d = 0; d < dim; ++d)
      sums[d] -= sign * site.impulse[d] / this->step_length;
    sums[dim] += site.impulse * site.normal / this->step_length;
    sums[dim + 1] += site.area;
    const Generalised wrench = rigid.wrench(site.impulse, site.x);
    for (unsigned int i = 0; i < n_motions; ++i)
      sums[n + i] -= wrench[i] / this->step_length;
  }
  if (this->parallel) {
    add_over_ranks(sums, this->communicator);
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
  this->now.gap = gap < ContactPair<dim>::far ? gap : std::numeric_limits<double>::infinity();
}

template <int dim>
void RigidContact<dim>::mark_nodes(const Continuum<dim> &other, std::vector<char> &count) const
{
  if (&other == &continuum)
    for (const ContactSite<dim> &site : sites)
      ++count[site.second];
}

template <int dim>
void RigidContact<dim>::note_late_forces()
{
  for (const ContactSite<dim> &site : sites)
    if (site.counts && site.impulse.norm_square() > 0.)
      this->push(noted, site.second_surface, this->late_impulse(site));
  this->give_late_forces(continuum, noted);
}

template <int dim>
void RigidContact<dim>::constrain_flux()
{
  for (const ContactSite<dim> &site : sites)
    if (site.counts && this->is_covered(site))
      this->note_flux(continuum, site.second_surface, -site.normal, noted);
  this->change_flux(continuum, noted);
}

template <int dim>
void RigidContact<dim>::constrain_carrying_velocity()
{
  for (const ContactSite<dim> &site : sites) {
    if (!site.counts || site.impulse.norm_square() == 0.)
      continue;
    const Vector compliance = this->compliance(continuum, site.second_surface);
    const Vector relative =
        rigid.velocity_at(site.x) - this->velocity(continuum.carrying_velocity(), site.second_surface);
    double normal_compliance = 0.;
    for (unsigned int d = 0; d < dim; ++d)
      normal_compliance += site.normal[d] * site.normal[d] * compliance[d];
    const double closing = relative * site.normal - std::max(site.gap, 0.) / this->step_length;
    if (closing > 0. && normal_compliance > 0.)
      this->push(noted, site.second_surface, closing / normal_compliance * site.normal);
  }
  this->change_carrying_velocity(continuum, noted);
}

template <int dim>
void RigidContact<dim>::persist(Archive &archive)
{
  archive.begin("contact of a rigid body");
  surface.persist(archive, continuum.nodes());
}

template class RigidContact<2>;
template class RigidContact<3>;
} // namespace peat
