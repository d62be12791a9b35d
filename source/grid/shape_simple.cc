#include <peat/base/text.h>
#include <peat/grid/shape.h>

#include <algorithm>
#include <cctype>
#include <cmath>

// Box, ball, cylinder, half-space and what an expression says.

namespace peat {
namespace {
template <int dim>
class Box : public Shape<dim>
{
public:
  explicit Box(const ShapeCall<dim> &call) : box{call.point(0), call.point(dim)}
  {
    for (unsigned int d = 0; d < dim; ++d)
      if (!(box.lower[d] < box.upper[d])) {
        const std::string axis(1, "xyz"[d]);
        call.fail("is empty: " + axis + "1 = " + to_text(box.upper[d]) + " must be greater than " + axis +
                  "0 = " + to_text(box.lower[d]));
      }
  }

  double distance(const dealii::Point<dim> &x) const override
  {
    double inner = -std::numeric_limits<double>::infinity();
    double outer_square = 0.;
    for (unsigned int d = 0; d < dim; ++d) {
      const double q = std::max(box.lower[d] - x[d], x[d] - box.upper[d]);
      inner = std::max(inner, q);
      if (q > 0.)
        outer_square += q * q;
    }
    return inner > 0. ? std::sqrt(outer_square) : inner;
  }

  bool is_convex() const override { return true; }

  Bounds<dim> bounds() const override { return box; }

  Side side(const Bounds<dim> &other, const double tolerance) const override
  {
    if (!box.overlaps(other, tolerance))
      return Side::outside;
    for (unsigned int d = 0; d < dim; ++d)
      if (other.lower[d] < box.lower[d] - tolerance || other.upper[d] > box.upper[d] + tolerance)
        return Side::cut;
    return Side::inside;
  }

private:
  const Bounds<dim> box;
};

template <int dim>
class Ball : public Shape<dim>
{
public:
  explicit Ball(const ShapeCall<dim> &call) : center(call.point(0)), radius(call.number(dim))
  {
    if (!(radius > 0.))
      call.fail("is empty: the radius is " + to_text(radius) + ", it must be positive");
  }

  double distance(const dealii::Point<dim> &x) const override { return center.distance(x) - radius; }

  bool is_convex() const override { return true; }

  Bounds<dim> bounds() const override
  {
    Bounds<dim> result{center, center};
    for (unsigned int d = 0; d < dim; ++d) {
      result.lower[d] -= radius;
      result.upper[d] += radius;
    }
    return result;
  }

private:
  const dealii::Point<dim> center;
  const double radius;
};

/// A straight circular cylinder with flat ends.
class Cylinder : public Shape<3>
{
public:
  explicit Cylinder(const ShapeCall<3> &call)
      : from(call.point(0)), to(call.point(3)), axis(to - from), length(axis.norm()), radius(call.number(6))
  {
    if (!(length > 0.))
      call.fail("is empty: its axis has no length");
    if (!(radius > 0.))
      call.fail("is empty: the radius is " + to_text(radius) + ", it must be positive");
    axis /= length;
  }

  double distance(const dealii::Point<3> &x) const override
  {
    const double along = (x - from) * axis;
    const double side = ((x - from) - along * axis).norm() - radius;
    const double end = std::max(-along, along - length);
    return side > 0. && end > 0. ? std::hypot(side, end) : std::max(side, end);
  }

  bool is_convex() const override { return true; }

  Bounds<3> bounds() const override
  {
    Bounds<3> result;
    for (unsigned int d = 0; d < 3; ++d) {
      const double reach = radius * std::sqrt(std::max(0., 1. - axis[d] * axis[d]));
      result.lower[d] = std::min(from[d], to[d]) - reach;
      result.upper[d] = std::max(from[d], to[d]) + reach;
    }
    return result;
  }

private:
  const dealii::Point<3> from;
  const dealii::Point<3> to;
  dealii::Tensor<1, 3> axis;
  const double length;
  const double radius;
};

/// The points x with (x - p) . n <= 0.
template <int dim>
class HalfSpace : public Shape<dim>
{
public:
  explicit HalfSpace(const ShapeCall<dim> &call) : p(call.point(0)), normal(call.point(dim))
  {
    const double norm = normal.norm();
    if (!(norm > 0.))
      call.fail("the outward normal must not be zero");
    normal /= norm;
  }

