#include <peat/grid/cut_box.h>

#include <algorithm>
#include <cmath>
#include <optional>

// A box is split where axis-parallel faces of the shape are to be expected, then halved again and again until
// the signed distance is nearly linear in each piece. There it is interpolated linearly on simplices, whose
// parts inside are polytopes. A face of the box is cut in the same way, as a box with one direction less.

namespace peat {
namespace {
template <int k>
using Local = dealii::Point<k>;

/// Measure of a region and the integral of the position over it.
template <int k>
struct Moments
{
  double measure = 0.;
  dealii::Tensor<1, k> first;

  void add(const double part, const Local<k> &centroid)
  {
    measure += part;
    first += part * centroid;
  }
};

template <int k>
double longest_side(const Local<k> &lower, const Local<k> &upper)
{
  double result = 0.;
  for (unsigned int i = 0; i < k; ++i)
    result = std::max(result, upper[i] - lower[i]);
  return result;
}

/// How far pieces are halved. Lengths are relative to the part of the box that the shape may fill.
struct Resolution
{
  /// Pieces larger than this are always halved.
  double coarse;
  /// Pieces without a change of sign are not halved below `medium`, others not below `fine`.
  double medium;
  double fine;
  /// The distance counts as linear in a piece if it deviates no more than this.
  double flat;
};

template <int dim, int k>
Resolution resolution(const bool is_distance)
{
  if (!is_distance)
    return dim == 2 ? Resolution{1. / 8, 1. / 8, 1. / 32, 0.} : Resolution{1. / 4, 1. / 4, 1. / 8, 0.};
  if (k == 1)
    return {1. / 8, 1. / 64, 1. / 4096, 1e-6};
  if (dim == 2)
    return {1. / 8, 1. / 64, 1. / 1024, 1e-4};
  return k == 2 ? Resolution{1. / 8, 1. / 32, 1. / 128, 1e-3} : Resolution{1. / 4, 1. / 16, 1. / 32, 2e-3};
}

/// Kuhn's simplices of the unit cube; corners are numbered by their bits.
template <int k>
std::vector<std::array<unsigned int, k + 1>> kuhn_simplices()
{
  std::array<unsigned int, k> order;
  for (unsigned int i = 0; i < k; ++i)
    order[i] = i;
  std::vector<std::array<unsigned int, k + 1>> result;
  do {
    std::array<unsigned int, k + 1> simplex{};
    for (unsigned int i = 0; i < k; ++i)
      simplex[i + 1] = simplex[i] | (1u << order[i]);
    result.push_back(simplex);
  } while (std::next_permutation(order.begin(), order.end()));
  return result;
}

/// A box in which the surface is nearly plane: where it crosses the lines between corners.
template <int k>
struct Piece
{
  static constexpr unsigned int n_corners = 1u << k;

  Local<k> lower;
  Local<k> upper;
  /// Signed distance.
  std::array<double, n_corners> at_corner;
  double at_center = 0.;

  Local<k> center() const { return Local<k>(0.5 * (lower + upper)); }
  Local<k> corner(const unsigned int c) const
  {
    Local<k> x;
    for (unsigned int i = 0; i < k; ++i)
      x[i] = (c >> i) & 1 ? upper[i] : lower[i];
    return x;
  }
  double measure() const
  {
    double result = 1.;
    for (unsigned int i = 0; i < k; ++i)
      result *= upper[i] - lower[i];
    return result;
  }
  double least() const { return std::min(at_center, *std::min_element(at_corner.begin(), at_corner.end())); }
  double greatest() const
  {
    return std::max(at_center, *std::max_element(at_corner.begin(), at_corner.end()));
  }
  double mean_of_corners() const
  {
    double sum = 0.;
    for (const double d : at_corner)
      sum += d;
    return sum / n_corners;
  }

