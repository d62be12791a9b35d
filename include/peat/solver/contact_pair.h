#pragma once

#include <peat/contact/contact.h>
#include <peat/contact/near_points.h>
#include <peat/solver/contact_site.h>
#include <peat/solver/continuum.h>
#include <peat/solver/nodal_additions.h>

namespace peat {
/// The contact of two bodies during a step: where they may touch, and impulses that keep them from
/// overlapping and from sliding as far as the law says (theory.md, contact).
///
/// A step calls begin(), then solve() until several contacts agree, constrain_flux(), then finish() and
/// constrain_carrying_velocity(). All are collective.
///
/// With implicit pore pressures all sites stay in their mode while the pressures are solved for, and hold()
/// says which these are. What changes of the pressure do to the nodes of both bodies is then restrained so
/// that surfaces in contact neither approach nor part, nor slide where they stick.
template <int dim>
class ContactPair
{
public:
  ContactPair(const ContactParameters<dim> &parameters, const SchemeParameters &scheme, const Grid<dim> &grid,
              const Scene<dim> &scene);
  virtual ~ContactPair() = default;

  /// The nodes of the continua have new numbers.
  virtual void match_nodes() = 0;
  /// Find sites, normals and gaps as they are at the start of a step of length dt.
  virtual void begin(double dt) = 0;
  /// Find the impulses, given those of the other contacts. Returns the largest change of a velocity [m/s].
  virtual double solve() = 0;
  /// The largest change of a velocity [m/s] that solve() would bring now, on this rank.
  virtual double outdated_change() = 0;

  /// The sites are now as they will be while pressures are solved for.
  virtual void hold() = 0;
  /// Forget the reactions of what was tried before.
  void forget_reactions();
  /// Change the accelerations in the continua's responses, and of free rigid bodies, by the reactions of the
  /// sites, given those of the other contacts.
  virtual void restrain_motion() = 0;
  /// The same with the fluxes.
  virtual void restrain_flux() = 0;
  /// The reactions of what was tried last act through the step.
  virtual void take_reactions() = 0;

  /// Sum up what the step did.
  virtual void finish(Ledger<dim> &book) = 0;
  /// Nodes that more than one contact acts on need several sweeps; whether this one acts on the node.
  virtual void mark_nodes(const Continuum<dim> &continuum, std::vector<char> &count) const = 0;
  /// Add to the continua's late_force() (theory.md, contact).
  virtual void note_late_forces() = 0;
  /// No flow through an impermeable interface, the given pressure at a drained one.
  virtual void constrain_flux() = 0;
  /// No approach of re-mapped velocities where there is contact.
  virtual void constrain_carrying_velocity() = 0;

  /// What a step knows of the one before; the nodes have been matched.
  virtual void persist(Archive &archive) = 0;

  const std::string &name() const { return parameters.name; }
  const ContactState<dim> &state() const { return now; }

protected:
  using Vector = dealii::Tensor<1, dim>;
  static constexpr double far = ContactSite<dim>::far;

  /// The impulse that the law allows.
  struct Response
  {
    Vector impulse;
    ContactMode mode = ContactMode::open;
    bool bears_shear = false; ///< sticks, and not for want of anything that would make it slide
    Vector slip_direction;
    double slip_ratio = 0.; ///< d(shear impulse) / d(normal impulse)
  };
  /// @param relative velocity of the first body towards the second, without the impulse [m/s]
  /// @param compliance change of the relative velocity by a unit impulse, per component [1/kg]
  /// @param fluid_force part of the normal force that pore fluid bears: a constant [N], and what is added
  ///        per normal impulse [1/s]
  Response respond(const ContactSite<dim> &site, const Vector &relative, const Vector &compliance,
                   const std::pair<double, double> &fluid_force) const;

