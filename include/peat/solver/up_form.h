#pragma once

#include <peat/condition/condition.h>
#include <peat/points/body.h>
#include <peat/solver/space.h>

#include <deal.II/lac/affine_constraints.h>
#include <deal.II/lac/trilinos_block_sparse_matrix.h>
#include <deal.II/lac/trilinos_parallel_block_vector.h>

#include <memory>

namespace peat {
using BlockMatrix = dealii::TrilinosWrappers::BlockSparseMatrix;
using BlockVector = dealii::TrilinosWrappers::MPI::BlockVector;

/// At which time, and by which combination of old and new values, the equations hold in a step from t_n. With
/// the unknowns U (displacement since t_n) and P (pressure at the end of the step)
///   u - u_n = share U,                     p   = (1 - share) p_n + share P,
///   v = velocity U + v_history,            p_t = pressure_rate (P - p_n) + rate_history,
///   a = acceleration U + a_history + old_velocity v_p,
/// where v_p are the velocities of the points at t_n. All rates zero: a static state.
struct TimeLevel
{
  double time = 0.; ///< of the loads [s]
  double share = 1.;
  double velocity = 0.;      ///< [1/s]
  double acceleration = 0.;  ///< [1/s^2]
  double old_velocity = 0.;  ///< [1/s]; not 0 where velocities live on points
  double pressure_rate = 0.; ///< [1/s]
  double dt = 0.;            ///< [s]
  bool seepage_inertia = true;

  /// The fluid's rows are multiplied by this, which makes the system symmetric but for the term rho_f a.
  double fluid_scale() const { return velocity > 0. ? -share / velocity : -1.; }
};

/// The nodal values that a step works with; vectors with ghosts. Blocks: displacement, pressure.
struct StepState
{
  BlockVector unknown;        ///< U [m], P [Pa]
  BlockVector rate_history;   ///< v_history [m/s], rate_history [Pa/s]
  BlockVector second_history; ///< a_history [m/s^2]; the pressure block is p_n [Pa]
  /// Displacement of finite elements of finite strain up to t_n [m]; empty where nodes start each step at
  /// their places in the mesh.
  dealii::TrilinosWrappers::MPI::Vector moved;
};

/// What the points take from the fluid and the skeleton in a step; one rank's share.
struct StepWork
{
  double seepage_dissipation = 0.; ///< [J]
  double seepage_work = 0.;        ///< [J], see Ledger
  double fluid_squeezed = 0.;      ///< [m^dim]
};

/// What the residual's terms would sum up to if none cancelled another: the scale of round-off. By block, of
/// one rank.
using GrossResidual = std::array<double, 2>;

/// Sources other than surfaces: gravity, body forces and fluid sources.
template <int dim>
struct VolumeLoads
{
  dealii::Tensor<1, dim> gravity; ///< [m/s^2]
  std::vector<const Condition<dim> *> forces, fluids;
};

/// The stiffness as that without its volumetric part, and what is left: A = shear + G W^-1 G^T; see
/// PreconditionerData, whose names these are. Functions psi are numbered in the order of assembly.
struct VolumetricSplit
{
  dealii::TrilinosWrappers::SparseMatrix shear, gradient, projection;
  dealii::TrilinosWrappers::MPI::Vector volumetric_compliance, shear_compliance;
  dealii::types::global_dof_index first = 0; ///< of this rank
  dealii::types::global_dof_index next = 0;

