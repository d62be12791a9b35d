#include "parameter_tree.h"

#include <peat/base/text.h>

#include <algorithm>
#include <cctype>
#include <stdexcept>

namespace peat::internal {
SectionNode::SectionNode(const std::string &name, SectionNode *parent, const PrmSection *in_file)
    : name(name), parent(parent), in_file(in_file)
{
  if (in_file != nullptr)
    for (const PrmSection &section : in_file->sections)
      children.push_back(std::make_unique<SectionNode>(section.name, this, &section));
}

std::string SectionNode::path() const
{
  if (parent == nullptr)
    return name;
  const std::string above = parent->path();
  return above.empty() ? name : above + "/" + name;
}

const PrmEntry *SectionNode::given(const std::string &key) const
{
  return in_file == nullptr ? nullptr : in_file->find_entry(key);
}

SectionNode *SectionNode::find_child(const std::string &child) const
{
  for (const auto &candidate : children)
    if (candidate->name == child)
      return candidate.get();
  return nullptr;
}

SectionNode &SectionNode::child(const std::string &child)
{
  if (SectionNode *const present = find_child(child))
    return *present;
  children.push_back(std::make_unique<SectionNode>(child, this, nullptr));
  return *children.back();
}

Declared &SectionNode::declare(Declared entry)
{
  mark_known();
  for (Declared &present : declared)
    if (present.key == entry.key) {
      if (present.kind != entry.kind || present.unit != entry.unit)
        throw std::logic_error("'" + entry.key + "' in '" + path() +
                               "' is declared twice, as two different things");
      return present;
    }
  entry.value = entry.fallback;
  declared.push_back(std::move(entry));
  return declared.back();
}

void SectionNode::mark_known()
{
  for (SectionNode *node = this; node != nullptr; node = node->parent)
    node->is_known = true;
}

ParameterTree::ParameterTree(const std::string &file_name, const std::vector<std::string> &overrides)
    : file_name(file_name), file(read_prm(file_name, overrides)), root("", nullptr, &file)
{
  evaluate_constants();
}

namespace {
bool is_name_character(const char c)
{
  return c == '_' || (static_cast<unsigned char>(c) < 128 && std::isalnum(static_cast<unsigned char>(c)));
}

bool is_identifier(const std::string &name)
{
  return !name.empty() && !(name[0] >= '0' && name[0] <= '9') &&
         std::all_of(name.begin(), name.end(), is_name_character);
}

} // namespace

bool mentions(const std::string &expression, const std::string &name)
{
  for (std::size_t i = expression.find(name); i != std::string::npos; i = expression.find(name, i + 1)) {
    const std::size_t end = i + name.size();
    if ((i == 0 || !is_name_character(expression[i - 1])) &&
        (end == expression.size() || !is_name_character(expression[end])))
      return true;
  }
  return false;
}

namespace {
double value_of_constant(const PrmEntry &entry, const Constants &earlier, const std::vector<PrmEntry> &all)
{
  const std::string place = "Constants/" + shortened(entry.key, 60) + ": ";
  if (!is_identifier(entry.key))
    throw InputError(entry.origin, place + "the name of a constant has letters, digits and '_' only");
  try {
    // A name that an expression cannot use as a constant is refused here.
    evaluate(entry.key, {{entry.key, 0.}}, Origin());
    return evaluate(entry.value, earlier, Origin());
  } catch (const InputError &error) {
    for (const PrmEntry &other : all)
      if (other.order > entry.order && is_identifier(other.key) && mentions(entry.value, other.key))
        throw InputError(entry.origin, place + "constants are evaluated in the file's order, and " +
                                           in_quotes(other.key) + " is set further below");
    throw InputError(entry.origin, place + error.what());
  }
}
} // namespace

void ParameterTree::evaluate_constants()
{
  SectionNode &node = root.child("Constants");
  node.mark_known();
  if (node.in_file == nullptr)
    return;

  std::vector<std::string> names;
  for (const PrmEntry &entry : node.in_file->entries)
    if (!entry.only_override)
      names.push_back(entry.key);
  for (const PrmSection &section : node.in_file->sections)
    throw InputError(section.origin, "the section 'Constants' holds numbers only, not the section " +
                                         in_quotes(section.name));
  for (const PrmEntry &entry : node.in_file->entries) {
    if (entry.only_override)
      throw InputError(entry.origin,
                       "the file has no constant " + in_quotes(entry.key) + suggestion(entry.key, names));
    const double value = value_of_constant(entry, constants, node.in_file->entries);
    constants[entry.key] = value;
    node.declare({entry.key, "constant", "", "", {}, "", to_text(value), {}});
  }
}
} // namespace peat::internal
