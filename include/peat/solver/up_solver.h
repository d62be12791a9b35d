#pragma once

#include <peat/solver/implicit_contact.h>
#include <peat/solver/implicit_parameters.h>
#include <peat/solver/linear_solver.h>
#include <peat/solver/scene.h>
#include <peat/solver/small_nodes.h>
#include <peat/solver/solver.h>
#include <peat/solver/time_step.h>
#include <peat/solver/up_boundary.h>
#include <peat/solver/up_form.h>

#include <memory>
#include <string>
#include <vector>

namespace peat {
/// The u-p equations solved implicitly, with the points of a scene's bodies as quadrature: with Gauss points
/// the finite element method, with material points the implicit material point method, whose points then
/// move.
///
/// A step is: level of time, Newton's iterations, new rates, points. Points carry stress, history and
/// pressure. Velocities, accelerations and the rates of pressures live on nodes; velocities of material
/// points live on the points.
template <int dim>
class UpSolver : public Solver<dim>
{
public:
  /// How the scene's points are used.
  enum class Method {
    finite_elements, ///< Gauss points, which stay where they are
    material_points, ///< material points with the basis of the explicit method
    points_at_rest   ///< the same for the skeleton alone, under the pressures that the points have, which act
                     ///< as in the explicit step: what is in equilibrium here is at rest there
  };

  UpSolver(const ImplicitParameters &parameters, const LinearSolverParameters &linear, Method method,
           Nodes displacement, bool seepage_inertia, const Grid<dim> &grid, Scene<dim> &scene,
           double start_time, const Ledger<dim> &carried = {});
  ~UpSolver();

  /// Number the unknowns and what depends on them. Collective.
  void prepare();

  /// What is wanted next of a run of steps.
  enum class Mode { dynamic, quasi_static };
  /// Begin a stage: rates at rest, or, for dynamics, from the points' velocities and the equations. From now
  /// on rigid bodies act on material points.
  void start(Mode mode);
  /// Step that the solver would take next, and why.
  StableStep suggested_step() const;
  /// Advance by one step, not beyond `latest`; a step whose length follows from its error may turn out
  /// shorter than suggested. Returns its length. Throws NumericalError on every rank if it does not converge
  /// or a number is not finite.
  double step(double latest);

  /// The state of equilibrium and of steady seepage under the loads at the present time. Points take it, time
  /// does not pass.
  void solve_static();

  /// Material points of another scene that are to take the same displacements and pressures, by the shape
  /// functions at their places; `other` must live as long as this.
  void lead(Scene<dim> &other) { followers.push_back(&other); }
  /// Make the horizontal effective stresses of all points K0 times the vertical one, and the shear stresses
  /// zero; to be followed by solve_static().
  void set_horizontal_stress(double K0);

  /// Take displacements from where the bodies are now.
  void reset_displacements();

  /// Begin the balances anew.
  void forget_work() { book = {}; }

  double time() const override { return now; }
  void set_time(const double time) override { now = time; }
  const ActiveNodes<dim> &nodes() const override { return active; }
  const NodalFields<dim> &fields() const override { return nodal; }
  const Ledger<dim> &ledger() const override { return book; }
  void persist(Archive &archive) override;
  const Space<dim> &space() const { return unknowns; }

  struct Work
  {
    unsigned long newton_iterations = 0, linear_solves = 0, linear_iterations = 0, rejected_steps = 0;
  };
  const Work &work() const { return done; }

private:
  /// Of the cells that hold points now.
  void number_unknowns();
  void resize();
  /// Find nodes with little or no mass. Collective.
  void survey_nodes();
  /// Whether points reach other nodes than before, which have no equations yet. Collective.
  bool reach_changes();
  void project_start();
  VolumeLoads<dim> volume_loads(double time) const;

  void dynamic_step(double dt);
  void damped_step(double dt);
  void generalised_alpha_step(double dt);
  /// Whether steps are those of the diagonally implicit method, with lengths that follow from their errors.
  bool runge_kutta() const { return mode == Mode::quasi_static || method == Method::material_points; }
  double runge_kutta_step(double latest);
  /// Both stages of a step; returns the estimated error over the largest changes so far.
  double find_stages(double dt);
  /// The same; infinite if the equations were not solved, unless the user has fixed the step.
  double try_stages(double dt);
  /// Of the points around a node, weighted by mass and shape function; 0 where conditions prescribe.
  dealii::TrilinosWrappers::MPI::Vector mean_velocity() const;
  double estimated_error(const BlockVector &difference);
  /// Roots of the mean squares of displacement [m] and pressure [Pa] at the points.
  std::array<double, 2> mean_at_points(const BlockVector &field);
  TimeLevel stage_level(double dt, bool last) const;

