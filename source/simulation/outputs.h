#pragma once

#include <peat/simulation/simulation.h>

#include <deal.II/base/mpi.h>

#include <chrono>

namespace peat {
/// Wall-clock time [s].
inline double seconds()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// All that is written while the run goes on, and when.
template <int dim>
struct Simulation<dim>::Outputs
{
  Outputs(const Case<dim> &parameters, const std::string &directory, const Scene<dim> &scene,
          const Grid<dim> &grid)
      : statistics(directory, scene, dealii::Utilities::MPI::this_mpi_process(grid.communicator()) == 0)
  {
    if (scene.probes)
      probes = std::make_unique<ProbeWriter<dim>>(parameters, scene, grid, directory + "/probes.csv");
    if (parameters.output.pictures)
      pictures = std::make_unique<Pictures<dim>>(directory, scene, grid.communicator());
  }

  void plan(const OutputParameters &output, const Comparison<dim> &comparison, const Recorder<dim> *recorder,
            const double start, const double end, const bool long_steps)
  {
    every_step = long_steps && output.statistics_interval == 0. && output.probe_interval == 0.;
    statistics_times = Schedule::every(output.statistics_interval_in(end - start), start, end);
    probe_times = Schedule::every(output.probe_interval_in(end - start), start, end);
    if (every_step)
      statistics_times = probe_times = Schedule::at({}, start, end);
    picture_times = Schedule::every(output.interval, start, end);
    comparison_times = Schedule::at(comparison.times(), start, end);
    recording_times = Schedule::at(recorder ? recorder->times() : std::vector<double>(), start, end);
  }

  /// What was due up to now has been written.
  void skip(const double now)
  {
    for (Schedule *times :
         {&statistics_times, &probe_times, &picture_times, &comparison_times, &recording_times})
      times->due(now);
  }

  void persist(Archive &archive)
  {
    archive.begin("outputs");
    archive(statistics, line_step, picture_step);
    if (probes)
      archive(*probes);
    if (pictures)
      archive(*pictures);
  }

  /// When something is next due.
  double next() const
  {
    double time = std::min({statistics_times.next(), comparison_times.next(), recording_times.next()});
    if (probes)
      time = std::min(time, probe_times.next());
    if (pictures)
      time = std::min(time, picture_times.next());
    return time;
  }

  Statistics<dim> statistics;
  std::unique_ptr<ProbeWriter<dim>> probes;
  std::unique_ptr<Pictures<dim>> pictures;
  bool every_step = false; ///< statistics and probes are written after each step
  /// Steps after which the last line of statistics and the last picture were written.
  unsigned long line_step = never, picture_step = never;
  static constexpr unsigned long never = std::numeric_limits<unsigned long>::max();
  Schedule statistics_times, probe_times, picture_times, comparison_times, recording_times;
};
} // namespace peat
