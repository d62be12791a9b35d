#include <peat/solver/scene.h>

#include <deal.II/base/mpi.h>

#include <algorithm>
#include <numeric>

namespace peat {
namespace {
/// Whether a point of the body lies nearer to the shape than its own edge does.
template <int dim>
bool touches(const Body<dim> &body, const Shape<dim> &shape)
{
  constexpr double slack = 1.001;
  const Layout &layout = body.layout();
  for (std::uint32_t handle = 0; handle < body.n_local_points(); ++handle) {
    double half_extent = 0.;
    for (unsigned int d = 0; d < dim; ++d)
      half_extent = std::max(half_extent, body.row(handle)[layout.extent + d]);
    if (shape.distance(body.position(handle)) <= slack * half_extent)
      return true;
  }
  return false;
}
} // namespace

template <int dim>
bool Scene<dim>::is_saturated() const
{
  for (const auto &body : bodies)
    if (body->material().mixture())
      return true;
  return false;
}

template <int dim>
void Scene<dim>::persist(Archive &archive)
{
  archive.begin("scene");
  for (const auto &body : bodies)
    archive(*body);
  for (auto &[name, tracers] : surfaces)
    archive(tracers);
  if (probes)
    archive(*probes);
  for (const auto &rigid : rigid_bodies)
    archive(*rigid);
  archive(contact_states);
}

template <int dim>
bool Scene<dim>::has_body_force() const
{
  return std::any_of(conditions.begin(), conditions.end(),
                     [](const auto &condition) { return condition->has_body_force(); });
}

template <int dim>
dealii::types::particle_index Scene<dim>::n_global_points() const
{
  dealii::types::particle_index n = 0;
  for (const auto &body : bodies)
    n += body->n_global_points();
  return n;
}

template <int dim>
Body<dim> &Scene<dim>::body(const std::string &name) const
{
  for (const auto &body : bodies)
    if (body->name() == name)
      return *body;
  throw InputError("there is no body '" + name + "'");
}

template <int dim>
int Scene<dim>::body_at(const dealii::Point<dim> &x, const double tolerance) const
{
  int found = -1;
  double nearest = tolerance;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const double distance = bodies[b]->shape()->distance(x);
    if (distance < nearest) {
      nearest = distance;
      found = b;
    }
  }
  return found;
}

template <int dim>
std::vector<std::vector<std::size_t>> find_continua(const Scene<dim> &scene, MPI_Comm communicator)
{
  const auto &bodies = scene.bodies;
  const auto &contacts = scene.contacts;
  std::vector<std::size_t> root(bodies.size(), 0);
  if (!contacts.empty()) {
    std::iota(root.begin(), root.end(), 0);
    for (std::size_t a = 0; a < bodies.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) {
        const auto contact =
            std::find_if(contacts.begin(), contacts.end(), [&](const ContactParameters<dim> &c) {
              return (c.first == bodies[a]->name() && c.second == bodies[b]->name()) ||
                     (c.second == bodies[a]->name() && c.first == bodies[b]->name());
            });
        const bool together =
            contact != contacts.end()
                ? contact->law->ties()
                : dealii::Utilities::MPI::max(int(touches(*bodies[a], *bodies[b]->shape()) ||
                                                  touches(*bodies[b], *bodies[a]->shape())),
                                              communicator) == 1;
        if (together)
          std::replace(root.begin(), root.end(), root[a], root[b]);
      }
  }
  std::vector<std::vector<std::size_t>> result;
  for (std::size_t r = 0; r < bodies.size(); ++r) {
    std::vector<std::size_t> members;
    for (std::size_t b = 0; b < bodies.size(); ++b)
      if (root[b] == r)
        members.push_back(b);
    if (!members.empty())
      result.push_back(members);
  }
  for (const auto &members : result)
    for (const ContactParameters<dim> &contact : contacts) {
      const auto holds = [&](const std::string &name) {
        return std::any_of(members.begin(), members.end(),
                           [&](const std::size_t b) { return bodies[b]->name() == name; });
      };
      if (!contact.law->ties() && holds(contact.first) && holds(contact.second))
        throw InputError(contact.origin, "'" + contact.first + "' and '" + contact.second +
                                             "' are to separate, but bodies that touch both and have no "
                                             "contact with them tie them together");
    }
  return result;
}

template struct Scene<2>;
template struct Scene<3>;
template std::vector<std::vector<std::size_t>> find_continua<2>(const Scene<2> &, MPI_Comm);
template std::vector<std::vector<std::size_t>> find_continua<3>(const Scene<3> &, MPI_Comm);
} // namespace peat
