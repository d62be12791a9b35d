#pragma once

#include <peat/base/error.h>

#include <string>
#include <vector>

namespace peat {
/// One `set KEY = VALUE`. The value may be empty.
struct PrmEntry
{
  std::string key;
  std::string value;
  /// Where the value in force was set; the file is "--set TEXT" for an override.
  Origin origin;
  /// Rank among all entries and sections as they were first met.
  unsigned int order = 0;
  /// Number of the file that set the value; each inclusion of a file counts anew.
  unsigned int reading = 0;
  /// No file sets this key, only `--set` does.
  bool only_override = false;
};

/// One `subsection NAME ... end`, or the whole file (with an empty name).
struct PrmSection
{
  std::string name;
  /// Where it was opened first.
  Origin origin;
  unsigned int order = 0;
  bool only_override = false;
  std::vector<PrmEntry> entries;
  std::vector<PrmSection> sections;

  /// Null if there is none of that name.
  const PrmEntry *find_entry(const std::string &key) const;
  const PrmSection *find_section(const std::string &section) const;
};

/// Reads a file in deal.II's parameter format, and what it includes, without knowing what the entries mean;
/// then applies the overrides "Section/Sub/Key=value".
///
/// A section opened twice is one section. A file may set a key once; it may override what the files it
/// included before have set. Names and values have single blanks inside and none around. Throws InputError.
PrmSection read_prm(const std::string &file_name, const std::vector<std::string> &overrides);
} // namespace peat
