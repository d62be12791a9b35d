#include "sweep_runner.h"

#include "child_process.h"

#include <peat/base/error.h>
#include <peat/base/nan.h>
#include <peat/base/text.h>
#include <peat/simulation/commands.h>
#include <peat/simulation/simulation.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <list>
#include <thread>

namespace peat {
namespace {
using State = SweepRun::State;
using json = nlohmann::ordered_json;

std::string read_text(const std::string &path)
{
  std::ifstream file(path);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

/// NaN for what is not there; JSON has no NaN, and null stands for it.
double number_at(const json &object, const std::string &pointer)
{
  const json::json_pointer path(pointer);
  return object.contains(path) && object.at(path).is_number() ? object.at(path).get<double>() : nan;
}

/// The last line in which the program complained, without its name; "" if it did not.
std::string complaint(const std::string &errors)
{
  const std::string sign = "peat: ";
  const std::size_t begin = errors.rfind(sign);
  if (begin == std::string::npos)
    return "";
  return trim(errors.substr(begin + sign.size(), errors.find('\n', begin) - begin - sign.size()));
}

/// Takes what the run has left in its directory. Returns whether it has come to its end.
bool read_results(SweepRun &run, const SweepSettings &settings)
{
  const json summary = json::parse(read_text(settings.directory_of(run) + "/summary.json"), nullptr, false);
  if (summary.is_discarded() || !summary.is_object())
    return false;
  run.seconds = number_at(summary, "/wall_seconds/time_loop");
  run.total_seconds = number_at(summary, "/wall_seconds/total");
  run.points = number_at(summary, "/points");
  run.unknowns = number_at(summary, "/dofs");
  run.steps = number_at(summary, "/steps");
  run.peak_memory = number_at(summary, "/peak_memory_bytes");
  run.binding_limit = summary.value(json::json_pointer("/dt/binding_limit"), "");
  run.errors.clear();
  run.error = nan;
  for (const std::string &name : settings.references) {
    const auto entry = summary.contains("errors") ? summary["errors"].find(name) : summary.end();
    const bool compared =
        summary.contains("errors") && entry != summary["errors"].end() && entry->value("compared", 0ul) > 0;
    run.errors.push_back(compared ? number_at(*entry, "/relative_" + settings.norm) : nan);
  }
  return summary.value("completed", false);
}

/// The error of a run is the largest one; without one of them it has none.
void set_error(SweepRun &run)
{
  run.error = run.errors.empty() ? nan : 0.;
  for (const double error : run.errors)
    run.error = std::isnan(error) || std::isnan(run.error) ? nan : std::max(run.error, error);
}

bool has_same_parameters(const SweepRun &run, const SweepSettings &settings)
{
  return without_comparisons(read_text(settings.directory_of(run) + "/parameters.prm")) == run.parameters;
}

/// What became of a run whose process has ended.
void conclude(SweepRun &run, const SweepSettings &settings, const ChildEnd &end)
{
  const bool completed = read_results(run, settings);
  if (end.code == exit_success && completed) {
    run.state = State::done;
    set_error(run);
    return;
  }
  run.state = end.code == exit_interrupted ? State::interrupted : State::failed;
  run.reason = complaint(read_text(settings.directory_of(run) + "/errors.txt"));
  if (run.state == State::interrupted)
    run.reason = "ended by a signal";
  else if (end.signal != 0)
    run.reason = "killed by signal " + std::to_string(end.signal);
  else if (run.reason.empty())
    run.reason = "exit code " + std::to_string(end.code);
}

std::string told(const SweepRun &run)
{
  char text[120] = "";
  if (run.is_done())
    std::snprintf(text, sizeof(text), "error %-9s %9s  %9.0f steps  %s",
                  std::isnan(run.error) ? "-" : to_text(std::round(run.error * 1e6) / 1e6).c_str(),
                  readable_duration(run.seconds).c_str(), run.steps, readable_bytes(run.peak_memory).c_str());
  switch (run.state) {
  case State::failed:
    return "failed: " + run.reason;
  case State::interrupted:
    return "interrupted";
  case State::skipped:
    return "skipped; " + run.reason;
  default:
    return text;
  }
}

/// Starts runs, watches them and keeps count.
class Runner
{
public:
  Runner(std::vector<SweepRun> &runs, const SweepSettings &settings,
         const std::optional<std::size_t> &mesh_axis, Log &log)
      : runs(runs), settings(settings), mesh_axis(mesh_axis), log(log), executable(own_executable()),
        queue(order_of_runs(runs)), n_all(queue.size())
  {}

  bool run()
  {
    while (next < queue.size() || !running.empty()) {
      while (!signal_was_caught() && next < queue.size() && running.size() < settings.n_jobs)
        start(queue[next++]);
      if (signal_was_caught())
        stop();
      look_after();
      log.status(state());
      // Short against a run, long against a look.
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return !signal_was_caught();
  }

private:
  struct Job
  {
    std::size_t run;
    ChildProcess process;
    std::chrono::steady_clock::time_point begin;
  };

  void start(const std::size_t i)
  {
    SweepRun &run = runs[i];
    run.reason = reason_to_skip(run, runs, mesh_axis, settings.skip_margin);
    if (!run.reason.empty()) {
      run.state = State::skipped;
      tell(run);
      return;
    }
    const std::string directory = settings.directory_of(run);
    std::error_code error;
    // What an earlier run has left there must not be taken for results of this one.
    std::filesystem::remove(directory + "/summary.json", error);
    std::filesystem::create_directories(directory, error);
    if (error)
      throw InputError("cannot make the output directory '" + directory + "'");
    std::vector<std::string> command = {executable, "run", settings.file};
    for (const std::string &setting : run.overrides)
      command.insert(command.end(), {"--set", setting});
    command.insert(command.end(), {"--output", directory, "--quiet"});
    running.push_back(
        {i, ChildProcess(command, directory + "/errors.txt"), std::chrono::steady_clock::now()});
  }

  void look_after()
  {
    for (auto job = running.begin(); job != running.end();) {
      const auto end = job->process.poll();
      if (!end) {
        ++job;
        continue;
      }
      SweepRun &run = runs[job->run];
      job = running.erase(job);
      conclude(run, settings, *end);
      tell(run);
    }
  }

  void stop()
  {
    for (; next < queue.size(); ++next) {
      runs[queue[next]].state = State::interrupted;
      runs[queue[next]].reason = "not begun";
    }
    if (!stopping)
      for (const Job &job : running)
        job.process.terminate();
    stopping = true;
  }

  /// Of what waits and what runs, spread over the jobs.
  double seconds_to_go() const
  {
    double seconds = 0.;
    for (std::size_t i = next; i < queue.size(); ++i)
      seconds += expected_seconds(runs[queue[i]], runs, mesh_axis);
    for (const Job &job : running) {
      const std::chrono::duration<double> past = std::chrono::steady_clock::now() - job.begin;
      seconds += std::max(0., expected_seconds(runs[job.run], runs, mesh_axis) - past.count());
    }
    return seconds / settings.n_jobs;
  }

  std::string state() const
  {
    std::string names;
    for (const Job &job : running)
      names += ' ' + shortened(runs[job.run].name, 40);
    return "[" + std::to_string(n_told) + "/" + std::to_string(n_all) + "] running:" + names + ", about " +
           readable_duration(std::round(seconds_to_go())) + " to go";
  }

  void tell(const SweepRun &run)
  {
    ++n_told;
    char text[200];
    std::snprintf(text, sizeof(text), "[%zu/%zu] %-32s ", n_told, n_all, shortened(run.name, 60).c_str());
    const std::string to_go =
        next < queue.size() ? "  (" + readable_duration(std::round(seconds_to_go())) + " to go)" : "";
    log.line(text + told(run) + to_go);
  }

  std::vector<SweepRun> &runs;
  const SweepSettings &settings;
  const std::optional<std::size_t> mesh_axis;
  Log &log;
  const std::string executable;
  const std::vector<std::size_t> queue;
  const std::size_t n_all;
  std::size_t next = 0;
  std::size_t n_told = 0;
  std::list<Job> running;
  bool stopping = false;
};
} // namespace

void take_over(std::vector<SweepRun> &runs, const SweepSettings &settings)
{
  for (SweepRun &run : runs) {
    if (run.state != State::waiting || !has_same_parameters(run, settings))
      continue;
    const std::string reason = complaint(read_text(settings.directory_of(run) + "/errors.txt"));
    if (read_results(run, settings)) {
      run.state = State::done;
      set_error(run);
    } else if (!reason.empty() && std::isfinite(run.seconds)) {
      run.state = State::failed;
      run.reason = reason;
    }
    run.from_before = run.state != State::waiting;
  }
}

bool run_all(std::vector<SweepRun> &runs, const SweepSettings &settings,
             const std::optional<std::size_t> &mesh_axis, Log &log)
{
  return Runner(runs, settings, mesh_axis, log).run();
}
} // namespace peat
