#include <peat/simulation/contact_events.h>
#include <peat/simulation/simulation.h>
#include <peat/solver/rest_pressure.h>

#include <algorithm>
#include <sstream>

#include "outputs.h"

namespace peat {
template <int dim>
void Simulation<dim>::begin_stage(const StageParameters &stage, const double start)
{
  bring_in_bodies(stage);
  if (stage.solver == StageParameters::Solver::dynamic && parameters.method == Method::mpm) {
    const SchemeEstimate chosen = choose_scheme(stage, start);
    progress.scheme = chosen.scheme;
    progress.largest_step = chosen.largest_step;
  }
  note_scheme(is_implicit(stage) ? Scheme::implicit : progress.scheme);
  plan_outputs(stage, start);
  if (parameters.method == Method::mpm && is_implicit(stage))
    note_contacts(stage);
  if (stage.solver == StageParameters::Solver::static_state)
    run_static_stage(stage, start);
  else if (is_implicit(stage))
    begin_implicit_stage(stage, start);
  else
    begin_explicit_stage(stage, start);
}

template <int dim>
void Simulation<dim>::finish_stage(const StageParameters &stage, const double start)
{
  if (stage.solver == StageParameters::Solver::static_state)
    return;
  if (is_implicit(stage))
    take_implicit_steps(start + stage.duration);
  else
    take_explicit_steps(start + stage.duration);
}

template <int dim>
bool Simulation<dim>::is_implicit(const StageParameters &stage) const
{
  return parameters.method == Method::fem || stage.solver != StageParameters::Solver::dynamic ||
         progress.scheme == Scheme::implicit;
}

template <int dim>
void Simulation<dim>::plan_outputs(const StageParameters &stage, const double start)
{
  const bool dynamic = stage.solver == StageParameters::Solver::dynamic;
  const bool fits_steps = is_implicit(stage) && (parameters.method == Method::mpm || !dynamic);
  outputs->plan(parameters.output, comparison, recorder, start, start + stage.duration, fits_steps);
}

template <int dim>
void Simulation<dim>::note_contacts(const StageParameters &stage)
{
  const bool deformable = std::any_of(scene.contacts.begin(), scene.contacts.end(), [&](const auto &contact) {
    return !parameters.concerns_rigid_body(contact);
  });
  if (deformable)
    log.line("stage '" + stage.name + "': implicit, so deformable bodies are tied where they meet");
  if (!scene.rigid_bodies.empty() && stage.solver == StageParameters::Solver::static_state)
    log.line("stage '" + stage.name + "': static, so rigid bodies do not act");
}

template <int dim>
SchemeEstimate Simulation<dim>::choose_scheme(const StageParameters &stage, const double start)
{
  if (stage.scheme != Scheme::automatic) {
    SchemeEstimate named;
    named.scheme = stage.scheme;
    return named;
  }
  const Demand asked = demand(parameters, stage, scene, grid, start);
  const auto list = estimate_schemes(parameters, stage, scene, grid, asked);
  if (!list.front().why_not.empty())
    throw NumericalError("no scheme applies to stage '" + stage.name + "': " + describe(list[0]) + "; " +
                         describe(list[1]) + "; " + describe(list[2]));
  log.line("stage '" + stage.name + "': scheme chosen, costs in explicit steps: " + describe(list[0]) +
           (asked.waves ? "; waves count, since " + asked.why : ""));
  log.line("    others: " + describe(list[1]) + "; " + describe(list[2]));
  return list.front();
}

template <int dim>
void Simulation<dim>::note_scheme(const Scheme scheme)
{
  const std::string name = name_of(scheme);
  if (std::find(schemes.begin(), schemes.end(), name) == schemes.end())
    schemes.push_back(name);
}

template <int dim>
void Simulation<dim>::bring_in_bodies(const StageParameters &stage)
{
  const std::vector<std::size_t> entering = parameters.entering_bodies(stage);
  if (entering.empty())
    return;
  const Totals<dim> before = totals(scene, communicator);
  for (const std::size_t b : entering) {
    scene.bodies[b]->enter();
    log.line("body '" + scene.bodies[b]->name() + "' comes in");
  }
  balances->admit(before, totals(scene, communicator));
}

template <int dim>
void Simulation<dim>::tell_of_stage(const StageParameters &stage, const StableStep &step)
{
  std::ostringstream message;
  message << "stage '" << stage.name << "': " << stage.duration << " s, "
          << (unknowns_of_solver() == 0 ? "stable step " : "first step ") << step.dt << " s (" << step.limit
          << ')';
  if (unknowns_of_solver() > 0)
    message << ", " << unknowns_of_solver() << " unknowns";
  log.line(message.str());
  if (steps.n_steps == 0)
    report(now, true);
}

template <int dim>
unsigned long Simulation<dim>::unknowns_of_solver() const
{
  return up_solver ? up_solver->space().n_unknowns() : 0;
}

template <int dim>
void Simulation<dim>::construct_up_solver(const typename UpSolver<dim>::Method method, const double start)
{
  const Ledger<dim> carried = solver ? solver->ledger() : Ledger<dim>();
  auto made = std::make_unique<UpSolver<dim>>(parameters.implicit, parameters.linear, method,
                                              parameters.displacement_nodes(),
                                              parameters.scheme.seepage_inertia, grid, scene, start, carried);
  up_solver = made.get();
  explicit_solver = nullptr;
  solver = std::move(made);
}

template <int dim>
void Simulation<dim>::make_up_solver(const typename UpSolver<dim>::Method method, const double start)
{
  // Finite elements keep their nodal values from stage to stage.
  if (up_solver && method == UpSolver<dim>::Method::finite_elements)
    return;
  construct_up_solver(method, start);
  up_solver->prepare();
}

namespace {
/// The state of rest under the loads; with a given ratio of stresses, the one that is nearest to it.
template <int dim>
void find_static_state(UpSolver<dim> &solver, const double K0)
{
  solver.solve_static();
  if (K0 > 0.) {
    solver.set_horizontal_stress(K0);
    solver.solve_static();
  }
}
} // namespace

template <int dim>
void Simulation<dim>::run_static_stage(const StageParameters &stage, const double start)
{
  using Method = typename UpSolver<dim>::Method;
  const double clock = seconds();
  std::string how = "finite elements";
  if (parameters.method == peat::Method::fem) {
    make_up_solver(Method::finite_elements, start);
    find_static_state(*up_solver, stage.K0);
  } else if (stage.static_on_points) {
    how = "on the material points";
    make_up_solver(Method::material_points, start);
    up_solver->solve_static();
    if (stage.K0 > 0.)
      up_solver->set_horizontal_stress(stage.K0);
    balance_pressures(scene, up_solver->nodes(), start);
    make_up_solver(Method::points_at_rest, start);
    up_solver->solve_static();
  } else {
    how = "finite elements, handed to the material points";
    Scene<dim> elements = make_gauss_scene(parameters, grid);
    elements.gravity = scene.gravity;
    elements.conditions.swap(scene.conditions);
    {
      UpSolver<dim> fem(parameters.implicit, parameters.linear, Method::finite_elements,
                        parameters.implicit.element, parameters.scheme.seepage_inertia, grid, elements,
                        start);
      fem.prepare();
      fem.lead(scene);
      find_static_state(fem, stage.K0);
    }
    elements.conditions.swap(scene.conditions);
    make_up_solver(Method::points_at_rest, start);
  }
  if (stage.reset_displacements)
    up_solver->reset_displacements();
  up_solver->forget_work();
  balances = std::make_unique<Balances<dim>>(totals(scene, communicator));
  log.line("stage '" + stage.name + "': static state, " + how + ", " + std::to_string(unknowns_of_solver()) +
           " unknowns");
  report_work();
  steps.add(0.);
  wall.time_loop += seconds() - clock;
  comparison.compare(now, scene, communicator);
  report(now, true);
}

template <int dim>
typename UpSolver<dim>::Method Simulation<dim>::method_of_steps() const
{
  return parameters.method == Method::fem ? UpSolver<dim>::Method::finite_elements
                                          : UpSolver<dim>::Method::material_points;
}

template <int dim>
void Simulation<dim>::begin_implicit_stage(const StageParameters &stage, const double start)
{
  using Mode = typename UpSolver<dim>::Mode;
  make_up_solver(method_of_steps(), start);
  up_solver->start(stage.solver == StageParameters::Solver::quasi_static ? Mode::quasi_static
                                                                         : Mode::dynamic);
  balances->count_inertia(stage.solver != StageParameters::Solver::quasi_static, totals(scene, communicator));
  tell_of_stage(stage, up_solver->suggested_step());
  events = std::make_unique<ContactEvents<dim>>(log, communicator);
}

template <int dim>
void Simulation<dim>::take_implicit_steps(const double end)
{
  double clock = seconds();
  while (now < end && !stopped) {
    const double event = std::min(end, outputs->next());
    steps.limit = up_solver->suggested_step().limit;
    const double dt = up_solver->step(event);
    steps.add(dt);
    now = up_solver->time();
    events->note(now, dt, scene);
    const Watch::Call call = watch.ask();
    const double lap = seconds();
    wall.time_loop += lap - clock;
    if (now >= event * (1. - 1e-12)) {
      now = event;
      up_solver->set_time(now);
    }
    report(now, now >= end);
    heed(call);
    clock = seconds();
    wall.output += clock - lap;
    log.progress(now / planned_end, now, steps.n_steps,
                 steps.n_steps * double(scene.n_global_points()) / std::max(1e-9, wall.time_loop));
  }
  if (stopped)
    report(now, true);
  if (!scene.contact_states.empty())
    events->summarise(scene);
  report_work();
}

template <int dim>
void Simulation<dim>::report_work() const
{
  const auto &work = up_solver->work();
  std::ostringstream text;
  text << work.newton_iterations << " Newton iterations, " << work.linear_solves << " linear systems of "
       << up_solver->space().n_unknowns() << " unknowns";
  if (work.linear_solves > 0)
    text << " with " << double(work.linear_iterations) / work.linear_solves << " iterations each";
  if (work.rejected_steps > 0)
    text << ", " << work.rejected_steps << " steps repeated with shorter ones";
  log.line(text.str());
}

template <int dim>
void Simulation<dim>::report_work(const PressureWork &work)
{
  pressure_work.solves += work.solves;
  pressure_work.iterations += work.iterations;
  pressure_work.multigrids += work.multigrids;
  if (work.solves == 0)
    return;
  std::ostringstream text;
  text << "implicit pressures: " << double(work.iterations) / work.solves << " iterations a step, "
       << work.multigrids << " multigrid preconditioners";
  log.line(text.str());
}

namespace {
/// Energy above the work that went in, as a share of the largest energy so far.
template <int dim>
double made_energy(const Balances<dim> &balances)
{
  return balances.numerical_dissipation < 0. ? balances.energy_error : 0.;
}

std::string above_the_limit(const SchemeParameters &scheme)
{
  std::ostringstream text;
  text << "; 'Step factor' " << scheme.step_factor << " is above the stable step, take 1 at most";
  return text.str();
}

/// A step that says so if it fails because it is above the stable one.
template <int dim>
void step_within(ExplicitMPM<dim> &solver, const SchemeParameters &scheme, const double dt)
{
  try {
    solver.step(dt);
  } catch (const NumericalError &error) {
    if (scheme.step_factor <= 1. || scheme.fixed_step > 0.)
      throw;
    throw NumericalError(error.what() + above_the_limit(scheme));
  }
}

/// Above the stable step points may stay where they are and yet take energy from nowhere. Energies are over
/// those at the start of the stage: close to the limit that of a stable step swings by more than there is.
template <int dim>
void check_step_factor(const SchemeParameters &scheme, const Balances<dim> &balances,
                       const double energy_at_start, const double time)
{
  constexpr double most = 0.5, least_growth = 10.;
  const double made = made_energy(balances);
  if (scheme.step_factor <= 1. || scheme.fixed_step > 0. || made <= most ||
      -balances.numerical_dissipation < least_growth * energy_at_start)
    return;
  std::ostringstream message;
  message << "by t = " << time << " s the scheme has made energy, " << 100. * made << " % of the largest";
  throw NumericalError(message.str() + above_the_limit(scheme));
}
} // namespace

template <int dim>
void Simulation<dim>::make_explicit_solver(const StageParameters &stage, const double start)
{
  stage_scheme.implicit_pressure = progress.scheme == Scheme::semi_implicit;
  stage_scheme.largest_step = progress.largest_step;
  stage_scheme.local_damping = std::max(parameters.scheme.local_damping, stage.local_damping);
  const Ledger<dim> carried = solver ? solver->ledger() : Ledger<dim>();
  up_solver = nullptr;
  auto made = std::make_unique<ExplicitMPM<dim>>(stage_scheme, grid, scene, start, carried);
  explicit_solver = made.get();
  solver = std::move(made);
}

template <int dim>
void Simulation<dim>::begin_explicit_stage(const StageParameters &stage, const double start)
{
  make_explicit_solver(stage, start);
  ExplicitMPM<dim> &mpm = *explicit_solver;
  mpm.prepare();
  balances->count_inertia(true, totals(scene, communicator));
  tell_of_stage(stage, mpm.stable_step());
  events = std::make_unique<ContactEvents<dim>>(log, communicator);
  progress.energy_at_start = totals(scene, communicator).energy();
  progress.stable = mpm.stable_step();
  progress.steps_since_check = progress.steps_left = 0;
}

template <int dim>
void Simulation<dim>::plan_steps(const double event)
{
  // Between two events the step is constant, unless the stable step has changed by then.
  constexpr unsigned int steps_between_checks = 100;
  if (progress.steps_since_check >= steps_between_checks) {
    // Steps that go up and down with a limit make energy come and go: they grow only where it is worth while.
    constexpr double worthwhile = 1.3;
    const StableStep found = explicit_solver->stable_step();
    if (found.dt < progress.stable.dt || found.dt > worthwhile * progress.stable.dt)
      progress.stable = found;
    progress.steps_since_check = 0;
  }
  const StableStep &stable = progress.stable;
  const double wanted = stage_scheme.fixed_step > 0.
                            ? stage_scheme.fixed_step
                            : std::min(stage_scheme.step_factor * stable.dt, stage_scheme.largest_step);
  if (stage_scheme.fixed_step > stable.dt) {
    std::ostringstream message;
    message << "'Time step' " << wanted << " s is above the stable step " << stable.dt << " s ("
            << stable.limit << ") at t = " << now << " s";
    throw NumericalError(message.str());
  }
  steps.limit = stable.limit;
  const double n_steps = std::ceil((event - now) / wanted * (1. - 1e-12));
  progress.dt = (event - now) / n_steps;
  progress.steps_left = std::min<double>(n_steps, steps_between_checks - progress.steps_since_check);
  progress.reaches_event = progress.steps_left == n_steps;
}

template <int dim>
void Simulation<dim>::take_explicit_steps(const double end)
{
  ExplicitMPM<dim> &mpm = *explicit_solver;
  double clock = seconds();
  while (now < end && !stopped) {
    const double event = std::min(end, outputs->next());
    if (progress.steps_left == 0)
      plan_steps(event);
    Watch::Call call = Watch::Call::none;
    while (progress.steps_left > 0 && call == Watch::Call::none) {
      step_within(mpm, stage_scheme, progress.dt);
      steps.add(progress.dt);
      events->note(mpm.time(), progress.dt, scene);
      ++progress.steps_since_check;
      --progress.steps_left;
      now = mpm.time();
      call = watch.ask();
    }
    const double lap = seconds();
    wall.time_loop += lap - clock;
    if (progress.reaches_event && progress.steps_left == 0) {
      now = event;
      mpm.set_time(now);
    }
    report(now, now >= end);
    check_step_factor(stage_scheme, *balances, progress.energy_at_start, now);
    heed(call);
    clock = seconds();
    wall.output += clock - lap;
    log.progress(now / planned_end, now, steps.n_steps,
                 steps.n_steps * double(scene.n_global_points()) / std::max(1e-9, wall.time_loop));
  }
  if (stopped)
    report(now, true);
  events->summarise(scene);
  constexpr double worth_a_word = 0.05;
  if (made_energy(*balances) > worth_a_word) {
    std::ostringstream message;
    message << "attention: the scheme has made energy, " << 100. * made_energy(*balances)
            << " % of the largest (energy error in statistics.csv); see doc/stability.md";
    log.line(message.str());
  }
  report_work(mpm.pressure_work());
}

#define PEAT_INSTANTIATE(dim)                                                                                \
  template unsigned long Simulation<dim>::unknowns_of_solver() const;                                        \
  template void Simulation<dim>::begin_stage(const StageParameters &, double);                               \
  template void Simulation<dim>::finish_stage(const StageParameters &, double);                              \
  template bool Simulation<dim>::is_implicit(const StageParameters &) const;                                 \
  template void Simulation<dim>::plan_outputs(const StageParameters &, double);                              \
  template void Simulation<dim>::make_explicit_solver(const StageParameters &, double);                      \
  template UpSolver<dim>::Method Simulation<dim>::method_of_steps() const;                                   \
  template void Simulation<dim>::construct_up_solver(UpSolver<dim>::Method, double);
PEAT_INSTANTIATE(2)
PEAT_INSTANTIATE(3)
#undef PEAT_INSTANTIATE
} // namespace peat
