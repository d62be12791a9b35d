#include <peat/simulation/simulation.h>

#include <deal.II/base/mpi.h>
#include <deal.II/base/timer.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <sstream>

namespace peat {
namespace {
volatile std::sig_atomic_t signal_received = 0;

double seconds()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string prepare_directory(const RunOptions &options, MPI_Comm communicator)
{
  const std::string directory =
      options.output.empty() ? default_output_directory(options.file) : options.output;
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

std::string default_output_directory(const std::string &file_name)
{
  return "output/" + std::filesystem::path(file_name).stem().string();
}

void StepRecord::add(const double dt)
{
  ++n_steps;
  smallest = std::min(smallest, dt);
  largest = std::max(largest, dt);
  total_time += dt;
}

/// All that is written while the run goes on, and when.
template <int dim>
struct Simulation<dim>::Outputs
{
  Outputs(const Case<dim> &parameters, const std::string &directory, const Scene<dim> &scene,
          const Grid<dim> &grid)
      : statistics(directory, dealii::Utilities::MPI::this_mpi_process(grid.communicator()) == 0)
  {
    if (scene.probes)
      probes = std::make_unique<ProbeWriter<dim>>(parameters, scene, grid, directory + "/probes.csv");
    if (parameters.output.pictures)
      pictures = std::make_unique<Pictures<dim>>(directory, scene, grid.communicator());
  }

  void plan(const OutputParameters &output, const Comparison<dim> &comparison, const Recorder<dim> *recorder,
            const double start, const double end)
  {
    const double statistics_interval =
        output.statistics_interval > 0. ? output.statistics_interval : (end - start) / 200.;
    statistics_times = Schedule::every(statistics_interval, start, end);
    probe_times =
        Schedule::every(output.probe_interval > 0. ? output.probe_interval : statistics_interval, start, end);
    picture_times = Schedule::every(output.interval, start, end);
    comparison_times = Schedule::at(comparison.times(), start, end);
    recording_times = Schedule::at(recorder ? recorder->times() : std::vector<double>(), start, end);
  }

  /// When something is next due.
  double next() const
  {
    double time = std::min({statistics_times.next(), comparison_times.next(), recording_times.next()});
    if (probes)
      time = std::min(time, probe_times.next());
    if (pictures)
      time = std::min(time, picture_times.next());
    return time;
  }

  Statistics<dim> statistics;
  std::unique_ptr<ProbeWriter<dim>> probes;
  std::unique_ptr<Pictures<dim>> pictures;
  Schedule statistics_times, probe_times, picture_times, comparison_times, recording_times;
};

template <int dim>
Simulation<dim>::Simulation(Case<dim> &parameters, const ParameterFile &file, const RunOptions &options,
                            MPI_Comm communicator, Recorder<dim> *recorder)
    : begin(seconds()), parameters(parameters), options(options), communicator(communicator),
      grid(parameters.grid, communicator), scene(make_scene(parameters, grid)),
      comparison(parameters, std::filesystem::path(options.file).parent_path().string()), recorder(recorder),
      directory(prepare_directory(options, communicator)),
      log(directory, dealii::Utilities::MPI::this_mpi_process(communicator) == 0, options.quiet),
      stage_scheme(parameters.scheme)
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
    for (const StageParameters &stage : parameters.stages) {
      run_stage(stage, start);
      if (stopped)
        break;
      start += stage.duration;
    }
  } catch (const NumericalError &) {
    report(now, true);
    write_summary();
    throw;
  }
  write_summary();
  log.line("results are in " + directory);
  return !stopped;
}

template <int dim>
bool Simulation<dim>::interrupted()
{
  // Ranks receive signals at different moments; they ask each other now and then.
  if (dealii::Utilities::MPI::n_mpi_processes(communicator) == 1)
    return signal_received != 0;
  return steps.n_steps % 50 == 0 && dealii::Utilities::MPI::max(int(signal_received), communicator) != 0;
}

template <int dim>
void Simulation<dim>::run_stage(const StageParameters &stage, const double start)
{
  const double end = start + stage.duration;
  stage_scheme.local_damping = std::max(parameters.scheme.local_damping, stage.local_damping);
  const Ledger<dim> carried = solver ? solver->ledger() : Ledger<dim>();
  solver = std::make_unique<ExplicitMPM<dim>>(stage_scheme, grid, scene, start, carried);
  solver->prepare();
  outputs->plan(parameters.output, comparison, recorder, start, end);
  std::ostringstream message;
  message << "stage '" << stage.name << "': " << stage.duration << " s, stable step "
          << solver->stable_step().dt << " s (" << solver->stable_step().limit << ')';
  log.line(message.str());
  if (steps.n_steps == 0)
    report(now, true);

  // Between two events the step is constant, unless the stable step has changed by then.
  constexpr unsigned int steps_between_checks = 100;
  unsigned int steps_since_check = 0;
  StableStep stable = solver->stable_step();
  double clock = seconds();
  while (now < end && !stopped) {
    if (steps_since_check >= steps_between_checks) {
      stable = solver->stable_step();
      steps_since_check = 0;
    }
    const double wanted =
        stage_scheme.fixed_step > 0. ? stage_scheme.fixed_step : stage_scheme.step_factor * stable.dt;
    if (stage_scheme.fixed_step > stable.dt) {
      std::ostringstream message;
      message << "'Time step' " << wanted << " s is above the stable step " << stable.dt << " s ("
              << stable.limit << ") at t = " << now << " s";
      throw NumericalError(message.str());
    }
    steps.limit = stable.limit;
    const double event = std::min(end, outputs->next());
    const double n_steps = std::ceil((event - now) / wanted * (1. - 1e-12));
    const double dt = (event - now) / n_steps;
    const unsigned int n_now = std::min<double>(n_steps, steps_between_checks - steps_since_check);
    const bool reaches_event = n_now == n_steps;
    for (unsigned int i = 0; i < n_now && !stopped; ++i) {
      solver->step(dt);
      steps.add(dt);
      ++steps_since_check;
      now = solver->time();
      stopped = interrupted();
    }
    const double lap = seconds();
    wall.time_loop += lap - clock;
    if (reaches_event && !stopped) {
      now = event;
      solver->set_time(now);
    }
    report(now, stopped || now >= end);
    clock = seconds();
    wall.output += clock - lap;
    log.progress(now / planned_end, now, steps.n_steps,
                 steps.n_steps * double(scene.n_global_points()) / std::max(1e-9, wall.time_loop));
  }
}

template <int dim>
void Simulation<dim>::report(const double time, const bool everything)
{
  if (outputs->statistics_times.due(time) || everything) {
    const Totals<dim> sums = totals(scene, communicator);
    balances->update(sums, solver->ledger(), communicator);
    outputs->statistics.write(time, steps.n_steps, steps.n_steps ? solver->fields().dt : 0., steps.limit,
                              sums, *balances);
  }
  if (outputs->comparison_times.due(time))
    comparison.compare(time, scene, communicator);
  if (outputs->recording_times.due(time))
    recorder->record(time, scene, grid);
  if (outputs->probes && (outputs->probe_times.due(time) || everything) &&
      !(steps.n_steps > 0 && outputs->probes->time() == time)) {
    outputs->probes->write(time);
    comparison.compare(*outputs->probes);
  }
  if (outputs->pictures && (outputs->picture_times.due(time) || everything))
    outputs->pictures->write(time, solver->nodes(), solver->fields());
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
