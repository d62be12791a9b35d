#include <peat/base/text.h>
#include <peat/simulation/simulation.h>

#include "outputs.h"

// Checkpoints of a run: what they hold, when they are written, and how a run goes on from one.

namespace peat {
template <int dim>
void Simulation<dim>::heed(const Watch::Call call)
{
  stopped = call == Watch::Call::end;
  // What a recorder has seen is not kept.
  if (call == Watch::Call::none || recorder)
    return;
  const std::string problem =
      checkpoints.write({progress.stage, now, steps.n_steps}, [this](Archive &archive) {
        persist_record(archive);
        persist_state(archive);
      });
  if (!problem.empty())
    log.line("attention: no checkpoint was written at t = " + to_text(now) + " s: " + problem);
  else if (stopped)
    log.line("ended by a signal at t = " + to_text(now) + " s; 'peat run --resume' goes on from here");
}

template <int dim>
std::size_t Simulation<dim>::resume()
{
  std::string problem;
  try {
    persist_record(checkpoint->archive());
  } catch (const InputError &error) {
    problem = error.what();
  }
  // Only the first rank has files.
  problem = dealii::Utilities::MPI::broadcast(communicator, problem);
  if (!problem.empty())
    throw InputError(problem);
  persist_state(checkpoint->archive());
  const StageParameters &stage = parameters.stages[progress.stage];
  plan_outputs(stage, start_of(progress.stage));
  outputs->skip(now);
  // Steps were planned up to what came next.
  if (checkpoint->changes_times())
    progress.steps_left = 0;
  log.line("resumed at t = " + to_text(now) + " s, step " + std::to_string(steps.n_steps) + ", in stage '" +
           stage.name + "'");
  return progress.stage;
}

template <int dim>
double Simulation<dim>::start_of(const std::size_t stage) const
{
  double start = 0.;
  for (std::size_t s = 0; s < stage; ++s)
    start += parameters.stages[s].duration;
  return start;
}

template <int dim>
void Simulation<dim>::persist_record(Archive &archive)
{
  archive.begin("run");
  WallTimes before = wall;
  archive(progress, now, steps, pressure_work, schemes, before, log, *outputs, comparison);
  if (!archive.is_loading())
    return;
  wall.setup += before.setup;
  wall.time_loop += before.time_loop;
  wall.output += before.output;
}

template <int dim>
void Simulation<dim>::persist_state(Archive &archive)
{
  if (archive.is_loading()) {
    // Explicit solvers are made first, since they take what a stage before has left for it.
    const StageParameters &stage = parameters.stages[progress.stage];
    const double start = start_of(progress.stage);
    if (is_implicit(stage))
      construct_up_solver(method_of_steps(), start);
    else
      make_explicit_solver(stage, start);
    events = std::make_unique<ContactEvents<dim>>(log, communicator);
  }
  archive(scene, *solver, *balances, *events);
}

#define PEAT_INSTANTIATE(dim)                                                                                \
  template void Simulation<dim>::heed(Watch::Call);                                                          \
  template std::size_t Simulation<dim>::resume();                                                            \
  template double Simulation<dim>::start_of(std::size_t) const;                                              \
  template void Simulation<dim>::persist_record(Archive &);                                                  \
  template void Simulation<dim>::persist_state(Archive &);
PEAT_INSTANTIATE(2)
PEAT_INSTANTIATE(3)
#undef PEAT_INSTANTIATE
} // namespace peat
