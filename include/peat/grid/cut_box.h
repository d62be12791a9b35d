#pragma once

#include <peat/grid/shape.h>

#include <deal.II/base/point.h>
#include <deal.II/base/tensor.h>

#include <array>

namespace peat {
/// The part of an axis-parallel box that is inside a shape.
///
/// The outward area vector of the shape's surface follows from the faces by the divergence theorem, so that
/// it is as accurate as they are, and sums of it over adjacent boxes cancel. What of the surface coincides
/// with a face of the box does not belong to `interface`; there, the area of the face as seen from the two
/// boxes that share it differs.
template <int dim>
struct CutBox
{
  /// Of the part inside [m^dim].
  double volume = 0.;

  /// Of the part inside; a point inside the shape even where the true centroid is not. The center of an empty
  /// box.
  dealii::Point<dim> centroid;

  /// Inside part of each face in the order x-, x+, y-, y+, ... [m^(dim-1)]. Where the surface coincides with
  /// the face, it counts as inside if the shape is on this box's side.
  std::array<double, 2 * dim> face_area{};

  /// Outward area vector of the surface within the box [m^(dim-1)].
  dealii::Tensor<1, dim> interface;

  /// A point on that surface: its centroid, seen along `interface`, moved onto the surface where that is
  /// curved. Meaningful where `interface` is not zero.
  dealii::Point<dim> interface_centroid;
};

/// Cuts the box between two corners with a shape. Exact up to round-off for boxes and what is made of them
/// without rotation, and for single planes; otherwise volumes are accurate to about 1e-5 (2-D) or 1e-4 (3-D)
/// of the box. Where only the sign of distance() is reliable the shape is sampled: what is smaller than an
/// eighth (in 3-D a quarter) of the box may be overlooked, and volumes are accurate to 1e-3.
///
/// Parts below 1e-10 of the box count as nothing, and above 1 - 1e-10 as all of it.
template <int dim>
CutBox<dim> cut(const Shape<dim> &shape, const dealii::Point<dim> &lower, const dealii::Point<dim> &upper);
} // namespace peat