  /// Find the unknowns at the end of [start, end] that satisfy the equations at a level.
  void solve(const TimeLevel &level, double start, double end, double tolerance);
  void assemble(const TimeLevel &level, bool with_matrix);
  bool needs_matrix(const TimeLevel &level) const;
  /// Over the larger of the scale of the residuals so far and round-off over the tolerance.
  double residual_norm(unsigned int block, double tolerance) const;
  bool converged(double tolerance) const;
  /// Of both blocks, each over its scale.
  double residual_size(double tolerance) const;
  void line_search(const TimeLevel &level, double before);
  [[noreturn]] void give_up(unsigned int iterations, double start, double end, double tolerance) const;
  /// What is prescribed, or held by nothing, stands for itself.
  void fill_empty_diagonal(const TimeLevel &level);
  void describe_unknowns();
  /// Room for the volumetric split, where the linear solver has a use for it.
  void prepare_split();
  void prepare_linear_solver(const TimeLevel &level, bool coupled, bool changed_little);
  void share_unknown();
  /// After the unknowns have been found: points and tracers.
  void accept(const TimeLevel &level, bool moves);
  /// Book a share of a step, after the unknowns of a level have been found: forces at this level on the
  /// motion with its velocity in the length of the step, and flow at its rates.
  void book_work(const TimeLevel &level, double share, const dealii::TrilinosWrappers::MPI::Vector &motion);
  void move_tracers();
  void relocate_points();
  /// Points have moved: put surfaces to where they are now. Whether other unknowns than before are
  /// prescribed.
  bool surfaces_change();
  TimeLevel level(double time, double dt) const;

  const ImplicitParameters &parameters;
  const Method method;
  const bool seepage_inertia;
  const Grid<dim> &grid;
  Scene<dim> &scene;
  const bool linear, finite_strain, nearly_incompressible;
  std::vector<Scene<dim> *> followers;

  Space<dim> unknowns;
  ActiveNodes<dim> active;
  std::unique_ptr<UpForm<dim>> form;
  SmallNodes<dim> small_nodes;
  ImplicitContact<dim> contact;
  UpBoundary<dim> boundary;
  BlockMatrix matrix;
  dealii::TrilinosWrappers::SparseMatrix pressure_mass;
  std::unique_ptr<VolumetricSplit> split;
  dealii::TrilinosWrappers::MPI::Vector inertia, mass_diagonal;
  LinearSolver linear_solver; ///< after what its preconditioner refers to, and so destroyed before it
  bool matrix_is_valid = false;
  bool matrix_is_near = false; ///< to the one of `matrix_level` that the linear solver saw last
  TimeLevel matrix_level;

  BlockVector unknown, correction, residual, right_side; ///< this rank's
  BlockVector rate;                                      ///< v [m/s] and p_t [Pa/s] at the start of the step
  BlockVector second;                                    ///< a [m/s^2] and p [Pa]
  BlockVector total;                                     ///< displacement since the last reset [m]
  BlockVector change; ///< of displacement and pressure in this stage, since the last numbering
  dealii::TrilinosWrappers::MPI::Vector
      moved; ///< the same since the start; of finite elements, finite strain
  BlockVector ghosted_total, ghosted_rate, ghosted_motion;
  StepState state;

  double now;
  Mode mode = Mode::dynamic;
  unsigned int damped_steps_left = 0;
  double next_step = 0.; ///< Runge-Kutta [s]; 0: none yet
  std::string failure;   ///< of the iterations that were last given up
  bool first_step_done = false;
  std::array<double, 2> change_scale{};   ///< largest changes so far [m], [Pa]
  std::array<double, 2> residual_scale{}; ///< largest residuals so far: momentum [N], fluid [m^dim/s]
  double fluid_scale_before = 1.;
  GrossResidual gross{};
  NodalFields<dim> nodal;
  Ledger<dim> book;
  Work done;
};
} // namespace peat
