#include <peat/base/expression.h>
#include <peat/base/text.h>

#include <muParser.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <set>

namespace peat {
namespace {
const std::array<const char *, 4> place_and_time = {{"x", "y", "z", "t"}};

bool is_place_or_time(const std::string &name)
{
  return std::find(place_and_time.begin(), place_and_time.end(), name) != place_and_time.end();
}

/// To muParser's functions come those that deal.II's users expect.
void define_names(mu::Parser &parser, const Constants &constants, const Origin &origin)
{
  parser.DefineFun(
      "if", +[](double condition, double yes, double no) { return condition != 0. ? yes : no; });
  parser.DefineFun(
      "pow", +[](double base, double exponent) { return std::pow(base, exponent); });
  parser.DefineFun(
      "floor", +[](double x) { return std::floor(x); });
  parser.DefineFun(
      "ceil", +[](double x) { return std::ceil(x); });
  parser.DefineFun(
      "erf", +[](double x) { return std::erf(x); });
  parser.DefineFun(
      "erfc", +[](double x) { return std::erfc(x); });

  for (const auto &[name, value] : constants) {
    if (parser.GetFunDef().count(name) > 0)
      throw InputError(origin, in_quotes(name) + " is a function and cannot be the name of a constant");
    if (is_place_or_time(name))
      throw InputError(origin,
                       in_quotes(name) + " stands for place or time and cannot be the name of a constant");
    parser.DefineConst(name, value);
  }
  if (constants.count("pi") == 0)
    parser.DefineConst("pi", 3.14159265358979323846);
  if (constants.count("e") == 0)
    parser.DefineConst("e", 2.71828182845904523536);
}

/// What muParser would misunderstand or accept although it makes no sense here.
void refuse_strange_text(const std::string &expression, const Origin &origin)
{
  if (trim(expression).empty())
    throw InputError(origin, "the value is empty");
  const auto is_strange = [](const char c) { return c == '"' || c < 32 || c == 127; };
  const auto strange = std::find_if(expression.begin(), expression.end(), is_strange);
  if (strange != expression.end()) {
    const std::string rest(strange, expression.end());
    throw InputError(origin,
                     "cannot read " + in_quotes(expression) + ": unexpected character at " + in_quotes(rest));
  }
  if (split_outside_parentheses(expression).size() != 1)
    throw InputError(origin,
                     "cannot read " + in_quotes(expression) + ": one value is expected here, not several");

  // muParser would assign to the variable.
  const auto is_one_of = [](const char c, const char *set) {
    return std::string(set).find(c) != std::string::npos;
  };
  for (std::size_t i = 0; i < expression.size(); ++i)
    if (expression[i] == '=' && (i == 0 || !is_one_of(expression[i - 1], "=<>!")) &&
        (i + 1 == expression.size() || expression[i + 1] != '='))
      throw InputError(origin, "cannot read " + in_quotes(expression) + ": to compare, write '=='");
}

InputError parse_error(const mu::Parser &parser, const mu::ParserError &error, const std::string &expression,
                       const Origin &origin)
{
  const std::string token = trim(error.GetToken());
  const bool is_name =
      !token.empty() && (std::isalpha(static_cast<unsigned char>(token[0])) || token[0] == '_');
  if (error.GetCode() == mu::ecUNASSIGNABLE_TOKEN && is_name) {
    std::vector<std::string> names;
    for (const auto &variable : parser.GetVar())
      names.push_back(variable.first);
    for (const auto &constant : parser.GetConst())
      names.push_back(constant.first);
    for (const auto &function : parser.GetFunDef())
      names.push_back(function.first);
    if (std::find(names.begin(), names.end(), token) != names.end())
      return {origin, "cannot read " + in_quotes(expression) + ": misplaced " + in_quotes(token)};
    if (is_place_or_time(token))
      return {origin,
              in_quotes(token) + " in " + in_quotes(expression) + ": place and time cannot enter here"};
    return {origin,
            "unknown name " + in_quotes(token) + " in " + in_quotes(expression) + did_you_mean(token, names)};
  }
  // "Internal error" is what muParser calls a lonely operator.
  std::string reason =
      error.GetCode() == mu::ecINTERNAL_ERROR ? "the expression is incomplete" : error.GetMsg();
  if (!reason.empty() && reason.back() == '.')
    reason.pop_back();
  if (!reason.empty())
    reason[0] = std::tolower(static_cast<unsigned char>(reason[0]));
  return {origin, "cannot read " + in_quotes(expression) + ": " + shortened(reason, 160)};
}

/// A parser that has accepted the expression. `variables` are x, y, z, t; null where place and time cannot
/// enter.
std::unique_ptr<mu::Parser> compile(const std::string &expression, const Constants &constants,
                                    double *variables, const Origin &origin)
{
  refuse_strange_text(expression, origin);
  auto parser = std::make_unique<mu::Parser>();
  try {
    define_names(*parser, constants, origin);
    if (variables != nullptr)
      for (std::size_t i = 0; i < place_and_time.size(); ++i)
        parser->DefineVar(place_and_time[i], variables + i);
    parser->SetExpr(expression);
    // Only an evaluation makes muParser look at the text.
    parser->Eval();
  } catch (const mu::ParserError &error) {
    throw parse_error(*parser, error, expression, origin);
  }
  return parser;
}

double finite(const double value, const std::string &expression, const Origin &origin)
{
  if (!std::isfinite(value))
    throw InputError(origin, in_quotes(expression) + " is not finite");
  return value;
}
} // namespace

double evaluate(const std::string &expression, const Constants &constants, const Origin &origin)
{
  // Most values are plain numbers, which need no parser. What is strange about others, the parser says.
  double number = 0.;
  const char *end = expression.data() + expression.size();
  const auto [stop, error] = std::from_chars(expression.data(), end, number);
  if (error == std::errc() && stop == end && (std::isfinite(number) || constants.count(expression) == 0))
    return finite(number, expression,
                  origin); // "inf" is a number for the library, unless the user calls a constant so
  return finite(compile(expression, constants, nullptr, origin)->Eval(), expression, origin);
}

std::vector<std::string> split_outside_parentheses(const std::string &text, const char separator)
{
  std::vector<std::string> parts;
  if (trim(text).empty())
    return parts;
  int depth = 0;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '(')
      ++depth;
    else if (text[i] == ')')
      --depth;
    else if (text[i] == separator && depth <= 0) {
      parts.push_back(trim(text.substr(begin, i - begin)));
      begin = i + 1;
    }
  }
  parts.push_back(trim(text.substr(begin)));
  return parts;
}

