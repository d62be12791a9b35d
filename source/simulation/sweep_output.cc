#include "sweep_output.h"

#include "result_files.h"

#include <cmath>

namespace peat {
namespace {
using json = nlohmann::ordered_json;

std::string word(const SweepRun::State state)
{
  switch (state) {
  case SweepRun::State::waiting:
    return "waiting";
  case SweepRun::State::refused:
    return "refused";
  case SweepRun::State::skipped:
    return "skipped";
  case SweepRun::State::failed:
    return "failed";
  case SweepRun::State::interrupted:
    return "interrupted";
  case SweepRun::State::done:
    return "done";
  }
  return "";
}

std::vector<bool> front_of(const SweepData &data)
{
  std::vector<Bought> bought;
  for (const SweepRun &run : data.runs)
    bought.push_back(run.bought());
  return pareto_front(bought);
}

json describe(const SweepRun &run, const bool is_on_front)
{
  json errors = json::array();
  for (const double error : run.errors)
    errors.push_back(json_number(error));
  return {{"name", run.name},
          {"values", run.values},
          {"state", word(run.state)},
          {"reason", run.reason},
          {"from_before", run.from_before},
          {"cell_size", run.cell_size},
          {"seconds", run.seconds},
          {"total_seconds", run.total_seconds},
          {"points", run.points},
          {"unknowns", run.unknowns},
          {"steps", run.steps},
          {"peak_memory_bytes", run.peak_memory},
          {"binding_limit", run.binding_limit},
          {"errors", errors},
          {"error", json_number(run.error)},
          {"pareto", is_on_front}};
}

/// The series of runs in which only the mesh differs, and what the target costs in each.
json series_of(const SweepData &data)
{
  json list = json::array();
  if (!data.mesh_axis)
    return list;
  std::vector<const SweepRun *> firsts;
  for (const SweepRun &first : data.runs) {
    bool is_new = first.is_done();
    for (const SweepRun *other : firsts)
      is_new = is_new && !same_but_for(*other, first, *data.mesh_axis);
    if (!is_new)
      continue;
    firsts.push_back(&first);
    std::vector<SeriesRun> series;
    for (const SweepRun &run : data.runs)
      if (run.is_done() && same_but_for(first, run, *data.mesh_axis))
        series.push_back({run.cell_size, run.bought()});
    std::vector<std::string> values = first.values;
    values[*data.mesh_axis].clear();
    json entry = {{"values", values}, {"target", nullptr}};
    if (const auto cost = cost_of_target(series, data.target))
      entry["target"] = {
          {"cell_size", cost->cell_size}, {"seconds", cost->seconds}, {"is_measured", cost->is_measured}};
    list.push_back(entry);
  }
  return list;
}
} // namespace

void write_sweep_table(const SweepData &data)
{
  ReplacedFile file(data.directory + "/sweep.csv");
  std::vector<std::string> head = {"run", "state"};
  for (const SweepAxis &axis : data.axes)
    head.push_back(axis.key);
  for (const char *name : {"error", "time loop [s]", "total time [s]", "steps", "peak memory [B]", "points",
                           "unknowns", "cell size [m]", "Pareto front"})
    head.push_back(name);
  for (const std::string &name : data.errors)
    head.push_back("error: " + name);
  head.push_back("reason");
  *file << join_csv(head) << '\n';
  const std::vector<bool> front = front_of(data);
  for (std::size_t i = 0; i < data.runs.size(); ++i) {
    const SweepRun &run = data.runs[i];
    std::vector<std::string> row = {run.name, word(run.state)};
    row.insert(row.end(), run.values.begin(), run.values.end());
    for (const double value : {run.error, run.seconds, run.total_seconds, run.steps, run.peak_memory,
                               run.points, run.unknowns, run.cell_size})
      row.push_back(run.is_done() ? csv_number(value, "%.9g") : "");
    row.push_back(front[i] ? "yes" : "no");
    for (std::size_t e = 0; e < data.errors.size(); ++e)
      row.push_back(e < run.errors.size() ? csv_number(run.errors[e], "%.9g") : "");
    row.push_back(run.reason);
    *file << join_csv(row) << '\n';
  }
  file.close();
}

void write_sweep_summary(const SweepData &data)
{
  json summary;
  summary["version"] = PEAT_VERSION;
  summary["case"] = data.title;
  summary["file"] = data.file;
  summary["norm"] = data.norm;
  summary["target"] = data.target;
  summary["jobs"] = data.n_jobs;
  summary["errors"] = data.errors;
  summary["finest"] = data.finest ? json(data.runs[*data.finest].name) : json(nullptr);
  summary["axes"] = json::array();
  for (const SweepAxis &axis : data.axes)
    summary["axes"].push_back(
        {{"key", axis.key}, {"name", axis.name()}, {"values", axis.values}, {"numeric", axis.is_numeric()}});
  summary["mesh_axis"] = data.mesh_axis ? json(*data.mesh_axis) : json(nullptr);
  summary["runs"] = json::array();
  const std::vector<bool> front = front_of(data);
  for (std::size_t i = 0; i < data.runs.size(); ++i)
    summary["runs"].push_back(describe(data.runs[i], front[i]));
  summary["orders"] = json::array();
  for (const FittedOrder &order : fitted_orders(data))
    summary["orders"].push_back({{"axis", order.axis},
                                 {"values", order.values},
                                 {"quantity", order.quantity},
                                 {"over_cell_size", order.over_cell_size},
                                 {"exponent", order.exponent},
                                 {"runs", order.n_runs}});
  summary["series"] = series_of(data);
  std::vector<Bought> bought;
  for (const SweepRun &run : data.runs)
    bought.push_back(run.bought());
  const auto best = cheapest(bought, data.target);
  summary["cheapest"] = best ? json(data.runs[*best].name) : json(nullptr);
  ReplacedFile file(data.directory + "/summary.json");
  *file << summary.dump(2) << std::endl;
  file.close();
}
} // namespace peat
