#pragma once

#include <peat/base/archive.h>
#include <peat/base/parameters.h>

#include <mpi.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

namespace peat {
/// A stage as far as it matters to a checkpoint.
struct StageSpan
{
  std::string name;
  double duration; ///< [s]
};

/// When in a run a checkpoint was written.
struct CheckpointMoment
{
  std::size_t stage = 0; ///< number of the stage
  double time = 0.;      ///< [s]
  unsigned long step = 0;
};

/// Writes checkpoints of a run to `checkpoint/` in its directory: one file for each rank with the state, and
/// `index.json`, which names them with their checksums, and the parameters of the run. The index is replaced
/// when the files are complete, and then those of the checkpoint before go: whatever happens in between,
/// there is a whole one.
class CheckpointWriter
{
public:
  /// Forgets the checkpoints of an earlier run if `is_new_run`. Collective.
  CheckpointWriter(const std::string &run_directory, const ParameterFile &file, bool is_new_run,
                   MPI_Comm communicator);

  /// `save` writes this rank's state. Returns what went wrong, then the checkpoint before still stands; "" if
  /// nothing did. Collective.
  std::string write(const CheckpointMoment &moment, const std::function<void(Archive &)> &save);

private:
  std::string write_state(const std::string &name, const std::function<void(Archive &)> &save) const;
  std::string write_index(const CheckpointMoment &moment, const std::vector<std::string> &names,
                          const std::vector<std::string> &files) const;
  void remove_others(const std::vector<std::string> &names) const;

  const std::string directory;
  const std::vector<ParameterValue> parameters;
  const MPI_Comm communicator;
};

/// The checkpoint that a run goes on from.
class Checkpoint
{
public:
  /// Throws an InputError on all ranks if there is none, if it is damaged, or if it is of another version, of
  /// another number of ranks or of other parameters. What may differ: intervals of output, and the durations
  /// of the present stage, which must not have ended by then, and later ones. Collective.
  Checkpoint(const std::string &run_directory, const ParameterFile &file,
             const std::vector<StageSpan> &stages, MPI_Comm communicator);

  const CheckpointMoment &moment() const { return when; }
  /// Whether outputs or the end of a stage are at other times than they were to be.
  bool changes_times() const { return other_times; }
  /// To read this rank's state from.
  Archive &archive() { return reader; }

private:
  void compare_parameters(const std::vector<ParameterValue> &before, const ParameterFile &file,
                          const std::vector<StageSpan> &stages);

  CheckpointMoment when;
  bool other_times = false;
  std::ifstream state;
  Archive reader;
};

/// Tells all ranks after the same step that a signal asks for the end, or that a checkpoint is due.
class Watch
{
public:
  enum class Call { none, checkpoint, end };

  /// @param interval time between checkpoints [s]; 0: none is ever due
  Watch(double interval, MPI_Comm communicator);

  /// To be asked after each step. Collective.
  Call ask();

private:
  using Clock = std::chrono::steady_clock;

  const std::chrono::duration<double> interval;
  const MPI_Comm communicator;
  const bool parallel;
  Clock::time_point last_checkpoint, last_question;
  unsigned int steps_asked_over = 1; ///< ranks ask each other once in so many steps
  unsigned int n_steps = 0;          ///< since they did
};
} // namespace peat
