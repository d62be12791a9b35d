#pragma once

#include <peat/grid/cut_box.h>
#include <peat/grid/grid.h>
#include <peat/grid/shape.h>

#include <map>
#include <vector>

namespace peat {
/// What a point stands for at the start: what the shape fills of a box.
template <int dim>
struct PointBox
{
  CutBox<dim> part;
  dealii::Tensor<1, dim> edges; ///< of the whole box [m]

  /// Half the mean edge lengths of what is left of the box [m].
  dealii::Tensor<1, dim> half_extents() const;
};

/// What the shape fills of n^dim equal boxes of a cell.
template <int dim>
std::vector<PointBox<dim>> even_boxes(const Shape<dim> &shape, const Grid<dim> &grid, CellId cell,
                                      unsigned int n);

/// Gauss points of a cell that the shape fills; elsewhere what it fills of as many boxes and some more.
template <int dim>
std::vector<PointBox<dim>> gauss_boxes(const Shape<dim> &shape, const Grid<dim> &grid, CellId cell,
                                       unsigned int n);

/// What the shape fills of equal boxes that divide its bounds, about n to a cell and direction: by the owned
/// cell that the centroid of what is filled lies in. The bounds must be finite, the cells there of one size.
template <int dim>
std::map<CellId, std::vector<PointBox<dim>>> lattice_boxes(const Shape<dim> &shape, const Grid<dim> &grid,
                                                           unsigned int n);

/// Whether all cells that the bounds meet have the same edges, up to round-off.
template <int dim>
bool is_uniform(const Grid<dim> &grid, const Bounds<dim> &bounds);
} // namespace peat
