#include <peat/base/parameters.h>
#include <peat/base/text.h>

#include "parameter_tree.h"

#include <algorithm>

namespace peat {
namespace {
using internal::Declared;
using internal::SectionNode;

std::string place(const SectionNode &node)
{
  return node.parent == nullptr ? "at the top of the file" : "in " + shortened(node.path(), 200);
}

std::vector<std::string> entry_names(const SectionNode &node)
{
  std::vector<std::string> names;
  for (const Declared &entry : node.declared)
    names.push_back(entry.key);
  return names;
}

std::vector<std::string> section_names(const SectionNode &node)
{
  std::vector<std::string> names;
  for (const auto &child : node.children)
    if (child->is_known)
      names.push_back(child->name);
  return names;
}

/// The first section that declares an entry of this name, or null.
const SectionNode *where_declared(const SectionNode &node, const std::string &key)
{
  for (const Declared &entry : node.declared)
    if (entry.key == key)
      return &node;
  for (const auto &child : node.children)
    if (const SectionNode *const found = where_declared(*child, key))
      return found;
  return nullptr;
}

const Declared *find_declared(const SectionNode &node, const std::string &key)
{
  for (const Declared &entry : node.declared)
    if (entry.key == key)
      return &entry;
  return nullptr;
}

std::string unknown_entry(const SectionNode &root, const SectionNode &node, const std::string &key)
{
  std::string message = "unknown entry " + in_quotes(key) + " " + place(node);
  const std::vector<std::string> names = entry_names(node);
  const SectionNode *const child = node.find_child(key);
  if (child != nullptr && child->is_known)
    return message + "; this is a section, write 'subsection " + key + "'";
  const SectionNode *const elsewhere = where_declared(root, key);
  if (nearest(key, names).empty() && elsewhere != nullptr)
    return message + "; it belongs " + place(*elsewhere);
  if (names.empty())
    return message + "; only subsections stand there";
  return message + suggestion(key, names);
}

std::string unknown_section(const SectionNode &node, const std::string &name)
{
  if (node.has_user_sections)
    return "the section " + in_quotes(name) + " " + place(node) + " is used by nothing";
  std::string message = "unknown section " + in_quotes(name) + " " + place(node);
  if (find_declared(node, name) != nullptr)
    return message + "; this is an entry, write 'set " + name + " = ...'";
  // The section of a family's member: of one that is not chosen, or that has no parameters.
  for (const Declared &entry : node.declared)
    if (std::find(entry.choices.begin(), entry.choices.end(), name) != entry.choices.end()) {
      const std::string chosen = entry.value.value_or("");
      return message + (chosen == name ? "; it has no entries"
                                       : "; it belongs to " + entry.key + " = " + name + ", not to " +
                                             entry.key + " = " + chosen);
    }
  const std::vector<std::string> names = section_names(node);
  return message + (names.empty() ? "; there are no subsections" : suggestion(name, names));
}

/// What the file holds and nobody declared.
struct Unknown
{
  const SectionNode *node = nullptr;
  std::string name;
  bool is_section = false;
  Origin origin;
  unsigned int order = 0;
};

/// Replaces `first` by what stands before it in this section or below.
void find_unknown(const SectionNode &node, Unknown &first)
{
  const auto is_earlier = [&](const unsigned int order) {
    return first.node == nullptr || order < first.order;
  };
  for (const PrmEntry &entry : node.in_file->entries)
    if (find_declared(node, entry.key) == nullptr && is_earlier(entry.order))
      first = {&node, entry.key, false, entry.origin, entry.order};
  for (const PrmSection &section : node.in_file->sections) {
    const SectionNode *const child = node.find_child(section.name);
    if (child->is_known)
      find_unknown(*child, first);
    else if (is_earlier(section.order))
      first = {&node, section.name, true, section.origin, section.order};
  }
}
} // namespace

void ParameterFile::refuse_unknown_entries() const
{
  if (tree->describing)
    return;
  Unknown unknown;
  find_unknown(tree->root, unknown);
  if (unknown.node == nullptr)
    return;
  throw InputError(unknown.origin, unknown.is_section
                                       ? unknown_section(*unknown.node, unknown.name)
                                       : unknown_entry(tree->root, *unknown.node, unknown.name));
}
} // namespace peat
