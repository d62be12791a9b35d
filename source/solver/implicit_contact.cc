#include <peat/solver/implicit_contact.h>

#include <peat/material/mixture.h>

#include <deal.II/base/mpi.h>
#include <deal.II/lac/full_matrix.h>

#include <limits>
#include <sstream>

#include "implicit_contact_data.h"

// What an implicit step asks of contact; the forces and their derivatives are in implicit_contact_forces.cc.

namespace peat {
namespace {
/// A gap that counts as closed: what the points' extents do not know of the strain below a surface [cell
/// sizes].
constexpr double slack = 1e-3;
/// A surface is covered where a rigid body is nearer than this [cell sizes].
constexpr double cover_range = 0.1;
/// Farthest that a rigid body moves in an iteration without inertia, and in a step [cell sizes].
constexpr double longest_way = 0.5;
/// In units of the weight over `longest_way`, what holds a body without inertia back in an iteration: little
/// beside what it rests on, and enough where it rests on nothing.
constexpr double hesitation = 1e-3;
} // namespace

template <int dim>
ImplicitContact<dim>::ImplicitContact(const Space<dim> &space, Scene<dim> &scene)
    : space(space), grid(space.grid()), scene(scene), communicator(grid.communicator()),
      basis(space.nodes() == Nodes::gimp ? Basis::gimp : Basis::q1)
{}

template <int dim>
ImplicitContact<dim>::~ImplicitContact() = default;

template <int dim>
std::vector<const Body<dim> *> ImplicitContact<dim>::partners(const ContactParameters<dim> &contact,
                                                              const RigidBody<dim> &rigid) const
{
  const auto partner_of = [&](const ContactParameters<dim> &one) {
    return one.first == rigid.name() ? one.second : one.second == rigid.name() ? one.first : std::string();
  };
  const std::string partner = partner_of(contact);
  std::vector<const Body<dim> *> result;
  for (const auto &continuum : scene.continua) {
    std::vector<std::string> named;
    for (const auto &other : scene.contacts)
      for (const std::size_t b : continuum)
        if (scene.bodies[b]->name() == partner_of(other))
          named.push_back(partner_of(other));
    if (std::find(named.begin(), named.end(), partner) == named.end())
      continue;
    // What nobody names goes with the first one named.
    for (const std::size_t b : continuum) {
      const std::string &name = scene.bodies[b]->name();
      const bool unnamed = std::find(named.begin(), named.end(), name) == named.end();
      if (name == partner || (unnamed && named.front() == partner))
        result.push_back(scene.bodies[b].get());
    }
  }
  return result;
}

template <int dim>
bool ImplicitContact<dim>::enter()
{
  scene.contact_states.clear();
  make_movers();
  return !movers.empty();
}

template <int dim>
void ImplicitContact<dim>::make_movers()
{
  movers.clear();
  touches.clear();
  for (const auto &rigid : scene.rigid_bodies) {
    movers.push_back(std::make_unique<Mover>(*rigid));
    for (const auto &contact : scene.contacts) {
      if (contact.first != rigid->name() && contact.second != rigid->name())
        continue;
      touches.push_back(std::make_unique<Touch>(contact, *movers.back(), grid, basis,
                                                partners(contact, *rigid),
                                                contact.first == rigid->name() ? 1. : -1.));
      movers.back()->may_touch = true;
    }
  }
}

template <int dim>
void ImplicitContact<dim>::persist(Archive &archive)
{
  archive.begin("implicit contact");
  bool entered = !movers.empty();
  archive(entered);
  if (!entered)
    return;
  if (archive.is_loading())
    make_movers();
  for (const auto &mover : movers)
    archive(mover->moved, mover->scale);
}

template <int dim>
void ImplicitContact<dim>::persist_nodes(Archive &archive, const ActiveNodes<dim> &active,
                                         const dealii::AffineConstraints<double> &constraints)
{
  for (const auto &touch : touches)
    touch->surface.persist(archive, active);
  if (!archive.is_loading())
    return;
  nodes = &active;
  held = &constraints;
  find_line_couplings();
}

template <int dim>
void ImplicitContact<dim>::share_nodes(const std::vector<CellId> &solid, ActiveNodes<dim> &active) const
{
  if (!touches.empty() && dealii::Utilities::MPI::n_mpi_processes(communicator) > 1)
    active.rebuild(solid, with_neighbours(grid, active.exchanged_nodes()));
}

template <int dim>
void ImplicitContact<dim>::match_nodes(const ActiveNodes<dim> &active,
                                       const dealii::AffineConstraints<double> &constraints)
{
  nodes = &active;
  held = &constraints;
  for (const auto &touch : touches)
    touch->surface.choose(active);
  find_line_couplings();
}

template <int dim>
void ImplicitContact<dim>::find_line_couplings()
{
  responses_known = false;
  couplings.clear();
  std::vector<NodeId> chosen;
  for (const auto &touch : touches)
    for (const ContactSite<dim> &site : touch->sites)
      chosen.push_back(nodes->grid_node(site.second));
  // The lines that may carry a site.
  for (const NodeId node : chosen)
    for (unsigned int axis = 0; axis < dim; ++axis) {
      std::array<Index, 3 * dim> coupling;
      coupling.fill(dealii::numbers::invalid_dof_index);
      for (unsigned int k = 0; k < 3; ++k) {
        auto lattice = grid.node_lattice(node);
        lattice[axis] += int(k) - 1;
        if (lattice[axis] < 0 || lattice[axis] > grid.n_cells(axis))
          continue;
        const NodeId other = grid.node_at(lattice);
        if (other == no_index)
          continue;
        if (const auto *known = space.node_at(other))
          std::copy(known->displacement.begin(), known->displacement.end(), &coupling[k * dim]);
      }
      couplings.push_back(coupling);
    }
}

template <int dim>
bool ImplicitContact<dim>::is_outdated() const
{
  return std::any_of(touches.begin(), touches.end(),
                     [](const auto &touch) { return touch->surface.is_outdated(); });
}

template <int dim>
const ContactParameters<dim> *ImplicitContact<dim>::cover(const Body<dim> &body,
                                                          const dealii::Point<dim> &x) const
{
  for (const auto &touch : touches)
    if (std::find(touch->bodies.begin(), touch->bodies.end(), &body) != touch->bodies.end() &&
        touch->mover.rigid.distance(x) < cover_range * grid.smallest_cell_size())
      return &touch->parameters;
  return nullptr;
}

template <int dim>
void ImplicitContact<dim>::begin_step(const double time)
{
  step_start = time;
  is_first_stage = true;
  for (const auto &mover : movers) {
    mover->start = mover->rigid.motion();
    mover->displacement = Generalised();
    mover->rate = Generalised();
    mover->force_sum = Generalised();
  }
  for (const auto &touch : touches) {
    // Nodes without mass are held, and no places for contact.
    touch->surface.find(*nodes, [](std::uint32_t) { return true; });
    touch->sums.fill(0.);
    find_places(*touch);
  }
}

template <int dim>
void ImplicitContact<dim>::find_places(Touch &touch)
{
  touch.places.clear();
  for (std::uint32_t s = 0; s < touch.sites.size(); ++s) {
    const ContactSite<dim> &site = touch.sites[s];
    if (!site.counts || !site.acts)
      continue;
    Place place;
    place.site = s;
    place.gap = std::max(0., site.gap - slack * grid.smallest_cell_size());
    find_nodes(site, place);
    double freedom = 0.;
    for (unsigned int d = 0; d < dim; ++d)
      freedom += std::pow(site.normal[d] * place.free[d], 2);
    // What conditions hold does not give way.
    if (freedom > 0.)
      touch.places.push_back(place);
  }
}

template <int dim>
void ImplicitContact<dim>::find_nodes(const ContactSite<dim> &site, Place &place) const
{
  double sum = 0.;
  for (unsigned int k = 0; k < 3; ++k) {
    if (site.second_surface.weight[k] == 0.)
      continue;
    const auto *node = space.node_at(nodes->grid_node(site.second_surface.node[k]));
    if (!node)
      continue;
    place.weight[place.n] = site.second_surface.weight[k];
    place.unknown[place.n] = node->displacement;
    sum += place.weight[place.n];
    ++place.n;
    for (unsigned int d = 0; d < dim; ++d)
      if (!held->is_constrained(node->displacement[d]))
        place.free[d] = 1.;
  }
  for (unsigned int k = 0; k < place.n; ++k)
    place.weight[k] /= sum;
}

template <int dim>
void ImplicitContact<dim>::begin_stage(const TimeLevel &level, const double start, const double end,
                                       const double rate_factor, const double acceleration_factor)
{
  stage = level;
  constexpr double origin[3] = {0., 0., 0.};
  for (unsigned int d = 0; d < dim; ++d)
    gravity[d] = scene.gravity.value(origin, level.time, d);
  for (const auto &mover : movers) {
    // A stage of the first kind has no history.
    mover->first_rate = mover->rate;
    mover->rate_history = rate_factor * mover->first_rate;
    mover->acceleration_history = acceleration_factor * mover->first_rate;
    if (mover->rigid.is_prescribed()) {
      mover->rigid.begin_step(start, end - start, Vector());
      mover->displacement = (end - start) * mover->rigid.motion();
    } else if (is_first_stage && level.acceleration > 0.)
      mover->displacement = (end - start) * mover->start;
  }
  for (const auto &touch : touches)
    for (Place &place : touch->places) {
      place.penalty = stiffness(*touch, touch->sites[place.site].area);
      place.is_known = !is_first_stage;
      place.known_force = place.force;
      place.known_relative = place.relative;
    }
  earlier_share = -rate_factor;
  predicting = true;
  is_first_stage = false;
}

template <int dim>
double ImplicitContact<dim>::stiffness(const Touch &touch, const double area) const
{
  // Above the stiffness and the inertia of what is within a cell of the interface, so that few augmentations
  // do; not so far that round-off counts.
  constexpr double above = 1e3;
  const double h = grid.smallest_cell_size();
  // At the edge of a body a site has little area, but neighbours that resist.
  constexpr double least = 0.1;
  const double size = std::max(area, least * std::pow(h, dim - 1));
  double largest = 0.;
  for (const Body<dim> *body : touch.bodies) {
    const Material &material = body->material();
    double modulus = material.initial_modulus();
    if (const Mixture *mixture = material.mixture())
      // Of the pressure what does not leave the cell within the step.
      modulus += std::pow(mixture->biot_coefficient(), 2) /
                 (mixture->storage() + 12. * mixture->mobility() * stage.dt / (h * h));
    largest = std::max(largest, modulus / h + material.density() * h * stage.acceleration);
  }
  return above * largest * size;
}

template <int dim>
double ImplicitContact<dim>::reach(const Mover &mover, const Generalised &motion)
{
  double translation = 0., rotation = 0.;
  for (unsigned int i = 0; i < n_motions; ++i)
    (i < dim ? translation : rotation) += motion[i] * motion[i];
  return std::sqrt(translation) + mover.radius * std::sqrt(rotation);
}

template <int dim>
bool ImplicitContact<dim>::is_falling(const Mover &mover) const
{
  return stage.acceleration == 0. && mover.n_closed == 0;
}

template <int dim>
bool ImplicitContact<dim>::is_balanced(const double tolerance) const
{
  for (const auto &mover : movers) {
    if (mover->rigid.is_prescribed())
      continue;
    const bool still_falls = is_falling(*mover) && reach(*mover, mover->displacement) >
                                                       0.9 * longest_way * grid.smallest_cell_size();
    if (!still_falls && mover->imbalance > tolerance * mover->force_scale)
      return false;
  }
  return true;
}

template <int dim>
std::string ImplicitContact<dim>::unbalanced() const
{
  std::ostringstream text;
  for (const auto &mover : movers)
    if (!mover->rigid.is_prescribed() && mover->imbalance > 0.)
      text << ", of rigid body '" << mover->rigid.name() << "' " << mover->imbalance / mover->force_scale;
  return text.str();
}

template <int dim>
unsigned int ImplicitContact<dim>::extra_iterations() const
{
  // Augmentations, and as many changes of what touches, sticks and slides.
  return movers.empty() ? 0 : 40;
}

template <int dim>
double ImplicitContact<dim>::residual_scale(const double size) const
{
  return std::max(size - guessed, multiplier_norm);
}

template <int dim>
void ImplicitContact<dim>::find_responses(const LinearSolve &solve)
{
  if (responses_known)
    return;
  for (const auto &mover : movers)
    for (unsigned int j = 0; j < n_motions && mover->is_coupled; ++j)
      if (mover->rigid.is_free(j)) {
        mover->response[j].reinit(mover->coupling[j]);
        solve(mover->response[j], mover->coupling[j]);
      }
  responses_known = true;
}

template <int dim>
double ImplicitContact<dim>::condensed(const TimeLevel &level, const Mover &mover, const unsigned int i,
                                       const Mover &other, const unsigned int j) const
{
  double entry = 0.;
  if (&mover == &other) {
    entry = mover.slope[i][j] + level.acceleration * mover.rigid.mass_matrix()[i][j];
    // Without inertia: what nothing resists.
    const double spring = std::max(mover.force_scale, std::numeric_limits<double>::min()) * hesitation /
                          (longest_way * grid.smallest_cell_size());
    if (level.acceleration == 0. && i == j)
      entry += spring * (i < dim ? 1. : mover.radius * mover.radius);
  }
  if (mover.is_coupled && other.is_coupled)
    entry -= mover.reaction[i] * other.response[j];
  return entry;
}

template <int dim>
void ImplicitContact<dim>::correct(const TimeLevel &level, BlockVector &correction, const LinearSolve &solve)
{
  std::vector<std::pair<Mover *, unsigned int>> unknown;
  for (const auto &mover : movers)
    for (unsigned int i = 0; i < n_motions; ++i)
      if (mover->rigid.is_free(i))
        unknown.emplace_back(mover.get(), i);
  if (unknown.empty())
    return;
  find_responses(solve);

  // Equation (57) of theory.md.
  const unsigned int n = unknown.size();
  dealii::FullMatrix<double> system(n, n);
  dealii::Vector<double> right(n), step(n);
  for (unsigned int a = 0; a < n; ++a) {
    const auto [mover, i] = unknown[a];
    right(a) = mover->residual[i];
    if (mover->is_coupled)
      right(a) += mover->reaction[i] * correction;
    for (unsigned int b = 0; b < n; ++b)
      system(a, b) = condensed(level, *mover, i, *unknown[b].first, unknown[b].second);
  }
  system.gauss_jordan();
  system.vmult(step, right);

  double farthest = 0.;
  for (const auto &mover : movers)
    mover->step = Generalised();
  for (unsigned int a = 0; a < n; ++a)
    unknown[a].first->step[unknown[a].second] = step(a);
  for (const auto &mover : movers)
    farthest = std::max(farthest, reach(*mover, mover->step));
  const double length = longest_way * grid.smallest_cell_size();
  const double factor = level.acceleration == 0. && farthest > length ? length / farthest : 1.;
  for (const auto &[mover, i] : unknown) {
    mover->step[i] *= factor;
    mover->displacement[i] += mover->step[i];
    if (mover->is_coupled)
      correction.add(mover->step[i], mover->response[i]);
  }
}

template <int dim>
void ImplicitContact<dim>::retreat(const double share)
{
  for (const auto &mover : movers)
    if (!mover->rigid.is_prescribed())
      mover->displacement -= share * mover->step;
}

template <int dim>
double ImplicitContact<dim>::estimated_error(const double tolerance)
{
  const double h = grid.smallest_cell_size();
  double error = 0.;
  for (const auto &mover : movers) {
    const double farthest = reach(*mover, mover->displacement) / (longest_way * h);
    error = std::max(error, tolerance * farthest * farthest);
    if (mover->rigid.is_prescribed() || is_falling(*mover))
      continue;
    mover->scale = std::max({mover->scale, 1e-6 * h, 2. * reach(*mover, mover->moved + mover->displacement)});
    const Generalised difference = mover->displacement - stage.dt * mover->first_rate;
    error = std::max(error, reach(*mover, difference) / mover->scale);
  }
  return error;
}

template <int dim>
void ImplicitContact<dim>::book_work(const TimeLevel &level, const double share, const BodyVector &motion,
                                     Ledger<dim> &book)
{
  const bool first_rank = dealii::Utilities::MPI::this_mpi_process(communicator) == 0;
  const double dt = level.dt;
  // With inertia a step has its mean force, which is that of its impulse; without, that at its end.
  const bool means = level.acceleration > 0.;
  for (const auto &mover : movers) {
    mover->rate = level.velocity * mover->displacement + mover->rate_history;
    if (!means)
      mover->force_sum = Generalised();
    mover->force_sum += (means ? share : 1.) * mover->force;
    if (mover->rigid.is_prescribed() || !first_rank)
      continue;
    for (unsigned int d = 0; d < dim; ++d) {
      // Guides bear what is not free.
      const double external = mover->rigid.is_free(d) ? mover->weight(gravity)[d] : -mover->force[d];
      book.impulse[d] += share * dt * external;
      book.gross_impulse += share * dt * std::abs(external);
      if (!mover->rigid.is_free(d))
        continue;
      book.external_work += share * dt * external * mover->rate[d];
      book.gravity_work += share * dt * external * mover->rate[d];
    }
  }
  for (const auto &touch : touches) {
    if (!means)
      touch->sums.fill(0.);
    touch->sums[dim + 1] = 0.;
    touch->gap = ContactSite<dim>::far;
    for (const Place &place : touch->places) {
      const ContactSite<dim> &site = touch->sites[place.site];
      const RigidBody<dim> &rigid = touch->mover.rigid;
      const Vector rigid_motion = dt * rigid.velocity_at(site.x, touch->mover.rate);
      book.contact_dissipation += share * (place.force * (rigid_motion - displacement(place, motion)));
      if (rigid.is_prescribed()) {
        book.external_work += share * (place.force * rigid_motion);
        book.impulse += share * dt * place.force;
        book.gross_impulse += share * dt * place.force.norm();
      }
      touch->gap = std::min(touch->gap, site.gap + site.normal * place.relative);
      const double factor = means ? share : 1.;
      for (unsigned int d = 0; d < dim; ++d)
        touch->sums[d] += factor * place.force[d];
      touch->sums[dim] += factor * (place.force * site.normal);
      if (place.mode != ContactMode::open)
        touch->sums[dim + 1] += site.area;
    }
  }
}

template <int dim>
void ImplicitContact<dim>::accept(const double dt)
{
  for (const auto &mover : movers) {
    RigidBody<dim> &rigid = mover->rigid;
    mover->moved += mover->displacement;
    if (rigid.is_prescribed()) {
      rigid.begin_step(step_start, dt, Vector());
      rigid.end_step();
    } else
      rigid.move(mover->displacement, mover->rate);
    for (unsigned int i = 0; i < n_motions; ++i)
      if (i < dim)
        rigid.last_force[i] = mover->force_sum[i];
      else
        rigid.last_moment[i - dim] = mover->force_sum[i];
  }
  for (const auto &touch : touches) {
    const dealii::ArrayView<double> sums(touch->sums.data(), touch->sums.size());
    dealii::Utilities::MPI::sum(dealii::ArrayView<const double>(sums), communicator, sums);
    ContactState<dim> now;
    for (unsigned int d = 0; d < dim; ++d)
      now.force[d] = -touch->sign * touch->sums[d];
    now.normal_force = touch->sums[dim];
    now.area = touch->sums[dim + 1];
    const double gap = dealii::Utilities::MPI::min(touch->gap, communicator);
    if (gap < ContactSite<dim>::far)
      now.gap = gap;
    scene.contact_states[touch->parameters.name] = now;
  }
}

template class ImplicitContact<2>;
template class ImplicitContact<3>;
} // namespace peat
