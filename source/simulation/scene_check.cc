#include <peat/grid/surface_mesh.h>
#include <peat/simulation/scene_check.h>

#include <deal.II/base/mpi.h>

#include <algorithm>
#include <limits>
#include <sstream>

namespace peat {
namespace {
bool on_any_rank(const bool found, MPI_Comm communicator)
{
  return dealii::Utilities::MPI::max(int(found), communicator) != 0;
}

/// Whether this rank has a point of one body deep in the shape of another. A point stands at the centroid of
/// its piece of the body; where the body has a notch that may be in the other body, but not deep in it.
template <int dim>
bool has_points_in(const Body<dim> &body, const unsigned int points_per_direction, const Shape<dim> &other,
                   const Grid<dim> &grid)
{
  // How deep a place is, only a distance tells.
  if (!other.is_distance())
    return false;
  for (const Slice &slice : body.slices()) {
    double spacing = std::numeric_limits<double>::max();
    for (unsigned int d = 0; d < dim; ++d)
      spacing = std::min(spacing, grid.size(slice.cell, d) / points_per_direction);
    for (std::uint32_t i = slice.begin; i < slice.end; ++i)
      if (other.distance(body.position(body.handles()[i])) < -0.5 * spacing)
        return true;
  }
  return false;
}

template <int dim>
void check_bodies(const Case<dim> &parameters, const Scene<dim> &scene, const Grid<dim> &grid)
{
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    for (std::size_t a = 0; a < b; ++a) {
      const auto &first = parameters.bodies[a], &second = parameters.bodies[b];
      if (!first.shape->bounds().overlaps(second.shape->bounds()))
        continue;
      const bool found = has_points_in(*scene.bodies[a], first.points_per_direction, *second.shape, grid) ||
                         has_points_in(*scene.bodies[b], second.points_per_direction, *first.shape, grid);
      if (on_any_rank(found, grid.communicator()))
        second.section.fail("Shape", "bodies '" + first.name + "' and '" + second.name +
                                         "' overlap; cut one out of the other with difference(..., ...)");
    }
}

/// Whether the shape of a body at the start and a rigid body share more than what touches: places on the
/// surface of one deep in the other, or points deep in the rigid one.
template <int dim>
bool overlap(const Body<dim> &body, const RigidBody<dim> &rigid, const double depth)
{
  if (!body.shape()->bounds().overlaps(rigid.bounds(), depth))
    return false;
  for (const std::uint32_t handle : body.handles())
    if (rigid.distance(body.position(handle)) < -depth)
      return true;
  if (!body.shape()->is_distance())
    return false;
  const SurfaceMesh<dim> surface = surface_mesh(rigid.reference_shape());
  return std::any_of(surface.vertices.begin(), surface.vertices.end(),
                     [&](const dealii::Point<dim> &x) { return body.shape()->distance(x) < -depth; });
}

template <int dim>
void check_rigid_bodies(const Scene<dim> &scene, const Grid<dim> &grid)
{
  constexpr double share_of_cell = 0.02;
  for (const auto &rigid : scene.rigid_bodies)
    for (const auto &body : scene.bodies)
      if (on_any_rank(overlap(*body, *rigid, share_of_cell * grid.smallest_cell_size()), grid.communicator()))
        rigid->section().fail("Shape", "rigid body '" + rigid->name() + "' and body '" + body->name() +
                                           "' overlap at the start");
}

/// Whether any node on a face of the mesh, or of the whole mesh (boundary -1), within the bounds satisfies
/// the predicate; it gets the node's lattice coordinates and the tolerance for regions. All ranks look at all
/// nodes.
template <int dim, typename Predicate>
bool any_node(const Grid<dim> &grid, const int boundary, const Bounds<dim> &bounds,
              const Predicate &predicate)
{
  const double tolerance = Place<dim>::tolerance(grid);
  typename Grid<dim>::Lattice first, last;
  for (int d = 0; d < dim; ++d) {
    const auto &planes = grid.planes(d);
    first[d] = std::lower_bound(planes.begin(), planes.end(), bounds.lower[d] - tolerance) - planes.begin();
    last[d] =
        std::upper_bound(planes.begin(), planes.end(), bounds.upper[d] + tolerance) - planes.begin() - 1;
    if (boundary >= 0 && d == boundary / 2) {
      const int end = boundary % 2 ? grid.n_cells(d) : 0;
      first[d] = std::max(first[d], end);
      last[d] = std::min(last[d], end);
    }
    if (first[d] > last[d])
      return false;
  }
  for (auto node = first; node[dim - 1] <= last[dim - 1];) {
    if (predicate(node, tolerance))
      return true;
    int d = 0;
    while (++node[d] > last[d] && d + 1 < dim) {
      node[d] = first[d];
      ++d;
    }
  }
  return false;
}

template <int dim>
bool holds_node(const Place<dim> &place, const typename Grid<dim>::Lattice &node, const Grid<dim> &grid,
                const double tolerance)
{
  dealii::Point<dim> x;
  for (int d = 0; d < dim; ++d)
    x[d] = grid.planes(d)[node[d]];
  return place.contains_node(x, tolerance);
}

template <int dim>
Bounds<dim> bounds(const Place<dim> &place)
{
  return place.region ? place.region->bounds() : Bounds<dim>::everything();
}

/// Whether two conditions both hold all nodes of a face on this boundary (-1: of a cell). Regions that only
/// touch each other share nodes, but no face.
template <int dim>
bool share_face(const Place<dim> &a, const Place<dim> &b, const int boundary, const Grid<dim> &grid)
{
  Bounds<dim> both = bounds(a);
  for (int d = 0; d < dim; ++d) {
    both.lower[d] = std::max(both.lower[d], bounds(b).lower[d]);
    both.upper[d] = std::min(both.upper[d], bounds(b).upper[d]);
  }
  return any_node(grid, boundary, both, [&](const typename Grid<dim>::Lattice &node, const double tolerance) {
    for (unsigned int corner = 0; corner < (1u << dim); ++corner) {
      auto other = node;
      for (int d = 0; d < dim; ++d) {
        other[d] += boundary >= 0 && d == boundary / 2 ? 0 : (corner >> d) & 1;
        if (other[d] > grid.n_cells(d))
          return false;
      }
      if (!holds_node(a, other, grid, tolerance) || !holds_node(b, other, grid, tolerance))
        return false;
    }
    return true;
  });
}

template <int dim>
bool holds_piece(const std::vector<Place<dim>> &places, const Tracers<dim> &surface, MPI_Comm communicator)
{
  bool found = false;
  for (const auto &tracer : surface.tracers()) {
    SurfacePoint<dim> point;
    point.initial_position = tracer.initial_position;
    point.area = tracer.area;
    found = found || std::all_of(places.begin(), places.end(),
                                 [&](const Place<dim> &place) { return place.contains(point); });
  }
  return on_any_rank(found, communicator);
}

template <int dim>
void check_selection(const Condition<dim> &condition, const Scene<dim> &scene, const Grid<dim> &grid)
{
  const Place<dim> &place = condition.place;
  const auto &names = boundary_names<dim>();
  if (!place.on_mesh()) {
    const Tracers<dim> &surface = scene.surfaces.at(place.body);
    const std::string name = (place.direction < 0 ? "surface" : names[place.direction]) + " of " + place.body;
    Place<dim> unrestricted = place;
    unrestricted.region.reset();
    if (!holds_piece<dim>({unrestricted}, surface, grid.communicator()))
      condition.section.fail("Where", "'" + name +
                                          "' is empty; where a body touches the edge of the mesh it has no "
                                          "surface, the mesh must be larger");
    if (!holds_piece<dim>({place}, surface, grid.communicator()))
      condition.section.fail("Region", "no part of '" + name + "' lies in this region");
    return;
  }
  if (!place.region)
    return;
  const auto is_held = [&](const typename Grid<dim>::Lattice &node, const double tolerance) {
    return holds_node(place, node, grid, tolerance);
  };
  bool found = place.boundaries.empty() && any_node(grid, -1, bounds(place), is_held);
  for (const unsigned int boundary : place.boundaries)
    found = found || any_node(grid, boundary, bounds(place), is_held);
  if (!found)
    condition.section.fail("Region", place.boundaries.empty() ? "no node of the mesh lies in this region"
                                                              : "no node on 'Where' lies in this region");
}

/// The faces of the mesh on which both act; -1: regions.
template <int dim>
std::vector<int> common_boundaries(const Place<dim> &a, const Place<dim> &b)
{
  if (a.on_mesh() && b.on_mesh() && a.boundaries.empty() && b.boundaries.empty())
    return {-1};
  std::vector<int> common;
  for (const unsigned int boundary : a.boundaries)
    if (std::find(b.boundaries.begin(), b.boundaries.end(), boundary) != b.boundaries.end())
      common.push_back(boundary);
  return common;
}

template <int dim>
void check_pair(const Condition<dim> &a, const Condition<dim> &b, const Scene<dim> &scene,
                const Grid<dim> &grid)
{
  const auto refuse = [&](const std::string &where, const std::string &what) {
    b.section.fail("Where",
                   where + " has two conditions on the " + what + ": '" + a.name + "' and '" + b.name + "'");
  };
  const bool fluid = a.concerns_fluid() && b.concerns_fluid();
  for (const int boundary : common_boundaries(a.place, b.place)) {
    bool motion = false;
    for (int d = 0; d < dim; ++d)
      motion = motion || (a.prescribes(boundary, d) && b.prescribes(boundary, d));
    if ((motion || fluid) && share_face(a.place, b.place, boundary, grid))
      refuse(boundary < 0 ? "a region" : "boundary '" + boundary_names<dim>()[boundary] + "'",
             motion ? "motion" : "pore fluid");
  }
  if (fluid && !a.place.on_mesh() && a.place.body == b.place.body &&
      holds_piece<dim>({a.place, b.place}, scene.surfaces.at(a.place.body), grid.communicator()))
    refuse("the surface of '" + a.place.body + "'", "pore fluid");
}

/// Faces of the mesh that a place names; -1: it is a region.
template <int dim>
std::vector<int> parts(const Place<dim> &place)
{
  return place.boundaries.empty() ? std::vector<int>{-1}
                                  : std::vector<int>(place.boundaries.begin(), place.boundaries.end());
}

/// What is tied moves as one, and so nothing else may say how any node of it moves.
template <int dim>
void check_tie(const Condition<dim> &a, const Condition<dim> &b, const Grid<dim> &grid)
{
  if (!a.place.on_mesh() || !b.place.on_mesh())
    return;
  const auto refuse = [&](const int component) {
    b.section.fail("Where", "conditions '" + a.name + "' and '" + b.name +
                                "' meet at nodes, whose motion in " + std::string(1, "xyz"[component]) +
                                " one ties and the other " +
                                (a.ties(component) && b.ties(component) ? "ties, too" : "prescribes"));
  };
  for (const int first : parts(a.place))
    for (const int second : parts(b.place))
      for (int d = 0; d < dim; ++d) {
        if (!((a.ties(d) && (b.ties(d) || b.prescribes(second, d))) || (b.ties(d) && a.prescribes(first, d))))
          continue;
        const auto in_both = [&](const typename Grid<dim>::Lattice &node, const double tolerance) {
          return holds_node(a.place, node, grid, tolerance) && holds_node(b.place, node, grid, tolerance) &&
                 (second < 0 || node[second / 2] == (second % 2 ? grid.n_cells(second / 2) : 0));
        };
        if (any_node(grid, first, bounds(a.place), in_both))
          refuse(d);
      }
}

template <int dim>
void check_conditions(const Scene<dim> &scene, const Grid<dim> &grid)
{
  for (std::size_t b = 0; b < scene.conditions.size(); ++b) {
    check_selection(*scene.conditions[b], scene, grid);
    for (std::size_t a = 0; a < b; ++a) {
      check_pair(*scene.conditions[a], *scene.conditions[b], scene, grid);
      check_tie(*scene.conditions[a], *scene.conditions[b], grid);
    }
  }
}

template <int dim>
void check_probes(const Case<dim> &parameters, const Grid<dim> &grid)
{
  for (const auto &probe : parameters.probes) {
    const bool found = !probe.follow ||
                       std::any_of(parameters.bodies.begin(), parameters.bodies.end(), [&](const auto &body) {
                         return !body.shape->is_distance() ||
                                body.shape->distance(probe.point) < 0.5 * grid.smallest_cell_size();
                       });
    if (!found)
      probe.section.fail("Point", "there is no material that probe '" + probe.name +
                                      "' could follow; for a fixed place set 'Follow material = false'");
  }
}

template <int dim>
void check_fixed_step(const Case<dim> &parameters, const Scene<dim> &scene, const Grid<dim> &grid)
{
  // Of stages that choose their scheme the longest step counts.
  const bool semi = parameters.may_have(Scheme::semi_implicit);
  if (!semi && !parameters.may_have(Scheme::explicit_steps))
    return;
  const StableStep stable = stable_step<dim>(scene.bodies, grid, parameters.scheme.seepage_inertia, semi);
  if (parameters.scheme.fixed_step <= stable.dt)
    return;
  std::ostringstream message;
  message << parameters.scheme.fixed_step << " s is above the stable step " << stable.dt << " s ("
          << stable.limit << ')';
  parameters.section.subsection("Explicit MPM").fail("Time step", message.str());
}
} // namespace

template <int dim>
void check_scene(const Case<dim> &parameters, const Scene<dim> &scene, const Grid<dim> &grid)
{
  check_bodies(parameters, scene, grid);
  check_rigid_bodies(scene, grid);
  try {
    check_conditions(scene, grid);
  } catch (const NumericalError &error) {
    // A region whose function has no value somewhere.
    throw InputError(error.what());
  }
  check_probes(parameters, grid);
  if (parameters.scheme.fixed_step > 0.)
    check_fixed_step(parameters, scene, grid);
}

template void check_scene<2>(const Case<2> &, const Scene<2> &, const Grid<2> &);
template void check_scene<3>(const Case<3> &, const Scene<3> &, const Grid<3> &);
} // namespace peat
