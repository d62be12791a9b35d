#include <peat/simulation/log.h>

#include <peat/base/error.h>
#include <peat/base/text.h>

#include <cstdio>
#include <iostream>
#include <unistd.h>

namespace peat {
Log::Log(const std::string &directory, const bool is_first_rank, const bool quiet)
    : active(is_first_rank), quiet(quiet), terminal(isatty(STDOUT_FILENO)),
      start(std::chrono::steady_clock::now()), last_progress(start)
{
  if (active && !directory.empty())
    file = GrowingFile(directory + "/log.txt");
}

Log::~Log()
{
  end_progress();
}

void Log::end_progress()
{
  if (progress_shown && terminal)
    std::cout << std::endl;
  progress_shown = false;
}

void Log::line(const std::string &text)
{
  if (!active)
    return;
  end_progress();
  if (file.is_open())
    file.lines() << text << std::endl;
  if (!quiet)
    std::cout << text << std::endl;
}

bool Log::is_due()
{
  if (!active || quiet)
    return false;
  const auto now = std::chrono::steady_clock::now();
  if (now - last_progress < std::chrono::milliseconds(terminal ? 500 : 10000))
    return false;
  last_progress = now;
  return true;
}

void Log::show(const std::string &text)
{
  if (terminal)
    std::cout << "\r\033[K" << text << std::flush;
  else
    std::cout << text << std::endl;
  progress_shown = true;
}

void Log::progress(const double fraction, const double time, const unsigned long step,
                   const double point_steps_per_second)
{
  if (first_fraction < 0.)
    first_fraction = fraction;
  if (!is_due())
    return;
  const double elapsed = std::chrono::duration<double>(last_progress - start).count();
  char text[160];
  std::snprintf(text, sizeof(text), "%5.1f %%  t = %.4g s  step %lu  %.1f million point-steps/s  %s to go",
                100. * fraction, time, step, 1e-6 * point_steps_per_second,
                fraction > first_fraction
                    ? readable_duration(elapsed * (1. - fraction) / (fraction - first_fraction)).c_str()
                    : "?");
  show(text);
}

void Log::status(const std::string &text)
{
  if (terminal && is_due())
    show(shortened(text, 160));
}

std::string readable_duration(const double seconds)
{
  char text[40];
  if (seconds < 120.)
    std::snprintf(text, sizeof(text), "%.3g s", seconds);
  else if (seconds < 7200.)
    std::snprintf(text, sizeof(text), "%.3g min", seconds / 60.);
  else if (seconds < 172800.)
    std::snprintf(text, sizeof(text), "%.3g h", seconds / 3600.);
  else
    std::snprintf(text, sizeof(text), "%.3g days", seconds / 86400.);
  return text;
}

std::string readable_bytes(const double bytes)
{
  char text[40];
  if (bytes < 1e6)
    std::snprintf(text, sizeof(text), "%.3g kB", bytes / 1e3);
  else if (bytes < 1e9)
    std::snprintf(text, sizeof(text), "%.3g MB", bytes / 1e6);
  else
    std::snprintf(text, sizeof(text), "%.3g GB", bytes / 1e9);
  return text;
}
} // namespace peat
