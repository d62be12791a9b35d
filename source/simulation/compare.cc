#include "compare_output.h"
#include "html_report.h"

#include <peat/base/nan.h>
#include <peat/base/text.h>
#include <peat/simulation/commands.h>
#include <peat/simulation/simulation.h>

#include <deal.II/base/mpi.h>

#include <malloc.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <sstream>

namespace peat {
namespace {
/// What the two runs of a case set, split at ';'.
std::vector<std::string> split_settings(const std::string &text)
{
  std::vector<std::string> settings;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ';');)
    if (!trim(part).empty())
      settings.push_back(trim(part));
  return settings;
}

/// "mpm" of "Method=mpm", "gimp" of "Explicit MPM/Basis=gimp"; fit for a directory.
std::string short_name(const std::string &settings)
{
  std::string name;
  for (const std::string &setting : split_settings(settings)) {
    const std::string value = trim(setting.substr(setting.find('=') + 1));
    name += (name.empty() ? "" : "_") + value;
  }
  for (char &c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '_')
      c = '_';
  return name.empty() ? "run" : shortened(name, 60);
}

std::string label_of(const std::string &name)
{
  return name == "mpm" ? "CMPM" : (name == "fem" ? "FEM" : name);
}

std::array<ComparedRun, 2> name_runs(const CompareParameters &compare, const std::string &directory)
{
  std::array<ComparedRun, 2> runs;
  const std::string settings[2] = {compare.first, compare.second};
  const bool same = short_name(settings[0]) == short_name(settings[1]);
  for (unsigned int r = 0; r < 2; ++r) {
    runs[r].settings = settings[r];
    runs[r].name = short_name(settings[r]);
    runs[r].label = label_of(runs[r].name);
    if (same) {
      runs[r].name += "_" + std::to_string(r + 1);
      runs[r].label += r == 0 ? " (first)" : " (second)";
    }
    runs[r].directory = directory + '/' + runs[r].name;
  }
  return runs;
}

/// The file with what a run sets. Throws an InputError at the entry of `Compare` if that is refused.
template <int dim>
ParameterFile file_of(const RunOptions &options, const CompareParameters &compare, const ComparedRun &run,
                      const bool is_first)
{
  std::vector<std::string> overrides = options.overrides;
  for (const std::string &setting : split_settings(run.settings))
    overrides.push_back(setting);
  try {
    ParameterFile file(options.file, overrides);
    if (read_dimension(file) != dim)
      throw InputError("the runs must have the same 'Dimension'");
    return file;
  } catch (const InputError &error) {
    compare.section.fail(is_first ? "First" : "Second", error.what());
  }
}

/// Finds what either run would refuse before anything is computed. Collective.
template <int dim>
void check_run(const ParameterFile &file, const RunOptions &options, const CompareParameters &compare,
               const bool is_first, MPI_Comm communicator)
{
  try {
    Case<dim> parameters(file);
    const Grid<dim> grid(parameters.grid, communicator);
    make_scene(parameters, grid);
    Comparison<dim>(parameters, std::filesystem::path(options.file).parent_path().string());
  } catch (const InputError &error) {
    compare.section.fail(is_first ? "First" : "Second", error.what());
  }
}

/// So that the peak memory of the second run is not that of the first; Linux only, elsewhere without effect.
void forget_peak_memory()
{
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
}

