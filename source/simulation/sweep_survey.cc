#include <peat/base/invalid_value.h>
#include <peat/base/text.h>
#include <peat/simulation/scheme_choice.h>
#include <peat/simulation/simulation.h>
#include <peat/simulation/sweep_plan.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

namespace peat {
namespace {
constexpr std::size_t most_runs = 10000;

// Rough costs on one core, only good to put runs in order and to begin with a time to go.
constexpr double seconds_a_step = 2e-5;
constexpr double seconds_a_point_and_step = 3e-7;
constexpr double seconds_an_unknown_and_solve = 1e-5;
constexpr double quasi_static_steps = 100.;

bool begins_with(const std::string &text, const std::string &begin)
{
  return text.compare(0, begin.size(), begin) == 0;
}

/// Why setting the entry changes nothing in this case; "" if it may.
template <int dim>
std::string without_meaning(const Case<dim> &parameters, const std::string &key)
{
  const bool fem = parameters.method == Method::fem;
  if (fem && (begins_with(key, "Explicit MPM/") || SweepAxis(key, "1").name() == "Scheme"))
    return "finite elements do not use " + in_quotes(key);
  if (fem && begins_with(key, "Bodies/") && SweepAxis(key, "1").name() == "Points per cell")
    return "finite elements have no " + in_quotes(key);
  if (!parameters.is_implicit() &&
      (begins_with(key, "Implicit solver/") || begins_with(key, "Linear solver/")))
    return "explicit stages do not use " + in_quotes(key);
  return "";
}

/// Rough seconds of a dynamic stage of material points.
template <int dim>
double dynamic_seconds(const Case<dim> &parameters, const StageParameters &stage, const Grid<dim> &grid,
                       const Scene<dim> &scene, const double start)
{
  const auto estimates =
      estimate_schemes(parameters, stage, scene, grid, demand(parameters, stage, scene, grid, start));
  auto used = estimates.begin();
  if (stage.scheme != Scheme::automatic)
    used = std::find_if(estimates.begin(), estimates.end(),
                        [&](const SchemeEstimate &estimate) { return estimate.scheme == stage.scheme; });
  return used->cost * (seconds_a_step + seconds_a_point_and_step * scene.n_global_points());
}

/// Rough seconds of a run; the scene is that of its start.
template <int dim>
double nominal_seconds(const Case<dim> &parameters, const Grid<dim> &grid, Scene<dim> &scene)
{
  using Solver = StageParameters::Solver;
  double seconds = 0.;
  const bool fem = parameters.method == Method::fem;
  std::unique_ptr<UpSolver<dim>> up;
  double n_unknowns = double(grid.triangulation().n_global_active_cells()) * (dim + 1);
  if (fem) {
    up = std::make_unique<UpSolver<dim>>(
        parameters.implicit, parameters.linear, UpSolver<dim>::Method::finite_elements,
        parameters.displacement_nodes(), parameters.scheme.seepage_inertia, grid, scene, 0.);
    up->prepare();
    n_unknowns = up->space().n_unknowns();
  }
  double start = 0.;
  for (const StageParameters &stage : parameters.stages) {
    for (const std::size_t b : parameters.entering_bodies(stage))
      scene.bodies[b]->enter();
    double n_solves = 1.;
    if (stage.solver == Solver::quasi_static)
      n_solves = quasi_static_steps;
    if (stage.solver == Solver::dynamic && fem) {
      up->start(UpSolver<dim>::Mode::dynamic);
      n_solves = stage.duration / up->suggested_step().dt;
    }
    if (stage.solver == Solver::dynamic && !fem)
      seconds += dynamic_seconds(parameters, stage, grid, scene, start);
    else
      seconds += n_solves * n_unknowns * seconds_an_unknown_and_solve;
    start += stage.duration;
  }
  return seconds;
}

/// Reads the case and builds its first state. Leaves in the run what is known of it beforehand; values that
/// mean nothing become empty, and the reason is left.
template <int dim>
void survey(const ParameterFile &file, const RunOptions &options, const std::vector<SweepAxis> &axes,
            MPI_Comm communicator, SweepRun &run)
{
  Case<dim> parameters(file);
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const std::string reason = without_meaning(parameters, axes[a].key);
    if (!reason.empty()) {
      run.values[a].clear();
      run.reason = reason;
    }
  }
  const Grid<dim> grid(parameters.grid, communicator);
  Scene<dim> scene = make_scene(parameters, grid);
  const Comparison<dim> comparison(parameters, std::filesystem::path(options.file).parent_path().string());
  run.cell_size = grid.smallest_cell_size();
  try {
    run.nominal_seconds = nominal_seconds(parameters, grid, scene);
  } catch (const NumericalError &) {
    // The run itself will meet it and say it; it is quick to do so.
    run.nominal_seconds = 0.;
  }
}

/// What the command line sets in a run.
std::vector<std::string> overrides_of(const RunOptions &options, const std::vector<SweepAxis> &axes,
                                      const std::vector<std::string> &values)
{
  // Pictures of all runs would fill disks; who wants them can vary or run them.
  std::vector<std::string> overrides = {"Output/Pictures=false"};
  overrides.insert(overrides.end(), options.overrides.begin(), options.overrides.end());
  for (std::size_t a = 0; a < axes.size(); ++a)
    if (!values[a].empty())
      overrides.push_back(axes[a].key + '=' + values[a]);
  return overrides;
}

/// Complains at the axis that the message of an override is about, if there is one.
void blame(const std::vector<SweepAxis> &axes, const std::string &message)
{
  for (const SweepAxis &axis : axes)
    if (begins_with(message, shortened("--set " + axis.key + '=', 200)))
      throw InputError(axis.place + message);
}

/// The complete parameters that a run leaves, as far as they matter for it.
template <int dim>
std::string complete_parameters(const ParameterFile &file)
{
  const Case<dim> parameters(file);
  std::ostringstream text;
  file.write_prm(text);
  return without_comparisons(text.str());
}

SweepRun plan_run(const RunOptions &options, const std::vector<SweepAxis> &axes,
                  const std::vector<std::string> &values, MPI_Comm communicator)
{
  SweepRun run;
  run.values = values;
  const auto file_with = [&](const std::vector<std::string> &chosen) {
    run.overrides = overrides_of(options, axes, chosen);
    try {
      return ParameterFile(options.file, run.overrides);
    } catch (const InputError &error) {
      // No number, or no constant of that name: nothing that another value of another entry would heal.
      throw InvalidValue(error.what());
    }
  };
  try {
    const ParameterFile file = file_with(values);
    if (read_dimension(file) == 2)
      survey<2>(file, options, axes, communicator, run);
    else
      survey<3>(file, options, axes, communicator, run);
    const ParameterFile final_file = file_with(run.values);
    run.parameters = read_dimension(final_file) == 2 ? complete_parameters<2>(final_file)
                                                     : complete_parameters<3>(final_file);
  } catch (const InvalidValue &error) {
    blame(axes, error.what());
    run.state = SweepRun::State::refused;
    run.reason = error.what();
  } catch (const InputError &error) {
    run.state = SweepRun::State::refused;
    run.reason = error.what();
  }
  return run;
}

void name_runs(std::vector<SweepRun> &runs)
{
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::string name = shortened(run_name(runs[i].values), 100);
    const auto n_before = std::count_if(runs.begin(), runs.begin() + i, [&](const SweepRun &other) {
      return shortened(run_name(other.values), 100) == name;
    });
    runs[i].name = (name.empty() ? "case" : name) + (n_before > 0 ? "_" + std::to_string(n_before + 1) : "");
  }
}
} // namespace

