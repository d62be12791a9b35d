#pragma once

#include <peat/base/parameters.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

// The entry 'Components' of conditions that act on some components of the motion.

namespace peat {
template <int dim>
std::vector<std::string> axis_names()
{
  const std::vector<std::string> names = {"x", "y", "z"};
  return {names.begin(), names.begin() + dim};
}

/// The components that are named. None, or one twice, is refused.
template <int dim>
std::array<bool, dim> named_components(const Section &section, const std::vector<std::string> &components)
{
  if (components.empty())
    section.fail("Components", "name at least one component");
  std::array<bool, dim> named{};
  for (unsigned int d = 0; d < dim; ++d) {
    const std::string axis = axis_names<dim>()[d];
    const auto n = std::count(components.begin(), components.end(), axis);
    if (n > 1)
      section.fail("Components", "'" + axis + "' stands twice");
    named[d] = n == 1;
  }
  return named;
}
} // namespace peat
