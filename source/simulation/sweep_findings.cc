#include "sweep_output.h"

#include <peat/base/nan.h>
#include <peat/base/text.h>
#include <peat/simulation/difference.h>
#include <peat/simulation/log.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <tuple>

namespace peat {
namespace {
std::optional<std::size_t> finest_run(const std::vector<SweepRun> &runs)
{
  std::optional<std::size_t> finest;
  const auto fineness = [&](const SweepRun &run) {
    return std::make_tuple(-run.cell_size, run.unknowns, run.steps);
  };
  for (std::size_t i = 0; i < runs.size(); ++i)
    if (runs[i].is_done() && (!finest || fineness(runs[i]) > fineness(runs[*finest])))
      finest = i;
  return finest;
}

std::string history_file(const SweepData &data, const SweepRun &run)
{
  return data.directory + "/runs/" + run.name + "/probes.csv";
}

/// Largest difference of the components of each chosen quantity at each probe, over the size of the quantity
/// at the probe where that is largest: a pressure that is zero at a drained surface is not measured against
/// itself.
std::map<std::string, double> largest_differences(const std::vector<Difference> &differences,
                                                  const std::vector<std::string> &fields, const bool largest)
{
  const auto is_wanted = [&](const Difference &difference) {
    return difference.n > 0 && !difference.negligible &&
           std::find(fields.begin(), fields.end(), quantity_of(difference.field)) != fields.end();
  };
  std::map<std::string, double> scales, result;
  for (const Difference &difference : differences)
    if (is_wanted(difference)) {
      double &scale = scales[quantity_of(difference.field)];
      scale = std::max(scale, largest ? difference.scale_Linf : difference.scale_L2);
    }
  for (const Difference &difference : differences)
    if (is_wanted(difference)) {
      const std::string quantity = quantity_of(difference.field);
      double &error = result[quantity + " at " + difference.name];
      error = std::max(error, (largest ? difference.Linf : difference.L2) / scales[quantity]);
    }
  return result;
}
} // namespace

void compare_with_finest(SweepData &data, const std::vector<std::string> &fields, const double end_time,
                         const double stiffness)
{
  data.finest = finest_run(data.runs);
  if (!data.finest)
    return;
  const Histories finest = read_histories(history_file(data, data.runs[*data.finest]));
  std::vector<std::map<std::string, double>> errors(data.runs.size());
  std::set<std::string> names;
  for (std::size_t i = 0; i < data.runs.size(); ++i) {
    if (!data.runs[i].is_done() || i == *data.finest)
      continue;
    auto differences = compare_histories(read_histories(history_file(data, data.runs[i])), finest, 0.);
    mark_negligible(differences, data.runs[i].cell_size, end_time, stiffness);
    errors[i] = largest_differences(differences, fields, data.norm == "Linf");
    for (const auto &[name, error] : errors[i])
      names.insert(name);
  }
  data.errors.assign(names.begin(), names.end());
  for (std::size_t i = 0; i < data.runs.size(); ++i) {
    SweepRun &run = data.runs[i];
    run.errors.clear();
    run.error = errors[i].empty() ? nan : 0.;
    for (const std::string &name : data.errors) {
      const auto found = errors[i].find(name);
      run.errors.push_back(found == errors[i].end() ? nan : found->second);
      run.error = std::max(run.error, found == errors[i].end() ? 0. : found->second);
    }
  }
}

namespace {
/// Fits of all quantities over some runs of one series.
void add_orders(const SweepData &data, const std::size_t axis, const std::vector<const SweepRun *> &series,
                std::vector<FittedOrder> &orders)
{
  const bool over_cell_size = data.mesh_axis == axis;
  std::vector<double> x, error, time;
  for (const SweepRun *run : series) {
    x.push_back(over_cell_size ? run->cell_size : std::stod(run->values[axis]));
    error.push_back(run->error);
    time.push_back(run->seconds);
  }
  FittedOrder order;
  order.axis = axis;
  order.values = series.front()->values;
  order.values[axis].clear();
  order.over_cell_size = over_cell_size;
  const auto add = [&](const std::string &quantity, const std::vector<double> &y) {
    const auto law = fit_power_law(x, y);
    if (!law)
      return;
    order.quantity = quantity;
    order.exponent = law->exponent;
    order.n_runs = std::count_if(y.begin(), y.end(), [](const double v) { return v > 0.; });
    orders.push_back(order);
  };
  for (std::size_t e = 0; e < data.errors.size(); ++e) {
    std::vector<double> y;
    for (const SweepRun *run : series)
      y.push_back(run->errors[e]);
    add(data.errors[e], y);
  }
  if (data.errors.size() > 1)
    add("largest", error);
  add("time", time);
}
} // namespace

std::vector<FittedOrder> fitted_orders(const SweepData &data)
{
  std::vector<FittedOrder> orders;
  for (std::size_t axis = 0; axis < data.axes.size(); ++axis) {
    if (!data.axes[axis].is_numeric())
      continue;
    std::vector<std::vector<const SweepRun *>> all;
    for (const SweepRun &run : data.runs) {
      if (!run.is_done() || run.values[axis].empty())
        continue;
      const auto found = std::find_if(all.begin(), all.end(), [&](const auto &series) {
        return same_but_for(*series.front(), run, axis);
      });
      if (found == all.end())
        all.push_back({&run});
      else
        found->push_back(&run);
    }
    for (const auto &series : all)
      if (series.size() > 1)
        add_orders(data, axis, series, orders);
  }
  return orders;
}

std::string conclusions(const SweepData &data)
{
  std::vector<Bought> bought;
  for (const SweepRun &run : data.runs)
    bought.push_back(run.bought());
  const std::vector<bool> front = pareto_front(bought);
  std::string text;
  if (data.finest)
    text = "the case has no references; errors are differences from the finest run, '" +
           data.runs[*data.finest].name + "'\n";
  text += "Pareto front:";
  char line[240];
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < front.size(); ++i)
    if (front[i])
      order.push_back(i);
  std::sort(order.begin(), order.end(),
            [&](const std::size_t a, const std::size_t b) { return bought[a].seconds < bought[b].seconds; });
  for (const std::size_t i : order) {
    std::snprintf(line, sizeof(line), "\n  %-40s error %-9.3g %s", shortened(data.runs[i].name, 60).c_str(),
                  bought[i].error, readable_duration(bought[i].seconds).c_str());
    text += line;
  }
  if (order.empty())
    text += " no run with an error";
  for (const FittedOrder &fit : fitted_orders(data))
    if (fit.over_cell_size && fit.quantity != "time" &&
        (fit.quantity == "largest" || data.errors.size() == 1)) {
      const std::string others = run_name(fit.values);
      std::snprintf(line, sizeof(line), "\norder %.2f in cell size%s%s (%u runs)", fit.exponent,
                    others.empty() ? "" : " of ", shortened(others, 60).c_str(), fit.n_runs);
      text += line;
    }
  const auto best = cheapest(bought, data.target);
  std::snprintf(line, sizeof(line), "\nerror of %.3g: ", data.target);
  text += line;
  return text + (best ? "'" + data.runs[*best].name + "' in " + readable_duration(bought[*best].seconds)
                      : "no run comes to it");
}
} // namespace peat
