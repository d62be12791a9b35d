#include <peat/simulation/schedule.h>

#include <algorithm>
#include <cmath>

namespace peat {
Schedule Schedule::every(const double interval, const double start, const double end)
{
  Schedule schedule;
  schedule.tolerance = 1e-12 * std::abs(end);
  if (interval > 0.) {
    const double n = std::ceil((end - start) / interval - 1e-9);
    for (double i = 1.; i < n; ++i)
      schedule.times.push_back(start + i * interval);
  }
  schedule.times.push_back(end);
  return schedule;
}

Schedule Schedule::at(std::vector<double> times, const double start, const double end)
{
  Schedule schedule;
  std::sort(times.begin(), times.end());
  schedule.tolerance = 1e-12 * std::abs(end);
  for (const double time : times)
    if (time > start + schedule.tolerance && time <= end + schedule.tolerance)
      schedule.times.push_back(std::min(time, end));
  return schedule;
}

bool Schedule::due(const double time)
{
  const std::size_t before = position;
  while (position < times.size() && time >= times[position] - tolerance)
    ++position;
  return position > before;
}
} // namespace peat
