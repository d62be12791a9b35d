#pragma once

#include <limits>

namespace peat {
/// A number that is not known.
inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();
} // namespace peat
