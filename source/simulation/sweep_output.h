#pragma once

#include <peat/simulation/case.h>
#include <peat/simulation/sweep_plan.h>

#include <string>
#include <vector>

namespace peat {
/// All that a sweep has found.
struct SweepData
{
  std::string title;
  std::string file;
  std::string directory;
  std::vector<SweepAxis> axes;
  std::vector<SweepRun> runs;
  std::optional<std::size_t> mesh_axis;
  std::vector<std::string> errors; ///< names of SweepRun::errors
  std::string norm;
  double target = 0.;
  unsigned int n_jobs = 1;
  /// The run with which the others are compared, where the case has no references.
  std::optional<std::size_t> finest;
};

/// How fast a quantity falls along an axis, all other values fixed.
struct FittedOrder
{
  std::size_t axis = 0;
  std::vector<std::string> values; ///< of the other axes
  std::string quantity;        ///< name of an error, "largest" for the largest one, "time" for the run time
  bool over_cell_size = false; ///< else over the values of the axis
  double exponent = 0.;
  unsigned int n_runs = 0;
};

/// Compares all finished runs with the finest one (smallest cells; of these the most unknowns, then the most
/// steps) by their histories at probes, and sets their errors. `fields` are quantities: "displacement".
void compare_with_finest(SweepData &data, const std::vector<std::string> &fields, double end_time,
                         double stiffness);

/// Orders along all numeric axes, for each combination of the other values with at least two finished runs.
std::vector<FittedOrder> fitted_orders(const SweepData &data);

/// sweep.csv: a line for each run, in the order of the combinations.
void write_sweep_table(const SweepData &data);

/// summary.json: runs, Pareto front, orders, what the target costs.
void write_sweep_summary(const SweepData &data);

/// The lines that the terminal shows at the end.
std::string conclusions(const SweepData &data);
} // namespace peat
