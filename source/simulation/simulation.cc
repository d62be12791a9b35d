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
    const std::string directory = options.output.empty() ? default_output_directory(options.file) : options.output;
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

/// All that is written while the run goes on.
template <int dim>
struct Simulation<dim>::Outputs
{
  Outputs(const std::string &directory, const bool is_first_rank) : statistics(directory, is_first_rank) {}

  Statistics<dim> statistics;
  Schedule statistics_times;
};

template <int dim>
Simulation<dim>::Simulation(Case<dim> &parameters, const ParameterFile &file, const RunOptions &options,
                            MPI_Comm communicator)
    : parameters(parameters), options(options), communicator(communicator),
      directory(prepare_directory(options, communicator)),
      log(directory, dealii::Utilities::MPI::this_mpi_process(communicator) == 0, options.quiet),
      grid(parameters.grid, communicator), scene(make_scene(parameters, grid)), stage_scheme(parameters.scheme)
{
  const bool first = dealii::Utilities::MPI::this_mpi_process(communicator) == 0;
  if (first) {
    std::ofstream prm(directory + "/parameters.prm");
    file.write_prm(prm);
  }
  outputs = std::make_unique<Outputs>(directory, first);
  balances = std::make_unique<Balances<dim>>(totals(scene, communicator));
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
  outputs->statistics_times = Schedule::every(
      parameters.output.statistics_interval > 0. ? parameters.output.statistics_interval : stage.duration / 200., start,
      end);
  log.line("stage '" + stage.name + "': " + std::to_string(stage.duration) + " s");

  // Between two events the step is constant, unless the stable step has changed by then.
  constexpr unsigned int steps_between_checks = 100;
  double clock = seconds();
  while (now < end && !stopped) {
    const StableStep stable = solver->stable_step();
    const double wanted = stage_scheme.fixed_step > 0. ? stage_scheme.fixed_step : stage_scheme.step_factor * stable.dt;
    if (stage_scheme.fixed_step > stable.dt) {
      std::ostringstream message;
      message << "'Time step' " << wanted << " s is above the stable step " << stable.dt << " s (" << stable.limit
              << ") at t = " << now << " s";
      throw NumericalError(message.str());
    }
    steps.limit = stable.limit;
    const double event = std::min(end, outputs->statistics_times.next());
    const double n_steps = std::ceil((event - now) / wanted * (1. - 1e-12));
    const double dt = (event - now) / n_steps;
    const bool reaches_event = n_steps <= steps_between_checks;
    for (unsigned int i = 0; i < (reaches_event ? n_steps : steps_between_checks) && !stopped; ++i) {
      solver->step(dt);
      steps.add(dt);
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
    outputs->statistics.write(time, steps.n_steps, steps.n_steps ? solver->fields().dt : 0., steps.limit, sums,
                              *balances);
  }
}

template class Simulation<2>;
template class Simulation<3>;
} // namespace peat
