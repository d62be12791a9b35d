#include <peat/grid/shape.h>

#include <deal.II/base/tensor.h>

#include <algorithm>
#include <cmath>

// Union, intersection, difference; rotation and translation.

namespace peat {
namespace {
template <int dim>
using Parts = std::vector<std::shared_ptr<const Shape<dim>>>;

/// What shapes made of others have in common.
template <int dim>
class Combined : public Shape<dim>
{
public:
  explicit Combined(const Parts<dim> &parts) : parts(parts) {}

  bool is_distance() const override
  {
    return std::all_of(parts.begin(), parts.end(), [](const auto &part) { return part->is_distance(); });
  }

  void append_bounds_of_parts(std::vector<Bounds<dim>> &result) const override
  {
    for (const auto &part : parts)
      part->append_bounds_of_parts(result);
  }

protected:
  const Parts<dim> parts;

  std::shared_ptr<const Shape<dim>> simplified_part(const unsigned int i, const Bounds<dim> &box,
                                                    const double tolerance) const
  {
    const auto result = parts[i]->simplified(box, tolerance);
    return result != nullptr ? result : parts[i];
  }
};

template <int dim>
class Union : public Combined<dim>
{
public:
  explicit Union(const Parts<dim> &parts) : Combined<dim>(parts) {}

  double distance(const dealii::Point<dim> &x) const override
  {
    double result = std::numeric_limits<double>::infinity();
    for (const auto &part : this->parts)
      result = std::min(result, part->distance(x));
    return result;
  }

  Bounds<dim> bounds() const override
  {
    Bounds<dim> result = this->parts[0]->bounds();
    for (const auto &part : this->parts) {
      const Bounds<dim> box = part->bounds();
      for (unsigned int d = 0; d < dim; ++d) {
        result.lower[d] = std::min(result.lower[d], box.lower[d]);
        result.upper[d] = std::max(result.upper[d], box.upper[d]);
      }
    }
    return result;
  }

  Side side(const Bounds<dim> &box, const double tolerance) const override
  {
    Side result = Side::outside;
    for (const auto &part : this->parts) {
      const Side side = part->side(box, tolerance);
      if (side == Side::inside)
        return Side::inside;
      if (side == Side::cut)
        result = Side::cut;
    }
    return result;
  }

  std::shared_ptr<const Shape<dim>> simplified(const Bounds<dim> &box, const double tolerance) const override
  {
    Parts<dim> kept;
    for (unsigned int i = 0; i < this->parts.size(); ++i)
      if (this->parts[i]->side(box, tolerance) != Side::outside)
        kept.push_back(this->simplified_part(i, box, tolerance));
    if (kept.empty())
      return nullptr;
    return kept.size() == 1 ? kept[0] : std::make_shared<const Union>(kept);
  }
};

/// What is in all of the first shapes and in none of the rest.
template <int dim>
class Intersection : public Combined<dim>
{
public:
  Intersection(const Parts<dim> &parts, const unsigned int n_kept) : Combined<dim>(parts), n_kept(n_kept) {}

  double distance(const dealii::Point<dim> &x) const override
  {
    double result = -std::numeric_limits<double>::infinity();
    for (unsigned int i = 0; i < this->parts.size(); ++i) {
      const double d = this->parts[i]->distance(x);
      result = std::max(result, i < n_kept ? d : -d);
    }
    return result;
  }

  bool is_convex() const override
  {
    return n_kept == this->parts.size() && std::all_of(this->parts.begin(), this->parts.end(),
                                                       [](const auto &part) { return part->is_convex(); });
  }

  Bounds<dim> bounds() const override
  {
    Bounds<dim> result = Bounds<dim>::everything();
    for (unsigned int i = 0; i < n_kept; ++i) {
      const Bounds<dim> box = this->parts[i]->bounds();
      for (unsigned int d = 0; d < dim; ++d) {
        result.lower[d] = std::max(result.lower[d], box.lower[d]);
        result.upper[d] = std::min(result.upper[d], box.upper[d]);
      }
    }
    return result;
  }

