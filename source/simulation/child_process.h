#pragma once

#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

namespace peat {
/// How a child process ended.
struct ChildEnd
{
  int code = 0;   ///< exit code
  int signal = 0; ///< that killed it, or 0
};

/// A program that runs beside this one. It does not see the MPI of this one, and so starts as a program of
/// its own; its standard output is dropped.
class ChildProcess
{
public:
  /// Starts it; `errors` is the file for its standard error. Throws an InputError if it cannot be started.
  ChildProcess(const std::vector<std::string> &command, const std::string &errors);
  ChildProcess(ChildProcess &&other) noexcept;
  ChildProcess &operator=(ChildProcess &&) = delete;
  /// Ends it, if it still runs, and waits for that.
  ~ChildProcess();

  /// How it ended, or nothing while it runs.
  std::optional<ChildEnd> poll();
  /// Asks it to end.
  void terminate() const;

private:
  pid_t process = -1;
};

/// The file that this program was started from.
std::string own_executable();
} // namespace peat
