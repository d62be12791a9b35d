#pragma once

#include <peat/base/lanes.h>
#include <peat/grid/grid.h>

#include <array>

namespace peat {
/// The bases: how many nodes per direction a point can reach from its cell.
enum class Basis {
  q1 = 2,  ///< FE_Q(1): the cell's own nodes
  gimp = 4 ///< FE_Q(1) averaged over the point's domain (Bardenhagen & Kober 2004): the neighbour cells'
           ///< nodes too
};

/// Shape functions of eight points of one cell in one direction: value and slope at each reachable node.
template <unsigned int reach>
struct DirectionWeights
{
  std::array<Lanes, reach> value;
  std::array<Lanes, reach> slope;
};

/// Shape functions of eight points as a tensor product.
template <int dim, unsigned int reach>
using Weights = std::array<DirectionWeights<reach>, dim>;

/// Where a cell and its neighbours lie in one direction.
struct CellInterval
{
  double lower;
  double size;
  double size_below; ///< of the neighbour cell; 0 at the mesh's edge
  double size_above;

  template <int dim>
  static CellInterval of(const Grid<dim> &grid, const CellId cell, const unsigned int d)
  {
    const auto &planes = grid.planes(d);
    const int i = grid.lattice(cell)[d], last = grid.n_cells(d) - 1;
    return {planes[i], planes[i + 1] - planes[i], i > 0 ? planes[i] - planes[i - 1] : 0.,
            i < last ? planes[i + 2] - planes[i + 1] : 0.};
  }
};

/// FE_Q(1): N = (1 - xi, xi).
inline void evaluate_direction(const Lanes x, const Lanes /*half_extent*/, const CellInterval &cell,
                               DirectionWeights<2> &w)
{
  const double inverse = 1. / cell.size;
  w.value[1] = (x - cell.lower) * inverse;
  w.value[0] = 1. - w.value[1];
  w.slope[1] = broadcast(inverse);
  w.slope[0] = broadcast(-inverse);
}

/// FE_Q(2) with its nodes at 0, 1/2 and 1: of finite elements; for points its values are not all positive.
inline void evaluate_direction(const Lanes x, const Lanes /*half_extent*/, const CellInterval &cell,
                               DirectionWeights<3> &w)
{
  const double inverse = 1. / cell.size;
  const Lanes xi = (x - cell.lower) * inverse;
  w.value[0] = (1. - xi) * (1. - 2. * xi);
  w.value[1] = 4. * xi * (1. - xi);
  w.value[2] = xi * (2. * xi - 1.);
  w.slope[0] = (4. * xi - 3.) * inverse;
  w.slope[1] = (4. - 8. * xi) * inverse;
  w.slope[2] = (4. * xi - 1.) * inverse;
}

/// GIMP on FE_Q(1): the point's domain [x - l, x + l] is cut by the cell faces; each part acts as one Q1
/// point of its cell, placed at the part's middle. What sticks out of the mesh is cut off.
inline void evaluate_direction(const Lanes x, const Lanes half_extent, const CellInterval &cell,
                               DirectionWeights<4> &w)
{
  const double plane[4] = {cell.lower - cell.size_below, cell.lower, cell.lower + cell.size,
                           cell.lower + cell.size + cell.size_above};
  const double size[3] = {cell.size_below, cell.size, cell.size_above};
  const Lanes lower = max(x - half_extent, broadcast(plane[0]));
  const Lanes upper = min(x + half_extent, broadcast(plane[3]));
  const Lanes inverse_length = 1. / (upper - lower);
  for (unsigned int k = 0; k < 4; ++k)
    w.value[k] = w.slope[k] = broadcast(0.);
  for (unsigned int c = 0; c < 3; ++c) {
    if (size[c] == 0.)
      continue;
    const double inverse = 1. / size[c];
    const Lanes from = max(lower, broadcast(plane[c]));
    const Lanes to = max(from, min(upper, broadcast(plane[c + 1])));
    const Lanes share = (to - from) * inverse_length;
    // In this form a part of a few units of round-off has values that belong to its slopes: the mass and the
    // force that a node gets from it are those of one and the same sliver.
    const Lanes xi = ((from - plane[c]) + 0.5 * (to - from)) * inverse;
    w.value[c] += share * (1. - xi);
    w.value[c + 1] += share * xi;
    w.slope[c] -= share * inverse;
    w.slope[c + 1] += share * inverse;
  }
}

/// Sum over nodes of a nodal field (x running fastest) times a product of one weight per direction.
template <int dim, unsigned int reach>
inline Lanes contract(const double *nodal, const std::array<const std::array<Lanes, reach> *, dim> &w)
{
  Lanes result = broadcast(0.);
  for (unsigned int z = 0; z < (dim == 3 ? reach : 1); ++z) {
    Lanes plane = broadcast(0.);
    for (unsigned int y = 0; y < reach; ++y) {
      const double *line = nodal + (z * reach + y) * reach;
      Lanes along_x = (*w[0])[0] * line[0];
      for (unsigned int x = 1; x < reach; ++x)
        along_x += (*w[0])[x] * line[x];
      plane += (*w[1])[y] * along_x;
    }
    result += dim == 3 ? (*w[dim - 1])[z] * plane : plane;
  }
  return result;
}

template <int dim, unsigned int reach>
inline Lanes interpolate(const double *nodal, const Weights<dim, reach> &w)
{
  std::array<const std::array<Lanes, reach> *, dim> factors;
  for (unsigned int d = 0; d < dim; ++d)
    factors[d] = &w[d].value;
  return contract<dim, reach>(nodal, factors);
}

/// d/dx_direction of the interpolated field.
template <int dim, unsigned int reach>
inline Lanes derivative(const double *nodal, const Weights<dim, reach> &w, const unsigned int direction)
{
  std::array<const std::array<Lanes, reach> *, dim> factors;
  for (unsigned int d = 0; d < dim; ++d)
    factors[d] = d == direction ? &w[d].slope : &w[d].value;
  return contract<dim, reach>(nodal, factors);
}

/// Value and gradient together, sharing the partial sums.
template <int dim, unsigned int reach>
inline void interpolate(const double *nodal, const Weights<dim, reach> &w, Lanes &value, Lanes *gradient)
{
  Lanes v = broadcast(0.), gx = v, gy = v, gz = v;
  for (unsigned int z = 0; z < (dim == 3 ? reach : 1); ++z) {
    Lanes plane = broadcast(0.), plane_x = plane, plane_y = plane;
    for (unsigned int y = 0; y < reach; ++y) {
      const double *line = nodal + (z * reach + y) * reach;
      Lanes along = w[0].value[0] * line[0];
      Lanes slope = w[0].slope[0] * line[0];
      for (unsigned int x = 1; x < reach; ++x) {
        along += w[0].value[x] * line[x];
        slope += w[0].slope[x] * line[x];
      }
      plane += w[1].value[y] * along;
      plane_y += w[1].slope[y] * along;
      plane_x += w[1].value[y] * slope;
    }
    if (dim == 3) {
      v += w[dim - 1].value[z] * plane;
      gz += w[dim - 1].slope[z] * plane;
      gy += w[dim - 1].value[z] * plane_y;
      gx += w[dim - 1].value[z] * plane_x;
    } else {
      v = plane;
      gx = plane_x;
      gy = plane_y;
    }
  }
  value = v;
  gradient[0] = gx;
  gradient[1] = gy;
  if (dim == 3)
    gradient[dim - 1] = gz;
}
} // namespace peat