/// What a run found against its references.
template <int dim>
void add_reference_differences(const Case<dim> &parameters, const Comparison<dim> &comparison,
                               const std::string &run, std::vector<Difference> &list)
{
  static const char *const kinds[] = {"profile", "history", "formula"};
  const auto results = comparison.results();
  for (std::size_t i = 0; i < results.size(); ++i) {
    const auto &result = results[i];
    Difference d;
    d.kind = kinds[int(parameters.references[i].kind)];
    d.runs = run + "-reference";
    d.name = result.reference;
    d.field = result.field;
    d.unit = result.unit;
    d.L2 = result.norms.L2;
    d.Linf = result.norms.Linf;
    d.scale_L2 = d.scale_Linf = result.scale;
    // A reference that is zero and has no scale of its own gives no relative differences.
    d.relative_L2 = result.scale > 0. ? result.relative_L2 : nan;
    d.relative_Linf = result.scale > 0. ? result.relative_Linf : nan;
    d.share_above = nan;
    d.n = result.norms.n;
    d.n_left_out = result.norms.n_outside;
    d.time = result.norms.worst_time;
    for (unsigned int k = 0; k < dim; ++k)
      d.place[k] = result.norms.worst_place[k];
    d.value = {result.norms.worst_reference, result.norms.worst_value};
    list.push_back(d);
  }
}

/// Runs the case with what one run sets, as far as it goes. Returns false if a signal ended it.
template <int dim>
bool run_one(const RunOptions &options, const CompareParameters &compare, ComparedRun &run,
             const bool is_first, std::vector<Difference> &against_references, MPI_Comm communicator)
{
  const ParameterFile file = file_of<dim>(options, compare, run, is_first);
  Case<dim> parameters(file);
  RunOptions own = options;
  own.output = run.directory;
  const Comparison<dim> references(parameters, std::filesystem::path(options.file).parent_path().string());
  Recorder<dim> recorder(parameters, sample_times(compare, parameters.end_time(), references.times()));
  Simulation<dim> simulation(parameters, file, own, communicator, &recorder);
  try {
    if (!simulation.run())
      return false;
  } catch (const NumericalError &error) {
    run.problem = error.what();
  }
  run.recording = recorder.recording();
  add_reference_differences(parameters, simulation.references(), run.name, against_references);
  return true;
}

/// Leave of both recordings the times that both have; returns the last of them, or 0.
double trim_recordings(std::array<ComparedRun, 2> &runs)
{
  const std::size_t n = std::min(runs[0].recording.times.size(), runs[1].recording.times.size());
  for (ComparedRun &run : runs) {
    run.recording.times.resize(n);
    run.recording.samples.resize(n);
  }
  return n > 0 ? runs[0].recording.times.back() : 0.;
}

/// Leave of a history what lies before a time.
Histories until(Histories histories, const double end)
{
  const std::size_t n = std::upper_bound(histories.time.begin(), histories.time.end(), end * (1. + 1e-9)) -
                        histories.time.begin();
  histories.time.resize(n);
  for (auto &column : histories.columns)
    column.resize(n);
  return histories;
}

void add_run_differences(ComparisonData &data, const double stiffness)
{
  auto &runs = data.runs;
  std::vector<Difference> list = compare_cells(runs[0].recording, runs[1].recording, data.tolerance);
  const auto probes = compare_histories(
      until(read_histories(runs[0].directory + "/probes.csv"), data.end_time),
      until(read_histories(runs[1].directory + "/probes.csv"), data.end_time), data.tolerance);
  list.insert(list.end(), probes.begin(), probes.end());
  double mesh_size = 0.;
  for (const auto &planes : runs[0].recording.planes)
    if (!planes.empty())
      mesh_size = std::max(mesh_size, planes.back() - planes.front());
  mark_negligible(list, mesh_size, data.end_time, stiffness);
  for (Difference &difference : list)
    difference.runs = runs[1].name + '-' + runs[0].name;
  data.differences.insert(data.differences.begin(), list.begin(), list.end());
}