  /// Half the difference between opposite faces.
  std::array<double, k> half_differences() const
  {
    std::array<double, k> result{};
    for (unsigned int c = 0; c < n_corners; ++c)
      for (unsigned int i = 0; i < k; ++i)
        result[i] += ((c >> i) & 1 ? at_corner[c] : -at_corner[c]) / n_corners;
    return result;
  }

  /// Largest deviation of the distance from a linear function.
  double deviation_from_linear() const
  {
    const double mean = mean_of_corners();
    const std::array<double, k> slope = half_differences();
    double result = std::abs(at_center - mean);
    for (unsigned int c = 0; c < n_corners; ++c) {
      double linear = mean;
      for (unsigned int i = 0; i < k; ++i)
        linear += (c >> i) & 1 ? slope[i] : -slope[i];
      result = std::max(result, std::abs(at_corner[c] - linear));
    }
    return result;
  }

  /// Where the values are not distances, whether they are those of a smooth function rather than of a
  /// condition.
  bool looks_smooth() const
  {
    double range = 0.;
    for (const double difference : half_differences())
      range += 2. * std::abs(difference);
    return deviation_from_linear() < 0.15 * range;
  }

  /// Shifts the values at the corners such that their linear interpolation on Kuhn's simplices has the mean
  /// of the quadratic function through corners and center: a curved surface then cuts off the right volume on
  /// average.
  void correct_for_curvature()
  {
    double interpolated = 0.;
    for (unsigned int c = 0; c < n_corners; ++c) {
      unsigned int bits = 0, choices = 1;
      for (unsigned int i = 0; i < k; ++i)
        if ((c >> i) & 1) {
          choices = choices * (k - bits) / (bits + 1);
          ++bits;
        }
      interpolated += at_corner[c] / (choices * (k + 1));
    }
    const double shift = mean_of_corners() / 3. + at_center * 2. / 3. - interpolated;
    for (double &d : at_corner)
      d += shift;
  }
};

template <int k>
double measure_of_simplex(const std::array<Local<k>, k + 1> &x)
{
  dealii::Tensor<2, k> edges;
  for (unsigned int i = 0; i < k; ++i)
    edges[i] = x[i + 1] - x[0];
  return std::abs(determinant(edges)) / (k == 3 ? 6. : k);
}

template <int k>
void add_simplex(const std::array<Local<k>, k + 1> &x, const double measure, Moments<k> &sum)
{
  dealii::Tensor<1, k> centroid;
  for (const Local<k> &vertex : x)
    centroid += vertex / (k + 1.);
  sum.add(measure, Local<k>(centroid));
}

/// Adds what is inside of one of Kuhn's simplices. `crossing(inner, outer)` is the place between two corners
/// of the piece where the surface is.
template <int k, class Crossing>
void add_inside_of_simplex(const Piece<k> &piece, const std::array<unsigned int, k + 1> &simplex,
                           const Crossing &crossing, Moments<k> &sum)
{
  std::array<unsigned int, k + 1> inner, outer;
  unsigned int n_inner = 0, n_outer = 0;
  for (const unsigned int c : simplex)
    if (piece.at_corner[c] < 0.)
      inner[n_inner++] = c;
    else
      outer[n_outer++] = c;
  if (n_inner == 0)
    return;

  std::array<Local<k>, k + 1> x;
  const auto add = [&](const double sign) { add_simplex<k>(x, sign * measure_of_simplex<k>(x), sum); };
  if (n_inner == 1) {
    x[0] = piece.corner(inner[0]);
    for (unsigned int i = 0; i < k; ++i)
      x[i + 1] = crossing(inner[0], outer[i]);
    add(1.);
  } else if (n_outer <= 1) {
    for (unsigned int i = 0; i <= k; ++i)
      x[i] = piece.corner(simplex[i]);
    add(1.);
    if (n_outer == 1) {
      x[0] = piece.corner(outer[0]);
      for (unsigned int i = 0; i < k; ++i)
        x[i + 1] = crossing(inner[i], outer[0]);
      add(-1.);
    }
  } else if constexpr (k == 3) {
    // A wedge between two triangles, as three tetrahedra.
    const std::array<Local<k>, 3> a = {
        {piece.corner(inner[0]), crossing(inner[0], outer[0]), crossing(inner[0], outer[1])}};
    const std::array<Local<k>, 3> b = {
        {piece.corner(inner[1]), crossing(inner[1], outer[0]), crossing(inner[1], outer[1])}};
    for (unsigned int i = 0; i < 3; ++i) {
      for (unsigned int j = 0; j < 4; ++j)
        x[j] = j <= i ? a[j] : b[j - 1];
      add(1.);
    }
  }
}

/// A place and whether it is inside the shape.
template <int dim>
struct Sample
{
  dealii::Point<dim> x;
  bool inside;
};

/// Cuts a box (k = dim) or one of its faces (k = dim - 1).
template <int dim, int k>
class Cutter
{
public:
  /// The whole box. `parts` are the bounds of the shape's parts that reach into it.
  Cutter(const Shape<dim> &shape, const Bounds<dim> &box, const std::vector<Bounds<dim>> &parts)
      : Cutter(shape, box, parts, dim, false)
  {}

