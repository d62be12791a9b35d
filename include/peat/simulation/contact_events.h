#pragma once

#include <peat/simulation/log.h>
#include <peat/solver/scene.h>

#include <array>
#include <map>
#include <string>

namespace peat {
/// Tells the log when bodies touch and part, and in the end the largest force of each contact.
template <int dim>
class ContactEvents
{
public:
  ContactEvents(Log &log, MPI_Comm communicator) : log(log), communicator(communicator) {}

  /// After a step of length dt that ended at this time. Collective.
  void note(double time, double dt, const Scene<dim> &scene);
  void persist(Archive &archive) { archive(records); }
  /// At the end of a stage.
  void summarise(const Scene<dim> &scene);

private:
  /// The force of one step rings with the lumps of mass that meet in it.
  static constexpr unsigned int n_averaged = 10;

  struct Record
  {
    bool touches = false;
    double mass = 0.; ///< of the lighter body [kg]; 0: not known yet
    unsigned int n_told = 0;
    unsigned long n_events = 0;
    unsigned long n_steps = 0;
    /// Impulses and lengths of the last steps, in turn.
    std::array<double, n_averaged> impulses{}, lengths{};
    double largest_force = 0.; ///< normal, mean over as many steps [N]
    double time_of_largest = 0.;
    double impulse = 0.; ///< normal [N s]
    double smallest_gap = std::numeric_limits<double>::infinity();
  };

  Log &log;
  MPI_Comm communicator;
  std::map<std::string, Record> records;
};
} // namespace peat
