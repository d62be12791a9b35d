#pragma once

#include <peat/grid/shape.h>

#include <deal.II/base/point.h>
#include <deal.II/base/tensor.h>

namespace peat {
/// Integrals over a shape.
template <int dim>
struct ShapeMoments
{
  double volume = 0.; ///< [m^dim]
  dealii::Point<dim> centroid;
  /// Integral of (x - centroid) (x - centroid)^T [m^(dim + 2)].
  dealii::Tensor<2, dim> second;
};

/// The shape must be bounded. Exact up to round-off where the surface is a mesh, to 1e-9 for axis-parallel
/// boxes, else to about 1e-6 of the largest moment where distance() is a distance.
template <int dim>
ShapeMoments<dim> moments(const Shape<dim> &shape);
} // namespace peat
