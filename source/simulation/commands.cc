#include <peat/base/text.h>
#include <peat/simulation/commands.h>
#include <peat/simulation/simulation.h>

#include <deal.II/base/mpi.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <sstream>

namespace peat {
namespace {
template <int dim>
int run(const ParameterFile &file, const RunOptions &options, MPI_Comm communicator)
{
  Case<dim> parameters(file);
  std::unique_ptr<Checkpoint> checkpoint;
  if (options.resume) {
    std::vector<StageSpan> stages;
    for (const StageParameters &stage : parameters.stages)
      stages.push_back({stage.name, stage.duration});
    checkpoint = std::make_unique<Checkpoint>(output_directory(options), file, stages, communicator);
  }
  catch_signals();
  Simulation<dim> simulation(parameters, file, options, communicator, nullptr, std::move(checkpoint));
  return simulation.run() ? exit_success : exit_interrupted;
}

/// Seconds that a step takes, from a few of the run's first ones. Collective.
template <int dim>
double measure_step(ExplicitMPM<dim> &solver, const double dt, const double n_steps, MPI_Comm communicator)
{
  const auto start = std::chrono::steady_clock::now();
  double elapsed = 0.;
  unsigned int n = 0;
  do {
    solver.step(dt);
    ++n;
    elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    // The ranks stop after the same step.
    elapsed = dealii::Utilities::MPI::max(elapsed, communicator);
  } while (elapsed < 0.2 && n < std::min(1000., n_steps));
  return elapsed / n;
}

/// What `peat check` says of a case that finite elements solve.
template <int dim>
std::string describe_elements(const Case<dim> &parameters, const Grid<dim> &grid, Scene<dim> &scene)
{
  UpSolver<dim> solver(parameters.implicit, parameters.linear, UpSolver<dim>::Method::finite_elements,
                       parameters.displacement_nodes(), parameters.scheme.seepage_inertia, grid, scene, 0.);
  solver.prepare();
  std::ostringstream text;
  text << "u-p finite elements: " << solver.space().n_unknowns() << " unknowns";
  for (const auto &stage : parameters.stages) {
    using Mode = typename UpSolver<dim>::Mode;
    text << "\nstage '" << stage.name << "': ";
    if (stage.solver == StageParameters::Solver::static_state) {
      text << "static";
      continue;
    }
    const bool dynamic = stage.solver == StageParameters::Solver::dynamic;
    solver.start(dynamic ? Mode::dynamic : Mode::quasi_static);
    const StableStep step = solver.suggested_step();
    text << "first step " << step.dt << " s (" << step.limit << ')';
    if (dynamic)
      text << ", about " << std::ceil(stage.duration / step.dt) << " steps, more if output asks for it";
  }
  return text.str();
}

/// What a scene of material points consists of.
template <int dim>
std::string describe_points(const Case<dim> &parameters, const Grid<dim> &grid, const Scene<dim> &scene,
                            const std::size_t n_own_cells)
{
  std::ostringstream text;
  text << (parameters.title.empty() ? "case" : parameters.title) << ": " << dim << "-D, "
       << dealii::Utilities::MPI::n_mpi_processes(grid.communicator()) << " rank(s)\n";
  for (const auto &body : scene.bodies)
    text << "body '" << body->name() << "': " << body->n_global_points() << " points of '"
         << body->material().name() << "', " << body->layout().n_columns << " values each\n";
  for (const auto &rigid : scene.rigid_bodies) {
    text << "rigid body '" << rigid->name() << "': ";
    if (rigid->is_prescribed())
      text << "prescribed motion\n";
    else
      text << rigid->mass() << (dim == 2 ? " kg/m\n" : " kg\n");
  }
  text << "cells: " << grid.triangulation().n_global_active_cells() << ", of them "
       << dealii::Utilities::MPI::sum(n_own_cells, grid.communicator()) << " hold points\n";
  dealii::Utilities::System::MemoryStats memory;
  dealii::Utilities::System::get_memory_stats(memory);
  text << "memory of this process: " << readable_bytes(1024. * memory.VmRSS);
  return text.str();
}

std::string describe_stage(const StageParameters &stage)
{
  switch (stage.solver) {
  case StageParameters::Solver::static_state:
    return "static";
  case StageParameters::Solver::quasi_static:
    return to_text(stage.duration) + " s, quasi-static, steps as long as changes allow";
  default:
    return to_text(stage.duration) +
           " s, dynamic; schemes, the one to be taken marked, costs in explicit steps:";
  }
}

template <int dim>
int check(const ParameterFile &file, const RunOptions &options, MPI_Comm communicator)
{
  Case<dim> parameters(file);
  const bool first = dealii::Utilities::MPI::this_mpi_process(communicator) == 0;
  Log log("", first, false);
  Grid<dim> grid(parameters.grid, communicator);
  Scene<dim> scene = make_scene(parameters, grid);
  const Comparison<dim> comparison(parameters, std::filesystem::path(options.file).parent_path().string());
  if (parameters.method == Method::fem) {
    log.line(describe_elements(parameters, grid, scene));
    return exit_success;
  }
  {
    ExplicitMPM<dim> solver(parameters.scheme, grid, scene, 0.);
    solver.prepare();
    log.line(describe_points(parameters, grid, scene, solver.nodes().occupied_cells().size()));
  }

  // Stages count as if they began with the points at their places of the start.
  double start = 0., cost = 0.;
  bool measurable = true;
  for (const auto &stage : parameters.stages) {
    for (const std::size_t b : parameters.entering_bodies(stage)) {
      scene.bodies[b]->enter();
      log.line("body '" + scene.bodies[b]->name() + "' comes in with stage '" + stage.name +
               "': " + std::to_string(scene.bodies[b]->n_global_points()) + " points");
    }
    log.line("stage '" + stage.name + "': " + describe_stage(stage));
    if (stage.solver == StageParameters::Solver::dynamic) {
      const Demand asked = demand(parameters, stage, scene, grid, start);
      const auto list = estimate_schemes(parameters, stage, scene, grid, asked);
      const SchemeEstimate &taken = *std::find_if(list.begin(), list.end(), [&](const auto &one) {
        return stage.scheme == Scheme::automatic || one.scheme == stage.scheme;
      });
      for (const auto &estimate : list)
        log.line((&estimate == &taken ? "  * " : "    ") + describe(estimate));
      if (asked.waves)
        log.line("    waves count, since " + asked.why);
      cost += taken.cost;
      measurable = measurable && parameters.why_not(Scheme::explicit_steps, stage).empty();
    }
    start += stage.duration;
  }
  if (cost == 0. || !measurable)
    return exit_success;
  ExplicitMPM<dim> solver(parameters.scheme, grid, scene, 0.);
  solver.prepare();
  const StableStep stable = solver.stable_step();
  const double step = measure_step(solver, parameters.scheme.step_factor * stable.dt, cost, communicator);
  log.line("stable explicit step: " + to_text(stable.dt) + " s, limit: " + stable.limit + "; takes " +
           readable_duration(step) + ", measured now");
  log.line("run time of the dynamic stages: about " + readable_duration(cost * step) + " without output");
  return exit_success;
}
} // namespace

int command_run(const RunOptions &options, MPI_Comm communicator)
{
  const ParameterFile file(options.file, options.overrides);
  return read_dimension(file) == 2 ? run<2>(file, options, communicator)
                                   : run<3>(file, options, communicator);
}

int command_check(const RunOptions &options, MPI_Comm communicator)
{
  const ParameterFile file(options.file, options.overrides);
  return read_dimension(file) == 2 ? check<2>(file, options, communicator)
                                   : check<3>(file, options, communicator);
}

int command_parameters(const std::string &format, const unsigned int dim)
{
  const ParameterFile file = ParameterFile::describing();
  read_dimension(file);
  if (dim == 2)
    Case<2> parameters(file);
  else
    Case<3> parameters(file);
  if (format == "markdown")
    file.write_markdown(std::cout);
  else if (format == "json")
    file.write_json(std::cout);
  else
    file.write_prm(std::cout);
  return exit_success;
}
} // namespace peat
