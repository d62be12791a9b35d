#pragma once

#include <peat/base/parameters.h>

#include <functional>
#include <map>
#include <memory>
#include <string>

// The one plug-in mechanism. A family has a base class; a member is one .cc with one line
//   const Member<Law, LinearElastic> member("linear elastic", "One sentence about it.");
// and a constructor that takes the Section to read its parameters from.

namespace peat {
template <class Base>
struct FamilyEntry
{
  std::string text;
  std::function<std::unique_ptr<Base>(const Section &)> make;
};

template <class Base>
std::map<std::string, FamilyEntry<Base>> &family()
{
  static std::map<std::string, FamilyEntry<Base>> entries;
  return entries;
}

template <class Base, class Derived>
struct Member
{
  Member(const std::string &name, const std::string &text)
  {
    family<Base>()[name] = {text, [](const Section &section) { return std::make_unique<Derived>(section); }};
  }
};

/// Reads which member of a family the entry `key` of a section chooses, and makes it. A member's own
/// parameters stand in the subsection that has its name. In the reference every member declares its entries.
template <class Base>
std::unique_ptr<Base> choose(Section section, const std::string &key, std::string fallback,
                             const std::string &text)
{
  std::vector<std::string> names;
  std::string explained = text;
  for (const auto &[name, entry] : family<Base>()) {
    names.push_back(name);
    explained += " '" + name + "': " + entry.text;
  }
  section.add(key, fallback, names, explained);
  if (section.describing())
    for (const auto &[name, entry] : family<Base>())
      if (name != fallback)
        entry.make(section.subsection(name));
  return family<Base>().at(fallback).make(section.subsection(fallback));
}
} // namespace peat
