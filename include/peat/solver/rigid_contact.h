#pragma once

#include <peat/contact/rigid_body.h>
#include <peat/solver/contact_pair.h>
#include <peat/solver/rigid_sites.h>

namespace peat {
/// Contact of a rigid body and the bodies of a continuum: at the continuum's nodes near the rigid body's
/// surface, with its distance and normal. A free rigid body and all its nodes find one common motion.
template <int dim>
class RigidContact : public ContactPair<dim>
{
public:
  /// @param bodies places in scene.bodies of those of the continuum that take part
  /// @param rigid_is_first whether the parameter file names the rigid body first
  /// @param tried_acceleration of the rigid body, and of its spin, by reactions to what is tried in a step:
  /// one for all contacts of the body
  RigidContact(const ContactParameters<dim> &parameters, const SchemeParameters &scheme,
               const Grid<dim> &grid, const Scene<dim> &scene, RigidBody<dim> &rigid,
               Continuum<dim> &continuum, const std::vector<std::size_t> &bodies, bool rigid_is_first,
               typename RigidBody<dim>::Generalised &tried_acceleration);

  void match_nodes() override;
  void begin(double dt) override;
  double solve() override;
  double outdated_change() override;
  void hold() override;
  void restrain_motion() override;
  void restrain_flux() override;
  void take_reactions() override;
  void finish(Ledger<dim> &book) override;
  void mark_nodes(const Continuum<dim> &continuum, std::vector<char> &count) const override;
  void note_late_forces() override;
  void constrain_flux() override;
  void constrain_carrying_velocity() override;
  void persist(Archive &archive) override;

private:
  using Vector = typename ContactPair<dim>::Vector;
  using Response = typename ContactPair<dim>::Response;
  using Generalised = typename RigidBody<dim>::Generalised;
  static constexpr unsigned int n_motions = RigidBody<dim>::n_motions;

  using ContactPair<dim>::sites;
  using ContactPair<dim>::held_sites;

  /// Impulses at all sites if the rigid body moves like this; their wrench, and its derivatives with the
  /// motion, over all ranks.
  void respond_to(const Generalised &motion);
  void find_motion();
  void find_common_mobility();
  Generalised over_ranks(const Generalised &mine) const;

  RigidBody<dim> &rigid;
  Continuum<dim> &continuum;
  const double sign; ///< -1: reports are of the body, not of the rigid one
  Generalised &tried_acceleration;

  RigidSites<dim> surface;

  // Of a step, here to keep their memory.
  std::vector<Response> responses;
  std::vector<double> wrench, slope;
  /// Acceleration of the rigid body by a wrench that what it touches takes part in, while pressures are
  /// solved for.
  typename RigidBody<dim>::Matrix common_mobility;
  NodalAdditions<dim> noted;
};
} // namespace peat
