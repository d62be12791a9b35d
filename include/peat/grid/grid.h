#pragma once

#include <peat/base/parameters.h>

#include <deal.II/base/index_set.h>
#include <deal.II/base/mpi.h>
#include <deal.II/base/point.h>
#include <deal.II/distributed/tria.h>
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/mapping_cartesian.h>

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace peat {
/// The section `Grid`: a box of cells.
template <int dim>
struct GridParameters
{
  explicit GridParameters(Section section);

  dealii::Point<dim> lower;
  dealii::Point<dim> upper;
  std::array<unsigned int, dim> n_cells;
  /// Size of the last cell over size of the first, per direction; sizes in between form a geometric
  /// progression.
  std::array<double, dim> grading;
};

/// Names of the mesh's faces in the order of deal.II's boundary ids: left, right, (front, back,) bottom, top.
template <int dim>
const std::vector<std::string> &boundary_names();

/// Index of a cell among the cells this rank knows (deal.II's active_cell_index()).
using CellId = std::uint32_t;
/// Index of a node among the nodes this rank knows (position in locally_relevant_nodes()).
using NodeId = std::uint32_t;
constexpr std::uint32_t no_index = std::numeric_limits<std::uint32_t>::max();

/// The Eulerian background mesh: a box of axis-aligned cells in a deal.II triangulation that is distributed
/// over the ranks, with the numbering of FE_Q(1) for its nodes.
///
/// Cells and nodes also have lattice coordinates (i, j, k), so that the neighbourhood of a cell costs a table
/// look-up.
template <int dim>
class Grid
{
public:
  using Lattice = std::array<int, dim>;

  Grid(const GridParameters<dim> &parameters, MPI_Comm communicator);

  MPI_Comm communicator() const { return mpi_communicator; }
  const dealii::parallel::distributed::Triangulation<dim> &triangulation() const { return tria; }
  const dealii::Mapping<dim> &mapping() const { return cartesian_mapping; }
  /// FE_Q(1), one scalar unknown a node.
  const dealii::DoFHandler<dim> &nodes() const { return node_handler; }
  const dealii::IndexSet &locally_relevant_nodes() const { return relevant_nodes; }
  /// Rank that owns a node.
  unsigned int owner(const NodeId node) const { return node_owner[node]; }

  /// Coordinates of the lattice planes in one direction; cell i lies between plane i and plane i + 1.
  const std::vector<double> &planes(const unsigned int direction) const { return lattice_planes[direction]; }
  int n_cells(const unsigned int direction) const { return lattice_planes[direction].size() - 1; }
  double smallest_cell_size() const;

  /// Number of cells this rank has an index for (owned, ghost and others).
  unsigned int n_local_cells() const { return cell_lattice.size(); }
  const Lattice &lattice(const CellId cell) const { return cell_lattice[cell]; }
  bool is_owned(const CellId cell) const { return cell_owners[cell] == this_rank; }
  /// Rank that owns a cell.
  unsigned int cell_owner(const CellId cell) const { return cell_owners[cell]; }
  double lower(const CellId cell, const unsigned int d) const
  {
    return lattice_planes[d][cell_lattice[cell][d]];
  }
  double size(const CellId cell, const unsigned int d) const
  {
    return lattice_planes[d][cell_lattice[cell][d] + 1] - lattice_planes[d][cell_lattice[cell][d]];
  }
  double volume(const CellId cell) const;

  /// The cell at lattice coordinates, or no_index outside the mesh or beyond this rank's ghost layer.
  CellId cell_at(const Lattice &lattice) const;
  /// The node at lattice coordinates (0 ... n_cells), or no_index.
  NodeId node_at(const Lattice &lattice) const;
  /// Coordinates and lattice of a node.
  Lattice node_lattice(const NodeId node) const;
  dealii::Point<dim> node_position(const NodeId node) const;

  /// Lattice coordinates of the cell that contains x, each clamped to the mesh; ties go to the upper cell.
  Lattice locate(const dealii::Point<dim> &x) const;
  bool contains(const dealii::Point<dim> &x) const;

private:
  void make_triangulation(const GridParameters<dim> &parameters);
  void make_tables();

  MPI_Comm mpi_communicator;
  dealii::parallel::distributed::Triangulation<dim> tria;
  dealii::MappingCartesian<dim> cartesian_mapping;
  dealii::FE_Q<dim> element;
  dealii::DoFHandler<dim> node_handler;
  dealii::IndexSet relevant_nodes;

  std::array<std::vector<double>, dim> lattice_planes;
  std::vector<Lattice> cell_lattice;
  std::vector<unsigned int> cell_owners;
  const unsigned int this_rank;
  std::vector<CellId> cell_of_lattice;
  std::vector<NodeId> node_of_lattice;
  std::vector<std::uint32_t> lattice_of_node;
  std::vector<unsigned int> node_owner;
};
} // namespace peat
