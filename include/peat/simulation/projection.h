#pragma once

#include <peat/grid/active_nodes.h>
#include <peat/simulation/fields.h>

#include <array>
#include <vector>

namespace peat {
/// The value of a field at a place from means over the cells around it: a linear function is fitted by least
/// squares. Exact for linear fields wherever two layers of cells hold material, also on the edge of a body;
/// where there is one layer only, or little more, it is constant across it.
///
/// Distances d are taken from the place in units of the cell size, per direction.
template <int dim>
struct LinearFit
{
  static constexpr unsigned int n_moments = 1 + dim + dim * (dim + 1) / 2;

  /// Means further away than this have no weight.
  static constexpr double reach = 2.;
  /// A product of hat functions; to be multiplied with the volume.
  static double weight(const dealii::Tensor<1, dim> &d);

  /// Add sum w, sum w d, sum w d d to the moments of places.
  static void add(double w, const dealii::Tensor<1, dim> &d, double *moments);

  /// c such that c[0] sum w f + c[1 + k] sum w d_k f is the value at the place; zeros if all weights are
  /// zero.
  static std::array<double, 1 + dim> coefficients(const double *moments);
};

/// Fields on the active nodes from means over cells, by linear fits through the cells around each node:
/// second-order accurate also at the edges of bodies, and the same for any number of ranks.
template <int dim>
class NodalProjection
{
public:
  /// Collective. Cells that were not occupied when the nodes were numbered are left out.
  NodalProjection(const ActiveNodes<dim> &nodes, const CellMeans<dim> &means);

  /// NaN at nodes around which no cell has a mean.
  double value(const unsigned int node, const unsigned int field) const
  {
    return values[std::size_t(node) * n_fields + field];
  }

private:
  void gather_ghosts(const CellMeans<dim> &means);
  void find_inner_nodes();
  template <typename Visit>
  void for_each_pair(const Visit &visit) const;

  const ActiveNodes<dim> &nodes;
  const Grid<dim> &grid;
  const unsigned int n_fields;
  /// Of this rank's cells first, then of its ghost cells.
  std::vector<CellId> cell;
  std::vector<double> volume;
  std::vector<dealii::Point<dim>> centroid;
  std::vector<double> mean;
  std::size_t n_owned;
  std::vector<std::uint32_t> entry_of_cell;
  /// Whether the cells next to a node are about full, so that they suffice for a fit.
  std::vector<char> is_inner;
  std::vector<double> values;
};

/// Active index of the corner v of an occupied cell (deal.II's order of vertices).
template <int dim>
inline std::uint32_t corner_node(const ActiveNodes<dim> &nodes, const CellId cell, const unsigned int v)
{
  const unsigned int reach = nodes.nodes_per_direction();
  unsigned int local = 0;
  for (int d = dim - 1; d >= 0; --d)
    local = local * reach + ((v >> d) & 1) + (reach == 4 ? 1 : 0);
  return nodes.cell_nodes(cell)[local];
}
} // namespace peat
