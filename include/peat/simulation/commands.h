#pragma once

#include <peat/simulation/run_options.h>

#include <deal.II/base/mpi.h>

#include <string>

namespace peat {
/// Exit codes of the program.
enum ExitCode { exit_success = 0, exit_input_error = 1, exit_numerical_error = 2, exit_interrupted = 130 };

/// `peat run`: run the case and leave an output directory.
int command_run(const RunOptions &options, MPI_Comm communicator);

/// `peat compare`: two runs of the case with two methods or settings, and how far they are from each other
/// and from the references; leaves the directories of both, compare.csv, samples.csv, summary.json and
/// report.html.
int command_compare(const RunOptions &options, MPI_Comm communicator);

/// `peat sweep`: runs of the case with all combinations of some settings, each in a process of its own: error
/// against run time. Leaves the directories of the runs, sweep.csv, summary.json and report.html.
int command_sweep(const SweepOptions &options, MPI_Comm communicator);

/// `peat check`: validate, and say what a run would take; runs nothing.
int command_check(const RunOptions &options, MPI_Comm communicator);

/// `peat parameters`: every parameter with meaning, unit, default and range, as prm, markdown or json.
int command_parameters(const std::string &format, unsigned int dim);
} // namespace peat