std::vector<SweepRun> plan_runs(const RunOptions &options, const std::vector<SweepAxis> &axes,
                                MPI_Comm communicator)
{
  double n_runs = 1.;
  for (const SweepAxis &axis : axes)
    n_runs *= axis.values.size();
  if (n_runs > most_runs)
    throw InputError("the sweep has " + to_text(n_runs) + " combinations; at most " +
                     std::to_string(most_runs) + " are possible");
  std::vector<SweepRun> runs;
  for (const auto &values : combinations(axes)) {
    SweepRun run = plan_run(options, axes, values, communicator);
    if (run.state == SweepRun::State::waiting) {
      const auto same = std::find_if(runs.begin(), runs.end(), [&](const SweepRun &other) {
        return other.state == SweepRun::State::waiting && other.values == run.values;
      });
      if (same != runs.end()) {
        run.state = SweepRun::State::refused;
        run.reason += ", and the run without it is in the list already";
        run.values = values;
      } else
        run.reason.clear();
    }
    runs.push_back(run);
  }
  if (std::none_of(runs.begin(), runs.end(),
                   [](const SweepRun &run) { return run.state == SweepRun::State::waiting; })) {
    blame(axes, runs.front().reason);
    throw InputError("the case refuses all combinations; the first one: " + runs.front().reason);
  }
  name_runs(runs);
  return runs;
}
} // namespace peat
