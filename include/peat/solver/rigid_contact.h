#pragma once

#include <peat/contact/rigid_body.h>
#include <peat/solver/contact_pair.h>

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
               Continuum<dim> &continuum, std::vector<std::size_t> bodies, bool rigid_is_first,
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
  void constrain_flux() override;
  void constrain_carrying_velocity() override;

private:
  using Vector = typename ContactPair<dim>::Vector;
  using Response = typename ContactPair<dim>::Response;
  using Generalised = typename RigidBody<dim>::Generalised;
  static constexpr unsigned int n_motions = RigidBody<dim>::n_motions;

  using ContactPair<dim>::sites;
  using ContactPair<dim>::held_sites;

  void choose_nodes();
  std::array<dealii::Point<dim>, (1u << dim)> corners() const;
  void find_gaps();
  void find_surfaces();
  /// Impulses at all sites if the rigid body moves like this; their wrench, and its derivatives with the
  /// motion, over all ranks.
  void respond_to(const Generalised &motion);
  void find_motion();
  void find_common_mobility();
  Generalised over_ranks(const Generalised &mine) const;
  double *values_of(const ContactSite<dim> &site) { return &sums[std::size_t(index_of(site)) * n_columns]; }
  /// Where the site's sums over ranks stand.
  std::size_t index_of(const ContactSite<dim> &site) const
  {
    return this->parallel ? site.second : site_of_node[site.second];
  }

  RigidBody<dim> &rigid;
  Continuum<dim> &continuum;
  const std::vector<std::size_t> bodies;
  const double sign; ///< -1: reports are of the body, not of the rigid one
  Generalised &tried_acceleration;

  std::vector<std::uint32_t> site_of_node;
  NearPoints<dim> near;
  /// Where the corners of the rigid body's box were when the nodes were chosen.
  std::array<dealii::Point<dim>, (1u << dim)> corners_of_choice;

  // Of a step, here to keep their memory.
  std::vector<Vector> normals; ///< of the rigid body at the points near it
  std::vector<double> distances;
  std::vector<double> areas; ///< of the interface, by site
  /// By index_of(): least distance of the body's points, negative; sums over them (see find_gaps()).
  std::vector<double> nearest, sums;
  static constexpr unsigned int n_columns = 2 + 3 * dim;
  std::vector<Response> responses;
  std::vector<double> wrench, slope;
  /// Acceleration of the rigid body by a wrench that what it touches takes part in, while pressures are
  /// solved for.
  typename RigidBody<dim>::Matrix common_mobility;
  NodalAdditions<dim> noted;
};
} // namespace peat