  /// The face with outward normal in direction +-`normal`.
  Cutter(const Shape<dim> &shape, const Bounds<dim> &box, const std::vector<Bounds<dim>> &parts,
         const unsigned int normal, const bool is_upper)
      : shape(&shape), box(box), parts(parts), around(shape.bounds()), normal(normal), is_upper(is_upper),
        is_distance(shape.is_distance()), resolution(peat::resolution<dim, k>(is_distance))
  {
    double largest_coordinate = 0.;
    Local<k> lower, upper;
    for (unsigned int d = 0, i = 0; d < dim; ++d) {
      thickness = std::max(thickness, 1e-7 * (box.upper[d] - box.lower[d]));
      largest_coordinate = std::max({largest_coordinate, std::abs(box.lower[d]), std::abs(box.upper[d])});
      if (d != normal) {
        size =
            std::max(size, std::min(box.upper[d], around.upper[d]) - std::max(box.lower[d], around.lower[d]));
        axis[i] = d;
        lower[i] = box.lower[d];
        upper[i] = box.upper[d];
        ++i;
      }
    }
    tolerance = std::max(1e-5 * thickness, 8. * std::numeric_limits<double>::epsilon() * largest_coordinate);
    thickness = std::max(thickness, 100. * tolerance);
    split(lower, upper);
  }

  Moments<k> moments;
  /// Where the surface is near: on both sides of it.
  std::vector<Sample<dim>> samples;

private:
  /// What is cut; a simpler one with the same points while a piece is visited.
  const Shape<dim> *shape;
  const Bounds<dim> &box;
  const std::vector<Bounds<dim>> &parts;
  const Bounds<dim> around;
  const unsigned int normal;
  const bool is_upper;
  const bool is_distance;
  const Resolution resolution;
  std::array<unsigned int, k> axis;
  /// Longest side of what the shape may fill.
  double size = 0.;
  double tolerance;
  /// Of the layer behind a face that tells on which side of it the shape is.
  double thickness = 0.;

  dealii::Point<dim> place(const Local<k> &x, const double depth = 0.) const
  {
    dealii::Point<dim> result;
    for (unsigned int i = 0; i < k; ++i)
      result[axis[i]] = x[i];
    if (k < dim)
      result[normal] = is_upper ? box.upper[normal] - depth : box.lower[normal] + depth;
    return result;
  }

  /// A box, or the thin layer within the box behind a part of its face.
  Bounds<dim> layer(const Local<k> &lower, const Local<k> &upper) const
  {
    Bounds<dim> result{place(lower), place(upper)};
    if (k < dim) {
      result.lower[normal] = is_upper ? box.upper[normal] - thickness : box.lower[normal];
      result.upper[normal] = is_upper ? box.upper[normal] : box.lower[normal] + thickness;
    }
    return result;
  }

