#pragma once

#include <peat/points/body.h>
#include <peat/transfer/weights.h>

#include <memory>

namespace peat {
/// Columns of the nodal sums that points contribute to, one row a node.
template <int dim>
struct Sums
{
  static constexpr unsigned int mass = 0;                   ///< sum N m [kg]
  static constexpr unsigned int momentum = 1;               ///< sum N m v [kg m/s]
  static constexpr unsigned int force = 1 + dim;            ///< - sum V (sigma'' - alpha p I) grad N [N]
  static constexpr unsigned int n_dry = 1 + 2 * dim;        ///< columns of a scene without pore fluid
  static constexpr unsigned int resistance = n_dry;         ///< sum N V / kappa
  static constexpr unsigned int fluid_inertia = n_dry + 1;  ///< sum N V rho_f [kg]
  static constexpr unsigned int pressure_force = n_dry + 2; ///< sum V p grad N [N]
  static constexpr unsigned int n_saturated = n_dry + 2 + dim;
  /// How many of them a scene uses.
  static constexpr unsigned int n_columns(const bool saturated) { return saturated ? n_saturated : n_dry; }
};

/// What the points' visits of one step find, over this rank's points.
struct StepFindings
{
  bool finite = true;
  double fluid_outflow = 0.; ///< sum V div w dt [m^dim]
  double fluid_squeezed =
      0.; ///< sum V alpha div v dt of bodies whose V and n do not follow the motion [m^dim]
};

/// The share of the grid's part in the points' new velocity, see theory.md (transfer).
struct VelocityUpdate
{
  double dt;
  /// v_p <- retention (v_p + dt a) + (1 - retention) v': 1 is FLIP, 0 is PIC/TPIC.
  double retention;
};

/// How a step treats the pore pressure.
struct PressureUpdate
{
  /// Pore pressure acts with its mean over the points of a cell, and follows the means of div v and div w:
  /// one value a cell, as in the element Q1-P0, where one value a point would lock. Each point still has its
  /// own pressure, which moves with it.
  bool cell_means = true;
  /// Share by which each point's pressure goes towards the mean of its cell in this step; conserves sum V p /
  /// Q.
  double filter = 0.;

  // Implicit pressures (theory.md): points carry the rate of the last step, which says what the pressure was
  // in its middle.
  double last_step = 0.;              ///< 0: there was none [s]
  double reach = 1.5;                 ///< of the increment, from there to the end of this step
  const double *increments = nullptr; ///< from middle to middle, by slice [Pa]; nullptr: explicit
};

/// What the points of cells add up to, for implicit pressures: slice by slice, one body after the other.
struct CellSums
{
  /// Nodes that the points reach: entries [entry_begin[k], entry_begin[k + 1]).
  std::vector<std::uint32_t> entry_begin = {0};
  std::vector<std::uint32_t> entry_node;
  std::vector<double> slopes;         ///< sum V grad N, [n_entries][dim] [m^(dim - 1)]
  std::vector<double> storage;        ///< sum V / Q [m^dim / Pa]
  std::vector<double> last_increment; ///< of the pressure from middle to middle of steps [Pa]

  void clear()
  {
    entry_begin.resize(1);
    entry_node.clear();
    slopes.clear();
    storage.clear();
    last_increment.clear();
  }
};

/// The visits of the points of a body in a step, cell by cell. Members differ by basis, and by whether there
/// is pore fluid; which one serves a body is decided once.
///
/// Where points keep the gradient C of their velocity (affine transfers), it is the gradient of the velocity
/// that they move with, and in cells with a flag in `spin_only` (by ActiveNodes::occupied_index()) its skew
/// part alone.
///
/// Nodal arrays have one row per active node: `sums` with `stride` columns as in Sums, all others with dim
/// columns.
template <int dim>
class Kernels
{
public:
  virtual ~Kernels() = default;

  static std::unique_ptr<Kernels> make(Basis basis, bool saturated);

  /// Points to nodes: mass, momentum, internal force and, with pore fluid, the terms of Darcy's law. Points
  /// that keep the gradient C of their velocity bring v_p + C (x_I - x_p) to node I.
  /// For implicit pressures the sums of cells are added at the end of `cell_sums`.
  virtual void scatter(const Body<dim> &body, const ActiveNodes<dim> &nodes, const PressureUpdate &pressure,
                       double *sums, unsigned int stride, CellSums *cell_sums) const = 0;

  /// Points' velocities from the nodes' acceleration `a` and new velocity `v` (modified-update-stress-last:
  /// and their momentum back to the nodes, columns of `momentum`).
  virtual void advance_and_remap(Body<dim> &body, const ActiveNodes<dim> &nodes, const double *a,
                                 const double *v, const char *spin_only, const VelocityUpdate &update,
                                 double *momentum) const = 0;

  /// Strain, stress, pressure, volume and position from the nodal velocity v and the nodal flux w = kappa R.
  virtual void deform(Body<dim> &body, const ActiveNodes<dim> &nodes, const double *v, const double *w,
                      const char *spin_only, double dt, const PressureUpdate &pressure,
                      StepFindings &findings) const = 0;

  /// Both of the above in one visit, without the way back to the nodes (update-stress-last).
  virtual void advance_and_deform(Body<dim> &body, const ActiveNodes<dim> &nodes, const double *a,
                                  const double *v, const double *w, const char *spin_only,
                                  const VelocityUpdate &update, const PressureUpdate &pressure,
                                  StepFindings &findings) const = 0;
};
} // namespace peat
