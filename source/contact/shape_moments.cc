#include <peat/contact/shape_moments.h>

#include <peat/grid/cut_box.h>

#include <cmath>

// A shape whose surface is a mesh has exact moments. Else the shape's bounds are divided into boxes, and each
// is cut with the shape. The cut gives volume and centroid; the moments about that centroid are those of a
// box that a plane cuts, with the outward normal and through the point of the surface that the cut found.

namespace peat {
namespace {
/// Abscissas and weights on [0, 1].
constexpr unsigned int n_gauss = 6;
constexpr double gauss_point[n_gauss] = {0.033765242898423986, 0.169395306766867743, 0.380690406958401546,
                                         0.619309593041598454, 0.830604693233132257, 0.966234757101576014};
constexpr double gauss_weight[n_gauss] = {0.085662246189585173, 0.180380786524069304, 0.233956967286345524,
                                          0.233956967286345524, 0.180380786524069304, 0.085662246189585173};

/// Second moments per volume, about the centroid, of the part of a box behind a plane.
template <int dim>
dealii::Tensor<2, dim>
covariance_behind_plane(const dealii::Point<dim> &lower, const dealii::Point<dim> &upper,
                        const dealii::Point<dim> &on_plane, const dealii::Tensor<1, dim> &normal)
{
  unsigned int up = 0;
  for (unsigned int d = 1; d < dim; ++d)
    if (std::abs(normal[d]) > std::abs(normal[up]))
      up = d;

  // Columns along `up`, from the box's end to the plane.
  double volume = 0.;
  dealii::Tensor<1, dim> first;
  dealii::Tensor<2, dim> second;
  const unsigned int n_columns = dim == 2 ? n_gauss : n_gauss * n_gauss;
  for (unsigned int column = 0; column < n_columns; ++column) {
    dealii::Tensor<1, dim> x;
    double weight = 1., height = on_plane[up];
    for (unsigned int d = 0, rest = column; d < dim; ++d)
      if (d != up) {
        const double length = upper[d] - lower[d];
        x[d] = lower[d] + length * gauss_point[rest % n_gauss];
        weight *= length * gauss_weight[rest % n_gauss];
        height -= normal[d] / normal[up] * (x[d] - on_plane[d]);
        rest /= n_gauss;
      }
    height = std::min(upper[up], std::max(lower[up], height));
    const double from = normal[up] > 0. ? lower[up] : height, to = normal[up] > 0. ? height : upper[up];
    const double length = to - from;
    x[up] = 0.5 * (from + to);
    volume += weight * length;
    first += weight * length * x;
    second += weight * length * outer_product(x, x);
    second[up][up] += weight * length * length * length / 12.;
  }
  if (volume <= 0.)
    return {};
  const auto centroid = first / volume;
  return second / volume - outer_product(centroid, centroid);
}

/// Closed facets that are counter-clockwise as seen from outside: each makes a simplex with one place, and
/// volumes and moments of these, with their signs, add up to those of the body.
template <int dim>
ShapeMoments<dim> moments_of(const SurfaceMesh<dim> &mesh, const dealii::Point<dim> &origin)
{
  ShapeMoments<dim> result;
  dealii::Tensor<1, dim> first;
  dealii::Tensor<2, dim> second;
  for (const auto &facet : mesh.facets) {
    dealii::Tensor<2, dim> corners;
    dealii::Tensor<1, dim> sum;
    for (unsigned int i = 0; i < dim; ++i) {
      corners[i] = mesh.vertices[facet[i]] - origin;
      sum += corners[i];
    }
    const double volume = determinant(corners) / (dim == 2 ? 2. : 6.);
    result.volume += volume;
    first += volume / (dim + 1) * sum;
    second += volume / ((dim + 1) * (dim + 2)) * (transpose(corners) * corners + outer_product(sum, sum));
  }
  const dealii::Tensor<1, dim> middle = first / result.volume;
  result.centroid = origin + middle;
  result.second = second - result.volume * outer_product(middle, middle);
  return result;
}
} // namespace

template <int dim>
ShapeMoments<dim> moments(const Shape<dim> &shape)
{
  SurfaceMesh<dim> mesh;
  if (shape.append_facets(mesh))
    return moments_of(mesh, shape.bounds().center());

  constexpr unsigned int n = dim == 2 ? 256 : 40, n_boxes = dim == 2 ? n * n : n * n * n;
  const Bounds<dim> box = shape.bounds();
  const dealii::Point<dim> origin = box.center();

  ShapeMoments<dim> result;
  dealii::Tensor<1, dim> first;
  dealii::Tensor<2, dim> second;
  for (unsigned int i = 0; i < n_boxes; ++i) {
    Bounds<dim> part;
    for (unsigned int d = 0, rest = i; d < dim; ++d, rest /= n) {
      const double h = (box.upper[d] - box.lower[d]) / n;
      part.lower[d] = box.lower[d] + h * (rest % n);
      part.upper[d] = box.lower[d] + h * (rest % n + 1);
    }
    if (shape.side(part, 0.) == Side::outside)
      continue;
    const CutBox<dim> inside = cut(shape, part.lower, part.upper);
    if (inside.volume == 0.)
      continue;
    // Relative to the middle of the shape, so that little is lost to round-off far from the origin.
    const dealii::Tensor<1, dim> x = inside.centroid - origin;
    result.volume += inside.volume;
    first += inside.volume * x;
    second += inside.volume * outer_product(x, x);
    if (inside.interface.norm() > 0.)
      second += inside.volume *
                covariance_behind_plane(part.lower, part.upper, inside.interface_centroid, inside.interface);
    else
      for (unsigned int d = 0; d < dim; ++d)
        second[d][d] += inside.volume * std::pow(part.upper[d] - part.lower[d], 2) / 12.;
  }
  if (result.volume <= 0.)
    return result;
  const dealii::Tensor<1, dim> middle = first / result.volume;
  result.centroid = origin + middle;
  result.second = second - result.volume * outer_product(middle, middle);
  return result;
}

template struct ShapeMoments<2>;
template struct ShapeMoments<3>;
template ShapeMoments<2> moments<2>(const Shape<2> &);
template ShapeMoments<3> moments<3>(const Shape<3> &);
} // namespace peat