  /// Signed distance at a place. On a face that lies in the surface, the sign is that of the inner side.
  double value(const Local<k> &x) const
  {
    if (!is_distance) {
      // Conditions such as x < 1 should hold up to the side of the box.
      const dealii::Point<dim> center = box.center();
      return shape->distance(center + (1. - 1e-9) * (place(x) - center));
    }
    const double d = shape->distance(place(x));
    if (k == dim || std::abs(d) > tolerance)
      return d;
    const double behind = shape->distance(place(x, thickness));
    return behind <= tolerance ? -1e-4 * tolerance : 1e-4 * tolerance;
  }

  /// Splits where faces of the shape's parts may be, so that the pieces see as few parts as possible.
  void split(const Local<k> &lower, const Local<k> &upper)
  {
    const Bounds<dim> here = layer(lower, upper);
    const Side side = around.overlaps(here, tolerance) ? shape->side(here, tolerance) : Side::outside;
    if (side != Side::cut) {
      settle(lower, upper, side == Side::inside);
      return;
    }
    for (const Bounds<dim> &part : parts)
      if (part.overlaps(here, tolerance))
        for (unsigned int i = 0; i < k; ++i)
          for (const double plane : {part.lower[axis[i]], part.upper[axis[i]]})
            if (plane > lower[i] + tolerance && plane < upper[i] - tolerance) {
              Local<k> middle_upper = upper, middle_lower = lower;
              middle_upper[i] = middle_lower[i] = plane;
              split(lower, middle_upper);
              split(middle_lower, upper);
              return;
            }

    const Shape<dim> *const whole_shape = shape;
    const auto simpler = shape->simplified(here, tolerance);
    if (simpler != nullptr)
      shape = simpler.get();
    visit(lower, upper);
    shape = whole_shape;
  }

  void visit(const Local<k> &lower, const Local<k> &upper)
  {
    const Side side = shape->side(layer(lower, upper), tolerance);
    if (side != Side::cut) {
      settle(lower, upper, side == Side::inside);
      return;
    }
    const double largest = longest_side<k>(lower, upper) / size;
    if (largest > resolution.coarse) {
      halve(lower, upper);
      return;
    }

    Piece<k> piece{lower, upper, {}};
    for (unsigned int c = 0; c < Piece<k>::n_corners; ++c)
      piece.at_corner[c] = value(piece.corner(c));
    piece.at_center = value(piece.center());
    const double nothing = is_distance ? tolerance : 0.;
    const bool is_crossed = piece.least() < -nothing && piece.greatest() > nothing;
    const bool is_flat = is_distance && piece.deviation_from_linear() <= resolution.flat * size;
    if (!is_flat && largest > (is_crossed ? resolution.fine : resolution.medium))
      halve(lower, upper);
    else if (!is_crossed)
      settle(lower, upper, piece.greatest() <= nothing);
    else
      settle_crossed(piece);
  }

  /// In all directions in which the piece is long.
  void halve(const Local<k> &lower, const Local<k> &upper)
  {
    const double largest = longest_side<k>(lower, upper);
    for (unsigned int child = 0; child < (1u << k); ++child) {
      Local<k> a = lower, b = upper;
      bool exists = true;
      for (unsigned int i = 0; i < k; ++i) {
        const bool second = (child >> i) & 1;
        if (upper[i] - lower[i] > 0.5 * largest)
          (second ? a : b)[i] = 0.5 * (lower[i] + upper[i]);
        else
          exists = exists && !second;
      }
      if (exists)
        visit(a, b);
    }
  }

  void settle(const Local<k> &lower, const Local<k> &upper, const bool inside)
  {
    const Piece<k> piece{lower, upper, {}};
    if (inside)
      moments.add(piece.measure(), piece.center());
    samples.push_back({place(piece.center()), inside});
  }

