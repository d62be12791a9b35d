#pragma once

#include <peat/simulation/log.h>
#include <peat/simulation/sweep_plan.h>

#include <string>
#include <vector>

namespace peat {
/// How the runs of a sweep are run.
struct SweepSettings
{
  std::string file;      ///< of the case
  std::string directory; ///< of the sweep; the runs' ones lie in its `runs`
  std::string norm;      ///< of the errors
  double skip_margin = 0.;
  unsigned int n_jobs = 1;
  std::vector<std::string> references; ///< of which the errors are wanted; may be none

  std::string directory_of(const SweepRun &run) const { return directory + "/runs/" + run.name; }
};

/// Takes over what an earlier sweep has left: runs with the same parameters that were finished or had failed.
void take_over(std::vector<SweepRun> &runs, const SweepSettings &settings);

/// Runs what is waiting, `n_jobs` child processes at a time, from cheap to dear; skips what is not worth
/// while. After a signal no run is started, and those that run end at their next step. Returns whether it
/// came to the end.
bool run_all(std::vector<SweepRun> &runs, const SweepSettings &settings,
             const std::optional<std::size_t> &mesh_axis, Log &log);
} // namespace peat
