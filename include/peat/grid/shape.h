#pragma once

#include <peat/base/error.h>
#include <peat/base/expression.h>
#include <peat/grid/surface_mesh.h>

#include <deal.II/base/point.h>
#include <deal.II/base/tensor.h>

#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

// Bodies and regions: what is inside, and how far the surface is. A shape is written as a call, e.g.
//   difference(box(0, 0, 4, 2), rotate(ball(1, 2, R), 30, 1, 2))
// where every number is an expression of the constants. New shapes are one class and one line in a .cc file:
//   const ShapeMember<2> member("disc", "cx, cy, r", "One sentence about it.", make_disc);

namespace peat {
/// An axis-parallel box; sides may be at infinity [m].
template <int dim>
struct Bounds
{
  dealii::Point<dim> lower;
  dealii::Point<dim> upper;

  static Bounds everything();
  dealii::Point<dim> center() const;
  /// Half of the diagonal: no point of the box is farther from its center.
  double radius() const;
  /// Whether the boxes share more than what touches within the tolerance.
  bool overlaps(const Bounds &other, double tolerance = 0.) const;
};

/// Where a box is with respect to a shape; `cut` also when nothing is certain.
enum class Side { inside, outside, cut };

/// A set of points with a surface. Shapes do not change; where an expression is part of one (`inside`), one
/// object must not be asked by two threads at a time.
template <int dim>
class Shape
{
public:
  virtual ~Shape() = default;

  /// Signed distance to the surface, negative inside [m]. Its absolute value never overestimates the
  /// distance, but may underestimate it where shapes are combined. Where is_distance() is false only the sign
  /// means something.
  virtual double distance(const dealii::Point<dim> &x) const = 0;
  virtual bool is_distance() const { return true; }

  /// Unit vector out of the shape: from the nearest point of the surface if x is outside, towards it if x is
  /// inside. Where several points are nearest it is that of one of them, and on an edge or corner of the
  /// surface it lies between the adjacent faces' normals. By differences of distance(), to about 1e-9.
  virtual dealii::Tensor<1, dim> normal(const dealii::Point<dim> &x) const;

  /// Whether it is certain that the segment between any two points inside is inside.
  virtual bool is_convex() const { return false; }

  /// An axis-parallel box that contains the shape [m]; infinite where nothing better is known.
  virtual Bounds<dim> bounds() const = 0;

  /// Appends facets that are the surface exactly, counter-clockwise as seen from outside. False if there are
  /// none.
  virtual bool append_facets(SurfaceMesh<dim> &) const { return false; }

  /// The bounds of the shapes of which this one is made: their sides are where axis-parallel faces are to be
  /// expected.
  virtual void append_bounds_of_parts(std::vector<Bounds<dim>> &parts) const;

  /// What is certain about a whole box; what is nearer to the surface than the tolerance [m] may be on either
  /// side.
  virtual Side side(const Bounds<dim> &box, double tolerance) const;

  /// A shape of fewer parts that has the same points within the box; null where there is none. Its distance
  /// is not disturbed by surfaces of parts that do not matter there.
  virtual std::shared_ptr<const Shape<dim>> simplified(const Bounds<dim> &box, double tolerance) const;
};

/// Reads a shape. Throws an InputError at `origin` that says in one line what is wrong: an unknown name, a
/// wrong number of arguments, a shape that is empty by its numbers, parentheses that do not match.
template <int dim>
std::shared_ptr<const Shape<dim>> parse_shape(const std::string &text, const Constants &constants,
                                              const Origin &origin);

/// The arguments from which a shape is made.
template <int dim>
class ShapeCall
{
public:
  std::string name;
  std::vector<std::string> arguments;
  const Constants &constants;
  const Origin &origin;

  unsigned int n_arguments() const { return arguments.size(); }
  double number(unsigned int i) const;
  /// `dim` numbers, from argument `first` on.
  dealii::Point<dim> point(unsigned int first) const;
  std::shared_ptr<const Shape<dim>> shape(unsigned int i) const;
  /// All arguments from `first` on.
  std::vector<std::shared_ptr<const Shape<dim>>> shapes(unsigned int first) const;
  /// Throws an InputError that starts with the shape's name.
  [[noreturn]] void fail(const std::string &message) const;
};

template <int dim>
struct ShapeEntry
{
  /// The arguments as the user is to write them, separated by commas; "..." at the end stands for any number
  /// of more.
  std::string arguments;
  /// One sentence.
  std::string text;
  std::function<std::shared_ptr<const Shape<dim>>(const ShapeCall<dim> &)> make;
};

/// All shapes by name.
template <int dim>
std::map<std::string, ShapeEntry<dim>> &shape_family()
{
  static std::map<std::string, ShapeEntry<dim>> entries;
  return entries;
}

/// A static object of this type adds a shape to the family.
template <int dim>
struct ShapeMember
{
  ShapeMember(const std::string &name, const std::string &arguments, const std::string &text,
              decltype(ShapeEntry<dim>::make) make)
  {
    shape_family<dim>()[name] = {arguments, text, std::move(make)};
  }
};
} // namespace peat
