#include <peat/simulation/sweep_plan.h>

#include <peat/base/text.h>
#include <peat/simulation/log.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <sstream>

namespace peat {
std::vector<std::vector<std::string>> combinations(const std::vector<SweepAxis> &axes)
{
  std::vector<std::vector<std::string>> all = {{}};
  for (const SweepAxis &axis : axes) {
    std::vector<std::vector<std::string>> longer;
    for (const auto &before : all)
      for (const std::string &value : axis.values) {
        longer.push_back(before);
        longer.back().push_back(value);
      }
    all.swap(longer);
  }
  return all;
}

std::string run_name(const std::vector<std::string> &values)
{
  std::string name;
  for (const std::string &value : values)
    if (!value.empty())
      name += (name.empty() ? "" : "_") + value;
  for (char &c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-')
      c = '_';
  return name;
}

std::string without_comparisons(const std::string &parameters)
{
  std::istringstream stream(parameters);
  std::string result;
  unsigned int depth = 0;
  bool left_out = false;
  for (std::string line; std::getline(stream, line);) {
    const std::string word = trim(line);
    const bool opens = word.compare(0, 11, "subsection ") == 0;
    if (opens && depth++ == 0)
      left_out = word == "subsection Sweep" || word == "subsection Compare";
    if (!left_out)
      result += line + '\n';
    if (word == "end" && --depth == 0)
      left_out = false;
  }
  return result;
}

std::vector<std::size_t> order_of_runs(const std::vector<SweepRun> &runs)
{
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < runs.size(); ++i)
    if (runs[i].state == SweepRun::State::waiting)
      order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](const std::size_t a, const std::size_t b) {
    return runs[a].nominal_seconds < runs[b].nominal_seconds;
  });
  return order;
}

bool same_but_for(const SweepRun &a, const SweepRun &b, const std::size_t axis)
{
  for (std::size_t k = 0; k < a.values.size(); ++k)
    if (k != axis && a.values[k] != b.values[k])
      return false;
  return true;
}

std::optional<std::size_t> mesh_axis(const std::vector<SweepRun> &runs, const std::vector<SweepAxis> &axes)
{
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    if (!axes[axis].is_numeric())
      continue;
    for (const SweepRun &a : runs)
      for (const SweepRun &b : runs)
        if (b.cell_size > a.cell_size * (1. + 1e-9) && a.cell_size > 0. && same_but_for(a, b, axis))
          return axis;
  }
  return {};
}

namespace {
/// The finished runs that differ from this one in the mesh alone.
std::vector<const SweepRun *> finished_series(const SweepRun &run, const std::vector<SweepRun> &runs,
                                              const std::optional<std::size_t> &mesh_axis)
{
  std::vector<const SweepRun *> series;
  for (const SweepRun &other : runs)
    if (mesh_axis && other.is_done() && same_but_for(run, other, *mesh_axis))
      series.push_back(&other);
  return series;
}

/// Measured over nominal time, geometric mean; nothing without runs.
std::optional<double> calibration(const std::vector<const SweepRun *> &runs)
{
  double sum = 0.;
  for (const SweepRun *run : runs)
    sum += std::log(std::max(run->total_seconds, 1e-3) / std::max(run->nominal_seconds, 1e-3));
  return runs.empty() ? std::nullopt : std::optional<double>(std::exp(sum / runs.size()));
}
} // namespace

std::string reason_to_skip(const SweepRun &run, const std::vector<SweepRun> &runs,
                           const std::optional<std::size_t> &mesh_axis, const double margin)
{
  std::vector<SeriesRun> series;
  for (const SweepRun *other : finished_series(run, runs, mesh_axis))
    series.push_back({other->cell_size, other->bought()});
  const auto expected = forecast(series, run.cell_size);
  if (!expected)
    return "";
  std::vector<const SweepRun *> done;
  std::vector<Bought> bought;
  for (const SweepRun &other : runs)
    if (other.is_done()) {
      done.push_back(&other);
      bought.push_back(other.bought());
    }
  const auto better = better_run(*expected, bought, margin);
  if (!better)
    return "";
  char text[160];
  std::snprintf(text, sizeof(text), "expected: error %.2g in %s, but %s had %.2g in %s", expected->error,
                readable_duration(expected->seconds).c_str(), shortened(done[*better]->name, 40).c_str(),
                bought[*better].error, readable_duration(bought[*better].seconds).c_str());
  return text;
}

double expected_seconds(const SweepRun &run, const std::vector<SweepRun> &runs,
                        const std::optional<std::size_t> &mesh_axis)
{
  auto factor = calibration(finished_series(run, runs, mesh_axis));
  if (!factor) {
    std::vector<const SweepRun *> done;
    for (const SweepRun &other : runs)
      if (other.is_done())
        done.push_back(&other);
    factor = calibration(done);
  }
  return run.nominal_seconds * factor.value_or(1.);
}
} // namespace peat
