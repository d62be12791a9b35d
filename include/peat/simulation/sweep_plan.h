#pragma once

#include <peat/simulation/run_options.h>
#include <peat/simulation/sweep_analysis.h>
#include <peat/simulation/sweep_parameters.h>

#include <deal.II/base/mpi.h>

#include <limits>
#include <string>
#include <vector>

namespace peat {
/// One combination of the values of a sweep, and what became of it.
struct SweepRun
{
  enum class State {
    waiting,
    refused,     ///< by the case, with a reason
    skipped,     ///< not worth while
    failed,      ///< the computation went wrong
    interrupted, ///< by a signal, before or while it ran
    done
  };

  // Of the plan
  std::vector<std::string> values;    ///< by axis; "" where the entry means nothing for this run
  std::string name;                   ///< of its directory: "20_explicit"
  std::vector<std::string> overrides; ///< "Section/Key=value"
  std::string parameters;             ///< what parameters.prm will hold, without what means nothing in a run
  double cell_size = 0.;              ///< smallest one [m]
  double nominal_seconds = 0.;        ///< rough time of the run, to put runs in order [s]

  // Of the run
  State state = State::waiting;
  std::string reason;       ///< why it is not done
  bool from_before = false; ///< was finished when the sweep began
  double seconds = 0.;      ///< of the time loop [s]
  double total_seconds = 0.;
  double points = 0., unknowns = 0., steps = 0., peak_memory = 0.; ///< memory in bytes
  std::string binding_limit;
  std::vector<double> errors;                              ///< relative, by reference; NaN: nothing compared
  double error = std::numeric_limits<double>::quiet_NaN(); ///< the largest of them

  bool is_done() const { return state == State::done; }
  Bought bought() const { return {seconds, is_done() ? error : std::numeric_limits<double>::quiet_NaN()}; }
};

/// All combinations of the values; the last axis changes first.
std::vector<std::vector<std::string>> combinations(const std::vector<SweepAxis> &axes);

/// A name for a directory made of the values, by their axes.
std::string run_name(const std::vector<std::string> &values);

/// A parameter file without its sections `Sweep` and `Compare`, which mean nothing in a run.
std::string without_comparisons(const std::string &parameters);

/// The runs of a sweep in the order of their combinations. Those that the case refuses say why; settings that
/// mean nothing in a combination (the basis of material points with finite elements) are left out of it, and
/// combinations that become equal by this are refused but one. Each case is read and its first state is
/// built, one after the other. Throws an InputError if a value is wrong whatever the others are, or if no
/// combination is left.
std::vector<SweepRun> plan_runs(const RunOptions &options, const std::vector<SweepAxis> &axes,
                                MPI_Comm communicator);

/// Numbers of the waiting runs, from cheap to dear.
std::vector<std::size_t> order_of_runs(const std::vector<SweepRun> &runs);

/// The axis along which cells get smaller, if any: the first numeric one between runs that differ in it
/// alone.
std::optional<std::size_t> mesh_axis(const std::vector<SweepRun> &runs, const std::vector<SweepAxis> &axes);

/// Whether two runs have the same values on all axes but one.
bool same_but_for(const SweepRun &a, const SweepRun &b, std::size_t axis);

/// Why a waiting run need not be done, "" if it should: by the finished runs that differ only in the mesh it
/// would be slower and worse than one that is done, both by the factor `margin`.
std::string reason_to_skip(const SweepRun &run, const std::vector<SweepRun> &runs,
                           const std::optional<std::size_t> &mesh_axis, double margin);

/// Seconds that a waiting run is going to take, as far as the finished ones tell.
double expected_seconds(const SweepRun &run, const std::vector<SweepRun> &runs,
                        const std::optional<std::size_t> &mesh_axis);
} // namespace peat
