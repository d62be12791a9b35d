#pragma once

#include <peat/solver/contact_pair.h>

#include <memory>

namespace peat {
/// All contacts of a scene in a step, and the motion of its rigid bodies. With a single continuum and no
/// rigid body there is nothing to do.
template <int dim>
class ContactSolver
{
public:
  /// Makes the contacts of the scene between the continua that its bodies belong to. Throws InputError.
  void reinit(const SchemeParameters &scheme, const Grid<dim> &grid, Scene<dim> &scene,
              std::vector<std::unique_ptr<Continuum<dim>>> &continua);

  /// Collective, as all below: the continua's nodes have new numbers.
  void match_nodes();
  /// Corrects new velocities and accelerations, moves the rigid bodies.
  void solve(double time, double dt, Ledger<dim> &book);
  void constrain_flux();
  void constrain_carrying_velocity();

private:
  template <typename Action>
  void for_each(const Action &action);

  Scene<dim> *scene = nullptr;
  std::vector<std::unique_ptr<Continuum<dim>>> *continua = nullptr;
  std::vector<std::unique_ptr<ContactPair<dim>>> pairs; ///< those of the parameter file
  /// Continua between which the file names no contact.
  std::vector<std::unique_ptr<ContactParameters<dim>>> ties;
  std::vector<std::unique_ptr<ContactPair<dim>>> tied_pairs;
  MPI_Comm communicator = MPI_COMM_NULL;
  bool needs_sweeps = false; ///< some node or rigid body takes part in several contacts
};
} // namespace peat
