#include <peat/simulation/scene_check.h>
#include <peat/simulation/simulation.h>

#include <deal.II/base/mpi.h>

namespace peat {
namespace {
/// A shape must not be cut off silently by the mesh.
template <int dim>
void check_inside_mesh(const BodyParameters<dim> &body, const GridParameters<dim> &grid)
{
  const auto bounds = body.shape->bounds();
  for (unsigned int d = 0; d < dim; ++d) {
    const double tolerance = 1e-9 * (grid.upper[d] - grid.lower[d]);
    if (bounds.upper[d] <= grid.lower[d] || bounds.lower[d] >= grid.upper[d])
      body.section.fail("Shape", "body '" + body.name + "' lies outside the mesh");
    const bool bounded = std::isfinite(bounds.lower[d]) && std::isfinite(bounds.upper[d]);
    if (bounded &&
        (bounds.lower[d] < grid.lower[d] - tolerance || bounds.upper[d] > grid.upper[d] + tolerance))
      body.section.fail("Shape", "body '" + body.name +
                                     "' reaches beyond the mesh; enlarge the mesh, or cut the "
                                     "shape with intersection(..., box(...))");
  }
}

template <int dim>
void cover(const Case<dim> &parameters, const std::string &name, const unsigned int gauss_points,
           Tracers<dim> &surface)
{
  for (const auto &body : parameters.bodies)
    if (body.name == name)
      surface.cover(*body.shape, body.points_per_direction, gauss_points);
  surface.find_adjoining([&](const dealii::Point<dim> &x) {
    return std::any_of(parameters.bodies.begin(), parameters.bodies.end(), [&](const auto &other) {
      return other.name != name && other.shape->distance(x) < 0.;
    });
  });
}
} // namespace

template <int dim>
Scene<dim> make_scene(Case<dim> &parameters, const Grid<dim> &grid)
{
  Scene<dim> scene;
  scene.gravity = parameters.gravity;
  for (const auto &body : parameters.bodies) {
    check_inside_mesh(body, parameters.grid);
    scene.bodies.push_back(
        std::make_unique<Body<dim>>(body, parameters.material(body.material), grid, parameters.fields()));
  }
  const auto add_surface = [&](const std::string &name) {
    if (scene.surfaces.find(name) == scene.surfaces.end())
      cover(parameters, name, parameters.fields().gauss_points,
            scene.surfaces.emplace(name, grid).first->second);
  };
  for (auto &condition : parameters.conditions)
    if (!condition->surface_of().empty())
      add_surface(condition->surface_of());
  // An implicit solver prescribes the pressure on free surfaces, which an explicit step has by nature.
  if (parameters.is_implicit())
    for (const auto &body : scene.bodies)
      if (body->material().mixture())
        add_surface(body->name());
  if (!parameters.probes.empty()) {
    scene.probes = std::make_unique<Tracers<dim>>(grid);
    for (unsigned int i = 0; i < parameters.probes.size(); ++i) {
      const auto &probe = parameters.probes[i];
      if (!grid.contains(probe.point))
        probe.section.fail("Point", "probe '" + probe.name + "' lies outside the mesh");
      scene.probes->add(i, probe.point, dealii::Tensor<1, dim>(),
                        scene.body_at(probe.point, 1e-6 * grid.smallest_cell_size()));
    }
  }
  for (const auto &rigid : parameters.rigid_bodies)
    scene.rigid_bodies.push_back(std::make_unique<RigidBody<dim>>(rigid));
  scene.contacts = parameters.contacts;
  scene.conditions = std::move(parameters.conditions);
  check_scene(parameters, scene, grid);
  scene.continua = find_continua(scene, grid.communicator());
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    if (!parameters.entry_stage(parameters.bodies[b]).empty())
      scene.bodies[b]->withdraw();
  return scene;
}

template <int dim>
Scene<dim> make_gauss_scene(const Case<dim> &parameters, const Grid<dim> &grid)
{
  const SchemeFields fields = parameters.gauss_fields();
  Scene<dim> scene;
  for (const auto &body : parameters.bodies) {
    scene.bodies.push_back(
        std::make_unique<Body<dim>>(body, parameters.material(body.material), grid, fields));
    cover(parameters, body.name, fields.gauss_points, scene.surfaces.emplace(body.name, grid).first->second);
  }
  scene.continua = find_continua(scene, grid.communicator());
  return scene;
}

template Scene<2> make_gauss_scene<2>(const Case<2> &, const Grid<2> &);
template Scene<3> make_gauss_scene<3>(const Case<3> &, const Grid<3> &);
template Scene<2> make_scene<2>(Case<2> &, const Grid<2> &);
template Scene<3> make_scene<3>(Case<3> &, const Grid<3> &);
} // namespace peat
