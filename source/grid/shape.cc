#include <peat/base/text.h>
#include <peat/grid/shape.h>

#include <algorithm>
#include <cmath>

namespace peat {
template <int dim>
Bounds<dim> Bounds<dim>::everything()
{
  Bounds result;
  for (unsigned int d = 0; d < dim; ++d) {
    result.lower[d] = -std::numeric_limits<double>::infinity();
    result.upper[d] = std::numeric_limits<double>::infinity();
  }
  return result;
}

template <int dim>
dealii::Point<dim> Bounds<dim>::center() const
{
  dealii::Point<dim> result;
  for (unsigned int d = 0; d < dim; ++d)
    result[d] = 0.5 * (lower[d] + upper[d]);
  return result;
}

template <int dim>
double Bounds<dim>::radius() const
{
  return 0.5 * (upper - lower).norm();
}

template <int dim>
bool Bounds<dim>::overlaps(const Bounds &other, const double tolerance) const
{
  for (unsigned int d = 0; d < dim; ++d)
    if (other.upper[d] <= lower[d] + tolerance || upper[d] <= other.lower[d] + tolerance)
      return false;
  return true;
}

namespace {
/// Central differences.
template <int dim>
dealii::Tensor<1, dim> gradient(const Shape<dim> &shape, const dealii::Point<dim> &x, const double h)
{
  dealii::Tensor<1, dim> result;
  for (unsigned int d = 0; d < dim; ++d) {
    dealii::Point<dim> below = x, above = x;
    below[d] -= h;
    above[d] += h;
    result[d] = (shape.distance(above) - shape.distance(below)) / (2. * h);
  }
  return result;
}
} // namespace

template <int dim>
dealii::Tensor<1, dim> Shape<dim>::normal(const dealii::Point<dim> &x) const
{
  const double size = bounds().radius();
  const double h = 1e-6 * (std::isfinite(size) ? size : 1. + x.norm());
  const dealii::Tensor<1, dim> middle = gradient(*this, x, h);
  const double d = distance(x), norm = middle.norm();
  constexpr double smooth = 0.999, defined = 0.01;
  if (norm > smooth || (std::abs(d) < 2. * h && norm > defined))
    return middle / norm;

  // Several points of the surface are as near. Beside x one of them is nearest: the one towards which the way
  // ends on the surface.
  dealii::Tensor<1, dim> best;
  best[0] = 1.;
  double best_miss = std::numeric_limits<double>::infinity();
  for (unsigned int side = 0; side < 2 * dim; ++side) {
    dealii::Point<dim> beside = x;
    beside[side / 2] += side % 2 ? -4. * h : 4. * h;
    const dealii::Tensor<1, dim> candidate = gradient(*this, beside, h);
    if (candidate.norm() <= defined)
      continue;
    const double miss = std::abs(distance(x - d / candidate.norm() * candidate));
    // Equal but for round-off and the step of the differences: the first one counts.
    if (miss < best_miss - 100. * h) {
      best = candidate / candidate.norm();
      best_miss = miss;
    }
  }
  return best;
}

template <int dim>
void Shape<dim>::append_bounds_of_parts(std::vector<Bounds<dim>> &parts) const
{
  parts.push_back(bounds());
}

template <int dim>
Side Shape<dim>::side(const Bounds<dim> &box, const double tolerance) const
{
  if (!bounds().overlaps(box, tolerance))
    return Side::outside;
  if (!is_distance())
    return Side::cut;

  const double d = distance(box.center());
  const double radius = box.radius() - tolerance;
  if (d >= radius)
    return Side::outside;
  if (d <= -radius)
    return Side::inside;

  if (!is_convex() || d > tolerance)
    return Side::cut;
  for (unsigned int corner = 0; corner < (1u << dim); ++corner) {
    dealii::Point<dim> x;
    for (unsigned int e = 0; e < dim; ++e)
      x[e] = (corner >> e) & 1 ? box.upper[e] : box.lower[e];
    if (distance(x) > tolerance)
      return Side::cut;
  }
  return Side::inside;
}

template <int dim>
std::shared_ptr<const Shape<dim>> Shape<dim>::simplified(const Bounds<dim> &, const double) const
{
  return nullptr;
}

template <int dim>
double ShapeCall<dim>::number(const unsigned int i) const
{
  return evaluate(arguments.at(i), constants, origin);
}

template <int dim>
dealii::Point<dim> ShapeCall<dim>::point(const unsigned int first) const
{
  dealii::Point<dim> result;
  for (unsigned int d = 0; d < dim; ++d)
    result[d] = number(first + d);
  return result;
}

template <int dim>
std::shared_ptr<const Shape<dim>> ShapeCall<dim>::shape(const unsigned int i) const
{
  return parse_shape<dim>(arguments.at(i), constants, origin);
}

template <int dim>
std::vector<std::shared_ptr<const Shape<dim>>> ShapeCall<dim>::shapes(const unsigned int first) const
{
  std::vector<std::shared_ptr<const Shape<dim>>> result;
  for (unsigned int i = first; i < n_arguments(); ++i)
    result.push_back(shape(i));
  return result;
}

template <int dim>
void ShapeCall<dim>::fail(const std::string &message) const
{
  throw InputError(origin, "shape " + in_quotes(name) + ": " + message);
}

namespace {
/// Splits "name(inner)" and refuses everything else.
std::pair<std::string, std::string> take_apart(const std::string &text, const Origin &origin)
{
  const auto open = text.find('(');
  const auto first_close = text.find(')');
  if (open == std::string::npos && first_close == std::string::npos)
    throw InputError(origin, text.empty() ? "a shape is missing; it is written like box(0, 0, 1, 1)"
                                          : in_quotes(text) +
                                                " is not a shape, which is written like box(0, 0, 1, 1)");
  if (first_close < open)
    throw InputError(origin, "')' without '(' in the shape " + in_quotes(text));

  unsigned int depth = 0;
  auto close = std::string::npos;
  for (auto i = open; i < text.size() && close == std::string::npos; ++i)
    if (text[i] == '(')
      ++depth;
    else if (text[i] == ')' && --depth == 0)
      close = i;
  if (close == std::string::npos)
    throw InputError(origin, std::to_string(depth) + " ')' missing in the shape " + in_quotes(text));

  const std::string rest = trim(text.substr(close + 1));
  if (!rest.empty())
    throw InputError(origin, rest[0] == ')' ? "')' without '(' at the end of the shape " + in_quotes(text)
                                            : "unexpected " + in_quotes(rest) + " after the shape " +
                                                  in_quotes(text.substr(0, close + 1)));
  return {trim(text.substr(0, open)), trim(text.substr(open + 1, close - open - 1))};
}

template <int dim>
[[noreturn]] void refuse_name(const std::string &name, const Origin &origin)
{
  const std::string here = std::to_string(dim) + "-D", elsewhere = std::to_string(5 - dim) + "-D";
  if (name.empty())
    throw InputError(origin, "a shape needs a name before '('");

  std::vector<std::string> known;
  for (const auto &member : shape_family<dim>())
    known.push_back(member.first);
  const std::string choice = "; shapes in " + here + " are " + join(known);
  if (shape_family<5 - dim>().count(name) > 0)
    throw InputError(origin, "the shape " + in_quotes(name) + " exists only in " + elsewhere + choice);
  throw InputError(origin, "unknown shape " + in_quotes(name) + did_you_mean(name, known) + choice);
}

template <int dim>
void check_arguments(const ShapeCall<dim> &call, const ShapeEntry<dim> &entry)
{
  std::vector<std::string> expected = split_outside_parentheses(entry.arguments);
  const bool open_ended = expected.back() == "...";
  if (open_ended)
    expected.pop_back();
  const std::string signature = call.name + "(" + entry.arguments + ")";

  if (open_ended ? call.n_arguments() < expected.size() : call.n_arguments() != expected.size())
    call.fail(std::to_string(call.n_arguments()) +
              (call.n_arguments() == 1 ? " argument is" : " arguments are") + " given, but it is written " +
              signature);
  for (unsigned int i = 0; i < call.n_arguments(); ++i)
    if (call.arguments[i].empty())
      call.fail("argument " + std::to_string(i + 1) + " of " + signature + " is empty");
}
} // namespace

template <int dim>
std::shared_ptr<const Shape<dim>> parse_shape(const std::string &text, const Constants &constants,
                                              const Origin &origin)
{
  const auto [name, inner] = take_apart(trim(text), origin);
  const auto entry = shape_family<dim>().find(name);
  if (entry == shape_family<dim>().end())
    refuse_name<dim>(name, origin);

  const ShapeCall<dim> call{
      name, inner.empty() ? std::vector<std::string>() : split_outside_parentheses(inner), constants, origin};
  check_arguments(call, entry->second);
  return entry->second.make(call);
}

template struct Bounds<2>;
template struct Bounds<3>;
template class Shape<2>;
template class Shape<3>;
template class ShapeCall<2>;
template class ShapeCall<3>;
template std::shared_ptr<const Shape<2>> parse_shape<2>(const std::string &, const Constants &,
                                                        const Origin &);
template std::shared_ptr<const Shape<3>> parse_shape<3>(const std::string &, const Constants &,
                                                        const Origin &);
} // namespace peat