  void clear();
  /// Collective.
  void compress();
};

/// The unknown in whose equation an unknown of displacement counts: itself, or the one that it is tied to.
inline dealii::types::global_dof_index equation_of(const dealii::AffineConstraints<double> &constraints,
                                                   const dealii::types::global_dof_index unknown)
{
  const auto *entries = constraints.get_constraint_entries(unknown);
  return entries && !entries->empty() ? entries->front().first : unknown;
}

/// What assemble() adds to; null what is not wanted.
struct UpSystem
{
  const dealii::AffineConstraints<double> &constraints;
  BlockVector &residual; ///< right side minus left side, without regard to constraints
  GrossResidual &gross;
  BlockMatrix *matrix = nullptr; ///< minus the residual's derivative, constrained
  /// Only with `matrix`: the fixed-stress mass and the split, see PreconditionerData.
  dealii::TrilinosWrappers::SparseMatrix *pressure_mass = nullptr;
  VolumetricSplit *split = nullptr;
};

/// The weak form of the u-p equations (theory.md, eqs. 2 and 3) as sums over points with weights in cells:
/// Gauss points make it the finite element method, material points the implicit material point method.
///
///   0 = sum V [ - (sigma'' - alpha p I) grad N_i + rho (g - a) N_i ] + surface forces
///   0 = sum V [ - (p_t/Q + alpha div v) N_i + kappa R . grad N_i ] - outflow,   R = - grad p + rho_f (g - a)
///
/// Stresses come from the points' own, which are those at t_n, and the gradient of share U. The storage term
/// takes p_n from the points, too: they carry the pressure, and nothing is lost where they move. Bodies of a
/// law of finite strain obey the equations at the places that their points have at the level's time (updated
/// Lagrange), others at those of the start of the step.
template <int dim>
class UpForm
{
public:
  virtual ~UpForm() = default;
  /// `projects`: the law sees volumetric strains by their projections on cells (theory.md, section 10), so
  /// that nearly incompressible skeletons do not lock.
  static std::unique_ptr<UpForm> make(const Space<dim> &space, bool projects);

  /// Functions psi of a body in a cell; 0 without projection.
  virtual unsigned int n_volumetric() const = 0;

  /// To be called for each body after its points have moved, before its part of the system is added.
  /// Collective.
  virtual void survey(const Body<dim> &body) = 0;

  /// Add the body's part of the system. Pressures act with their means over cells where the space has no
  /// pressure for a saturated body.
  virtual void assemble(const Body<dim> &body, const TimeLevel &level, const StepState &state,
                        const VolumeLoads<dim> &loads, double stabilisation, const UpSystem &system) = 0;

  /// Take the step: stress, state, pressure, displacement and velocity of the points from the unknowns and
  /// the velocity at its end (in `end_velocity`); volumes and porosities under finite strain; with `move`,
  /// also positions and extents. `finite` becomes false if a number is not.
  virtual void update_points(Body<dim> &body, const TimeLevel &level, const StepState &state,
                             const BlockVector &end_velocity, bool move, bool &finite) = 0;
  /// Book what flow takes from the points in a step at the rates of a level.
  virtual void book_seepage(const Body<dim> &body, const TimeLevel &level, const StepState &state,
                            const dealii::Tensor<1, dim> &gravity, StepWork &work) = 0;

  /// Add sum m N_i v of the points.
  virtual void add_momentum(const Body<dim> &body, dealii::TrilinosWrappers::MPI::Vector &momentum) = 0;
  /// Add sum m N_i.
  virtual void sum_mass(const Body<dim> &body, dealii::TrilinosWrappers::MPI::Vector &mass) = 0;
  /// Add sum m N_i^2, the diagonal of the mass matrix.
  virtual void sum_inertia(const Body<dim> &body, dealii::TrilinosWrappers::MPI::Vector &inertia) = 0;
  /// Add volume integrals over the points: of the squares of a displacement and of a pressure field (with
  /// ghosts), and of 1 for each of them.
  virtual void add_squares(const Body<dim> &body, const BlockVector &field, std::array<double, 2> &squares,
                           std::array<double, 2> &volumes) = 0;
  /// Sum of the points' weights and other body forces, and their work on a motion (with ghosts) [m].
  virtual void sum_weight(const Body<dim> &body, const dealii::TrilinosWrappers::MPI::Vector &motion,
                          const VolumeLoads<dim> &loads, double time, dealii::Tensor<1, dim> &weight,
                          double &work) = 0;
};
} // namespace peat
