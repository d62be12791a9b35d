#include <peat/base/parameters.h>
#include <peat/base/text.h>

#include "parameter_tree.h"

#include <algorithm>
#include <ostream>
#include <sstream>

namespace peat {
namespace {
using internal::Declared;
using internal::SectionNode;

// --- The parameter file

/// A comment in lines of at most 100 characters.
void write_comment(std::ostream &out, const std::string &indent, const std::string &text)
{
  std::istringstream words(text);
  std::string word, line = indent + "#";
  while (words >> word) {
    if (line.size() + 1 + word.size() > 100 && line.size() > indent.size() + 1) {
      out << line << '\n';
      line = indent + "#";
    }
    line += " " + word;
  }
  out << line << '\n';
}

/// "Stiffness of the skeleton [Pa], > 0, default 1e7"
std::string comment(const Declared &entry)
{
  std::string text = entry.text;
  if (!text.empty() && text.back() == '.')
    text.pop_back();
  if (!entry.unit.empty())
    text += " [" + entry.unit + "]";
  if (!entry.range.empty())
    text += ", " + entry.range;
  // The text of a family explains its members by name already.
  if (!entry.choices.empty() && text.find("'" + entry.choices.front() + "':") == std::string::npos)
    text += ", of: " + join(entry.choices);
  if (!entry.fallback.has_value())
    return text + ", no default";
  return text + ", default " + (entry.fallback->empty() ? "empty" : *entry.fallback);
}

/// Presence has a meaning, and the file does not set it.
bool is_absent(const SectionNode &node, const Declared &entry)
{
  return node.given(entry.key) == nullptr && node.presence_asked.count(entry.key) > 0;
}

void write_entry(std::ostream &out, const SectionNode &node, const Declared &entry, const std::string &indent)
{
  if (entry.kind != "constant")
    write_comment(out, indent, comment(entry));
  // Where presence has a meaning, and where there is no value, the line is only shown.
  out << indent << (is_absent(node, entry) || !entry.value.has_value() ? "# " : "") << "set " << entry.key
      << " =";
  if (entry.value.has_value() && !entry.value->empty())
    out << ' ' << *entry.value;
  out << '\n';
}

/// Sections whose presence would change the run: those that the program looks for and the file does not have,
/// and, in the reference, the members of a family that are not chosen.
bool must_be_absent(const SectionNode &node, const SectionNode &child)
{
  if (child.in_file != nullptr)
    return false;
  bool is_member = false, is_chosen = false;
  for (const Declared &entry : node.declared)
    if (is_one_of(entry.choices, child.name)) {
      is_member = true;
      is_chosen = is_chosen || entry.value == child.name;
    }
  return node.presence_asked.count(child.name) > 0 || (is_member && !is_chosen);
}

bool has_entries(const SectionNode &node)
{
  return !node.declared.empty() || std::any_of(node.children.begin(), node.children.end(),
                                               [](const auto &child) { return has_entries(*child); });
}

void write_section(std::ostream &out, const SectionNode &node, const std::string &indent)
{
  for (const Declared &entry : node.declared)
    write_entry(out, node, entry, indent);
  for (const auto &child : node.children)
    if (has_entries(*child)) {
      const std::string start = indent + (must_be_absent(node, *child) ? "# " : "");
      out << '\n' << start << "subsection " << child->name << '\n';
      write_section(out, *child, start + "  ");
      out << start << "end\n";
    }
}

void collect(const SectionNode &node, const std::vector<std::string> &sections,
             std::vector<ParameterValue> &values)
{
  for (const Declared &entry : node.declared) {
    ParameterValue value;
    value.sections = sections;
    value.key = entry.key;
    value.value = entry.value.value_or("");
    value.is_expression = entry.kind == "function" || entry.kind == "text";
    value.is_constant = entry.kind == "constant";
    if (is_absent(node, entry))
      value.value = "(not set)";
    values.push_back(value);
  }
  for (const auto &child : node.children) {
    std::vector<std::string> below = sections;
    below.push_back(child->name);
    collect(*child, below, values);
  }
}

// --- The reference

std::string without_bars(const std::string &text)
{
  std::string result;
  for (const char c : text)
    result += c == '|' ? std::string("\\|") : std::string(1, c);
  return result;
}

std::string allowed(const Declared &entry)
{
  if (entry.choices.empty())
    return entry.range.empty() ? "-" : entry.range;
  return join(entry.choices);
}

void write_markdown_section(std::ostream &out, const SectionNode &node)
{
  if (!node.declared.empty()) {
    out << "\n## " << (node.parent == nullptr ? "Top of the file" : node.path()) << "\n\n"
        << "| entry | default | unit | range | meaning |\n"
        << "|---|---|---|---|---|\n";
    for (const Declared &entry : node.declared) {
      const std::string fallback = !entry.fallback.has_value() ? "-"
                                   : entry.fallback->empty()   ? "empty"
                                                               : *entry.fallback;
      for (const std::string &cell :
           {entry.key, fallback, entry.unit.empty() ? "-" : entry.unit, allowed(entry)})
        out << "| " << without_bars(cell) << ' ';
      out << "| " << without_bars(entry.text) << " |\n";
    }
  }
  for (const auto &child : node.children)
    write_markdown_section(out, *child);
}

// --- JSON

std::string json_string(const std::string &text)
{
  std::string result = "\"";
  for (const char c : text)
    if (c == '"' || c == '\\')
      result += std::string("\\") + c;
    else if (c == '\n')
      result += "\\n";
    else
      result += c;
  return result + "\"";
}

std::string json_strings(const std::vector<std::string> &words)
{
  std::vector<std::string> strings;
  for (const std::string &word : words)
    strings.push_back(json_string(word));
  return "[" + join(strings) + "]";
}

/// The value in JSON's own types; null if there is none.
std::string json_value(const std::string &kind, const std::optional<std::string> &value)
{
  if (!value.has_value())
    return "null";
  if (kind == "numbers")
    return "[" + *value + "]";
  if (kind == "names" || kind == "choices")
    return json_strings(split_outside_parentheses(*value));
  const bool is_text = kind == "text" || kind == "choice" || kind == "function";
  return is_text ? json_string(*value) : *value;
}

void write_json_section(std::ostream &out, const SectionNode &node, bool &is_first)
{
  for (const Declared &entry : node.declared) {
    out << (is_first ? "\n" : ",\n") << "  {\"section\": " << json_string(node.path())
        << ", \"entry\": " << json_string(entry.key) << ", \"kind\": " << json_string(entry.kind)
        << ", \"unit\": " << json_string(entry.unit) << ", \"range\": " << json_string(entry.range)
        << ", \"choices\": " << json_strings(entry.choices)
        << ", \"default\": " << json_value(entry.kind, entry.fallback)
        << ", \"value\": " << json_value(entry.kind, entry.value) << ", \"text\": " << json_string(entry.text)
        << "}";
    is_first = false;
  }
  for (const auto &child : node.children)
    write_json_section(out, *child, is_first);
}
} // namespace

void ParameterFile::write_prm(std::ostream &out) const
{
  write_section(out, tree->root, "");
}

std::vector<ParameterValue> ParameterFile::values() const
{
  std::vector<ParameterValue> values;
  collect(tree->root, {}, values);
  return values;
}

std::string ParameterValue::path() const
{
  std::string path;
  for (const std::string &section : sections)
    path += section + "/";
  return path + key;
}

bool ParameterValue::mentions(const std::string &name) const
{
  return is_expression && internal::mentions(value, name);
}

void ParameterFile::write_markdown(std::ostream &out) const
{
  out << "# Parameters\n\n"
      << "Numbers may be expressions, e.g. `2*Height/h`, of the constants that the section `Constants` sets "
         "(`set Height = 5`), of `pi` and `e`. Functions may use `x`, `y`, `z` and `t` as well; their "
         "components are "
         "separated by commas.\n";
  write_markdown_section(out, tree->root);
}

void ParameterFile::write_json(std::ostream &out) const
{
  bool is_first = true;
  out << "[";
  write_json_section(out, tree->root, is_first);
  out << "\n]\n";
}
} // namespace peat
