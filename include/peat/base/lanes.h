#pragma once

#include <cmath>

// Kernels and laws work on eight points at a time. A `Lanes` is an ordinary value to write formulas with; the
// compiler maps it to the widest registers the target has (one AVX-512, two AVX2 or four SSE2 registers).

namespace peat {
constexpr unsigned int n_lanes = 8;

typedef double Lanes __attribute__((vector_size(8 * sizeof(double))));

inline Lanes broadcast(const double x)
{
  return Lanes{x, x, x, x, x, x, x, x};
}

/// Apply a scalar function lane by lane: `map(x, [](double v) { return std::log(v); })`.
template <typename Function>
inline Lanes map(const Lanes x, const Function &function)
{
  Lanes result;
  for (unsigned int l = 0; l < n_lanes; ++l)
    result[l] = function(x[l]);
  return result;
}

inline double sum(const Lanes x)
{
  return ((x[0] + x[1]) + (x[2] + x[3])) + ((x[4] + x[5]) + (x[6] + x[7]));
}

inline Lanes min(const Lanes a, const Lanes b)
{
  return a < b ? a : b;
}

inline Lanes max(const Lanes a, const Lanes b)
{
  return a > b ? a : b;
}

inline Lanes sqrt(const Lanes x)
{
  return map(x, [](const double v) { return std::sqrt(v); });
}
} // namespace peat
