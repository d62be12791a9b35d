#pragma once

#include <peat/base/error.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace peat {
/// Named numbers that expressions may use.
using Constants = std::map<std::string, double>;

/// The value of an expression (muParser's language) of the constants. Throws InputError at `origin` if it
/// does not parse, names something unknown, or is not finite.
double evaluate(const std::string &expression, const Constants &constants, const Origin &origin);

/// Splits at separators that stand outside parentheses, and trims the parts: "min(1,2), x" -> {"min(1,2)",
/// "x"}.
std::vector<std::string> split_outside_parentheses(const std::string &text, char separator = ',');

/// A function of place and time given as text, with one or more components.
///
/// Copies are independent; evaluation is not thread-safe within one object.
class Function
{
public:
  /// Zero, with one component.
  Function();
  /// Components separated by commas, e.g. "0, -q*(t<1)". An expression of numbers only is recognised as
  /// constant and costs nothing to evaluate. Throws InputError at `origin`.
  Function(const std::string &text, const Constants &constants, const Origin &origin);
  Function(const Function &other);
  Function(Function &&other) noexcept;
  Function &operator=(Function other) noexcept;
  ~Function();

  const std::string &text() const;
  unsigned int n_components() const;
  /// Neither place nor time enters.
  bool is_constant() const;
  /// Place does not enter: one evaluation serves all places.
  bool is_uniform() const;
  /// Whether "x", "y", "z" or "t" enters.
  bool depends_on(const std::string &variable) const;

  /// `x` are three coordinates (z = 0 in 2-D). Throws NumericalError if the value is not finite.
  double value(const double *x, double t, unsigned int component = 0) const;

private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation;
};
} // namespace peat