  void settle_crossed(Piece<k> &piece)
  {
    for (const bool inside : {true, false}) {
      const auto best = inside ? std::min_element(piece.at_corner.begin(), piece.at_corner.end())
                               : std::max_element(piece.at_corner.begin(), piece.at_corner.end());
      if (inside ? *best < 0. : *best > 0.)
        samples.push_back({place(piece.corner(best - piece.at_corner.begin())), inside});
    }

    static const auto simplices = kuhn_simplices<k>();
    if (is_distance || piece.looks_smooth()) {
      piece.correct_for_curvature();
      const auto crossing = [&](const unsigned int inner, const unsigned int outer) {
        const Local<k> a = piece.corner(inner), b = piece.corner(outer);
        const double d = piece.at_corner[inner];
        return Local<k>(a + d / (d - piece.at_corner[outer]) * (b - a));
      };
      for (const auto &simplex : simplices)
        add_inside_of_simplex<k>(piece, simplex, crossing, moments);
    } else {
      std::array<std::optional<Local<k>>, Piece<k>::n_corners * Piece<k>::n_corners> known;
      const auto crossing = [&](const unsigned int inner, const unsigned int outer) {
        auto &result = known[inner * Piece<k>::n_corners + outer];
        if (!result)
          result = bisect(piece.corner(inner), piece.corner(outer));
        return *result;
      };
      for (const auto &simplex : simplices)
        add_inside_of_simplex<k>(piece, simplex, crossing, moments);
    }
  }