  Side side(const Bounds<dim> &box, const double tolerance) const override
  {
    Side result = Side::inside;
    for (unsigned int i = 0; i < this->parts.size(); ++i) {
      const Side side = this->parts[i]->side(box, tolerance);
      if (side == (i < n_kept ? Side::outside : Side::inside))
        return Side::outside;
      if (side == Side::cut)
        result = Side::cut;
    }
    return result;
  }

  std::shared_ptr<const Shape<dim>> simplified(const Bounds<dim> &box, const double tolerance) const override
  {
    Parts<dim> relevant;
    unsigned int n_relevant_kept = 0;
    for (unsigned int i = 0; i < this->parts.size(); ++i)
      if (this->parts[i]->side(box, tolerance) != (i < n_kept ? Side::inside : Side::outside)) {
        relevant.push_back(this->simplified_part(i, box, tolerance));
        n_relevant_kept += i < n_kept;
      }
    if (relevant.empty())
      return nullptr;
    if (relevant.size() == 1 && n_relevant_kept == 1)
      return relevant[0];
    return std::make_shared<const Intersection>(relevant, n_relevant_kept);
  }

private:
  const unsigned int n_kept;
};

/// A shape moved as a rigid body: the point y of the shape goes to to + R (y - from).
template <int dim>
class Moved : public Shape<dim>
{
public:
  Moved(const std::shared_ptr<const Shape<dim>> &shape, const dealii::Tensor<2, dim> &rotation,
        const dealii::Point<dim> &from, const dealii::Point<dim> &to)
      : shape(shape), forward(rotation), backward(transpose(rotation)), from(from), to(to)
  {}

  double distance(const dealii::Point<dim> &x) const override
  {
    return shape->distance(from + backward * (x - to));
  }
  bool is_distance() const override { return shape->is_distance(); }
  dealii::Tensor<1, dim> normal(const dealii::Point<dim> &x) const override
  {
    return forward * shape->normal(from + backward * (x - to));
  }
  bool is_convex() const override { return shape->is_convex(); }
  Bounds<dim> bounds() const override { return image(shape->bounds(), forward, from, to); }

  bool append_facets(SurfaceMesh<dim> &mesh) const override
  {
    const std::size_t first = mesh.vertices.size();
    if (!shape->append_facets(mesh))
      return false;
    for (auto x = mesh.vertices.begin() + first; x != mesh.vertices.end(); ++x)
      *x = to + forward * (*x - from);
    return true;
  }

  void append_bounds_of_parts(std::vector<Bounds<dim>> &parts) const override
  {
    std::vector<Bounds<dim>> before;
    shape->append_bounds_of_parts(before);
    for (const auto &box : before)
      parts.push_back(image(box, forward, from, to));
  }

  Side side(const Bounds<dim> &box, const double tolerance) const override
  {
    const Side result = shape->side(image(box, backward, to, from), tolerance);
    return result != Side::cut ? result : Shape<dim>::side(box, tolerance);
  }

  std::shared_ptr<const Shape<dim>> simplified(const Bounds<dim> &box, const double tolerance) const override
  {
    const auto result = shape->simplified(image(box, backward, to, from), tolerance);
    return result == nullptr ? nullptr : std::make_shared<const Moved>(result, forward, from, to);
  }

private:
  const std::shared_ptr<const Shape<dim>> shape;
  const dealii::Tensor<2, dim> forward;
  const dealii::Tensor<2, dim> backward;
  const dealii::Point<dim> from;
  const dealii::Point<dim> to;

