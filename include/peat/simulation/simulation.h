#pragma once

#include <peat/simulation/case.h>
#include <peat/simulation/comparison.h>
#include <peat/simulation/log.h>
#include <peat/simulation/pictures.h>
#include <peat/simulation/probes.h>
#include <peat/simulation/recorder.h>
#include <peat/simulation/run_options.h>
#include <peat/simulation/schedule.h>
#include <peat/simulation/scheme_choice.h>
#include <peat/simulation/statistics.h>
#include <peat/solver/explicit_mpm.h>
#include <peat/solver/totals.h>
#include <peat/solver/up_solver.h>

#include <memory>
#include <string>

namespace peat {
/// The wall-clock time of the parts of a run [s].
struct WallTimes
{
  double setup = 0.;
  double time_loop = 0.; ///< without output
  double output = 0.;
};

/// The steps taken so far.
struct StepRecord
{
  unsigned long n_steps = 0;
  double smallest = std::numeric_limits<double>::infinity();
  double largest = 0.;
  double total_time = 0.;
  std::string limit; ///< what binds the present step

  void add(double dt);
};

/// Make the bodies, and the tracers that the conditions and probes ask for. Collective.
template <int dim>
Scene<dim> make_scene(Case<dim> &parameters, const Grid<dim> &grid);

/// The bodies of a case with Gauss points, and their surfaces; without conditions and probes. Collective.
template <int dim>
Scene<dim> make_gauss_scene(const Case<dim> &parameters, const Grid<dim> &grid);

/// Runs the stages of a case and leaves an output directory.
template <int dim>
class Simulation
{
public:
  /// `recorder`, if any, is called at its times and must live as long as this.
  Simulation(Case<dim> &parameters, const ParameterFile &file, const RunOptions &options,
             MPI_Comm communicator, Recorder<dim> *recorder = nullptr);
  ~Simulation();

  /// Returns false if a signal ended the run early. Throws NumericalError after writing the last state.
  bool run();

  /// What was found against the references of the case.
  const Comparison<dim> &references() const { return comparison; }

private:
  struct Outputs;
  void run_stage(const StageParameters &stage, double start);
  void run_explicit_stage(const StageParameters &stage, double start, const SchemeEstimate &estimate);
  void run_implicit_stage(const StageParameters &stage, double start);
  void run_static_stage(const StageParameters &stage, double start);
  void bring_in_bodies(const StageParameters &stage);
  /// Say what contacts mean in an implicit stage.
  void note_contacts(const StageParameters &stage);
  void begin_stage(const StageParameters &stage, const StableStep &step);
  /// The scheme of a dynamic stage of material points, and what the log says of it. Collective.
  SchemeEstimate choose_scheme(const StageParameters &stage, double start);
  void note_scheme(Scheme scheme);
  void make_up_solver(typename UpSolver<dim>::Method method, double start);
  unsigned long unknowns_of_solver() const;
  void report_work() const;
  void report_work(const PressureWork &work);
  void report(double time, bool everything);
  void write_summary() const;
  std::vector<typename Comparison<dim>::Result> compare_with_references() const;
  bool interrupted();

  const double begin; ///< wall-clock time
  Case<dim> &parameters;
  const RunOptions options;
  MPI_Comm communicator;
  WallTimes wall;
  // What may refuse the parameter file comes first, and leaves no directory behind.
  Grid<dim> grid;
  Scene<dim> scene;
  Comparison<dim> comparison;
  Recorder<dim> *const recorder;
  const std::string directory;
  mutable Log log;
  std::unique_ptr<Solver<dim>> solver;
  UpSolver<dim> *up_solver = nullptr; ///< the same, if it is one
  SchemeParameters stage_scheme;
  std::unique_ptr<Balances<dim>> balances;
  std::unique_ptr<Outputs> outputs;
  StepRecord steps;
  PressureWork pressure_work;       ///< of semi-implicit stages
  std::vector<std::string> schemes; ///< names of those used so far
  double now = 0.;
  double planned_end = 0.;
  bool stopped = false;
};

/// Asks SIGINT and SIGTERM to end the run at the next step; see Simulation::run().
void catch_signals();
/// Whether one of them has come.
bool signal_was_caught();

/// The directory that results go to if none is named.
std::string default_output_directory(const std::string &file_name);
} // namespace peat
