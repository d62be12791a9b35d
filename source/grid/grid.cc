#include <peat/grid/grid.h>

#include <deal.II/dofs/dof_tools.h>
#include <deal.II/grid/grid_generator.h>

#include <cmath>

namespace peat {
template <int dim>
const std::vector<std::string> &boundary_names()
{
  static const std::vector<std::string> names =
      dim == 2 ? std::vector<std::string>{"left", "right", "bottom", "top"}
               : std::vector<std::string>{"left", "right", "front", "back", "bottom", "top"};
  return names;
}

template <int dim>
GridParameters<dim>::GridParameters(Section section)
{
  std::vector<double> lower_corner(dim, 0.), upper_corner(dim, 1.), cells(dim, 10.), ratio(dim, 1.);
  section.add("Lower corner", lower_corner, dim, any("m"),
              "Corner of the background mesh with the smallest coordinates.");
  section.add("Upper corner", upper_corner, dim, any("m"), "Corner with the largest coordinates.");
  section.add("Cells", cells, dim, between(1, 1e5), "Number of cells in each direction.");
  section.add("Grading", ratio, dim, between(1e-3, 1e3),
              "Size of the last cell over size of the first in each direction; the sizes form a geometric "
              "progression.");
  for (unsigned int d = 0; d < dim; ++d) {
    if (!(upper_corner[d] > lower_corner[d]))
      section.fail("Upper corner",
                   "each coordinate of 'Upper corner' must be larger than that of 'Lower corner'");
    // Coordinates have 16 digits; places within a cell need some of them.
    const double farthest = std::max(std::abs(lower_corner[d]), std::abs(upper_corner[d]));
    if (upper_corner[d] - lower_corner[d] < 1e-10 * cells[d] * farthest)
      section.fail("Upper corner",
                   "the cells are lost in round-off so far from the origin; move the origin nearer");
    if (std::abs(cells[d] - std::round(cells[d])) > 1e-9 * cells[d])
      section.fail("Cells", "'Cells' must be whole numbers, got " + std::to_string(cells[d]));
    lower[d] = lower_corner[d];
    upper[d] = upper_corner[d];
    n_cells[d] = static_cast<unsigned int>(std::lround(cells[d]));
    grading[d] = ratio[d];
  }
  double total = 1.;
  for (const unsigned int n : n_cells)
    total *= n;
  if (total > 1e9)
    section.fail("Cells", "more than 1e9 cells; this version numbers cells and nodes with 32 bits");
}

template <int dim>
Grid<dim>::Grid(const GridParameters<dim> &parameters, MPI_Comm communicator)
    : mpi_communicator(communicator),
      tria(communicator, dealii::Triangulation<dim>::none,
           dealii::parallel::distributed::Triangulation<dim>::no_automatic_repartitioning),
      element(1), node_handler(tria), this_rank(dealii::Utilities::MPI::this_mpi_process(communicator))
{
  for (unsigned int d = 0; d < dim; ++d) {
    const unsigned int n = parameters.n_cells[d];
    const double length = parameters.upper[d] - parameters.lower[d];
    const double q = n > 1 ? std::pow(parameters.grading[d], 1. / (n - 1)) : 1.;
    for (unsigned int i = 0; i <= n; ++i) {
      const double fraction = std::abs(q - 1.) < 1e-14
                                  ? double(i) / n
                                  : (std::pow(q, double(i)) - 1.) / (std::pow(q, double(n)) - 1.);
      lattice_planes[d].push_back(i == n ? parameters.upper[d] : parameters.lower[d] + fraction * length);
    }
  }
  make_triangulation(parameters);
  node_handler.distribute_dofs(element);
  dealii::DoFTools::extract_locally_relevant_dofs(node_handler, relevant_nodes);
  make_tables();
}

template <int dim>
void Grid<dim>::make_triangulation(const GridParameters<dim> &parameters)
{
  // As few coarse cells as the cell counts allow: each is a tree of p4est, which costs memory on every rank.
  bool uniform = true;
  unsigned int levels = 30;
  for (unsigned int d = 0; d < dim; ++d) {
    uniform = uniform && std::abs(parameters.grading[d] - 1.) < 1e-14;
    unsigned int twos = 0;
    for (unsigned int n = parameters.n_cells[d]; n % 2 == 0; n /= 2)
      ++twos;
    levels = std::min(levels, twos);
  }
  if (!uniform)
    levels = 0;

  if (uniform) {
    std::vector<unsigned int> repetitions(dim);
    for (unsigned int d = 0; d < dim; ++d)
      repetitions[d] = parameters.n_cells[d] >> levels;
    dealii::GridGenerator::subdivided_hyper_rectangle(tria, repetitions, parameters.lower, parameters.upper,
                                                      true);
    tria.refine_global(levels);
  } else {
    std::vector<std::vector<double>> steps(dim);
    for (unsigned int d = 0; d < dim; ++d)
      for (unsigned int i = 0; i < parameters.n_cells[d]; ++i)
        steps[d].push_back(lattice_planes[d][i + 1] - lattice_planes[d][i]);
    dealii::GridGenerator::subdivided_hyper_rectangle(tria, steps, parameters.lower, parameters.upper, true);
  }
}

namespace {
template <int dim>
std::size_t flatten(const std::array<int, dim> &lattice, const std::array<int, dim> &extent)
{
  std::size_t index = lattice[dim - 1];
  for (int d = dim - 2; d >= 0; --d)
    index = index * extent[d] + lattice[d];
  return index;
}

template <int dim>
bool inside(const std::array<int, dim> &lattice, const std::array<int, dim> &extent)
{
  for (unsigned int d = 0; d < dim; ++d)
    if (lattice[d] < 0 || lattice[d] >= extent[d])
      return false;
  return true;
}

/// Number of cells (extra = 0) or nodes (extra = 1) in each direction.
template <int dim>
std::array<int, dim> extents(const Grid<dim> &grid, const int extra)
{
  std::array<int, dim> extent;
  for (unsigned int d = 0; d < dim; ++d)
    extent[d] = grid.n_cells(d) + extra;
  return extent;
}
} // namespace

template <int dim>
void Grid<dim>::make_tables()
{
  const auto cell_extent = extents(*this, 0);
  const auto node_extent = extents(*this, 1);
  std::size_t n_all_cells = 1, n_all_nodes = 1;
  for (unsigned int d = 0; d < dim; ++d) {
    n_all_cells *= cell_extent[d];
    n_all_nodes *= node_extent[d];
  }
  cell_lattice.resize(tria.n_active_cells());
  cell_owners.assign(tria.n_active_cells(), dealii::numbers::artificial_subdomain_id);
  cell_of_lattice.assign(n_all_cells, no_index);
  node_of_lattice.assign(n_all_nodes, no_index);
  lattice_of_node.assign(relevant_nodes.n_elements(), 0);

  std::vector<dealii::types::global_dof_index> dofs(element.dofs_per_cell);
  for (const auto &cell : node_handler.active_cell_iterators()) {
    if (cell->is_artificial())
      continue;
    const CellId id = cell->active_cell_index();
    cell_lattice[id] = locate(cell->center());
    cell_owners[id] = cell->subdomain_id();
    cell_of_lattice[flatten<dim>(cell_lattice[id], cell_extent)] = id;
    cell->get_dof_indices(dofs);
    for (unsigned int v = 0; v < dofs.size(); ++v) {
      Lattice corner = cell_lattice[id];
      for (unsigned int d = 0; d < dim; ++d)
        corner[d] += (v >> d) & 1;
      const NodeId node = relevant_nodes.index_within_set(dofs[v]);
      const std::size_t flat = flatten<dim>(corner, node_extent);
      node_of_lattice[flat] = node;
      lattice_of_node[node] = flat;
    }
  }

  const std::vector<unsigned int> owners = dealii::Utilities::MPI::compute_index_owner(
      node_handler.locally_owned_dofs(), relevant_nodes, mpi_communicator);
  node_owner.assign(owners.begin(), owners.end());
}

template <int dim>
double Grid<dim>::smallest_cell_size() const
{
  double smallest = std::numeric_limits<double>::max();
  for (const auto &planes : lattice_planes)
    for (std::size_t i = 1; i < planes.size(); ++i)
      smallest = std::min(smallest, planes[i] - planes[i - 1]);
  return smallest;
}

template <int dim>
double Grid<dim>::volume(const CellId cell) const
{
  double product = 1.;
  for (unsigned int d = 0; d < dim; ++d)
    product *= size(cell, d);
  return product;
}

template <int dim>
CellId Grid<dim>::cell_at(const Lattice &lattice) const
{
  const auto extent = extents(*this, 0);
  return inside<dim>(lattice, extent) ? cell_of_lattice[flatten<dim>(lattice, extent)] : no_index;
}

template <int dim>
NodeId Grid<dim>::node_at(const Lattice &lattice) const
{
  const auto extent = extents(*this, 1);
  return inside<dim>(lattice, extent) ? node_of_lattice[flatten<dim>(lattice, extent)] : no_index;
}

template <int dim>
typename Grid<dim>::Lattice Grid<dim>::node_lattice(const NodeId node) const
{
  const auto extent = extents(*this, 1);
  std::size_t flat = lattice_of_node[node];
  Lattice result;
  for (unsigned int d = 0; d < dim; ++d) {
    result[d] = flat % extent[d];
    flat /= extent[d];
  }
  return result;
}

template <int dim>
dealii::Point<dim> Grid<dim>::node_position(const NodeId node) const
{
  const Lattice lattice = node_lattice(node);
  dealii::Point<dim> x;
  for (unsigned int d = 0; d < dim; ++d)
    x[d] = lattice_planes[d][lattice[d]];
  return x;
}

template <int dim>
typename Grid<dim>::Lattice Grid<dim>::locate(const dealii::Point<dim> &x) const
{
  Lattice result;
  for (unsigned int d = 0; d < dim; ++d) {
    const auto &planes = lattice_planes[d];
    const int i = std::upper_bound(planes.begin(), planes.end(), x[d]) - planes.begin() - 1;
    result[d] = std::max(0, std::min(i, n_cells(d) - 1));
  }
  return result;
}

template <int dim>
bool Grid<dim>::contains(const dealii::Point<dim> &x) const
{
  for (unsigned int d = 0; d < dim; ++d)
    if (!(x[d] >= lattice_planes[d].front() && x[d] <= lattice_planes[d].back()))
      return false;
  return true;
}

template const std::vector<std::string> &boundary_names<2>();
template const std::vector<std::string> &boundary_names<3>();
template struct GridParameters<2>;
template struct GridParameters<3>;
template class Grid<2>;
template class Grid<3>;
} // namespace peat
