#pragma once

// What Section and ParameterFile share; nobody else includes this.

#include <peat/base/parameters.h>
#include <peat/base/prm_file.h>

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace peat::internal {
/// An entry that the program knows. Defaults and values are texts as they would stand in a file.
struct Declared
{
  std::string key;
  /// "number", "whole number", "true or false", "text", "choice", "numbers", "names", "choices", "function",
  /// "constant"
  std::string kind;
  std::string unit;
  /// "> 0", or "" if any value is right.
  std::string range;
  std::vector<std::string> choices;
  std::string text;
  /// Nothing if the default is no admissible value; then it only says that nothing was given.
  std::optional<std::string> fallback;
  std::optional<std::string> value;
};

struct SectionNode
{
  /// Mirrors what the file holds, so that sections keep the file's order.
  SectionNode(const std::string &name, SectionNode *parent, const PrmSection *in_file);

  /// "Bodies/ground"
  std::string path() const;
  /// The entry as the file sets it, or null.
  const PrmEntry *given(const std::string &key) const;
  /// Null if there is none.
  SectionNode *find_child(const std::string &child) const;
  /// Made if there is none.
  SectionNode &child(const std::string &child);
  /// Records an entry; the first declaration counts.
  Declared &declare(Declared entry);
  /// The file may have this section.
  void mark_known();

  std::string name;
  SectionNode *parent;
  /// Null if the file does not have this section.
  const PrmSection *in_file;
  std::vector<Declared> declared;
  std::vector<std::unique_ptr<SectionNode>> children;
  /// Something was declared in it or below.
  bool is_known = false;
  bool has_user_sections = false;
  /// Keys and sections whose mere presence has a meaning: the complete file must not add them.
  std::set<std::string> presence_asked;
};

/// Whether the name stands in the expression as a word of its own.
bool mentions(const std::string &expression, const std::string &name);

class ParameterTree
{
public:
  ParameterTree() : root("", nullptr, nullptr) {}
  ParameterTree(const std::string &file_name, const std::vector<std::string> &overrides);

  std::string file_name;
  PrmSection file;
  SectionNode root;
  Constants constants;
  bool describing = false;
  /// 2 or 3 once it is known.
  unsigned int dimension = 0;

private:
  void evaluate_constants();
};
} // namespace peat::internal