  /// 1 / mass of a node, zero in components that a condition prescribes.
  static Vector node_compliance(const Continuum<dim> &continuum, std::uint32_t node);
  /// Change of the surface's velocity by a unit impulse there.
  static Vector compliance(const Continuum<dim> &continuum, const SurfaceNodes &surface);
  static Vector velocity(const std::vector<double> &field, const SurfaceNodes &surface);
  /// Volume of fluid that leaves the body through the surface with normal n out of it [m^dim/s].
  static double outflow(const std::vector<double> &flux, const SurfaceNodes &surface, const Vector &n);
  /// Note an impulse of this step on a surface; give_impulses() hands what was noted to the nodes.
  void push(NodalAdditions<dim> &noted, const SurfaceNodes &surface, const Vector &impulse) const;
  void give_impulses(Continuum<dim> &continuum, NodalAdditions<dim> &noted) const;
  /// Of the site's impulse what drives the flux in the mean over steps only.
  Vector late_impulse(const ContactSite<dim> &site) const;
  void give_late_forces(Continuum<dim> &continuum, NodalAdditions<dim> &noted) const;
  /// The force of the pore fluid on an interface with normal n out of the continuum: with the impulses that
  /// the nodes have had [N], and what a further impulse along -n adds to it [1/s] (theory.md, contact).
  std::pair<double, double> fluid_force(const Continuum<dim> &continuum, const SurfaceNodes &surface,
                                        const Vector &n, double area) const;
  /// Whether fluid meets the interface there: where bodies are tied, or press on each other.
  bool is_covered(const ContactSite<dim> &site) const
  {
    return parameters.law->ties() ? site.area > 0. : site.impulse * site.normal > 0.;
  }
  /// Note what the interface makes of the flux where bodies touch; n points out of the continuum.
  void note_flux(const Continuum<dim> &continuum, const SurfaceNodes &surface, const Vector &n,
                 NodalAdditions<dim> &noted) const;
  void change_carrying_velocity(Continuum<dim> &continuum, NodalAdditions<dim> &noted) const;
  /// What is to be kept of a response for the rest of the step: its mode, for pressures without that of
  /// surfaces that have no friction and do not slide only because nothing pulls.
  static ContactMode kept_mode(const Response &response);

  /// Note the site among those that are held, and what mass resists there.
  void hold(std::uint32_t site, const Vector &compliance);
  /// The nodes of a surface are held in their motion: by sticking, or because the fluid may leave.
  void note_held_nodes(const ContactSite<dim> &site, const Continuum<dim> &continuum,
                       const SurfaceNodes &surface, NodalAdditions<dim> &noted) const;
  void mark_held_nodes(Continuum<dim> &continuum, NodalAdditions<dim> &noted) const;
  /// The force that keeps surfaces from moving with this acceleration, as far as the site's mode says.
  Vector reaction(const ContactSite<dim> &site, const Vector &relative) const;
  void give_reactions(Continuum<dim> &continuum, NodalAdditions<dim> &noted) const;
  /// The change of the flux that an impermeable interface with normal n out of the continuum makes.
  void note_flux_reaction(const Continuum<dim> &continuum, const SurfaceNodes &surface, const Vector &n,
                          NodalAdditions<dim> &noted) const;
  void give_flux_reactions(Continuum<dim> &continuum, NodalAdditions<dim> &noted) const;
  void change_flux(Continuum<dim> &continuum, NodalAdditions<dim> &noted) const;
  /// Biot's coefficient of the continuum's first saturated body.
  static double biot_coefficient(const Continuum<dim> &continuum, const Scene<dim> &scene);

  const ContactParameters<dim> &parameters;
  const SchemeParameters &scheme;
  const Grid<dim> &grid;
  const Scene<dim> &scene;
  MPI_Comm communicator;
  const bool parallel;
  const double touching; ///< a gap that counts as closed [m]: round-off of coordinates
  ContactState<dim> now;
  double step_length = 0.;
  double alpha = 1.; ///< Biot's coefficient of the saturated side

  std::vector<ContactSite<dim>> sites;
  std::vector<std::uint32_t> held_sites; ///< of those that this rank handles
};
} // namespace peat