  double distance(const dealii::Point<dim> &x) const override { return (x - p) * normal; }

  bool is_convex() const override { return true; }

  Bounds<dim> bounds() const override
  {
    Bounds<dim> result = Bounds<dim>::everything();
    for (unsigned int d = 0; d < dim; ++d) {
      if (normal[d] == 1.)
        result.upper[d] = p[d];
      if (normal[d] == -1.)
        result.lower[d] = p[d];
    }
    return result;
  }

  Side side(const Bounds<dim> &box, const double tolerance) const override
  {
    double reach = -tolerance;
    for (unsigned int d = 0; d < dim; ++d)
      reach += 0.5 * std::abs(normal[d]) * (box.upper[d] - box.lower[d]);
    const double middle = distance(box.center());
    return middle >= reach ? Side::outside : middle <= -reach ? Side::inside : Side::cut;
  }

private:
  const dealii::Point<dim> p;
  dealii::Tensor<1, dim> normal;
};

/// Whether a single letter stands in a text as a name of its own.
bool contains_word(const std::string &text, const char letter)
{
  const auto is_of_name = [](const char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
  };
  for (std::size_t i = 0; i < text.size(); ++i)
    if (text[i] == letter && (i == 0 || !is_of_name(text[i - 1])) &&
        (i + 1 == text.size() || !is_of_name(text[i + 1])))
      return true;
  return false;
}

/// Where an expression of x, y (and z) is positive.
template <int dim>
class Inside : public Shape<dim>
{
public:
  explicit Inside(const ShapeCall<dim> &call) : function(call.arguments[0], call.constants, call.origin)
  {
    if (contains_word(call.arguments[0], 't'))
      call.fail("it cannot depend on the time t");
    if (dim == 2 && function.depends_on("z"))
      call.fail("there is no z in 2-D; the vertical axis is y");
    const double origin[3] = {0., 0., 0.};
    if (function.is_constant() && function.value(origin, 0.) <= 0.)
      call.fail("is empty: the expression is never positive");
  }

  double distance(const dealii::Point<dim> &x) const override
  {
    double place[3] = {0., 0., 0.};
    for (unsigned int d = 0; d < dim; ++d)
      place[d] = x[d];
    const double value = function.value(place, 0.);
    return value > 0. ? -value : std::max(-value, std::numeric_limits<double>::min());
  }

  bool is_distance() const override { return false; }

  Bounds<dim> bounds() const override { return Bounds<dim>::everything(); }

private:
  const Function function;
};

template <class Member, int dim>
std::shared_ptr<const Shape<dim>> make(const ShapeCall<dim> &call)
{
  return std::make_shared<const Member>(call);
}

const ShapeMember<2> box_2("box", "x0, y0, x1, y1", "The rectangle between two corners.", make<Box<2>, 2>);
const ShapeMember<3> box_3("box", "x0, y0, z0, x1, y1, z1", "The box between two corners.", make<Box<3>, 3>);

const ShapeMember<2> ball_2("ball", "cx, cy, r", "The disc around a center.", make<Ball<2>, 2>);
const ShapeMember<2> disc_2("disc", "cx, cy, r", "The disc around a center.", make<Ball<2>, 2>);
const ShapeMember<3> ball_3("ball", "cx, cy, cz, r", "The ball around a center.", make<Ball<3>, 3>);
const ShapeMember<3> sphere_3("sphere", "cx, cy, cz, r", "The ball around a center.", make<Ball<3>, 3>);

const ShapeMember<3> cylinder_3("cylinder", "x0, y0, z0, x1, y1, z1, r",
                                "The cylinder around the axis between two points, with flat ends.",
                                make<Cylinder, 3>);

const ShapeMember<2> halfspace_2("halfspace", "px, py, nx, ny",
                                 "All points behind the line through p with outward normal n.",
                                 make<HalfSpace<2>, 2>);
const ShapeMember<3> halfspace_3("halfspace", "px, py, pz, nx, ny, nz",
                                 "All points behind the plane through p with outward normal n.",
                                 make<HalfSpace<3>, 3>);

const ShapeMember<2> inside_2("inside", "expression", "Where an expression of x and y is positive.",
                              make<Inside<2>, 2>);
const ShapeMember<3> inside_3("inside", "expression", "Where an expression of x, y and z is positive.",
                              make<Inside<3>, 3>);
} // namespace
} // namespace peat
