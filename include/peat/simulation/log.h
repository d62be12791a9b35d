#pragma once

#include <peat/simulation/growing_file.h>

#include <chrono>
#include <string>

namespace peat {
/// What a run tells: lines to log.txt and, unless quiet, to the terminal; a progress line to the terminal
/// alone. Only rank 0 writes.
class Log
{
public:
  /// Without a directory there is no log.txt.
  Log(const std::string &directory, bool is_first_rank, bool quiet);
  ~Log();

  void line(const std::string &text);

  /// Shown at most twice a second on a terminal, every ten seconds otherwise.
  void progress(double fraction, double time, unsigned long step, double point_steps_per_second);

  /// The same with a text of one's own; on a terminal only.
  void status(const std::string &text);

  void persist(Archive &archive) { archive(file); }

private:
  void end_progress();
  bool is_due();
  void show(const std::string &text);

  GrowingFile file;
  const bool active;
  const bool quiet;
  const bool terminal;
  bool progress_shown = false;
  double first_fraction = -1.; ///< of progress; a run that goes on does not begin at 0
  const std::chrono::steady_clock::time_point start;
  std::chrono::steady_clock::time_point last_progress;
};

/// "3 s", "12 min", "1.5 h"
std::string readable_duration(double seconds);
/// "1.2 GB"
std::string readable_bytes(double bytes);
} // namespace peat
