#include <peat/grid/cut_box.h>
#include <peat/points/body.h>
#include <peat/points/seeding.h>

#include <deal.II/base/mpi.h>

#include <map>
#include <numeric>
#include <optional>
#include <sstream>

namespace peat {
template <int dim>
BodyParameters<dim>::BodyParameters(Section section, const std::vector<std::string> &material_names)
    : section(section), name(section.name())
{
  constexpr unsigned int n_stress = dim == 2 ? 4 : 6;
  material = material_names.empty() ? "" : material_names.front();
  std::string shape_text = dim == 2 ? "box(0, 0, 1, 1)" : "box(0, 0, 0, 1, 1, 1)";
  const std::string zeros_vector = dim == 2 ? "0, 0" : "0, 0, 0";
  const std::string zeros_stress = dim == 2 ? "0, 0, 0, 0" : "0, 0, 0, 0, 0, 0";
  initial_velocity = Function(zeros_vector, {}, {});
  initial_stress = Function(zeros_stress, {}, {});
  initial_pressure = Function("0", {}, {});

  section.add("Material", material, material_names, "The material it is made of.");
  section.add("Shape", shape_text,
              "Its region at the start: box, ball, polygon, ..., combined by union, intersection, "
              "difference (see the user guide).");
  section.add("Points per cell", points_per_direction, between(1, 16),
              "Material points per cell in each direction.");
  std::string lattice = "mesh";
  section.add("Point lattice", lattice, {"mesh", "body"},
              "Which boxes the points stand for. 'mesh': equal parts of the cells, as far as the shape fills "
              "them. 'body': "
              "equal parts of the shape's bounds, about as large; without the thin pieces that limit the "
              "step of a body "
              "whose edges do not lie on the lines of the mesh.");
  lattice_of_body = lattice == "body";
  section.add("Initial velocity", initial_velocity, dim, "m/s", "Velocity at the start.");
  section.add("Fall height", fall_height, nonnegative("m"),
              "Adds the velocity of a free fall from this height, along gravity at the time when the body "
              "comes in.");
  section.add("From stage", from_stage,
              "The stage from whose start on the body takes part; empty: from the first one on.");
  section.add("Initial stress", initial_stress, n_stress, "Pa",
              dim == 2 ? "Effective stress at the start: xx, yy, zz, xy; tension positive."
                       : "Effective stress at the start: xx, yy, zz, xy, yz, zx; tension positive.");
  section.add("Initial pressure", initial_pressure, 1, "Pa", "Pore pressure at the start; saturated bodies.");
  section.require("Shape", "body '" + name + "'");
  section.require("Material", "body '" + name + "'");
  shape = parse_shape<dim>(shape_text, section.constants(), section.origin("Shape"));
}

template <int dim>
Body<dim>::Body(const BodyParameters<dim> &parameters, const Material &material, const Grid<dim> &grid,
                const SchemeFields &scheme)
    : parameters(parameters), gauss_points(scheme.gauss_points), body_material(material), grid(grid),
      columns(dim, material, scheme), initial_shape(parameters.shape),
      particles(grid.triangulation(), grid.mapping(), columns.n_columns),
      count_in_cell(grid.n_local_cells(), 0)
{
  if (parameters.lattice_of_body && gauss_points == 0) {
    if (!columns.wide_domains)
      parameters.section.fail("Point lattice",
                              "'body' is for 'Basis = gimp', whose points may reach over cells");
    const Bounds<dim> bounds = initial_shape->bounds();
    if (!grid.contains(bounds.lower) || !grid.contains(bounds.upper))
      parameters.section.fail("Point lattice", "'body' needs a shape that has bounds, inside the mesh");
    if (!is_uniform(grid, bounds))
      parameters.section.fail("Point lattice", "'body' needs cells of one size where the body is");
  }
  enter();
  if (initial_number == 0)
    parameters.section.fail("Shape", "body '" + parameters.name +
                                         "' has no material points: its shape lies outside the mesh "
                                         "or is smaller than the spacing of points");
}

namespace {
/// See Layout::surface_depth.
template <int dim>
double surface_depth(const Shape<dim> &shape, const dealii::Point<dim> &x,
                     const dealii::Tensor<1, dim> &half_extent)
{
  // Deeper points are behind others that contact meets first.
  constexpr double most_depth = 6.;
  const double distance = -shape.distance(x);
  auto n = shape.normal(x);
  // Beside an edge two faces may be as near, and the normal between them meets neither.
  const auto meets_surface = [&](const dealii::Tensor<1, dim> &direction) {
    return std::abs(shape.distance(x + distance * direction)) < 1e-4 * distance;
  };
  for (unsigned int k = 0; k < 2 * dim && !meets_surface(n); ++k) {
    n = dealii::Tensor<1, dim>();
    n[k / 2] = k % 2 ? 1. : -1.;
  }
  double towards_surface = 0.;
  for (unsigned int d = 0; d < dim; ++d)
    towards_surface += std::abs(n[d]) * half_extent[d];
  const double depth = distance / towards_surface;
  return depth > 0. && depth < most_depth ? depth : 0.;
}

template <int dim>
void fill_row(std::vector<double> &row, const Layout &layout, const Material &material,
              const BodyParameters<dim> &parameters, const PointBox<dim> &box)
{
  const CutBox<dim> &part = box.part;
  const dealii::Tensor<1, dim> half_extent = box.half_extents();
  double x[3] = {0., 0., 0.};
  for (unsigned int d = 0; d < dim; ++d)
    x[d] = part.centroid[d];
  row.assign(layout.n_columns, 0.);
  row[layout.mass] = material.density() * part.volume;
  row[layout.volume] = part.volume;
  for (unsigned int d = 0; d < dim; ++d)
    row[layout.velocity + d] = parameters.initial_velocity.value(x, 0., d) + parameters.fall_velocity[d];
  if (layout.velocity_gradient >= 0)
    for (unsigned int e = 0; e < dim; ++e) {
      // Exact for velocities that are linear in place, but for round-off.
      double below[3] = {x[0], x[1], x[2]}, above[3] = {x[0], x[1], x[2]};
      below[e] -= half_extent[e];
      above[e] += half_extent[e];
      for (unsigned int d = 0; d < dim; ++d)
        row[layout.velocity_gradient + d * dim + e] = (parameters.initial_velocity.value(above, 0., d) -
                                                       parameters.initial_velocity.value(below, 0., d)) /
                                                      (2. * half_extent[e]);
    }
  for (unsigned int c = 0; c < parameters.initial_stress.n_components(); ++c)
    row[layout.stress + c] = parameters.initial_stress.value(x, 0., c);
  if (layout.pressure >= 0)
    row[layout.pressure] = parameters.initial_pressure.value(x, 0.);
  if (layout.porosity >= 0)
    row[layout.porosity] = material.mixture()->porosity();
  if (layout.extent >= 0)
    for (unsigned int d = 0; d < dim; ++d)
      row[layout.extent + d] = half_extent[d];
  if (layout.surface_depth >= 0)
    row[layout.surface_depth] = surface_depth(*parameters.shape, part.centroid, half_extent);
  int column = layout.state;
  for (const StateField &field : material.law().state())
    for (const double value : field.initial)
      row[column++] = value;
}
} // namespace

template <int dim>
void Body<dim>::seed()
{
  const unsigned int n = gauss_points > 0 ? gauss_points : parameters.points_per_direction;
  const unsigned int n_boxes = dim == 2 ? n * n : n * n * n;
  const auto bounds = initial_shape->bounds();

  const auto apart = [&](const CellId id) {
    for (unsigned int d = 0; d < dim; ++d)
      if (grid.lower(id, d) > bounds.upper[d] || grid.lower(id, d) + grid.size(id, d) < bounds.lower[d])
        return true;
    return false;
  };
  std::size_t most_points = 0;
  for (CellId id = 0; id < grid.n_local_cells(); ++id)
    most_points += grid.is_owned(id) && !apart(id) ? n_boxes : 0;
  // Without this the arrays would grow by doubling, which costs twice the memory while a large body is made.
  particles.get_property_pool().reserve(most_points);

  std::optional<std::map<CellId, std::vector<PointBox<dim>>>> lattice;
  if (parameters.lattice_of_body && gauss_points == 0)
    lattice = lattice_boxes(*initial_shape, grid, n);
  std::vector<double> row;
  std::uint32_t n_local = 0;
  std::string problem;
  const auto make_points = [&](const auto &cell) {
    const CellId id = cell->active_cell_index();
    for (const PointBox<dim> &box : lattice            ? (*lattice)[id]
                                    : gauss_points > 0 ? gauss_boxes(*initial_shape, grid, id, n)
                                                       : even_boxes(*initial_shape, grid, id, n)) {
      fill_row(row, columns, body_material, parameters, box);
      const auto unit = grid.mapping().transform_real_to_unit_cell(cell, box.part.centroid);
      particles.insert_particle(box.part.centroid, unit, n_local++, cell, row);
    }
  };
  for (const auto &cell : grid.triangulation().active_cell_iterators()) {
    if (!cell->is_locally_owned() || apart(cell->active_cell_index()))
      continue;
    try {
      make_points(cell);
    } catch (const NumericalError &error) {
      // A function of the file that has no value somewhere. Other ranks may not meet that place.
      problem = error.what();
      break;
    }
  }
  for (const std::string &one : dealii::Utilities::MPI::all_gather(grid.communicator(), problem))
    if (!one.empty())
      throw InputError(one);
  number_points(n_local);
  particles.update_cached_numbers();
}

template <int dim>
void Body<dim>::enter()
{
  seed();
  attach_storage();
  initial_number = particles.n_global_particles();
}

template <int dim>
void Body<dim>::withdraw()
{
  particles.clear_particles();
  particles.update_cached_numbers();
  moved_points.clear();
  attach_storage();
  initial_number = 0;
}

template <int dim>
void Body<dim>::number_points(const std::uint32_t n_local)
{
  const dealii::types::particle_index n = n_local;
  dealii::types::particle_index first = 0;
  const int ierr = MPI_Exscan(&n, &first, 1, DEAL_II_PARTICLE_INDEX_MPI_TYPE, MPI_SUM, grid.communicator());
  AssertThrowMPI(ierr);
  if (dealii::Utilities::MPI::this_mpi_process(grid.communicator()) == 0)
    return;
  auto &pool = particles.get_property_pool();
  for (std::uint32_t handle = 0; handle < n_local; ++handle)
    pool.set_id(handle, first + pool.get_id(handle));
}

template <int dim>
void Body<dim>::attach_storage()
{
  const std::size_t n = particles.n_locally_owned_particles();
  cell_of_point.resize(n);
  if (n > 0) {
    auto &pool = particles.get_property_pool();
    first_row = pool.get_properties(0).data();
    // The pool's positions are writable one by one through set_location(); kernels update them in place.
    first_position = const_cast<dealii::Point<dim> *>(&pool.get_location(0));
  }
  std::uint32_t handle = 0;
  for (const auto &particle : particles) {
    Assert(particle.get_local_index() == handle, dealii::ExcInternalError());
    cell_of_point[handle++] = particle.get_surrounding_cell()->active_cell_index();
  }
  rebuild_slices();
}

template <int dim>
dealii::types::particle_index Body<dim>::id(const std::uint32_t handle) const
{
  return particles.get_property_pool().get_id(handle);
}

template <int dim>
void Body<dim>::rebuild_slices()
{
  std::vector<CellId> occupied;
  for (const CellId cell : cell_of_point)
    if (count_in_cell[cell]++ == 0)
      occupied.push_back(cell);
  std::sort(occupied.begin(), occupied.end());

  cell_slices.clear();
  std::uint32_t begin = 0;
  for (const CellId cell : occupied) {
    const std::uint32_t end = begin + count_in_cell[cell];
    cell_slices.push_back({cell, begin, end});
    count_in_cell[cell] = begin;
    begin = end;
  }
  handles_by_cell.resize(cell_of_point.size());
  for (std::uint32_t handle = 0; handle < cell_of_point.size(); ++handle)
    handles_by_cell[count_in_cell[cell_of_point[handle]]++] = handle;
  for (const CellId cell : occupied)
    count_in_cell[cell] = 0;
}

template <int dim>
void Body<dim>::note_movers()
{
  for (std::uint32_t handle = 0; handle < cell_of_point.size(); ++handle)
    for (unsigned int d = 0; d < dim; ++d) {
      const double x = position(handle)[d] - grid.lower(cell_of_point[handle], d);
      if (x < 0. || x > grid.size(cell_of_point[handle], d)) {
        moved_points.push_back(handle);
        break;
      }
    }
}

template <int dim>
typename Body<dim>::Relocation Body<dim>::relocate(const double time)
{
  Relocation result;
  if (moved_points.empty())
    return result;
  const auto complain = [&](const std::uint32_t handle, const std::string &what) {
    std::ostringstream message;
    message << "point " << id(handle) << " of body '" << name() << "' " << what << " at (" << position(handle)
            << "), t = " << time << " s";
    throw NumericalError(message.str());
  };
  for (const std::uint32_t handle : moved_points) {
    const dealii::Point<dim> &x = position(handle);
    if (!grid.contains(x))
      complain(handle, "leaves the mesh");
    auto lattice = grid.lattice(cell_of_point[handle]);
    for (unsigned int d = 0; d < dim; ++d) {
      const auto &planes = grid.planes(d);
      if (x[d] < planes[lattice[d]])
        --lattice[d];
      else if (x[d] > planes[lattice[d] + 1])
        ++lattice[d];
      if (x[d] < planes[lattice[d]] || x[d] > planes[lattice[d] + 1])
        complain(handle, "moves further than one cell in one step; the step is too large");
    }
    const CellId cell = grid.cell_at(lattice);
    result.leaves_rank = result.leaves_rank || !grid.is_owned(cell);
    cell_of_point[handle] = cell;
  }
  moved_points.clear();

  rebuild_slices();
  result.cells_changed = cells_changed();
  return result;
}

template <int dim>
bool Body<dim>::cells_changed() const
{
  return accepted_cells.size() != cell_slices.size() ||
         !std::equal(cell_slices.begin(), cell_slices.end(), accepted_cells.begin(),
                     [](const Slice &slice, const CellId cell) { return slice.cell == cell; });
}

template <int dim>
void Body<dim>::accept_cells()
{
  accepted_cells.clear();
  for (const Slice &slice : cell_slices)
    accepted_cells.push_back(slice.cell);
}

template <int dim>
void Body<dim>::synchronise(const double time)
{
  particles.sort_particles_into_subdomains_and_cells();
  attach_storage();
  if (particles.n_global_particles() != initial_number) {
    std::ostringstream message;
    message << "body '" << name() << "' lost " << initial_number - particles.n_global_particles()
            << " of its points when they were handed to other ranks, t = " << time << " s";
    throw NumericalError(message.str());
  }
}

template <int dim>
void Body<dim>::persist(Archive &archive)
{
  archive.begin("body " + name());
  std::uint64_t n = n_local_points();
  archive(initial_number, n);
  // Where the particle handler has a point is where the last synchronise() put it, and decides how the next
  // one orders the storage.
  const auto one_point = [&](CellId handler_cell, dealii::types::particle_index id, CellId cell,
                             dealii::Point<dim> x, double *row, const auto &take) {
    archive(handler_cell, id, cell, x);
    archive.bytes(row, columns.n_columns * sizeof(double));
    take(handler_cell, id, cell, x);
  };
  if (!archive.is_loading()) {
    for (const auto &particle : particles) {
      const std::uint32_t handle = particle.get_local_index();
      one_point(particle.get_surrounding_cell()->active_cell_index(), id(handle), cell_of_point[handle],
                position(handle), row(handle), [](auto &&...) {});
    }
    return;
  }
  std::vector<typename dealii::Triangulation<dim>::active_cell_iterator> iterators(grid.n_local_cells());
  for (const auto &cell : grid.triangulation().active_cell_iterators())
    iterators[cell->active_cell_index()] = cell;
  particles.clear_particles();
  particles.get_property_pool().reserve(n);
  std::vector<CellId> cells(n);
  std::vector<double> row(columns.n_columns);
  for (std::uint64_t p = 0; p < n; ++p)
    one_point(0, 0, 0, {}, row.data(),
              [&](const CellId handler_cell, const auto id, const CellId cell, const auto &x) {
                const auto &place = iterators[handler_cell];
                particles.insert_particle(x, grid.mapping().transform_real_to_unit_cell(place, x), id, place,
                                          row);
                cells[p] = cell;
              });
  particles.update_cached_numbers();
  moved_points.clear();
  attach_storage();
  cell_of_point.swap(cells);
  rebuild_slices();
}

template struct BodyParameters<2>;
template struct BodyParameters<3>;
template class Body<2>;
template class Body<3>;
} // namespace peat
