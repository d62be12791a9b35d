#pragma once

#include <peat/base/parameters.h>

#include <deal.II/base/point.h>

#include <string>
#include <vector>

namespace peat {
/// One subsection of `Probes`: a place where fields are recorded over time in probes.csv.
template <int dim>
struct ProbeParameters
{
  explicit ProbeParameters(Section section);

  Section section;
  std::string name;
  dealii::Point<dim> point;
  bool follow = true; ///< moves with the material that is there at the start
};

/// The section `Output`.
struct OutputParameters
{
  explicit OutputParameters(Section section);

  double interval = 0.;            ///< of solution.pvd [s]; 0: start and end of each stage
  bool pictures = true;            ///< whether solution.pvd is written at all
  double statistics_interval = 0.; ///< of statistics.csv [s]; 0: 200 lines a stage
  double probe_interval = 0.;      ///< of probes.csv [s]; 0: as statistics
  double checkpoint_interval = 0.; ///< of checkpoints, wall-clock [min]; 0: only on a signal

  /// In a stage of this length, after what is 0 has been replaced [s].
  double statistics_interval_in(const double duration) const
  {
    return statistics_interval > 0. ? statistics_interval : duration / 200.;
  }
  double probe_interval_in(const double duration) const
  {
    return probe_interval > 0. ? probe_interval : statistics_interval_in(duration);
  }
};
} // namespace peat