  /// Where between a place inside and one outside the surface is.
  Local<k> bisect(Local<k> inner, Local<k> outer) const
  {
    for (unsigned int i = 0; i < (dim == 2 ? 16 : 10); ++i) {
      const Local<k> middle(0.5 * (inner + outer));
      (value(middle) < 0. ? inner : outer) = middle;
    }
    return Local<k>(0.5 * (inner + outer));
  }
};

/// The nearest of the samples inside (or outside); null if there is none.
template <int dim>
const Sample<dim> *nearest(const std::vector<Sample<dim>> &samples, const bool inside,
                           const dealii::Point<dim> &x)
{
  const Sample<dim> *result = nullptr;
  for (const Sample<dim> &sample : samples)
    if (sample.inside == inside &&
        (result == nullptr || sample.x.distance_square(x) < result->x.distance_square(x)))
      result = &sample;
  return result;
}

/// The centroid c of a plane surface with area vector A satisfies
///   A_i c_j = \int_V delta_ij - \int_faces x_j n_i,
/// the divergence theorem for the coordinates. For a curved surface the contraction with A is the centroid of
/// the surface as seen along A.
template <int dim>
dealii::Point<dim> centroid_of_interface(const Bounds<dim> &box, const CutBox<dim> &result,
                                         const std::array<dealii::Tensor<1, dim>, 2 * dim> &face_moments)
{
  dealii::Tensor<1, dim> sum = result.volume * result.interface;
  for (unsigned int d = 0; d < dim; ++d)
    sum -= result.interface[d] * (face_moments[2 * d + 1] - face_moments[2 * d]);
  dealii::Point<dim> centroid = box.center() + sum / result.interface.norm_square();
  for (unsigned int d = 0; d < dim; ++d)
    centroid[d] = std::min(box.upper[d], std::max(box.lower[d], centroid[d]));
  return centroid;
}

/// The point of the surface between x and the nearest sample on its other side.
template <int dim>
dealii::Point<dim> move_to_surface(const Shape<dim> &shape, dealii::Point<dim> x, const double size,
                                   const std::vector<Sample<dim>> &samples)
{
  const double d = shape.distance(x);
  const bool inside = d <= 0.;
  const Sample<dim> *other = nearest(samples, !inside, x);
  if ((shape.is_distance() && std::abs(d) <= 1e-9 * size) || other == nullptr)
    return x;
  dealii::Point<dim> y = other->x;
  for (unsigned int i = 0; i < 40; ++i) {
    const dealii::Point<dim> middle(0.5 * (x + y));
    ((shape.distance(middle) <= 0.) == inside ? x : y) = middle;
  }
  return x;
}

template <int dim>
void fill(CutBox<dim> &result, const Bounds<dim> &box, const double volume)
{
  result.volume = volume;
  result.centroid = box.center();
  for (unsigned int face = 0; face < 2 * dim; ++face)
    result.face_area[face] = volume / (box.upper[face / 2] - box.lower[face / 2]);
}

/// Areas of the faces, and the surface that follows from them.
template <int dim>
void cut_faces(CutBox<dim> &result, const Shape<dim> &shape, const Bounds<dim> &box,
               const std::vector<Bounds<dim>> &parts, const std::vector<Sample<dim>> &samples)
{
  const dealii::Point<dim> center = box.center();
  std::array<dealii::Tensor<1, dim>, 2 * dim> face_moments;
  double size = 0.;
  for (unsigned int face = 0; face < 2 * dim; ++face) {
    const unsigned int normal = face / 2;
    const bool is_upper = face % 2;
    const Moments<dim - 1> moments = Cutter<dim, dim - 1>(shape, box, parts, normal, is_upper).moments;
    double whole = 1.;
    for (unsigned int d = 0; d < dim; ++d)
      whole *= d == normal ? 1. : box.upper[d] - box.lower[d];
    if (moments.measure < 1e-10 * whole)
      continue;
    result.face_area[face] = moments.measure > (1. - 1e-10) * whole ? whole : moments.measure;
    for (unsigned int d = 0, i = 0; d < dim; ++d)
      face_moments[face][d] =
          d != normal ? moments.first[i++] - moments.measure * center[d]
                      : moments.measure * 0.5 * (is_upper ? 1. : -1.) * (box.upper[d] - box.lower[d]);
    size = std::max(size, box.upper[normal] - box.lower[normal]);
  }
  for (unsigned int d = 0; d < dim; ++d)
    result.interface[d] = result.face_area[2 * d] - result.face_area[2 * d + 1];

  result.interface_centroid = result.centroid;
  if (result.interface.norm_square() > 0.)
    result.interface_centroid =
        move_to_surface(shape, centroid_of_interface(box, result, face_moments), size, samples);
}
} // namespace

template <int dim>
CutBox<dim> cut(const Shape<dim> &shape, const dealii::Point<dim> &lower, const dealii::Point<dim> &upper)
{
  const Bounds<dim> box{lower, upper};
  CutBox<dim> result;
  result.centroid = result.interface_centroid = box.center();
  double whole = 1.;
  for (unsigned int d = 0; d < dim; ++d)
    whole *= upper[d] - lower[d];

  std::vector<Bounds<dim>> parts{shape.bounds()};
  shape.append_bounds_of_parts(parts);
  parts.erase(
      std::remove_if(parts.begin(), parts.end(), [&](const auto &part) { return !part.overlaps(box); }),
      parts.end());
  const Cutter<dim, dim> cutter(shape, box, parts);
  const double volume = cutter.moments.measure;
  if (volume < 1e-10 * whole)
    return result;
  if (volume > (1. - 1e-10) * whole) {
    fill(result, box, whole);
    return result;
  }

  dealii::Point<dim> centroid(cutter.moments.first / volume);
  if (shape.distance(centroid) > 0.) {
    const auto *inner = nearest(cutter.samples, true, centroid);
    if (inner == nullptr)
      return result;
    centroid = inner->x;
  }
  result.volume = volume;
  result.centroid = centroid;
  cut_faces(result, shape, box, parts, cutter.samples);
  return result;
}

template struct CutBox<2>;
template struct CutBox<3>;
template CutBox<2> cut<2>(const Shape<2> &, const dealii::Point<2> &, const dealii::Point<2> &);
template CutBox<3> cut<3>(const Shape<3> &, const dealii::Point<3> &, const dealii::Point<3> &);
} // namespace peat
