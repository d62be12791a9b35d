#include "html_report.h"
#include "sweep_output.h"
#include "sweep_runner.h"

#include <peat/base/text.h>
#include <peat/simulation/commands.h>
#include <peat/simulation/simulation.h>

#include <deal.II/base/mpi.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

namespace peat {
namespace {
/// Axes of the case, with those of the command line in their place or after them.
std::vector<SweepAxis> all_axes(const SweepOptions &options, const SweepParameters &sweep)
{
  std::vector<SweepAxis> axes = sweep.axes, given;
  for (const std::string &text : options.vary) {
    const std::string place = "--vary " + shortened(text, 200) + ": ";
    const std::size_t equals = text.find('=');
    try {
      if (equals == std::string::npos)
        throw InputError("no '='; write --vary \"Section/Key=value, value, ...\"");
      given.emplace_back(text.substr(0, equals), text.substr(equals + 1));
    } catch (const InputError &error) {
      throw InputError(place + error.what());
    }
    given.back().place = place;
  }
  const auto find = [](std::vector<SweepAxis> &list, const std::string &key) {
    return std::find_if(list.begin(), list.end(), [&](const SweepAxis &axis) { return axis.key == key; });
  };
  for (auto axis = given.begin(); axis != given.end(); ++axis) {
    if (find(given, axis->key) != axis)
      throw InputError(axis->place + in_quotes(axis->key) + " is varied twice");
    const auto present = find(axes, axis->key);
    if (present == axes.end())
      axes.push_back(*axis);
    else
      *present = *axis;
  }
  for (const SweepAxis &axis : axes)
    for (const std::string &text : options.run.overrides)
      if (trim(text.substr(0, text.find('='))) == axis.key)
        throw InputError("--set " + shortened(text, 200) + ": the sweep varies " + in_quotes(axis.key));
  if (axes.empty())
    throw InputError("nothing to vary: give --vary \"Section/Key=value, value, ...\", or subsections of "
                     "'Sweep' with 'Key' and 'Values'");
  return axes;
}

template <int dim>
std::vector<std::string> chosen_references(const Case<dim> &parameters)
{
  const SweepParameters &sweep = parameters.sweep;
  std::vector<std::string> known;
  for (const auto &reference : parameters.references)
    known.push_back(reference.name);
  for (const std::string &name : sweep.references)
    if (std::find(known.begin(), known.end(), name) == known.end())
      sweep.section.fail("References", "there is no reference " + in_quotes(name) + suggestion(name, known));
  if (known.empty() && parameters.probes.empty())
    throw InputError("the case has neither 'References' nor 'Probes': nothing tells the error of a run");
  if (known.empty() && sweep.norm == "L1")
    sweep.section.fail("Norm", "without references runs are compared in L2 or Linf");
  return sweep.references.empty() ? known : sweep.references;
}

/// Each reason once, with the first combination and the number of the others.
void list_refused(const std::vector<SweepRun> &runs, const std::vector<SweepAxis> &axes, Log &log)
{
  std::vector<std::string> reasons;
  for (const SweepRun &run : runs)
    if (run.state == SweepRun::State::refused &&
        std::find(reasons.begin(), reasons.end(), run.reason) == reasons.end())
      reasons.push_back(run.reason);
  for (const std::string &reason : reasons) {
    std::string first;
    unsigned int n_others = 0;
    for (const SweepRun &run : runs) {
      if (run.state != SweepRun::State::refused || run.reason != reason)
        continue;
      if (!first.empty()) {
        ++n_others;
        continue;
      }
      for (std::size_t a = 0; a < axes.size(); ++a)
        first += (a > 0 ? "; " : "") + axes[a].name() + '=' + run.values[a];
    }
    log.line("refused: " + first + (n_others > 0 ? " and " + std::to_string(n_others) + " more: " : ": ") +
             reason);
  }
}

/// "7 runs, of them 2 finished before, 1 refused"
std::string overview(const std::vector<SweepRun> &runs)
{
  const auto n = [&](const auto &condition) { return std::count_if(runs.begin(), runs.end(), condition); };
  std::ostringstream text;
  text << runs.size() << " combinations";
  if (const auto refused = n([](const SweepRun &run) { return run.state == SweepRun::State::refused; }))
    text << ", " << refused << " refused";
  if (const auto before = n([](const SweepRun &run) { return run.from_before; }))
    text << ", " << before << " finished before";
  text << ", " << n([](const SweepRun &run) { return run.state == SweepRun::State::waiting; }) << " to run";
  return text.str();
}

template <int dim>
int sweep(const ParameterFile &file, const SweepOptions &options, MPI_Comm communicator)
{
  const Case<dim> parameters(file);
  SweepData data;
  SweepSettings settings;
  data.axes = all_axes(options, parameters.sweep);
  data.errors = settings.references = chosen_references(parameters);
  data.norm = settings.norm = parameters.sweep.norm;
  data.target = options.target > 0. ? options.target : parameters.sweep.target;
  data.n_jobs = settings.n_jobs = options.n_jobs > 0 ? options.n_jobs : parameters.sweep.n_jobs;
  settings.skip_margin = parameters.sweep.skip_margin;
  data.title = parameters.title.empty() ? options.run.file : parameters.title;
  data.file = settings.file = options.run.file;
  data.runs = plan_runs(options.run, data.axes, communicator);
  data.mesh_axis = mesh_axis(data.runs, data.axes);
  data.directory = settings.directory =
      options.run.output.empty() ? default_output_directory(options.run.file) + "_sweep" : options.run.output;
  std::error_code error;
  std::filesystem::create_directories(data.directory, error);
  if (error || !std::filesystem::is_directory(data.directory))
    throw InputError("cannot make the output directory '" + data.directory + "'");

  catch_signals();
  Log log(data.directory, true, options.run.quiet);
  take_over(data.runs, settings);
  log.line(overview(data.runs));
  list_refused(data.runs, data.axes, log);
  const bool complete = run_all(data.runs, settings, data.mesh_axis, log);

  double stiffness = 0.;
  for (const auto &material : parameters.materials)
    stiffness = std::max(stiffness, material->initial_modulus());
  if (data.errors.empty())
    compare_with_finest(data, parameters.sweep.fields, parameters.end_time(), stiffness);
  write_sweep_table(data);
  write_sweep_summary(data);
  log.line(conclusions(data));
  write_html_report("sweep_report.py", data.directory, "sweep.csv", log);
  if (!complete)
    log.line("interrupted; the same command goes on where it ended");
  return complete ? exit_success : exit_interrupted;
}
} // namespace

int command_sweep(const SweepOptions &options, MPI_Comm communicator)
{
  if (dealii::Utilities::MPI::n_mpi_processes(communicator) > 1)
    throw InputError(
        "'peat sweep' starts its runs itself, each on one rank; start it without mpirun, and use "
        "--jobs to run several at a time");
  const ParameterFile file(options.run.file, options.run.overrides);
  return read_dimension(file) == 2 ? sweep<2>(file, options, communicator)
                                   : sweep<3>(file, options, communicator);
}
} // namespace peat
