#pragma once

#include <deal.II/base/point.h>

#include <array>
#include <vector>

namespace peat {
template <int dim>
class Shape;

/// Line segments (2-D) or triangles (3-D).
template <int dim>
struct SurfaceMesh
{
  using Facet = std::array<unsigned int, dim>;

  std::vector<dealii::Point<dim>> vertices;
  std::vector<Facet> facets; ///< numbers of vertices
};

/// The surface of a bounded shape, to look at: its own facets if it has some, else where the distance
/// vanishes on a grid that is 1/128 (3-D: 1/40) of the shape's longest side wide; edges are cut off to that
/// width, and the facets have no common sense of rotation.
template <int dim>
SurfaceMesh<dim> surface_mesh(const Shape<dim> &shape);
} // namespace peat
