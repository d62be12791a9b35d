#pragma once

#include <peat/grid/grid.h>

#include <vector>

namespace peat {
/// The nodes that carry material, numbered without gaps, and the sums over ranks on them.
///
/// Everything a step does on nodes runs over these and no others, so that empty background costs nothing. The
/// set is remade only when the set of cells that hold points changes.
template <int dim>
class ActiveNodes
{
public:
  /// @param nodes_per_direction nodes that a point in a cell may reach in each direction: 2 (the cell's own)
  /// or
  ///        4 (those of its neighbours too)
  ActiveNodes(const Grid<dim> &grid, unsigned int nodes_per_direction);

  /// Number the nodes that points in these owned cells reach, and `more_nodes` of this rank's part of the
  /// mesh. Collective: all ranks call it together.
  void rebuild(const std::vector<CellId> &occupied_cells, const std::vector<NodeId> &more_nodes = {});

  unsigned int size() const { return node.size(); }
  unsigned int nodes_per_direction() const { return reach; }
  unsigned int nodes_per_cell() const { return n_cell_nodes; }

  /// The nodes that points of an occupied cell reach, x running fastest. Those outside the mesh stand as the
  /// nearest one inside; their weight is zero.
  const std::uint32_t *cell_nodes(const CellId cell) const
  {
    return &table[std::size_t(slot[cell]) * n_cell_nodes];
  }
  /// Whether points of this cell can be handled, i.e. the cell was occupied at the last rebuild.
  bool is_occupied(const CellId cell) const { return slot[cell] != no_index; }
  /// Place of an occupied cell in occupied_cells().
  std::uint32_t occupied_index(const CellId cell) const { return slot[cell]; }
  const std::vector<CellId> &occupied_cells() const { return cells; }

  const dealii::Point<dim> &position(const unsigned int i) const { return positions[i]; }
  const Grid<dim> &grid() const { return background; }
  NodeId grid_node(const unsigned int i) const { return node[i]; }
  /// Number of a node of the mesh, or no_index if it is not active.
  std::uint32_t index_of(const NodeId grid_node) const { return active_index[grid_node]; }
  /// Nodes of the mesh that other ranks know, too.
  std::vector<NodeId> exchanged_nodes() const;
  /// Position in cell_nodes() of the cell's own nodes, in deal.II's order of vertices.
  unsigned int own_node(unsigned int vertex) const;

  /// Number of a node before the last rebuild, or no_index if it was not active.
  std::uint32_t previous_index(const unsigned int i) const { return old_index[node[i]]; }
  /// Each node is counted by one rank in sums over nodes.
  bool is_owned(const unsigned int i) const { return owned[i]; }
  /// Active nodes on a face of the mesh (0 left, 1 right, ...).
  const std::vector<std::uint32_t> &on_boundary(const unsigned int boundary) const
  {
    return boundary_nodes[boundary];
  }

  /// Replace, at each node, n_components values starting at data[i * n_components] by their sums over the
  /// ranks.
  void sum_over_ranks(double *data, unsigned int n_components) const;
  /// The same with the largest of the ranks' values.
  void max_over_ranks(double *data, unsigned int n_components) const;

  /// Counts the rebuilds, so that others know when what they derived is stale.
  unsigned int generation() const { return n_rebuilds; }

private:
  void number_nodes(const std::vector<CellId> &occupied_cells, const std::vector<NodeId> &more_nodes);
  void make_exchange();
  template <typename Combine>
  void combine_over_ranks(double *data, unsigned int n_components, const Combine &combine) const;
  unsigned int add(NodeId grid_node);

  const Grid<dim> &background;
  const unsigned int reach;
  const unsigned int n_cell_nodes;
  unsigned int n_rebuilds = 0;

  std::vector<CellId> cells;
  std::vector<std::uint32_t> slot;
  std::vector<std::uint32_t> table;
  std::vector<NodeId> node;
  std::vector<std::uint32_t> active_index; ///< by NodeId
  std::vector<std::uint32_t> old_index;    ///< by NodeId
  std::vector<NodeId> old_nodes;
  std::vector<dealii::Point<dim>> positions;
  std::vector<char> owned;
  std::array<std::vector<std::uint32_t>, 2 * dim> boundary_nodes;

  /// Nodes shared with one other rank: what I send to the owner, or, as owner, what I receive.
  struct Share
  {
    unsigned int rank;
    std::vector<std::uint32_t> nodes;
  };
  std::vector<Share> to_owners;
  std::vector<Share> from_others;
  mutable std::vector<std::vector<double>> buffers;
};

/// These nodes and those next to them along the lines of the mesh, as far as this rank knows them, ascending.
template <int dim>
std::vector<NodeId> with_neighbours(const Grid<dim> &grid, const std::vector<NodeId> &nodes);
} // namespace peat
