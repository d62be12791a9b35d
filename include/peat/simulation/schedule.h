#pragma once

#include <limits>
#include <string>
#include <vector>

namespace peat {
/// Times at which something is due. Steps are chosen so that they end there exactly.
class Schedule
{
public:
  /// Every `interval` from `start` on, and at `end`; interval 0: only at `end`.
  static Schedule every(double interval, double start, double end);
  /// At these times as far as they lie in (start, end].
  static Schedule at(std::vector<double> times, double start, double end);

  /// The next time that is due; infinity when none is left.
  double next() const
  {
    return position < times.size() ? times[position] : std::numeric_limits<double>::infinity();
  }
  /// Whether something is due at this time, up to the round-off of sums of steps; if so it is ticked off.
  bool due(double time);

private:
  std::vector<double> times;
  double tolerance = 0.;
  std::size_t position = 0;
};
} // namespace peat
