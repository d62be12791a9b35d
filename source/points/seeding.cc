#include <peat/points/seeding.h>

#include <deal.II/base/quadrature_lib.h>

#include <algorithm>
#include <cmath>

namespace peat {
template <int dim>
dealii::Tensor<1, dim> PointBox<dim>::half_extents() const
{
  dealii::Tensor<1, dim> half;
  for (unsigned int d = 0; d < dim; ++d) {
    const double cross_section = std::max(part.face_area[2 * d], part.face_area[2 * d + 1]);
    const double length = cross_section > 0. ? part.volume / cross_section : std::pow(part.volume, 1. / dim);
    half[d] = 0.5 * std::min(length, edges[d]);
  }
  return half;
}

template <int dim>
std::vector<PointBox<dim>> even_boxes(const Shape<dim> &shape, const Grid<dim> &grid, const CellId cell,
                                      const unsigned int n)
{
  std::vector<PointBox<dim>> boxes;
  for (unsigned int b = 0; b < (dim == 2 ? n * n : n * n * n); ++b) {
    dealii::Point<dim> lower, upper;
    dealii::Tensor<1, dim> edges;
    for (unsigned int d = 0, rest = b; d < dim; ++d, rest /= n) {
      const double h = grid.size(cell, d);
      lower[d] = grid.lower(cell, d) + h * (rest % n) / n;
      upper[d] = grid.lower(cell, d) + h * (rest % n + 1) / n;
      edges[d] = h / n;
    }
    const CutBox<dim> part = cut(shape, lower, upper);
    if (part.volume > 0.)
      boxes.push_back({part, edges});
  }
  return boxes;
}

template <int dim>
std::vector<PointBox<dim>> gauss_boxes(const Shape<dim> &shape, const Grid<dim> &grid, const CellId cell,
                                       const unsigned int n)
{
  const auto whole = even_boxes(shape, grid, cell, 1);
  if (whole.empty())
    return {};
  if (whole.front().part.volume < grid.volume(cell) * (1. - 1e-10))
    return even_boxes(shape, grid, cell, 2 * n);
  std::vector<PointBox<dim>> boxes;
  const dealii::QGauss<dim> rule(n);
  for (unsigned int q = 0; q < rule.size(); ++q) {
    PointBox<dim> point;
    point.part.volume = rule.weight(q) * grid.volume(cell);
    for (unsigned int d = 0; d < dim; ++d)
      point.part.centroid[d] = grid.lower(cell, d) + rule.point(q)[d] * grid.size(cell, d);
    boxes.push_back(point);
  }
  return boxes;
}

template <int dim>
std::map<CellId, std::vector<PointBox<dim>>> lattice_boxes(const Shape<dim> &shape, const Grid<dim> &grid,
                                                           const unsigned int n)
{
  const Bounds<dim> bounds = shape.bounds();
  const auto corner = grid.locate(bounds.lower);
  std::array<unsigned int, dim> counts;
  dealii::Tensor<1, dim> edges;
  std::size_t n_boxes = 1;
  for (unsigned int d = 0; d < dim; ++d) {
    const double h = grid.planes(d)[corner[d] + 1] - grid.planes(d)[corner[d]];
    const double length = bounds.upper[d] - bounds.lower[d];
    counts[d] = std::max(1., std::round(n * length / h));
    edges[d] = length / counts[d];
    n_boxes *= counts[d];
  }
  std::map<CellId, std::vector<PointBox<dim>>> boxes;
  for (std::size_t b = 0; b < n_boxes; ++b) {
    dealii::Point<dim> lower, upper;
    std::size_t rest = b;
    for (unsigned int d = 0; d < dim; ++d, rest /= counts[d - 1]) {
      const unsigned int k = rest % counts[d];
      lower[d] = bounds.lower[d] + k * edges[d];
      upper[d] = k + 1 == counts[d] ? bounds.upper[d] : bounds.lower[d] + (k + 1) * edges[d];
    }
    // The centroid is in the box; so is a cell that this rank knows, or it does not own the centroid's.
    if (grid.cell_at(grid.locate(lower)) == no_index && grid.cell_at(grid.locate(upper)) == no_index)
      continue;
    const CutBox<dim> part = cut(shape, lower, upper);
    if (part.volume == 0.)
      continue;
    if (const CellId cell = grid.cell_at(grid.locate(part.centroid)); cell != no_index && grid.is_owned(cell))
      boxes[cell].push_back({part, edges});
  }
  return boxes;
}

template <int dim>
bool is_uniform(const Grid<dim> &grid, const Bounds<dim> &bounds)
{
  const auto lower = grid.locate(bounds.lower), upper = grid.locate(bounds.upper);
  for (unsigned int d = 0; d < dim; ++d) {
    const auto &planes = grid.planes(d);
    const double h = planes[lower[d] + 1] - planes[lower[d]];
    for (int i = lower[d]; i <= upper[d]; ++i)
      if (std::abs(planes[i + 1] - planes[i] - h) > 1e-9 * h)
        return false;
  }
  return true;
}

template struct PointBox<2>;
template struct PointBox<3>;
template std::vector<PointBox<2>> even_boxes(const Shape<2> &, const Grid<2> &, CellId, unsigned int);
template std::vector<PointBox<3>> even_boxes(const Shape<3> &, const Grid<3> &, CellId, unsigned int);
template std::vector<PointBox<2>> gauss_boxes(const Shape<2> &, const Grid<2> &, CellId, unsigned int);
template std::vector<PointBox<3>> gauss_boxes(const Shape<3> &, const Grid<3> &, CellId, unsigned int);
template std::map<CellId, std::vector<PointBox<2>>> lattice_boxes(const Shape<2> &, const Grid<2> &,
                                                                  unsigned int);
template std::map<CellId, std::vector<PointBox<3>>> lattice_boxes(const Shape<3> &, const Grid<3> &,
                                                                  unsigned int);
template bool is_uniform(const Grid<2> &, const Bounds<2> &);
template bool is_uniform(const Grid<3> &, const Bounds<3> &);
} // namespace peat
