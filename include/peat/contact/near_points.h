#pragma once

#include <peat/points/body.h>
#include <peat/transfer/weights.h>

#include <vector>

namespace peat {
/// The points of some bodies that reach chosen nodes, as contact sees them: each point is a box inside its
/// body whose surface is the body's where the point lies near it.
template <int dim>
class NearPoints
{
public:
  struct PointData
  {
    dealii::Point<dim> x;
    dealii::Tensor<1, dim> half_extent; ///< [m]
    double depth;  ///< below the body's surface at the start, see Layout::surface_depth; 0: far from it
    double volume; ///< [m^dim]

    /// How far the body reaches beyond the point in the direction of a unit vector [m].
    double reach(const dealii::Tensor<1, dim> &n) const
    {
      double reach = 0.;
      for (unsigned int d = 0; d < dim; ++d)
        reach += std::abs(n[d]) * half_extent[d];
      return depth * reach;
    }
  };
  struct Entry
  {
    std::uint32_t site;
    std::uint32_t point; ///< place in points()
    double N;
    dealii::Tensor<1, dim> dN; ///< [1/m]
  };

  /// Choose the nodes: site_of_node has a number for each active node, no_index for those that do not matter.
  void choose(const ActiveNodes<dim> &nodes, Basis basis, const std::vector<const Body<dim> *> &bodies,
              std::vector<std::uint32_t> site_of_node);
  /// Collect the points as they are now.
  void collect(const ActiveNodes<dim> &nodes);

  const std::vector<PointData> &points() const { return data; }
  /// In the order of points, which is that of cells.
  const std::vector<Entry> &entries() const { return list; }

  /// Points near the body's surface, by site, of all cells that the site's basis reaches: also those that are
  /// too far from the node to have a weight there.
  struct Neighbour
  {
    std::uint32_t site;
    std::uint32_t point; ///< place in points()
  };
  const std::vector<Neighbour> &neighbours() const { return around; }

private:
  struct Cell
  {
    const Body<dim> *body;
    CellId cell;
  };
  template <unsigned int reach>
  void collect(const ActiveNodes<dim> &nodes);

  Basis basis = Basis::q1;
  std::vector<std::uint32_t> sites;
  std::vector<Cell> cells;
  std::vector<PointData> data;
  std::vector<Entry> list;
  std::vector<Neighbour> around;
};
} // namespace peat
