#include <peat/base/text.h>
#include <peat/grid/shape.h>

#include <algorithm>
#include <cmath>

// Polygons in the plane, and prisms over them.

namespace peat {
namespace {
using Corner = dealii::Point<2>;

/// Twice the signed area of the triangle abc, positive if counter-clockwise; 0 if the points are on a line up
/// to round-off.
double turn(const Corner &a, const Corner &b, const Corner &c)
{
  const double left = (b[0] - a[0]) * (c[1] - a[1]), right = (b[1] - a[1]) * (c[0] - a[0]);
  const double round_off = 4. * std::numeric_limits<double>::epsilon() * (std::abs(left) + std::abs(right));
  return std::abs(left - right) <= round_off ? 0. : left - right;
}

/// Square of the distance between x and the segment ab.
double distance_square(const Corner &a, const Corner &b, const Corner &x)
{
  const auto edge = b - a;
  const double along = ((x - a) * edge) / edge.norm_square();
  return (x - a - std::min(1., std::max(0., along)) * edge).norm_square();
}

bool within_box_of(const Corner &a, const Corner &b, const Corner &x)
{
  for (unsigned int d = 0; d < 2; ++d)
    if (x[d] < std::min(a[d], b[d]) || x[d] > std::max(a[d], b[d]))
      return false;
  return true;
}

/// Whether the segments ab and cd have a point in common.
bool segments_meet(const Corner &a, const Corner &b, const Corner &c, const Corner &d)
{
  const double a_side = turn(c, d, a), b_side = turn(c, d, b), c_side = turn(a, b, c), d_side = turn(a, b, d);
  if (((a_side > 0. && b_side < 0.) || (a_side < 0. && b_side > 0.)) &&
      ((c_side > 0. && d_side < 0.) || (c_side < 0. && d_side > 0.)))
    return true;
  return (a_side == 0. && within_box_of(c, d, a)) || (b_side == 0. && within_box_of(c, d, b)) ||
         (c_side == 0. && within_box_of(a, b, c)) || (d_side == 0. && within_box_of(a, b, d));
}

/// A closed line that does not meet itself.
class Outline
{
public:
  /// Reads the corners from argument `first` of the call on.
  template <int dim>
  Outline(const ShapeCall<dim> &call, const unsigned int first)
  {
    if ((call.n_arguments() - first) % 2 != 0)
      call.fail("the coordinates of the corners must come in pairs x, y, but there is one left over");
    for (unsigned int i = first; i < call.n_arguments(); i += 2)
      corners.push_back(Corner(call.number(i), call.number(i + 1)));
    if (corners.front() == corners.back())
      corners.pop_back();
    if (corners.size() < 3)
      call.fail("needs at least three different corners");
    refuse_degenerate(call);

    bounds.lower = bounds.upper = corners[0];
    unsigned int n_left = 0, n_right = 0;
    for (unsigned int i = 0; i < corners.size(); ++i) {
      for (unsigned int d = 0; d < 2; ++d) {
        bounds.lower[d] = std::min(bounds.lower[d], corners[i][d]);
        bounds.upper[d] = std::max(bounds.upper[d], corners[i][d]);
      }
      const double t = turn(corner(i), corner(i + 1), corner(i + 2));
      n_left += t > 0.;
      n_right += t < 0.;
    }
    is_convex = n_left == 0 || n_right == 0;
  }

  double distance(const Corner &x) const
  {
    double nearest_square = std::numeric_limits<double>::infinity();
    bool inside = false;
    for (unsigned int i = 0; i < corners.size(); ++i) {
      const Corner &a = corner(i), &b = corner(i + 1);
      nearest_square = std::min(nearest_square, distance_square(a, b, x));
      // A ray in direction +x crosses the edge.
      if ((a[1] > x[1]) != (b[1] > x[1]) && (turn(a, b, x) > 0.) == (b[1] > a[1]))
        inside = !inside;
    }
    return inside ? -std::sqrt(nearest_square) : std::sqrt(nearest_square);
  }

  Bounds<2> bounds;
  bool is_convex;

private:
  std::vector<Corner> corners;

  const Corner &corner(const unsigned int i) const { return corners[i % corners.size()]; }

  template <int dim>
  void refuse_degenerate(const ShapeCall<dim> &call) const
  {
    const auto number = [&](const unsigned int i) { return std::to_string(i % corners.size() + 1); };
    const unsigned int n = corners.size();
    for (unsigned int i = 0; i < n; ++i) {
      if (corner(i) == corner(i + 1))
        call.fail("corners " + number(i) + " and " + number(i + 1) + " coincide");
      if (turn(corner(i), corner(i + 1), corner(i + 2)) == 0. &&
          (corner(i + 1) - corner(i)) * (corner(i + 2) - corner(i + 1)) < 0.)
        call.fail("is degenerate: its line turns back on itself at corner " + number(i + 1));
    }
    for (unsigned int i = 0; i < n; ++i)
      for (unsigned int j = i + 2; j < n; ++j)
        if ((j + 1) % n != i && segments_meet(corner(i), corner(i + 1), corner(j), corner(j + 1)))
          call.fail("meets itself: the edge between corners " + number(i) + " and " + number(i + 1) +
                    " and the edge between corners " + number(j) + " and " + number(j + 1));
  }
};

class Polygon : public Shape<2>
{
public:
  explicit Polygon(const ShapeCall<2> &call) : outline(call, 0) {}

  double distance(const dealii::Point<2> &x) const override { return outline.distance(x); }
  bool is_convex() const override { return outline.is_convex; }
  Bounds<2> bounds() const override { return outline.bounds; }

private:
  const Outline outline;
};

/// A polygon in the x-y plane, extruded along z.
class Prism : public Shape<3>
{
public:
  explicit Prism(const ShapeCall<3> &call) : z0(call.number(0)), z1(call.number(1)), outline(call, 2)
  {
    if (!(z0 < z1))
      call.fail("is empty: z1 = " + to_text(z1) + " must be greater than z0 = " + to_text(z0));
  }

  double distance(const dealii::Point<3> &x) const override
  {
    const double side = outline.distance(dealii::Point<2>(x[0], x[1]));
    const double end = std::max(z0 - x[2], x[2] - z1);
    return side > 0. && end > 0. ? std::hypot(side, end) : std::max(side, end);
  }

  bool is_convex() const override { return outline.is_convex; }

  Bounds<3> bounds() const override
  {
    const auto &[lower, upper] = outline.bounds;
    return {dealii::Point<3>(lower[0], lower[1], z0), dealii::Point<3>(upper[0], upper[1], z1)};
  }

private:
  const double z0;
  const double z1;
  const Outline outline;
};

const ShapeMember<2>
    polygon("polygon", "x1, y1, x2, y2, x3, y3, ...",
            "The polygon with these corners, in either sense; its line must not meet itself.",
            [](const ShapeCall<2> &call) { return std::make_shared<const Polygon>(call); });
const ShapeMember<3> prism("prism", "z0, z1, x1, y1, x2, y2, x3, y3, ...",
                           "The polygon with these corners in the x-y plane, extruded from z0 to z1.",
                           [](const ShapeCall<3> &call) { return std::make_shared<const Prism>(call); });
} // namespace
} // namespace peat
