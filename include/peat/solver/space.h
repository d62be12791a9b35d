#pragma once

#include <peat/grid/grid.h>

#include <deal.II/base/index_set.h>
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/hp/fe_collection.h>
#include <deal.II/lac/trilinos_vector.h>

#include <array>
#include <vector>

namespace peat {
/// Nodes that a point reaches in each direction: the displacement's shape functions of the implicit solvers.
enum class Nodes : unsigned int {
  q1 = 2,  ///< FE_Q(1)
  q2 = 3,  ///< FE_Q(2)
  gimp = 4 ///< FE_Q(1) averaged over the points' domains, see Basis
};

/// The unknowns of the u-p equations on the cells that bodies fill: displacements (dim components a node)
/// and, in cells of saturated material, pore pressures of FE_Q(1). Numbered by deal.II's DoFHandler; cells
/// without material have FE_Nothing and no unknowns.
///
/// Unknowns are numbered in two blocks: displacements first, pressures after them. Nodes of a cell run with x
/// fastest, the components of a node are neighbours.
template <int dim>
class Space
{
public:
  using Index = dealii::types::global_dof_index;

  Space(const Grid<dim> &grid, Nodes displacement);

  /// Number the unknowns. `solid` and `saturated` are cells of this rank that hold points of any body and of
  /// a saturated one. Collective.
  void distribute(const std::vector<CellId> &solid, const std::vector<CellId> &saturated);

  Nodes nodes() const { return kind; }
  unsigned int reach() const { return static_cast<unsigned int>(kind); }
  /// Displacement nodes of a cell.
  unsigned int n_cell_nodes() const { return n_nodes; }
  static constexpr unsigned int n_pressures = 1 << dim;
  bool has_pressure() const { return n_global[1] > 0; }

  /// `n_cell_nodes() * dim` unknowns of a cell that holds points, of this rank or (not with `gimp`) a ghost.
  const Index *displacements(const CellId cell) const
  {
    return &displacement_table[std::size_t(slot[cell]) * n_nodes * dim];
  }
  /// `n_pressures` unknowns; only of a cell for which is_saturated().
  const Index *pressures(const CellId cell) const
  {
    return &pressure_table[std::size_t(pressure_slot[cell]) * n_pressures];
  }
  bool is_solid(const CellId cell) const { return slot[cell] != no_index; }
  /// Also known of ghost cells.
  bool is_saturated(const CellId cell) const { return saturated_cell[cell]; }

  /// By block: unknowns of this rank, and those it knows of, counted from the start of the block.
  const std::vector<dealii::IndexSet> &owned() const { return owned_sets; }
  const std::vector<dealii::IndexSet> &relevant() const { return relevant_sets; }
  unsigned int n_blocks() const { return has_pressure() ? 2 : 1; }
  Index n_unknowns() const { return n_global[0] + n_global[1]; }
  Index first_pressure() const { return n_global[0]; }

  struct Node
  {
    dealii::Point<dim> position;
    std::array<Index, dim> displacement;
  };
  /// Displacement nodes whose unknowns this rank knows of.
  const std::vector<Node> &displacement_nodes() const { return node_list; }
  /// The displacement node at a vertex of the mesh; null where there is none.
  const Node *node_at(const NodeId vertex) const
  {
    return vertex_node[vertex] == no_index ? nullptr : &node_list[vertex_node[vertex]];
  }
  struct PressureNode
  {
    dealii::Point<dim> position;
    Index pressure;
  };
  const std::vector<PressureNode> &pressure_nodes() const { return pressure_node_list; }

  /// A displacement field (with ghosts) at a place in a cell that holds points, or on its edge; zero
  /// elsewhere.
  dealii::Tensor<1, dim> value(const dealii::TrilinosWrappers::MPI::Vector &displacement,
                               const dealii::Point<dim> &x) const;
  /// A cell that holds points and contains the place, or no_index.
  CellId solid_cell_at(const dealii::Point<dim> &x) const;

  /// The mesh's faces on which a place lies, as bits.
  unsigned int boundaries_at(const dealii::Point<dim> &x) const;
  const Grid<dim> &grid() const { return background; }

private:
  /// Whether a cell of this rank or its neighbours are marked, for bases that reach into neighbour cells.
  std::vector<char> dilate(const std::vector<char> &marked) const;
  std::vector<char> with_ghosts(const std::vector<CellId> &cells) const;
  void number(dealii::DoFHandler<dim> &handler, const dealii::hp::FECollection<dim> &elements,
              const std::vector<char> &active, unsigned int block);
  void make_displacement_tables(std::vector<CellId> solid, const std::vector<char> &solid_cell);
  void find_vertices();
  void make_patches(const std::vector<CellId> &solid);
  void make_pressure_tables(const std::vector<CellId> &saturated);

  const Grid<dim> &background;
  const Nodes kind;
  const unsigned int n_nodes;
  dealii::hp::FECollection<dim> displacement_elements, pressure_elements;
  dealii::DoFHandler<dim> displacement_handler, pressure_handler;
  std::vector<dealii::IndexSet> owned_sets, relevant_sets;
  std::array<Index, 2> n_global = {{0, 0}};

  std::vector<char> saturated_cell;
  std::vector<std::uint32_t> slot, pressure_slot;
  std::vector<Index> displacement_table, pressure_table;
  std::vector<Node> node_list;
  std::vector<std::uint32_t> vertex_node; ///< by NodeId
  std::vector<PressureNode> pressure_node_list;
};
} // namespace peat
