#pragma once

#include <peat/contact/contact.h>
#include <peat/contact/near_points.h>
#include <peat/solver/continuum.h>

namespace peat {
/// A node at which two bodies may touch.
template <int dim>
struct ContactSite
{
  std::uint32_t first;            ///< node of the first continuum; no_index if the first body is rigid
  std::uint32_t second;           ///< node of the second continuum
  bool counts;                    ///< this rank adds it to sums over sites
  dealii::Point<dim> x;           ///< where forces act
  dealii::Tensor<1, dim> normal;  ///< from the first body to the second
  double gap;                     ///< between their surfaces [m]; negative if they overlap
  double area;                    ///< of the interface [m^(dim-1)]
  dealii::Tensor<1, dim> impulse; ///< of this step, on the second body [N s]
  dealii::Tensor<1, dim> relative_velocity; ///< of the first body, at the start of the step [m/s]
};

/// The contact of two bodies during a step: where they may touch, and impulses that keep them from
/// overlapping and from sliding as far as the law says (theory.md, contact).
///
/// A step calls begin(), then solve() until several contacts agree, then finish() and the constraints. All
/// are collective.
template <int dim>
class ContactPair
{
public:
  ContactPair(const ContactParameters<dim> &parameters, MPI_Comm communicator)
      : parameters(parameters), communicator(communicator)
  {}
  virtual ~ContactPair() = default;

  /// The nodes of the continua have new numbers.
  virtual void match_nodes() = 0;
  /// Find sites, normals and gaps as they are at the start of the step.
  virtual void begin(double time, double dt) = 0;
  /// Find the impulses, given those of the other contacts. Returns the largest change of a velocity [m/s].
  virtual double solve() = 0;
  /// Sum up what the step did.
  virtual void finish(Ledger<dim> &book) = 0;
  /// Nodes that more than one contact acts on need several sweeps; whether this one acts on the node.
  virtual void mark_nodes(const Continuum<dim> &continuum, std::vector<char> &count) const = 0;
  /// No flow through an impermeable interface, the given pressure at a drained one.
  virtual void constrain_flux() = 0;
  /// No approach of re-mapped velocities where there is contact.
  virtual void constrain_carrying_velocity() = 0;

  const std::string &name() const { return parameters.name; }
  const ContactState<dim> &state() const { return now; }

protected:
  using Vector = dealii::Tensor<1, dim>;

  /// The impulse that the law allows.
  struct Response
  {
    Vector impulse;
    enum class Kind { open, sticks, slides } kind = Kind::open;
    Vector slip_direction;
    double slip_ratio = 0.; ///< d(shear impulse) / d(normal impulse)
  };
  /// @param relative velocity of the first body towards the second, without the impulse [m/s]
  /// @param compliance change of the relative velocity by a unit impulse, per component [1/kg]
  /// @param fluid_force part of the normal force that pore fluid bears: a constant [N], and what is added
  ///        per normal impulse [1/s]
  Response respond(const ContactSite<dim> &site, const Vector &relative, const Vector &compliance,
                   const std::pair<double, double> &fluid_force, double dt) const;

  /// 1 / mass of a node, zero in components that a condition prescribes.
  static Vector node_compliance(const Continuum<dim> &continuum, std::uint32_t node);
  static Vector node_velocity(const std::vector<double> &field, std::uint32_t node);
  /// Give a node an impulse of this step.
  static void push(Continuum<dim> &continuum, std::uint32_t node, const Vector &impulse, double dt);
  /// The force of the pore fluid on an interface with normal n out of the continuum: with the impulses that
  /// the node has had [N], and what a further impulse along -n adds to it [1/s] (theory.md, contact).
  std::pair<double, double> fluid_force(const Continuum<dim> &continuum, std::uint32_t node, const Vector &n,
                                        double area, double dt) const;
  /// What the interface makes of the flux at a node where bodies touch; n points out of the continuum.
  void set_flux(Continuum<dim> &continuum, std::uint32_t node, const Vector &n, double area) const;
  /// Biot's coefficient of the continuum's first saturated body.
  static double biot_coefficient(const Continuum<dim> &continuum, const Scene<dim> &scene);

  const ContactParameters<dim> &parameters;
  MPI_Comm communicator;
  ContactState<dim> now;
  bool seepage_inertia = true;
  double alpha = 1.; ///< Biot's coefficient of the saturated side
};
} // namespace peat