void print_table(const ComparisonData &data, Log &log)
{
  const auto percent = [](const double share) {
    char text[40];
    std::snprintf(text, sizeof(text), std::isfinite(share) ? "%.3g %%" : "-", 100. * share);
    return std::string(text);
  };
  std::ostringstream text;
  text << std::left << std::setw(44) << "difference" << std::right << std::setw(12) << "L2" << std::setw(12)
       << "Linf" << '\n';
  for (const Difference &d : data.differences) {
    if (d.kind == "probe" || (d.kind == "cells" && !d.name.empty()))
      continue;
    const bool cells = d.kind == "cells";
    text << std::left << std::setw(44) << shortened(d.runs + ": " + (cells ? d.field : d.name), 43)
         << std::right << std::setw(12) << percent(d.relative_L2) << std::setw(12) << percent(d.relative_Linf)
         << (is_above(d, data.tolerance) ? "  attention" : "") << '\n';
  }
  log.line(text.str());
  const auto sentences = findings(data);
  constexpr std::size_t most = 3;
  for (std::size_t i = 0; i < std::min(most, sentences.size()); ++i)
    log.line(sentences[i]);
  if (sentences.size() > most)
    log.line("and " + std::to_string(sentences.size() - most) + " more in " + data.directory +
             "/summary.json");
}

template <int dim>
void evaluate(const Case<dim> &parameters, const RunOptions &options, ComparisonData &data)
{
  Log log(data.directory, true, options.quiet);
  data.title = parameters.title.empty() ? options.file : parameters.title;
  data.tolerance = parameters.compare.tolerance;
  data.dimension = dim;
  double stiffness = 0.;
  for (const auto &material : parameters.materials)
    stiffness = std::max(stiffness, material->initial_modulus());
  add_run_differences(data, stiffness);
  const Sights sights = find_sights(parameters, data.runs[0].recording);
  write_differences(data);
  const bool complete = write_samples(data, sights);
  write_references(parameters, std::filesystem::path(options.file).parent_path().string(), data, sights);
  write_compare_summary(data, sights, complete);
  print_table(data, log);
  write_html_report("compare_report.py", data.directory, "compare.csv", log);
}

template <int dim>
int compare(const ParameterFile &file, const RunOptions &options, MPI_Comm communicator)
{
  const bool first_rank = dealii::Utilities::MPI::this_mpi_process(communicator) == 0;
  const Case<dim> parameters(file);
  catch_signals();
  ComparisonData data;
  data.directory = options.output.empty() ? default_output_directory(options.file) : options.output;
  data.runs = name_runs(parameters.compare, data.directory);
  for (unsigned int r = 0; r < 2; ++r)
    check_run<dim>(file_of<dim>(options, parameters.compare, data.runs[r], r == 0), options,
                   parameters.compare, r == 0, communicator);
  for (unsigned int r = 0; r < 2; ++r) {
    ComparedRun &run = data.runs[r];
    forget_peak_memory();
    if (first_rank && !options.quiet)
      std::cout << "run " << r + 1 << " of 2: " << run.label << " (" << run.settings << ")" << std::endl;
    if (!run_one<dim>(options, parameters.compare, run, r == 0, data.differences, communicator))
      return exit_interrupted;
  }
  std::string problems;
  for (const ComparedRun &run : data.runs)
    if (!run.problem.empty())
      problems +=
          (problems.empty() ? "run '" : "; run '") + run.name + "' (" + run.settings + "): " + run.problem;
  data.end_time = parameters.end_time();
  if (!problems.empty())
    data.end_time = trim_recordings(data.runs);
  data.end_time = dealii::Utilities::MPI::broadcast(communicator, data.end_time);
  if (first_rank && data.end_time > 0.)
    evaluate(parameters, options, data);
  if (!problems.empty())
    throw NumericalError(problems + (data.end_time > 0.
                                         ? "; the report ends at t = " + to_text(data.end_time) + " s"
                                         : "; the runs have no sample in common"));
  return exit_success;
}
} // namespace

int command_compare(const RunOptions &options, MPI_Comm communicator)
{
  const ParameterFile file(options.file, options.overrides);
  return read_dimension(file) == 2 ? compare<2>(file, options, communicator)
                                   : compare<3>(file, options, communicator);
}
} // namespace peat