  /// The box around the moved box; exact for multiples of 90 degrees.
  static Bounds<dim> image(const Bounds<dim> &box, const dealii::Tensor<2, dim> &matrix,
                           const dealii::Point<dim> &from, const dealii::Point<dim> &to)
  {
    Bounds<dim> result{to, to};
    for (unsigned int i = 0; i < dim; ++i)
      for (unsigned int j = 0; j < dim; ++j)
        if (matrix[i][j] != 0.) {
          const double a = matrix[i][j] * (box.lower[j] - from[j]),
                       b = matrix[i][j] * (box.upper[j] - from[j]);
          result.lower[i] += std::min(a, b);
          result.upper[i] += std::max(a, b);
        }
    return result;
  }
};

/// Cosine and sine of an angle in degrees, exact for multiples of 90 degrees.
std::pair<double, double> cos_sin(const double degrees)
{
  const double quarters = std::fmod(degrees, 360.) / 90.;
  if (quarters == std::round(quarters)) {
    static const double cosine[4] = {1., 0., -1., 0.};
    const int n = (static_cast<int>(quarters) + 4) % 4;
    return {cosine[n], cosine[(n + 3) % 4]};
  }
  const double angle = quarters * std::acos(0.);
  return {std::cos(angle), std::sin(angle)};
}

std::shared_ptr<const Shape<2>> make_rotated_2(const ShapeCall<2> &call)
{
  const auto [c, s] = cos_sin(call.number(1));
  const dealii::Point<2> center(call.number(2), call.number(3));
  return std::make_shared<const Moved<2>>(call.shape(0), dealii::Tensor<2, 2>({{c, -s}, {s, c}}), center,
                                          center);
}

/// Rodrigues' formula.
std::shared_ptr<const Shape<3>> make_rotated_3(const ShapeCall<3> &call)
{
  const auto [c, s] = cos_sin(call.number(1));
  const dealii::Point<3> center = call.point(2);
  dealii::Tensor<1, 3> a = call.point(5);
  if (!(a.norm() > 0.))
    call.fail("the axis of rotation must not be zero");
  a /= a.norm();

  const dealii::Tensor<2, 3> cross({{0., -a[2], a[1]}, {a[2], 0., -a[0]}, {-a[1], a[0], 0.}});
  dealii::Tensor<2, 3> rotation = s * cross + (1. - c) * outer_product(a, a);
  for (unsigned int d = 0; d < 3; ++d)
    rotation[d][d] += c;
  return std::make_shared<const Moved<3>>(call.shape(0), rotation, center, center);
}

template <int dim>
std::shared_ptr<const Shape<dim>> make_translated(const ShapeCall<dim> &call)
{
  dealii::Tensor<2, dim> identity;
  for (unsigned int d = 0; d < dim; ++d)
    identity[d][d] = 1.;
  return std::make_shared<const Moved<dim>>(call.shape(0), identity, dealii::Point<dim>(), call.point(1));
}

template <int dim>
std::shared_ptr<const Shape<dim>> make_union(const ShapeCall<dim> &call)
{
  return std::make_shared<const Union<dim>>(call.shapes(0));
}

template <int dim>
std::shared_ptr<const Shape<dim>> make_intersection(const ShapeCall<dim> &call)
{
  const auto result = std::make_shared<const Intersection<dim>>(call.shapes(0), call.n_arguments());
  const Bounds<dim> box = result->bounds();
  for (unsigned int d = 0; d < dim; ++d)
    if (!(box.lower[d] < box.upper[d]))
      call.fail("is empty: its parts do not overlap in direction " + std::string(1, "xyz"[d]));
  return result;
}

template <int dim>
std::shared_ptr<const Shape<dim>> make_difference(const ShapeCall<dim> &call)
{
  return std::make_shared<const Intersection<dim>>(call.shapes(0), 1);
}

template <int dim>
struct CombinedMembers
{
  const ShapeMember<dim> union_of{"union", "a, b, ...", "What is in any of the shapes.", make_union<dim>};
  const ShapeMember<dim> intersection{"intersection", "a, b, ...", "What is in all of the shapes.",
                                      make_intersection<dim>};
  const ShapeMember<dim> difference{"difference", "a, b, ...", "The first shape without the others.",
                                    make_difference<dim>};
};
const CombinedMembers<2> combined_2;
const CombinedMembers<3> combined_3;

const ShapeMember<2> rotate_2("rotate", "shape, degrees, cx, cy",
                              "The shape turned counter-clockwise around a center.", make_rotated_2);
const ShapeMember<3>
    rotate_3("rotate", "shape, degrees, cx, cy, cz, ax, ay, az",
             "The shape turned around the axis with direction a through c, by the right-hand rule.",
             make_rotated_3);
const ShapeMember<2> translate_2("translate", "shape, dx, dy", "The shape moved along.", make_translated<2>);
const ShapeMember<3> translate_3("translate", "shape, dx, dy, dz", "The shape moved along.",
                                 make_translated<3>);
} // namespace
} // namespace peat
