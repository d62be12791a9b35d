#include <peat/simulation/simulation.h>

#include <deal.II/base/mpi.h>

#include <csignal>
#include <cstdio>
#include <filesystem>

#include "outputs.h"

namespace peat {
namespace {
volatile std::sig_atomic_t signal_received = 0;

std::string prepare_directory(const RunOptions &options, MPI_Comm communicator)
{
  const std::string directory = output_directory(options);
  std::string problem;
  if (dealii::Utilities::MPI::this_mpi_process(communicator) == 0) {
    std::error_code error;
    std::filesystem::create_directories(directory, error);
    if (error || !std::filesystem::is_directory(directory))
      problem = "cannot make the output directory '" + directory + "'";
  }
  problem = dealii::Utilities::MPI::broadcast(communicator, problem);
  if (!problem.empty())
    throw InputError(problem);
  return directory;
}
} // namespace

void catch_signals()
{
  const auto note = [](int signal) { signal_received = signal; };
  std::signal(SIGINT, note);
  std::signal(SIGTERM, note);
}

bool signal_was_caught()
{
  return signal_received != 0;
}

std::string default_output_directory(const std::string &file_name)
{
  return "output/" + std::filesystem::path(file_name).stem().string();
}

std::string output_directory(const RunOptions &options)
{
  return options.output.empty() ? default_output_directory(options.file) : options.output;
}

void StepRecord::persist(Archive &archive)
{
  archive(n_steps, smallest, largest, total_time, limit);
}

void StageProgress::persist(Archive &archive)
{
  archive(stage, scheme, largest_step, stable.dt, stable.limit, steps_since_check, dt, steps_left,
          reaches_event, energy_at_start);
}

void StepRecord::add(const double dt)
{
  ++n_steps;
  smallest = std::min(smallest, dt);
  largest = std::max(largest, dt);
  total_time += dt;
}

template <int dim>
Simulation<dim>::Simulation(Case<dim> &parameters, const ParameterFile &file, const RunOptions &options,
                            MPI_Comm communicator, Recorder<dim> *recorder, std::unique_ptr<Checkpoint> begun)
    : begin(seconds()), parameters(parameters), options(options), communicator(communicator),
      grid(parameters.grid, communicator), scene(make_scene(parameters, grid)),
      comparison(parameters, std::filesystem::path(options.file).parent_path().string()), recorder(recorder),
      directory(prepare_directory(options, communicator)),
      log(directory, dealii::Utilities::MPI::this_mpi_process(communicator) == 0, options.quiet),
      stage_scheme(parameters.scheme), checkpoint(std::move(begun)),
      checkpoints(directory, file, !checkpoint, communicator),
      watch(60. * parameters.output.checkpoint_interval, communicator)
{
  const bool first = dealii::Utilities::MPI::this_mpi_process(communicator) == 0;
  if (first) {
    std::ofstream prm(directory + "/parameters.prm");
    file.write_prm(prm);
  }
  outputs = std::make_unique<Outputs>(parameters, directory, scene, grid);
  balances = std::make_unique<Balances<dim>>(totals(scene, communicator));
  wall.setup = seconds() - begin;
}

template <int dim>
Simulation<dim>::~Simulation() = default;

template <int dim>
bool Simulation<dim>::run()
{
  planned_end = parameters.end_time();
  double start = 0.;
  try {
    const std::size_t first = checkpoint ? resume() : 0;
    for (std::size_t s = 0; s < parameters.stages.size() && !stopped; ++s) {
      const StageParameters &stage = parameters.stages[s];
      progress.stage = s;
      if (s > first || !checkpoint)
        begin_stage(stage, start);
      if (s >= first)
        finish_stage(stage, start);
      start += stage.duration;
    }
  } catch (const NumericalError &) {
    outputs->line_step = outputs->picture_step = Outputs::never;
    report(now, true);
    write_summary();
    throw;
  }
  write_summary();
  log.line("results are in " + directory);
  return !stopped;
}

template <int dim>
void Simulation<dim>::report(const double time, const bool everything)
{
  if (outputs->statistics_times.due(time) || outputs->every_step ||
      (everything && outputs->line_step != steps.n_steps)) {
    outputs->line_step = steps.n_steps;
    const Totals<dim> sums = totals(scene, communicator);
    balances->update(sums, solver->ledger(), communicator);
    outputs->statistics.write(time, steps.n_steps, steps.n_steps ? solver->fields().dt : 0., steps.limit,
                              sums, *balances);
  }
  if (outputs->comparison_times.due(time))
    comparison.compare(time, scene, communicator);
  if (outputs->recording_times.due(time))
    recorder->record(time, scene, grid);
  if (outputs->probes && (outputs->probe_times.due(time) || outputs->every_step || everything) &&
      !(steps.n_steps > 0 && outputs->probes->time() == time)) {
    outputs->probes->write(time);
    comparison.compare(*outputs->probes);
  }
  if (outputs->pictures &&
      (outputs->picture_times.due(time) || (everything && outputs->picture_step != steps.n_steps))) {
    outputs->picture_step = steps.n_steps;
    outputs->pictures->write(time, solver->nodes(), solver->fields());
  }
}

template <int dim>
std::vector<typename Comparison<dim>::Result> Simulation<dim>::compare_with_references() const
{
  if (dealii::Utilities::MPI::this_mpi_process(communicator) == 0 && !comparison.empty())
    comparison.write_errors(directory + "/errors.csv");
  return comparison.results();
}

template class Simulation<2>;
template class Simulation<3>;
} // namespace peat
