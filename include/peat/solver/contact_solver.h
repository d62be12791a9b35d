#pragma once

#include <peat/solver/contact_pair.h>
#include <peat/solver/nodal_coupling.h>

#include <memory>

namespace peat {
/// All contacts of a scene in a step, and the motion of its rigid bodies. With a single continuum and no
/// rigid body there is nothing to do.
///
/// A step calls begin(), solve() and constrain_flux(), finish(), and constrain_carrying_velocity(). Where
/// pore pressures are implicit these come before finish(), given hold(), and bring reactions, after which
/// some sites may have to be solved anew.
template <int dim>
class ContactSolver : public NodalCoupling
{
public:
  /// Makes the contacts of the scene between the continua that its bodies belong to. Throws InputError.
  void reinit(const SchemeParameters &scheme, const Grid<dim> &grid, Scene<dim> &scene,
              std::vector<std::unique_ptr<Continuum<dim>>> &continua);

  /// Collective, as all below: the continua's nodes have new numbers.
  void match_nodes();
  /// Find where bodies may touch, and what rigid bodies would do without.
  void begin(double time, double dt);
  /// Correct new velocities and accelerations, and the rigid bodies' motion.
  void solve();
  /// Of the impulses found, to the continua; before these find the flux.
  void note_late_forces();
  void constrain_flux();
  /// Move the rigid bodies, sum up.
  void finish(Ledger<dim> &book);
  void constrain_carrying_velocity();

  void persist(Archive &archive);

  bool is_empty() const { return pairs.empty() && tied_pairs.empty(); }
  /// All sites stay as they are while pressures are solved for.
  void hold();
  void restrain() override;
  /// What the last restrain() found happens.
  void take_reactions();
  /// Whether solve() would find other impulses now: sites that part, meet, slide or stick, other friction.
  bool is_outdated();

private:
  template <typename Action>
  void for_each(const Action &action);
  /// There and back again, so that the result is symmetric; where contacts share something, often enough.
  template <typename Action>
  void sweep(const Action &action);

  Scene<dim> *scene = nullptr;
  std::vector<std::unique_ptr<Continuum<dim>>> *continua = nullptr;
  std::vector<std::unique_ptr<ContactPair<dim>>> pairs; ///< those of the parameter file
  /// Continua between which the file names no contact.
  std::vector<std::unique_ptr<ContactParameters<dim>>> ties;
  std::vector<std::unique_ptr<ContactPair<dim>>> tied_pairs;
  MPI_Comm communicator = MPI_COMM_NULL;
  bool needs_sweeps = false; ///< some node or rigid body takes part in several contacts
  bool implicit_pressure = false;
  /// Of the rigid bodies, by reactions to what is tried in a step.
  std::vector<typename RigidBody<dim>::Generalised> tried_accelerations;

  // Of a step.
  double time = 0., dt = 0.;
  std::vector<dealii::Tensor<1, dim>> start; ///< velocities of the rigid bodies
  double largest_change = 0.;                ///< of a velocity, by contact [m/s]
};
} // namespace peat
