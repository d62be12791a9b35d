#include <peat/solver/contact_solver.h>

#include <peat/solver/body_contact.h>
#include <peat/solver/rigid_contact.h>

#include <deal.II/base/mpi.h>

#include <algorithm>

namespace peat {
namespace {
/// Its place in the scene, or no_index.
template <int dim>
std::uint32_t find_rigid(const Scene<dim> &scene, const std::string &name)
{
  for (std::uint32_t r = 0; r < scene.rigid_bodies.size(); ++r)
    if (scene.rigid_bodies[r]->name() == name)
      return r;
  return no_index;
}

template <int dim>
bool holds(const Scene<dim> &scene, const Continuum<dim> &continuum, const std::string &name)
{
  return std::any_of(continuum.bodies().begin(), continuum.bodies().end(),
                     [&](const std::size_t b) { return scene.bodies[b]->name() == name; });
}

/// Of the continuum: the body of this name and those that no other contact with the same partner names.
template <int dim>
std::vector<std::size_t> side(const Scene<dim> &scene, const Continuum<dim> &continuum,
                              const std::string &name, const std::vector<std::string> &names_of_all)
{
  std::vector<std::size_t> result;
  for (const std::size_t b : continuum.bodies()) {
    const std::string &body = scene.bodies[b]->name();
    // What nobody names goes with the first one named.
    const bool unnamed = std::find(names_of_all.begin(), names_of_all.end(), body) == names_of_all.end();
    if (body == name || (unnamed && names_of_all.front() == name))
      result.push_back(b);
  }
  return result;
}
} // namespace

template <int dim>
void ContactSolver<dim>::reinit(const SchemeParameters &scheme, const Grid<dim> &grid, Scene<dim> &used_scene,
                                std::vector<std::unique_ptr<Continuum<dim>>> &used)
{
  scene = &used_scene;
  continua = &used;
  tried_accelerations.assign(scene->rigid_bodies.size(), {});
  pairs.clear();
  ties.clear();
  tied_pairs.clear();
  const auto names_of = [&](const Continuum<dim> &continuum, const auto &is_partner) {
    std::vector<std::string> names;
    for (const auto &contact : scene->contacts) {
      if (is_partner(contact.second) && holds(*scene, continuum, contact.first))
        names.push_back(contact.first);
      if (is_partner(contact.first) && holds(*scene, continuum, contact.second))
        names.push_back(contact.second);
    }
    return names;
  };

  for (const auto &contact : scene->contacts) {
    const std::uint32_t rigid_first = find_rigid(*scene, contact.first);
    const std::uint32_t place = rigid_first != no_index ? rigid_first : find_rigid(*scene, contact.second);
    if (place == no_index)
      continue;
    RigidBody<dim> *rigid = scene->rigid_bodies[place].get();
    const std::string &partner = rigid_first != no_index ? contact.second : contact.first;
    for (const auto &continuum : *continua)
      if (holds(*scene, *continuum, partner)) {
        const auto names =
            names_of(*continuum, [&](const std::string &name) { return name == rigid->name(); });
        pairs.push_back(std::make_unique<RigidContact<dim>>(
            contact, scheme, grid, *scene, *rigid, *continuum, side(*scene, *continuum, partner, names),
            rigid_first != no_index, tried_accelerations[place]));
      }
  }
  for (std::size_t a = 0; a < continua->size(); ++a)
    for (std::size_t b = a + 1; b < continua->size(); ++b) {
      Continuum<dim> &one = *(*continua)[a], &other = *(*continua)[b];
      const auto names_one =
          names_of(one, [&](const std::string &name) { return holds(*scene, other, name); });
      const auto names_other =
          names_of(other, [&](const std::string &name) { return holds(*scene, one, name); });
      if (names_one.empty()) {
        ties.push_back(std::make_unique<ContactParameters<dim>>(ContactParameters<dim>::tied(
            scene->bodies[one.bodies().front()]->name(), scene->bodies[other.bodies().front()]->name())));
        tied_pairs.push_back(std::make_unique<BodyContact<dim>>(*ties.back(), scheme, grid, *scene, one,
                                                                other, one.bodies(), other.bodies()));
        continue;
      }
      for (const auto &contact : scene->contacts)
        for (const bool swapped : {false, true}) {
          Continuum<dim> &first = swapped ? other : one, &second = swapped ? one : other;
          if (holds(*scene, first, contact.first) && holds(*scene, second, contact.second))
            pairs.push_back(std::make_unique<BodyContact<dim>>(
                contact, scheme, grid, *scene, first, second,
                side(*scene, first, contact.first, swapped ? names_other : names_one),
                side(*scene, second, contact.second, swapped ? names_one : names_other)));
        }
    }
  communicator = grid.communicator();
  implicit_pressure = scheme.implicit_pressure;
}

template <int dim>
template <typename Action>
void ContactSolver<dim>::for_each(const Action &action)
{
  for (const auto &pair : pairs)
    action(*pair);
  for (const auto &pair : tied_pairs)
    action(*pair);
}

template <int dim>
template <typename Action>
void ContactSolver<dim>::sweep(const Action &action)
{
  // Stopped after any number of turns, the reactions are those of bodies that give way a little: never more
  // than what holds them together.
  constexpr unsigned int most_turns = 8;
  for (unsigned int turn = 0; turn < (needs_sweeps ? most_turns : 1); ++turn) {
    for_each(action);
    if (!needs_sweeps)
      return;
    for (auto pair = tied_pairs.rbegin(); pair != tied_pairs.rend(); ++pair)
      action(**pair);
    for (auto pair = pairs.rbegin(); pair != pairs.rend(); ++pair)
      action(**pair);
  }
}

template <int dim>
void ContactSolver<dim>::match_nodes()
{
  if (is_empty())
    return;
  for (const auto &continuum : *continua) {
    continuum->fields().contact_force.assign(continuum->nodes().size() * dim, 0.);
    continuum->find_prescribed_rows();
    if (implicit_pressure)
      continuum->couple_nodes();
  }
  for_each([](auto &pair) { pair.match_nodes(); });

  int several = 0;
  for (const auto &continuum : *continua) {
    std::vector<char> count(continuum->nodes().size(), 0);
    for_each([&](auto &pair) { pair.mark_nodes(*continuum, count); });
    several |= std::any_of(count.begin(), count.end(), [](const char n) { return n > 1; });
  }
  for (const auto &rigid : scene->rigid_bodies) {
    unsigned int n = 0;
    for (const auto &contact : scene->contacts)
      n += contact.first == rigid->name() || contact.second == rigid->name();
    several |= n > 1 && !rigid->is_prescribed();
  }
  needs_sweeps = dealii::Utilities::MPI::max(several, communicator) == 1;
}

template <int dim>
void ContactSolver<dim>::begin(const double step_begin, const double step_length)
{
  time = step_begin;
  dt = step_length;
  largest_change = 0.;
  if (!is_empty())
    for (const auto &continuum : *continua) {
      auto &force = continuum->fields().contact_force;
      std::fill(force.begin(), force.end(), 0.);
    }
  for_each([&](auto &pair) { pair.begin(dt); });
  start.clear();
  for (const auto &rigid : scene->rigid_bodies) {
    start.push_back(rigid->velocity());
    rigid->last_force = {};
    rigid->last_moment = {};
    rigid->begin_step(time, dt, continua->front()->gravity());
  }
}

template <int dim>
void ContactSolver<dim>::solve()
{
  constexpr unsigned int most_sweeps = 100;
  constexpr double tolerance = 1e-12;
  double first_change = 0.;
  for (unsigned int sweep = 0; sweep < most_sweeps; ++sweep) {
    double change = 0.;
    for_each([&](auto &pair) { change = std::max(change, pair.solve()); });
    largest_change = std::max(largest_change, change);
    if (!needs_sweeps)
      break;
    change = dealii::Utilities::MPI::max(change, communicator);
    first_change = std::max(first_change, change);
    if (change <= tolerance * first_change)
      break;
  }
}

template <int dim>
void ContactSolver<dim>::hold()
{
  if (is_empty())
    return;
  for (const auto &continuum : *continua) {
    auto &held = continuum->response().held;
    std::fill(held.begin(), held.end(), 0);
  }
  for_each([](auto &pair) { pair.hold(); });
}

template <int dim>
void ContactSolver<dim>::restrain()
{
  for (const auto &continuum : *continua)
    if (!continuum->is_saturated()) {
      auto &acceleration = continuum->response().acceleration;
      std::fill(acceleration.begin(), acceleration.end(), 0.);
    }
  std::fill(tried_accelerations.begin(), tried_accelerations.end(), typename RigidBody<dim>::Generalised());
  // Equations (53) and (54) of theory.md.
  for_each([](auto &pair) { pair.forget_reactions(); });
  sweep([](auto &pair) { pair.restrain_motion(); });
  sweep([](auto &pair) { pair.restrain_flux(); });
}

template <int dim>
void ContactSolver<dim>::take_reactions()
{
  for_each([](auto &pair) { pair.take_reactions(); });
}

template <int dim>
bool ContactSolver<dim>::is_outdated()
{
  // Of the largest change in the step: so much may be left to the next one.
  constexpr double negligible = 1e-4;
  if (is_empty())
    return false;
  double change = 0.;
  for_each([&](auto &pair) { change = std::max(change, pair.outdated_change()); });
  const std::vector<double> mine = {change, largest_change};
  std::vector<double> all(2);
  dealii::Utilities::MPI::max(mine, communicator, all);
  return all[0] > negligible * all[1];
}

template <int dim>
void ContactSolver<dim>::finish(Ledger<dim> &book)
{
  for_each([&](auto &pair) { pair.finish(book); });
  for (const auto &pair : pairs)
    scene->contact_states[pair->name()] = pair->state();

  const auto &gravity = continua->front()->gravity();
  const bool first_rank = dealii::Utilities::MPI::this_mpi_process(communicator) == 0;
  for (std::size_t r = 0; r < scene->rigid_bodies.size(); ++r) {
    RigidBody<dim> &rigid = *scene->rigid_bodies[r];
    if (!rigid.is_prescribed() && first_rank) {
      // What is not contact comes from outside: gravity, and guides that keep components from moving.
      const auto external = rigid.mass() * (rigid.velocity() - start[r]) - dt * rigid.last_force;
      const double work = dt * rigid.mass() * (gravity * (0.5 * (start[r] + rigid.velocity())));
      book.impulse += external;
      book.gross_impulse += external.norm();
      book.external_work += work;
      book.gravity_work += work;
    }
    rigid.end_step();
  }
}

template <int dim>
void ContactSolver<dim>::note_late_forces()
{
  bool any = false;
  for (const auto &continuum : *continua)
    any = any || continuum->has_late_force();
  if (is_empty() || !any)
    return;
  for (const auto &continuum : *continua)
    std::fill(continuum->late_force().begin(), continuum->late_force().end(), 0.);
  for_each([](auto &pair) { pair.note_late_forces(); });
}

template <int dim>
void ContactSolver<dim>::constrain_flux()
{
  for_each([](auto &pair) { pair.constrain_flux(); });
}

template <int dim>
void ContactSolver<dim>::constrain_carrying_velocity()
{
  if (!continua->front()->remaps_velocity())
    return;
  for_each([](auto &pair) { pair.constrain_carrying_velocity(); });
}

template <int dim>
void ContactSolver<dim>::persist(Archive &archive)
{
  archive.begin("contacts");
  for_each([&](auto &pair) { pair.persist(archive); });
}

template class ContactSolver<2>;
template class ContactSolver<3>;
} // namespace peat
