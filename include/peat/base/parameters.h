#pragma once

#include <peat/base/error.h>
#include <peat/base/expression.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace peat {
namespace internal {
class ParameterTree;
struct SectionNode;
} // namespace internal

/// What a number may be. Unit is "" for a pure number.
struct Range
{
  std::string unit;
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  bool lower_allowed = true;
  bool upper_allowed = true;
};

inline Range any(const std::string &unit)
{
  return {unit};
}
inline Range positive(const std::string &unit)
{
  return {unit, 0., std::numeric_limits<double>::infinity(), false, true};
}
inline Range nonnegative(const std::string &unit)
{
  return {unit, 0., std::numeric_limits<double>::infinity(), true, true};
}
inline Range between(const double lower, const double upper, const std::string &unit = "")
{
  return {unit, lower, upper, true, true};
}
inline Range strictly_between(const double lower, const double upper, const std::string &unit = "")
{
  return {unit, lower, upper, false, false};
}

/// One section of a parameter file. To declare an entry is to read it: after `add("Young modulus", E, ...)`
/// the variable E holds the value that the file gives, or keeps the default it had. Whatever the file
/// contains that was declared by nobody is refused by ParameterFile::refuse_unknown_entries().
///
/// Numbers may be expressions of the file's `Constants`; they are evaluated here. Every failure is an
/// InputError that names file and line. Sections are cheap handles: copy them freely, as long as their
/// ParameterFile lives.
class Section
{
public:
  /// A number within a range; the text is one sentence for the reference and the default file.
  void add(const std::string &key, double &value, const Range &range, const std::string &text);
  /// A whole number; expressions must evaluate to one (up to 1e-9).
  void add(const std::string &key, unsigned int &value, const Range &range, const std::string &text);
  void add(const std::string &key, bool &value, const std::string &text);
  /// Free text, a name or a file name.
  void add(const std::string &key, std::string &value, const std::string &text);
  /// One of several words.
  void add(const std::string &key, std::string &value, const std::vector<std::string> &choices,
           const std::string &text);
  /// Numbers separated by commas. With n_values > 0 exactly so many must be given.
  void add(const std::string &key, std::vector<double> &value, unsigned int n_values, const Range &range,
           const std::string &text);
  /// Names separated by commas.
  void add(const std::string &key, std::vector<std::string> &value, const std::string &text);
  /// Names separated by commas, each one of the choices.
  void add(const std::string &key, std::vector<std::string> &value, const std::vector<std::string> &choices,
           const std::string &text);
  /// A function of x, y, z, t and the constants with `n_components` parts separated by commas. The default is
  /// the text the function was made from.
  void add(const std::string &key, Function &value, unsigned int n_components, const std::string &unit,
           const std::string &text);

  /// The section of that name below this one; it need not be in the file.
  Section subsection(const std::string &name) const;

  /// Names of the sections below this one that the *user* named, in the file's order. `example` stands for
  /// them in the reference (`peat parameters`), where there is no file.
  std::vector<std::string> user_sections(const std::string &example) const;

  /// Whether the file sets this key / holds this section.
  bool has(const std::string &key) const;
  bool has_subsection(const std::string &name) const;

  /// True while the reference is being written: there is no file, and every member of a family declares its
  /// entries.
  bool describing() const;

  /// The last part of this section's path, e.g. the name of a body.
  const std::string &name() const;
  /// "Bodies/ground"
  std::string path() const;

  /// Where the key (or, with no argument, the section) stands in the file.
  Origin origin(const std::string &key = "") const;
  /// Throws an InputError at that key (or, if the file does not set it, at the section).
  [[noreturn]] void fail(const std::string &key, const std::string &message) const;
  /// Throws an InputError if the file does not set the key that `owner`, e.g. "body 'ground'", cannot do
  /// without; points at the entry that may be a misspelt one.
  void require(const std::string &key, const std::string &owner) const;
  /// Throws an InputError if a function of time alone has no value at t = 0.
  void require_start(const std::string &key, const Function &value) const;

  /// Functions that are read from now on, in any section, may depend on z only in three dimensions.
  void set_dimension(unsigned int dim);

  /// The constants of the file, for expressions that are not numbers or functions (shapes).
  const Constants &constants() const;

private:
  friend class ParameterFile;
  Section(std::shared_ptr<internal::ParameterTree> tree, internal::SectionNode &node);

  std::shared_ptr<internal::ParameterTree> tree;
  internal::SectionNode *node;
};

/// The value of an entry, as text.
struct ParameterValue
{
  std::vector<std::string> sections; ///< from the top down
  std::string key;
  std::string value;
  /// Words in it are names of constants: a function, a shape.
  bool is_expression = false;
  /// Of the section `Constants`.
  bool is_constant = false;

  /// "Bodies/ground/Shape"
  std::string path() const;
  /// Whether the name stands in an expression as a word of its own.
  bool mentions(const std::string &name) const;
};

/// A parameter file in deal.II's format (subsection, set, end, include, comments, continuation lines) with
/// what
/// `--set` overrides.
class ParameterFile
{
public:
  /// Reads the file and what it includes (relative to the including file), applies the overrides
  /// ("Section/Sub/Key=value"), and evaluates the section `Constants`. Throws InputError.
  ParameterFile(const std::string &file_name, const std::vector<std::string> &overrides);

  /// No file: every entry keeps its default and is recorded for the reference.
  static ParameterFile describing();

  Section root() const;

  /// Throws an InputError at the first entry or section of the file that no one declared, with the nearest
  /// declared name as a suggestion.
  void refuse_unknown_entries() const;

  /// The complete set of parameters as a parameter file that reproduces the run; expressions of numbers stand
  /// evaluated.
  void write_prm(std::ostream &out) const;
  /// Of all entries that have been read; "(not set)" where absence has a meaning of its own.
  std::vector<ParameterValue> values() const;
  /// The reference: every declared entry with meaning, unit, default and range.
  void write_markdown(std::ostream &out) const;
  void write_json(std::ostream &out) const;

private:
  explicit ParameterFile(std::shared_ptr<internal::ParameterTree> tree);
  std::shared_ptr<internal::ParameterTree> tree;
};
} // namespace peat
