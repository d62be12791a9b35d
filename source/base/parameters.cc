#include <peat/base/invalid_value.h>
#include <peat/base/parameters.h>
#include <peat/base/text.h>

#include "parameter_tree.h"

#include <algorithm>
#include <cmath>

namespace peat {
namespace {
using internal::Declared;

bool contains(const Range &range, const double value)
{
  const bool above = range.lower_allowed ? value >= range.lower : value > range.lower;
  const bool below = range.upper_allowed ? value <= range.upper : value < range.upper;
  return std::isfinite(value) && above && below;
}

/// "> 0 and <= 1"
std::string describe(const Range &range)
{
  std::string result;
  if (std::isfinite(range.lower))
    result = (range.lower_allowed ? ">= " : "> ") + to_text(range.lower);
  if (std::isfinite(range.upper))
    result += (result.empty() ? "" : " and ") + std::string(range.upper_allowed ? "<= " : "< ") +
              to_text(range.upper);
  return result;
}

/// Whole numbers have no sign here.
Range unsigned_range(Range range)
{
  if (range.lower < 0.) {
    range.lower = 0.;
    range.lower_allowed = true;
  }
  return range;
}

/// "-3", or "'Drop - 5' = -3" for an expression.
std::string shown(const std::string &text, const double value)
{
  return to_text(value) == text ? text : in_quotes(text) + " = " + to_text(value);
}

/// As Section::fail(), for what is wrong whatever the rest of the file says.
[[noreturn]] void refuse(const Section &section, const std::string &key, const std::string &message)
{
  try {
    section.fail(key, message);
  } catch (const InputError &error) {
    throw InvalidValue(error.what());
  }
}

double evaluate(const Section &section, const std::string &key, const std::string &text)
{
  try {
    return evaluate(text, section.constants(), Origin());
  } catch (const InputError &error) {
    refuse(section, key, error.what());
  }
}

void check_range(const Section &section, const std::string &key, const std::string &text, const double value,
                 const Range &range)
{
  if (!contains(range, value))
    refuse(section, key,
           shown(text, value) + " must be " + describe(range) + (range.unit.empty() ? "" : " " + range.unit));
}

double read_number(const Section &section, const std::string &key, const std::string &text,
                   const Range &range)
{
  const double value = evaluate(section, key, text);
  check_range(section, key, text, value, range);
  return value;
}

std::vector<std::string> read_list(const Section &section, const std::string &key, const std::string &text)
{
  const std::vector<std::string> parts = split_outside_parentheses(text);
  for (const std::string &part : parts)
    if (part.empty())
      refuse(section, key, "a comma with nothing before or after it in " + in_quotes(text));
  return parts;
}

std::string read_choice(const Section &section, const std::string &key, const std::string &word,
                        const std::vector<std::string> &choices)
{
  if (!is_one_of(choices, word))
    refuse(section, key, in_quotes(word) + " is none of " + in_quotes(choices) + did_you_mean(word, choices));
  return word;
}
} // namespace

Section::Section(std::shared_ptr<internal::ParameterTree> tree, internal::SectionNode &node)
    : tree(std::move(tree)), node(&node)
{}

// Each add() records what the entry is with its default, reads the value if the file gives one, and records
// that.

void Section::add(const std::string &key, double &value, const Range &range, const std::string &text)
{
  Declared declared{key, "number", range.unit, describe(range), {}, text, {}, {}};
  if (contains(range, value))
    declared.fallback = to_text(value);
  Declared &entry = node->declare(declared);
  if (const PrmEntry *const given = node->given(key)) {
    value = read_number(*this, key, given->value, range);
    entry.value = to_text(value);
  }
}

void Section::add(const std::string &key, unsigned int &value, const Range &range, const std::string &text)
{
  const Range whole = unsigned_range(range);
  Declared declared{key, "whole number", range.unit, describe(whole), {}, text, {}, {}};
  if (contains(whole, value))
    declared.fallback = std::to_string(value);
  Declared &entry = node->declare(declared);
  if (const PrmEntry *const given = node->given(key)) {
    const double number = evaluate(*this, key, given->value);
    const double rounded = std::round(number);
    if (std::abs(number - rounded) > 1e-9)
      refuse(*this, key, shown(given->value, number) + " must be a whole number");
    // Rounded first: 0.3 / 0.1 is a little less than 3.
    check_range(*this, key, given->value, rounded, whole);
    if (rounded > std::numeric_limits<unsigned int>::max())
      refuse(*this, key, shown(given->value, number) + " is too large");
    value = static_cast<unsigned int>(rounded);
    entry.value = std::to_string(value);
  }
}

void Section::add(const std::string &key, bool &value, const std::string &text)
{
  const auto word = [](const bool v) { return std::string(v ? "true" : "false"); };
  Declared &entry = node->declare({key, "true or false", "", "", {"true", "false"}, text, word(value), {}});
  if (const PrmEntry *const given = node->given(key)) {
    // deal.II takes yes and no as well.
    const std::string answer = given->value == "yes" ? "true" : given->value == "no" ? "false" : given->value;
    value = read_choice(*this, key, answer, {"true", "false"}) == "true";
    entry.value = word(value);
  }
}

void Section::add(const std::string &key, std::string &value, const std::string &text)
{
  Declared &entry = node->declare({key, "text", "", "", {}, text, value, {}});
  if (const PrmEntry *const given = node->given(key)) {
    value = given->value;
    entry.value = value;
  }
}

void Section::add(const std::string &key, std::string &value, const std::vector<std::string> &choices,
                  const std::string &text)
{
  Declared declared{key, "choice", "", "", choices, text, {}, {}};
  if (is_one_of(choices, value))
    declared.fallback = value;
  Declared &entry = node->declare(declared);
  if (const PrmEntry *const given = node->given(key)) {
    value = read_choice(*this, key, given->value, choices);
    entry.value = value;
  }
}

void Section::add(const std::string &key, std::vector<double> &value, const unsigned int n_values,
                  const Range &range, const std::string &text)
{
  Declared declared{key, "numbers", range.unit, describe(range), {}, text, {}, {}};
  const bool inside =
      std::all_of(value.begin(), value.end(), [&](const double v) { return contains(range, v); });
  if (inside && (n_values == 0 || value.size() == n_values))
    declared.fallback = to_text(value);
  Declared &entry = node->declare(declared);
  if (const PrmEntry *const given = node->given(key)) {
    const std::vector<std::string> parts = read_list(*this, key, given->value);
    if (n_values > 0 && parts.size() != n_values)
      refuse(*this, key,
             std::to_string(n_values) + " numbers separated by commas are needed, not " +
                 std::to_string(parts.size()));
    value.clear();
    for (const std::string &part : parts)
      value.push_back(read_number(*this, key, part, range));
    entry.value = to_text(value);
  }
}

void Section::add(const std::string &key, std::vector<std::string> &value, const std::string &text)
{
  Declared &entry = node->declare({key, "names", "", "", {}, text, join(value), {}});
  if (const PrmEntry *const given = node->given(key)) {
    value = read_list(*this, key, given->value);
    entry.value = join(value);
  }
}

void Section::add(const std::string &key, std::vector<std::string> &value,
                  const std::vector<std::string> &choices, const std::string &text)
{
  Declared declared{key, "choices", "", "", choices, text, {}, {}};
  if (std::all_of(value.begin(), value.end(),
                  [&](const std::string &word) { return is_one_of(choices, word); }))
    declared.fallback = join(value);
  Declared &entry = node->declare(declared);
  if (const PrmEntry *const given = node->given(key)) {
    value = read_list(*this, key, given->value);
    for (const std::string &word : value)
      read_choice(*this, key, word, choices);
    entry.value = join(value);
  }
}

void Section::add(const std::string &key, Function &value, const unsigned int n_components,
                  const std::string &unit, const std::string &text)
{
  // A function that was made from nothing stands for zero, with as many components as needed.
  if (value.n_components() == 1 && value.text() == "0" && n_components > 1)
    value = Function(join(std::vector<std::string>(n_components, "0")), {}, {});
  Declared declared{key, "function", unit, "", {}, text, {}, {}};
  if (value.n_components() == n_components)
    declared.fallback = value.text();
  Declared &entry = node->declare(declared);
  if (const PrmEntry *const given = node->given(key)) {
    try {
      value = Function(given->value, constants(), given->origin);
    } catch (const InputError &error) {
      refuse(*this, key, std::string(error.what()).substr(given->origin.prefix().size()));
    }
    if (value.n_components() != n_components)
      refuse(*this, key,
             std::to_string(n_components) + (n_components == 1 ? " component is" : " components are") +
                 " needed, but " + in_quotes(given->value) + " has " + std::to_string(value.n_components()));
    if (tree->dimension == 2 && value.depends_on("z"))
      fail(key, "there is no z in 2-D; the vertical axis is y");
    entry.value = value.text();
  }
}

Section Section::subsection(const std::string &name) const
{
  return {tree, node->child(name)};
}

std::vector<std::string> Section::user_sections(const std::string &example) const
{
  node->mark_known();
  node->has_user_sections = true;
  if (describing())
    return {example};
  std::vector<std::string> names, misspelt;
  if (node->in_file == nullptr)
    return names;
  for (const PrmSection &section : node->in_file->sections)
    if (!section.only_override)
      names.push_back(section.name);
  // The command line changes sections, it does not make new ones: a misspelt name would otherwise go
  // unnoticed.
  for (const PrmSection &section : node->in_file->sections)
    if (section.only_override)
      throw InputError(section.origin, "the file has no section " + in_quotes(section.name) + " in " +
                                           path() + suggestion(section.name, names));
  return names;
}

bool Section::has(const std::string &key) const
{
  node->presence_asked.insert(key);
  return node->given(key) != nullptr;
}

bool Section::has_subsection(const std::string &name) const
{
  node->presence_asked.insert(name);
  const internal::SectionNode *const child = node->find_child(name);
  return child != nullptr && child->in_file != nullptr;
}

bool Section::describing() const
{
  return tree->describing;
}

const std::string &Section::name() const
{
  return node->name;
}

std::string Section::path() const
{
  return node->path();
}

Origin Section::origin(const std::string &key) const
{
  if (const PrmEntry *const given = node->given(key))
    return given->origin;
  // A section that the file does not have would stand in the one above.
  for (const internal::SectionNode *above = node; above->parent != nullptr; above = above->parent)
    if (above->in_file != nullptr)
      return above->in_file->origin;
  return {tree->file_name, 0};
}

void Section::fail(const std::string &key, const std::string &message) const
{
  std::string place = path();
  if (!key.empty())
    place += (place.empty() ? "" : "/") + key;
  place = shortened(place, 200);
  throw InputError(origin(key), (place.empty() ? "" : place + ": ") + message);
}

void Section::require(const std::string &key, const std::string &owner) const
{
  if (describing() || has(key))
    return;
  std::vector<std::string> unknown;
  if (node->in_file != nullptr)
    for (const PrmEntry &entry : node->in_file->entries)
      if (std::none_of(node->declared.begin(), node->declared.end(),
                       [&](const Declared &one) { return one.key == entry.key; }))
        unknown.push_back(entry.key);
  const std::string misspelt = nearest(key, unknown);
  fail(misspelt, owner + " needs a " + in_quotes(key) +
                     (misspelt.empty() ? "" : "; is that what " + in_quotes(misspelt) + " stands for?"));
}

void Section::require_start(const std::string &key, const Function &value) const
{
  if (!value.is_uniform())
    return;
  const double place[3] = {0., 0., 0.};
  try {
    for (unsigned int c = 0; c < value.n_components(); ++c)
      value.value(place, 0., c);
  } catch (const NumericalError &) {
    fail(key, in_quotes(value.text()) + " is not finite at the start, t = 0");
  }
}

void Section::set_dimension(const unsigned int dim)
{
  tree->dimension = dim;
}

const Constants &Section::constants() const
{
  return tree->constants;
}

ParameterFile::ParameterFile(std::shared_ptr<internal::ParameterTree> tree) : tree(std::move(tree)) {}

ParameterFile::ParameterFile(const std::string &file_name, const std::vector<std::string> &overrides)
    : tree(std::make_shared<internal::ParameterTree>(file_name, overrides))
{}

ParameterFile ParameterFile::describing()
{
  auto tree = std::make_shared<internal::ParameterTree>();
  tree->describing = true;
  return ParameterFile(tree);
}

Section ParameterFile::root() const
{
  return {tree, tree->root};
}
} // namespace peat
