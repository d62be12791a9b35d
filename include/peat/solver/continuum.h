#pragma once

#include <peat/condition/nodal_fields.h>
#include <peat/solver/implicit_pressure.h>
#include <peat/solver/ledger.h>
#include <peat/solver/nodal_coupling.h>
#include <peat/solver/node_extension.h>
#include <peat/solver/scene.h>
#include <peat/solver/scheme.h>
#include <peat/transfer/kernels.h>

namespace peat {
/// Bodies that move with one velocity field of the grid: their nodes, the sums and velocities on them, and
/// the stages of an explicit step (theory.md, a step). Bodies in contact belong to different continua.
///
/// Every stage that sums over ranks is collective; all continua of a scene take it one after the other.
template <int dim>
class Continuum : public NodalCoupling
{
public:
  /// @param bodies places in scene.bodies
  Continuum(const SchemeParameters &scheme, const Grid<dim> &grid, Scene<dim> &scene,
            std::vector<std::size_t> bodies);

  /// Number the nodes that carry these bodies, and `more_nodes` (of this rank's part of the mesh).
  /// Collective.
  void number_nodes(const std::vector<NodeId> &more_nodes);
  /// Cells of this rank that hold points of the bodies, ascending.
  std::vector<CellId> occupied_cells() const;

  // The stages of a step, in the order of the equations.
  void points_to_nodes(double time, double dt);
  void add_loads();
  void find_velocities();
  void solve_momentum();
  void constrain_motion(Ledger<dim> &book);
  void solve_darcy();
  // Implicit pressures: begin, prepare and take once or more often, finish. In between PressureSystem solves.
  void begin_pressure();
  void prepare_pressure();
  /// What the pressure does to motion and flux.
  void take_pressure();
  void finish_pressure();
  /// Velocities of the points; with modified-update-stress-last mapped back to the nodes:
  /// carrying_velocity().
  void advance_points();
  void deform_points();
  void book_balances(Ledger<dim> &book) const;
  void move_tracers();

  /// What the next step knows of those before; the nodes are numbered.
  void persist(Archive &archive);

  const std::vector<std::size_t> &bodies() const { return members; }
  const ActiveNodes<dim> &nodes() const { return active; }
  NodalFields<dim> &fields() { return nodal; }
  const NodalFields<dim> &fields() const { return nodal; }
  bool is_saturated() const { return saturated; }
  const dealii::Tensor<1, dim> &gravity() const { return gravity_now; }
  const StepFindings &findings() const { return step_findings; }
  /// Nullptr with explicit pressures and in dry continua.
  ImplicitPressure<dim> *implicit_pressure() const { return pressure.get(); }
  /// What a change of pressures that is tried does to the nodes; empty where it concerns these alone.
  NodalResponse &response() { return tried; }
  const NodalResponse &response() const { return tried; }
  /// Nullptr with shape functions that have no small nodes of large effect.
  const NodeExtension<dim> *node_extension() const { return extension.get(); }
  /// From now on other things are coupled with the nodes.
  void couple_nodes();
  /// Of the contact force what drives the flux in the mean over steps only, by node and component [N]
  /// (theory.md, contact). To be filled before solve_darcy().
  std::vector<double> &late_force() { return late_contact_force; }
  /// Whether steps are so short that it makes a difference.
  bool has_late_force() const { return saturated && scheme.seepage_inertia && late_share() < 1.; }

  /// Whether conditions tie nodes; then it is what restrains them in a PressureSystem.
  bool ties_nodes() const { return has_ties; }
  void restrain() override { tie(tried.acceleration); }

  double mass(const std::size_t node) const { return nodal.mass(node); }
  /// The velocity that points deform and move with: new_velocity, or what is mapped back from the points.
  std::vector<double> &carrying_velocity() { return remapped ? mapped_velocity : nodal.new_velocity; }
  bool remaps_velocity() const { return remapped; }

  /// For contact: one entry per node and component, whether a condition prescribes the motion, and whether
  /// the mesh's faces or conditions on them leave the flux no choice.
  void find_prescribed_rows();
  bool is_prescribed(const std::size_t row) const { return prescribed[row]; }
  bool closes_flux(const std::size_t row) const { return flux_is_given[row]; }

private:
  void resize_fields();
  /// Of a field with dim columns keep what nodes had that are still there.
  void renumber(std::vector<double> &field) const;
  /// Of late forces, and of what the flux has not felt yet, the share that it feels in this step.
  double late_share() const;
  /// The acceleration that drives the flux.
  double felt_acceleration(std::size_t row, double share) const;
  void extend_nodes();
  /// The field as points see it; a copy in `seen` where that differs from what the nodes have.
  const std::vector<double> &seen_by_points(const std::vector<double> &field,
                                            std::vector<double> &seen) const;
  void find_small_nodes();
  /// Half of the cells of the mesh on either side, in every direction [m^dim].
  double node_volume(std::size_t node) const;
  dealii::Tensor<1, dim> total_momentum() const;
  PressureUpdate pressure_update(std::size_t member) const;
  void make_implicit_pressure();
  /// Increments of the pressure from the middle of a step on to its end. The first step begins at a full
  /// level of time, and the middle is that of both ends.
  double extrapolation() const { return last_dt > 0. ? 1.5 : 1.; }
  void find_freedom();
  /// Of accelerations or velocities: what tied nodes have in common. Collective where nodes are tied.
  void tie(std::vector<double> &motion) const;
  void book_fluid(Ledger<dim> &book) const;
  const Surface<dim> &surface(const Condition<dim> &condition) const;
  Body<dim> &body(const std::size_t member) const { return *scene.bodies[members[member]]; }
  bool holds_body(const std::string &name) const;

  const SchemeParameters &scheme;
  const Grid<dim> &grid;
  Scene<dim> &scene;
  const std::vector<std::size_t> members;
  const bool remapped;
  bool saturated = false;
  bool has_loads = false;
  bool has_ties = false;

  ActiveNodes<dim> active;
  std::vector<std::unique_ptr<Condition<dim>>> conditions; ///< those that concern these bodies
  std::vector<std::string> surfaces;                       ///< bodies of which there are surface pieces
  std::vector<std::unique_ptr<Kernels<dim>>> kernels;
  std::vector<double> filter_rates; ///< of the pressure filter, by member [1/s]
  NodalFields<dim> nodal;
  std::vector<double> mapped_velocity;
  std::unique_ptr<NodeExtension<dim>> extension;
  /// What points see of the nodes' motion where there is an extension.
  std::vector<double> seen_acceleration, seen_velocity, seen_flux;
  std::vector<double> late_contact_force, unfelt_velocity; ///< the latter by the former [m/s]
  double wave_time = 0.; ///< of an undrained wave across the smallest cell [s]
  /// Cells that have a node of little mass, by ActiveNodes::occupied_index().
  std::vector<char> near_small_node;
  unsigned int steps_to_small_nodes = 0;
  /// Nodes and components on impermeable faces of the mesh.
  std::vector<std::size_t> closed_rows;
  std::vector<char> prescribed, flux_is_given;
  dealii::Tensor<1, dim> gravity_now;
  StepFindings step_findings;

  NodalResponse tried;
  std::unique_ptr<ImplicitPressure<dim>> pressure;
  std::vector<std::size_t> first_increment; ///< of the member's cells
  NodeFreedom<dim> freedom;
  bool constrains_flux = false; ///< a condition gives or closes the flux, beside the mesh's faces
  double last_dt = 0.;          ///< of the step before; 0: there was none [s]
  double last_outflow = 0., last_squeezed = 0.;
};
} // namespace peat
