#pragma once

#include <peat/simulation/log.h>
#include <peat/solver/scene.h>

#include <map>
#include <string>

namespace peat {
/// Tells the log when bodies touch and part, and in the end the largest force of each contact.
template <int dim>
class ContactEvents
{
public:
  explicit ContactEvents(Log &log) : log(log) {}

  /// After a step of length dt that ended at this time.
  void note(double time, double dt, const Scene<dim> &scene);
  /// At the end of a stage.
  void summarise(const Scene<dim> &scene);

private:
  struct Record
  {
    bool touches = false;
    unsigned int n_told = 0;
    unsigned long n_events = 0;
    double largest_force = 0.; ///< normal [N]
    double time_of_largest = 0.;
    double impulse = 0.; ///< normal [N s]
    double smallest_gap = std::numeric_limits<double>::infinity();
  };

  Log &log;
  std::map<std::string, Record> records;
};
} // namespace peat
