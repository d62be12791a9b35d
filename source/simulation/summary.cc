#include <peat/base/text.h>
#include <peat/simulation/simulation.h>

#include <deal.II/base/mpi.h>

#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include <cmath>
#include <cstdio>

namespace peat {
namespace {
double peak_memory(MPI_Comm communicator)
{
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return dealii::Utilities::MPI::sum(1024. * usage.ru_maxrss, communicator);
}

/// JSON knows no NaN.
nlohmann::ordered_json number(const double x)
{
  return std::isfinite(x) ? nlohmann::ordered_json(x) : nlohmann::ordered_json(nullptr);
}
} // namespace

template <int dim>
void Simulation<dim>::write_summary() const
{
  const auto results = compare_with_references();
  const double memory = peak_memory(communicator);
  const std::size_t active_cells =
      dealii::Utilities::MPI::sum(std::size_t(solver->nodes().occupied_cells().size()), communicator);
  std::size_t n_owned_nodes = 0;
  for (unsigned int i = 0; i < solver->nodes().size(); ++i)
    n_owned_nodes += solver->nodes().is_owned(i);
  n_owned_nodes = dealii::Utilities::MPI::sum(n_owned_nodes, communicator);
  if (dealii::Utilities::MPI::this_mpi_process(communicator) != 0)
    return;

  const unsigned int n_ranks = dealii::Utilities::MPI::n_mpi_processes(communicator);
  const double n_points = scene.n_global_points();
  nlohmann::ordered_json summary;
  summary["version"] = PEAT_VERSION;
  summary["case"] = parameters.title.empty() ? options.file : parameters.title;
  const bool fem = parameters.method == Method::fem;
  summary["method"] = fem ? "fem" : "mpm";
  summary["scheme"] = join(schemes);
  summary["dimension"] = dim;
  summary["ranks"] = n_ranks;
  summary["completed"] = !stopped && now >= planned_end;
  summary["points"] = n_points;
  summary["active_cells"] = active_cells;
  summary["dofs"] = unknowns_of_solver() > 0 ? unknowns_of_solver() : n_owned_nodes * dim;
  summary["steps"] = steps.n_steps;
  if (up_solver)
    summary["iterations"] = {{"newton", up_solver->work().newton_iterations},
                             {"linear_systems", up_solver->work().linear_solves},
                             {"linear", up_solver->work().linear_iterations},
                             {"rejected_steps", up_solver->work().rejected_steps}};
  if (pressure_work.solves > 0) {
    summary["iterations"]["pressure_systems"] = pressure_work.solves;
    summary["iterations"]["pressure"] = pressure_work.iterations;
  }
  summary["simulated_time"] = number(now);
  summary["dt"] = {{"min", number(steps.smallest)},
                   {"max", number(steps.largest)},
                   {"mean", number(steps.n_steps ? steps.total_time / steps.n_steps : 0.)},
                   {"binding_limit", steps.limit}};
  summary["wall_seconds"] = {{"total", wall.setup + wall.time_loop + wall.output},
                             {"setup", wall.setup},
                             {"time_loop", wall.time_loop},
                             {"output", wall.output}};
  summary["point_steps_per_second_per_rank"] =
      number(wall.time_loop > 0. ? steps.n_steps * n_points / wall.time_loop / n_ranks : 0.);
  summary["peak_memory_bytes"] = memory;
  summary["lost_points"] = 0; // a lost point ends the run
  summary["balance"] = {{"mass", number(balances->mass_error)},
                        {"fluid_mass", number(balances->fluid_error)},
                        {"momentum", number(balances->momentum_error)},
                        {"energy", number(balances->energy_error)}};
  summary["errors"] = nlohmann::ordered_json::object();
  for (const auto &result : results)
    summary["errors"][result.reference] = {{"field", result.field},
                                           {"L2", number(result.norms.L2)},
                                           {"Linf", number(result.norms.Linf)},
                                           {"relative_L1", number(result.relative_L1)},
                                           {"relative_L2", number(result.relative_L2)},
                                           {"relative_Linf", number(result.relative_Linf)},
                                           {"compared", result.norms.n},
                                           {"not_compared", result.norms.n_outside}};

  const std::string path = directory + "/summary.json";
  {
    std::ofstream file(path + ".tmp");
    file << summary.dump(2) << std::endl;
  }
  std::rename((path + ".tmp").c_str(), path.c_str());
}

template void Simulation<2>::write_summary() const;
template void Simulation<3>::write_summary() const;
} // namespace peat
