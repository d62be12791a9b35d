#include <peat/simulation/contact_events.h>

#include <deal.II/base/mpi.h>

#include <numeric>
#include <sstream>

namespace peat {
namespace {
/// 0 if it has no points yet; infinite if its motion is prescribed.
template <int dim>
double mass_of(const std::string &name, const Scene<dim> &scene, MPI_Comm communicator)
{
  for (const auto &rigid : scene.rigid_bodies)
    if (rigid->name() == name)
      return rigid->is_prescribed() ? std::numeric_limits<double>::infinity() : rigid->mass();
  double mass = 0.;
  for (const auto &body : scene.bodies)
    if (body->name() == name) {
      for (const std::uint32_t handle : body->handles())
        mass += body->row(handle)[body->layout().mass];
      mass = dealii::Utilities::MPI::sum(mass, communicator);
    }
  return mass;
}

template <int dim>
double lighter_mass(const std::string &contact, const Scene<dim> &scene, MPI_Comm communicator)
{
  for (const auto &one : scene.contacts)
    if (one.name == contact)
      return std::min(mass_of(one.first, scene, communicator), mass_of(one.second, scene, communicator));
  return 0.;
}
} // namespace

template <int dim>
void ContactEvents<dim>::note(const double time, const double dt, const Scene<dim> &scene)
{
  // Bodies that ring part and meet many times.
  constexpr unsigned int most_told = 6;
  for (const auto &[name, state] : scene.contact_states) {
    Record &record = records[name];
    if (state.normal_force > 0. && record.mass == 0.)
      record.mass = lighter_mass(name, scene, communicator);
    // Nodes with hardly any mass meet before bodies do: what moves none of these is no touch.
    constexpr double slightest_motion = 1e-9; // [m/s]
    const bool touches = dt * state.normal_force > slightest_motion * record.mass;
    if (touches != record.touches) {
      record.touches = touches;
      ++record.n_events;
      if (record.n_told < most_told) {
        ++record.n_told;
        std::ostringstream text;
        text << "contact '" << name << "': " << (touches ? "touch" : "release") << " at t = " << time << " s";
        if (record.n_told == most_told)
          text << "; more such events are not listed";
        log.line(text.str());
      }
    }
    const unsigned int turn = record.n_steps++ % n_averaged;
    record.impulses[turn] = dt * state.normal_force;
    record.lengths[turn] = dt;
    const double force = std::accumulate(record.impulses.begin(), record.impulses.end(), 0.) /
                         std::accumulate(record.lengths.begin(), record.lengths.end(), 0.);
    if (record.n_steps >= n_averaged && force > record.largest_force) {
      record.largest_force = force;
      record.time_of_largest = time;
    }
    record.impulse += dt * state.normal_force;
    record.smallest_gap = std::min(record.smallest_gap, state.gap);
  }
}

template <int dim>
void ContactEvents<dim>::summarise(const Scene<dim> &scene)
{
  for (const auto &[name, record] : records) {
    std::ostringstream text;
    text << "contact '" << name << "': ";
    if (record.n_events == 0)
      text << "bodies do not touch";
    else
      text << "largest normal force " << record.largest_force << " N (mean of " << n_averaged
           << " steps) at t = " << record.time_of_largest << " s, normal impulse " << record.impulse
           << " N s, deepest overlap " << std::max(0., -record.smallest_gap) << " m, in the end "
           << (record.touches ? "in contact" : "apart");
    log.line(text.str());
  }
  for (const auto &rigid : scene.rigid_bodies) {
    std::ostringstream text;
    text << "rigid body '" << rigid->name() << "': in the end at (" << rigid->center() << "), velocity ("
         << rigid->velocity() << ") m/s";
    log.line(text.str());
  }
}

template class ContactEvents<2>;
template class ContactEvents<3>;
} // namespace peat
