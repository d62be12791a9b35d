#pragma once

#include <peat/solver/scene.h>
#include <peat/solver/scheme.h>
#include <peat/solver/solver.h>
#include <peat/solver/time_step.h>
#include <peat/transfer/kernels.h>

#include <deal.II/base/tensor.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace peat {
/// The explicit coupled material point method in the u-p form. step() is its table of contents.
template <int dim>
class ExplicitMPM : public Solver<dim>
{
public:
  /// `carried` is the ledger of the stages before.
  ExplicitMPM(const SchemeParameters &scheme, const Grid<dim> &grid, Scene<dim> &scene, double start_time,
              const Ledger<dim> &carried = {});

  /// Number the nodes that carry material and everything that depends on them. Collective.
  void prepare();

  /// Advance by dt. Throws NumericalError on every rank if a point is lost or a number is not finite on any.
  void step(double dt);

  StableStep stable_step() const;
  double time() const override { return now; }
  void set_time(const double time) override { now = time; }
  double largest_speed() const { return findings.largest_speed; }
  const ActiveNodes<dim> &nodes() const override { return active; }
  const NodalFields<dim> &fields() const override { return nodal; }
  const Ledger<dim> &ledger() const override { return book; }

private:
  // The stages of a step, in the order of the equations.
  void points_to_nodes();
  void add_loads();
  void find_velocities();
  void solve_momentum();
  void constrain_motion();
  void solve_darcy();
  void nodes_to_points();
  void book_balances();
  void move_tracers();
  void relocate_points();

  void resize_fields();
  void renumber_flux();
  void find_small_nodes();
  /// Half of the cells of the mesh on either side, in every direction [m^dim].
  double node_volume(std::size_t node) const;
  dealii::Tensor<1, dim> total_momentum() const;
  PressureUpdate pressure_update(std::size_t body) const;
  const Surface<dim> &surface(const Condition<dim> &condition) const;

  const SchemeParameters &scheme;
  const Grid<dim> &grid;
  Scene<dim> &scene;
  const bool saturated;
  const bool has_loads;

  ActiveNodes<dim> active;
  std::vector<std::unique_ptr<Kernels<dim>>> kernels;
  std::vector<double> filter_rates; ///< of the pressure filter, by body [1/s]
  NodalFields<dim> nodal;
  /// The velocity that points deform and move with: new_velocity, or what is mapped back from the points.
  std::vector<double> carrying_velocity;
  /// Cells that have a node of little mass, by ActiveNodes::occupied_index().
  std::vector<char> near_small_node;
  unsigned int steps_to_small_nodes = 0;
  /// Nodes and components on impermeable faces of the mesh.
  std::vector<std::size_t> closed_rows;
  dealii::Tensor<1, dim> gravity_now;

  double now;
  StepFindings findings;
  Ledger<dim> book;
};
} // namespace peat
