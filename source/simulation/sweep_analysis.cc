#include <peat/simulation/sweep_analysis.h>

#include <algorithm>
#include <cmath>

namespace peat {
std::vector<bool> pareto_front(const std::vector<Bought> &runs)
{
  std::vector<bool> front(runs.size(), false);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Bought &run = runs[i];
    if (!std::isfinite(run.error))
      continue;
    front[i] = true;
    for (std::size_t j = 0; j < runs.size() && front[i]; ++j) {
      const Bought &other = runs[j];
      if (j == i || !std::isfinite(other.error) || other.seconds > run.seconds || other.error > run.error)
        continue;
      front[i] = other.seconds == run.seconds && other.error == run.error && i < j;
    }
  }
  return front;
}

std::optional<std::size_t> cheapest(const std::vector<Bought> &runs, const double target)
{
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < runs.size(); ++i)
    if (runs[i].error <= target && (!found || runs[i].seconds < runs[*found].seconds))
      found = i;
  return found;
}

double PowerLaw::operator()(const double x) const
{
  return factor * std::pow(x, exponent);
}

std::optional<PowerLaw> fit_power_law(const std::vector<double> &x, const std::vector<double> &y)
{
  std::vector<double> a, b;
  for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i)
    if (x[i] > 0. && y[i] > 0. && std::isfinite(x[i]) && std::isfinite(y[i])) {
      a.push_back(std::log(x[i]));
      b.push_back(std::log(y[i]));
    }
  if (a.empty())
    return {};
  double mean_a = 0., mean_b = 0.;
  for (std::size_t i = 0; i < a.size(); ++i) {
    mean_a += a[i] / a.size();
    mean_b += b[i] / a.size();
  }
  double square = 0., product = 0.;
  for (std::size_t i = 0; i < a.size(); ++i) {
    square += (a[i] - mean_a) * (a[i] - mean_a);
    product += (a[i] - mean_a) * (b[i] - mean_b);
  }
  // Cell sizes that differ by round-off are the same.
  if (square < 1e-12 * a.size())
    return {};
  const double exponent = product / square;
  return PowerLaw{std::exp(mean_b - exponent * mean_a), exponent};
}

std::optional<Bought> forecast(const std::vector<SeriesRun> &series, const double cell_size)
{
  std::vector<SeriesRun> finest = series;
  std::sort(finest.begin(), finest.end(),
            [](const SeriesRun &a, const SeriesRun &b) { return a.cell_size < b.cell_size; });
  if (finest.size() < 2 || !(cell_size < finest[0].cell_size))
    return {};
  const SeriesRun &last = finest[0], &before = finest[1];
  const std::vector<double> sizes = {before.cell_size, last.cell_size};
  const auto time = fit_power_law(sizes, {before.bought.seconds, last.bought.seconds});
  const auto error = fit_power_law(sizes, {before.bought.error, last.bought.error});
  if (!time || !error)
    return {};
  return Bought{(*time)(cell_size), error->exponent > 0. ? (*error)(cell_size)
                                                         : std::min(before.bought.error, last.bought.error)};
}

std::optional<TargetCost> cost_of_target(const std::vector<SeriesRun> &series, const double target)
{
  constexpr double least_order = 0.25;
  constexpr double farthest = 32.;
  std::vector<SeriesRun> runs;
  for (const SeriesRun &run : series)
    if (std::isfinite(run.bought.error))
      runs.push_back(run);
  std::sort(runs.begin(), runs.end(),
            [](const SeriesRun &a, const SeriesRun &b) { return a.cell_size > b.cell_size; });
  std::size_t good = 0;
  while (good < runs.size() && runs[good].bought.error > target)
    ++good;
  if (good == 0 && !runs.empty())
    return TargetCost{runs[0].cell_size, runs[0].bought.seconds, true};
  if (runs.size() < 2)
    return {};
  const bool is_measured = good < runs.size();
  const SeriesRun &fine = runs[is_measured ? good : runs.size() - 1];
  const SeriesRun &coarse = runs[(is_measured ? good : runs.size() - 1) - 1];
  const std::vector<double> sizes = {coarse.cell_size, fine.cell_size};
  const auto error = fit_power_law(sizes, {coarse.bought.error, fine.bought.error});
  const auto time = fit_power_law(sizes, {coarse.bought.seconds, fine.bought.seconds});
  if (!error || !time)
    return is_measured ? std::optional<TargetCost>({fine.cell_size, fine.bought.seconds, true})
                       : std::nullopt;
  if (error->exponent < least_order)
    return {};
  const double cell_size = std::pow(target / error->factor, 1. / error->exponent);
  if (cell_size * farthest < fine.cell_size)
    return {};
  return TargetCost{cell_size, (*time)(cell_size), is_measured};
}

std::optional<std::size_t> better_run(const Bought &expected, const std::vector<Bought> &finished,
                                      const double margin)
{
  if (margin < 1.)
    return {};
  for (std::size_t i = 0; i < finished.size(); ++i)
    if (margin * finished[i].seconds < expected.seconds && margin * finished[i].error < expected.error)
      return i;
  return {};
}
} // namespace peat
