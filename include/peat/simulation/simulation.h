#pragma once

#include <peat/simulation/case.h>
#include <peat/simulation/checkpoint.h>
#include <peat/simulation/comparison.h>
#include <peat/simulation/contact_events.h>
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
  void persist(Archive &archive);
};

/// Where a run is in its stages, and what a stage remembers beside its solver.
struct StageProgress
{
  std::size_t stage = 0; ///< number of the stage
  Scheme scheme = Scheme::explicit_steps;
  double largest_step = std::numeric_limits<double>::max(); ///< [s], of semi-implicit steps

  // Explicit steps.
  StableStep stable{0., ""};
  unsigned int steps_since_check = 0; ///< of the stable step
  double dt = 0.;                     ///< of steps to the next event or check [s]
  unsigned int steps_left = 0;        ///< of this length
  bool reaches_event = false;         ///< with the last of them
  double energy_at_start = 0.;        ///< [J]

  void persist(Archive &archive);
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
  /// With a checkpoint the run goes on from it.
  Simulation(Case<dim> &parameters, const ParameterFile &file, const RunOptions &options,
             MPI_Comm communicator, Recorder<dim> *recorder = nullptr,
             std::unique_ptr<Checkpoint> checkpoint = nullptr);
  ~Simulation();

  /// Returns false if a signal ended the run early. Throws NumericalError after writing the last state.
  bool run();

  /// What was found against the references of the case.
  const Comparison<dim> &references() const { return comparison; }

private:
  struct Outputs;
  /// Bodies, scheme, outputs and solver of a stage; all of a static one.
  void begin_stage(const StageParameters &stage, double start);
  /// From where it is to its end, or until a signal comes.
  void finish_stage(const StageParameters &stage, double start);
  void run_static_stage(const StageParameters &stage, double start);
  void begin_explicit_stage(const StageParameters &stage, double start);
  void begin_implicit_stage(const StageParameters &stage, double start);
  void take_explicit_steps(double end);
  void take_implicit_steps(double end);
  /// How many steps of which length come next.
  void plan_steps(double event);
  bool is_implicit(const StageParameters &stage) const;
  void plan_outputs(const StageParameters &stage, double start);
  /// Write a checkpoint if it is called for, or to end the run.
  void heed(Watch::Call call);
  /// Read the checkpoint. Returns the number of the stage that it was written in.
  std::size_t resume();
  double start_of(std::size_t stage) const; ///< [s]
  /// What has been done and written; without communication.
  void persist_record(Archive &archive);
  /// What the next step depends on. Collective.
  void persist_state(Archive &archive);
  void bring_in_bodies(const StageParameters &stage);
  /// Say what contacts mean in an implicit stage.
  void note_contacts(const StageParameters &stage);
  void tell_of_stage(const StageParameters &stage, const StableStep &step);
  /// The scheme of a dynamic stage of material points, and what the log says of it. Collective.
  SchemeEstimate choose_scheme(const StageParameters &stage, double start);
  void note_scheme(Scheme scheme);
  void make_explicit_solver(const StageParameters &stage, double start);
  void construct_up_solver(typename UpSolver<dim>::Method method, double start);
  void make_up_solver(typename UpSolver<dim>::Method method, double start);
  typename UpSolver<dim>::Method method_of_steps() const;
  unsigned long unknowns_of_solver() const;
  void report_work() const;
  void report_work(const PressureWork &work);
  void report(double time, bool everything);
  void write_summary() const;
  std::vector<typename Comparison<dim>::Result> compare_with_references() const;

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
  UpSolver<dim> *up_solver = nullptr;          ///< the same, if it is one
  ExplicitMPM<dim> *explicit_solver = nullptr; ///< the same, if it is one
  SchemeParameters stage_scheme;
  std::unique_ptr<Balances<dim>> balances;
  std::unique_ptr<Outputs> outputs;
  std::unique_ptr<Checkpoint> checkpoint; ///< to go on from; until then
  CheckpointWriter checkpoints;
  Watch watch;
  StageProgress progress;
  std::unique_ptr<ContactEvents<dim>> events; ///< of the stage
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
/// The one that is named, or that.
std::string output_directory(const RunOptions &options);
} // namespace peat