struct Function::Implementation
{
  Implementation(const std::string &text, const Constants &constants, const Origin &origin);

  struct Component
  {
    /// Null for a constant.
    std::unique_ptr<mu::Parser> parser;
    double value = 0.;
  };

  std::string text;
  Constants constants;
  Origin origin;
  std::vector<Component> components;
  bool is_constant = true;
  bool is_uniform = true;
  std::set<std::string> used;
  /// x, y, z, t, where the parsers look for them.
  double variables[4] = {0., 0., 0., 0.};
};

Function::Implementation::Implementation(const std::string &text, const Constants &constants,
                                         const Origin &origin)
    : text(trim(text)), constants(constants), origin(origin)
{
  const std::vector<std::string> parts = split_outside_parentheses(text);
  if (parts.empty())
    throw InputError(origin, "the value is empty");
  for (const std::string &part : parts) {
    Component component;
    component.parser = compile(part, constants, variables, origin);
    const auto variables_used = component.parser->GetUsedVar();
    if (variables_used.empty()) {
      component.value = finite(component.parser->Eval(), part, origin);
      component.parser.reset();
    } else {
      is_constant = false;
      if (variables_used.size() > 1 || variables_used.begin()->first != "t")
        is_uniform = false;
      for (const auto &variable : variables_used)
        used.insert(variable.first);
    }
    components.push_back(std::move(component));
  }
}

Function::Function() : Function("0", {}, {}) {}

Function::Function(const std::string &text, const Constants &constants, const Origin &origin)
    : implementation(std::make_unique<Implementation>(text, constants, origin))
{}

// Parsers point to the variables of their function; a copy therefore parses again.
Function::Function(const Function &other)
    : Function(other.implementation->text, other.implementation->constants, other.implementation->origin)
{}

Function::Function(Function &&other) noexcept = default;

Function &Function::operator=(Function other) noexcept
{
  implementation.swap(other.implementation);
  return *this;
}

Function::~Function() = default;

const std::string &Function::text() const
{
  return implementation->text;
}

unsigned int Function::n_components() const
{
  return implementation->components.size();
}

bool Function::is_constant() const
{
  return implementation->is_constant;
}

bool Function::is_uniform() const
{
  return implementation->is_uniform;
}

bool Function::depends_on(const std::string &variable) const
{
  return implementation->used.count(variable) > 0;
}

double Function::value(const double *x, const double t, const unsigned int component) const
{
  const Implementation::Component &part = implementation->components.at(component);
  if (part.parser == nullptr)
    return part.value;
  std::copy(x, x + 3, implementation->variables);
  implementation->variables[3] = t;
  const double value = part.parser->Eval();
  if (!std::isfinite(value))
    throw NumericalError(implementation->origin.prefix() + in_quotes(text()) +
                         " is not finite at x = " + to_text(x[0]) + ", y = " + to_text(x[1]) +
                         ", z = " + to_text(x[2]) + ", t = " + to_text(t));
  return value;
}
} // namespace peat
