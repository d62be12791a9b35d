#pragma once

#include <peat/solver/ledger.h>
#include <peat/solver/rigid_sites.h>
#include <peat/solver/scene.h>
#include <peat/solver/up_form.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace peat {
/// Rigid bodies in contact with the bodies of an implicit solver, at the sites of the explicit contact
/// (theory.md, implicit contact): an augmented Lagrangian, whose multipliers are the forces at the sites. The
/// motion of a free rigid body is an unknown of the step, which is eliminated from the linear systems.
///
/// In a step: begin_step(), for each of its stages begin_stage(), then assemble() and correct() in turn with
/// augment() in between until is_balanced(); accept() in the end. Nothing of a step but the motion of the
/// rigid bodies lives on. Without rigid bodies, or before enter(), all of it does nothing. All functions
/// that find or change something are collective.
template <int dim>
class ImplicitContact
{
public:
  using BodyVector = dealii::TrilinosWrappers::MPI::Vector;
  using Generalised = typename RigidBody<dim>::Generalised;
  using LinearSolve = std::function<void(BlockVector &solution, const BlockVector &right_side)>;

  ImplicitContact(const Space<dim> &space, Scene<dim> &scene);
  ~ImplicitContact();

  /// From now on rigid bodies act. Returns whether there are any in contact.
  bool enter();
  bool is_empty() const { return movers.empty(); }

  /// Which rigid bodies act, and what of their motion steps go by; reading does what enter() does.
  void persist(Archive &archive);
  /// The nodes near rigid bodies. Reading takes the place of match_nodes().
  void persist_nodes(Archive &archive, const ActiveNodes<dim> &nodes,
                     const dealii::AffineConstraints<double> &held);

  // The nodes.

  /// Let ranks know the nodes that interfaces near their border need.
  void share_nodes(const std::vector<CellId> &solid, ActiveNodes<dim> &nodes) const;
  /// Nodes and unknowns have new numbers; `held` are the unknowns that conditions prescribe.
  void match_nodes(const ActiveNodes<dim> &nodes, const dealii::AffineConstraints<double> &held);
  /// Room in a matrix for what contact couples: call an action with lists of unknowns.
  template <typename Action>
  void for_each_coupling(const Action &action) const;
  /// Whether match_nodes() is to be called anew, with all that follows from it.
  bool is_outdated() const;
  /// The contact under whose rigid body a place on the surface of a body lies; null if under none.
  const ContactParameters<dim> *cover(const Body<dim> &body, const dealii::Point<dim> &x) const;

  // A step.

  /// Find where bodies may touch at the time of the start.
  void begin_step(double time);
  /// Begin to find the motion at a level in [start, end]; the rigid bodies obey eq. (36) of theory.md with
  /// histories that are the rates of the stage before times these factors [-], [1/s].
  void begin_stage(const TimeLevel &level, double start, double end, double rate_factor,
                   double acceleration_factor);
  /// Take the forces at the present unknowns as multipliers.
  void augment(const StepState &state);
  /// Whether the matrix of the last assemble() does not hold the present states of the sites.
  bool changes_matrix() const { return tangent_changed; }
  /// Add contact forces to the residual, and their derivatives to the matrix.
  void assemble(const TimeLevel &level, const StepState &state, const UpSystem &system);
  /// Find the rigid bodies' part of a Newton step.
  /// @param correction of the unknowns with rigid bodies that stand still; is completed
  /// @param solve a linear system with the matrix of the last assemble()
  void correct(const TimeLevel &level, BlockVector &correction, const LinearSolve &solve);
  /// Take back a share of the last step.
  void retreat(double share);
  /// Whether the free rigid bodies are in balance to a tolerance relative to the forces on them.
  bool is_balanced(double tolerance) const;
  /// The scale of a residual of this size [N] without what the first guesses of forces make of it, and not
  /// below the forces themselves.
  double residual_scale(double size) const;
  /// Iterations beyond those of the bodies alone.
  unsigned int extra_iterations() const;
  /// What keeps a rigid body from balance, for a message; empty if nothing does.
  std::string unbalanced() const;

  /// Book a share of the step at the level that was solved for.
  /// @param motion of the bodies at this level's velocities in the length of the step, with ghosts [m]
  void book_work(const TimeLevel &level, double share, const BodyVector &motion, Ledger<dim> &book);
  /// Estimated error of the rigid bodies' motion over its largest so far, and at least `tolerance` where one
  /// moves farther than half a cell.
  double estimated_error(double tolerance);
  /// Move the rigid bodies, and report.
  void accept(double dt);

private:
  using Index = typename Space<dim>::Index;
  using Vector = dealii::Tensor<1, dim>;
  static constexpr unsigned int n_motions = RigidBody<dim>::n_motions;

  struct Mover;
  struct Place;
  struct Touch;

  /// Whether the contact is of this rigid body, and of which bodies of the scene.
  std::vector<const Body<dim> *> partners(const ContactParameters<dim> &contact,
                                          const RigidBody<dim> &rigid) const;
  void make_movers();
  void find_line_couplings();
  void find_places(Touch &touch);
  void find_nodes(const ContactSite<dim> &site, Place &place) const;
  /// Penalty of a place [N/m].
  double stiffness(const Touch &touch, double area) const;
  /// Part of the normal force that pore fluid bears [N].
  double fluid_force(const Touch &touch, const ContactSite<dim> &site, const StepState &state) const;
  /// Of the bodies' surface [m].
  Vector displacement(const Place &place, const BodyVector &field) const;
  /// Forces at the unknowns, and what they make of the rigid bodies.
  void evaluate(const StepState &state);
  /// The force if the place stays what it was, or is closed and sticks as far as anyone knows; false if that
  /// says nothing.
  bool predict(const Touch &touch, Place &place, const Vector &relative, const Vector &n) const;
  /// The force at a place, and how it changes with the displacement.
  void respond(const Touch &touch, const ContactSite<dim> &site, Place &place, const Vector &relative,
               double fluid) const;
  void find_residual(Mover &mover) const;
  /// The unknowns' answers to unit motions of the rigid bodies.
  void find_responses(const LinearSolve &solve);
  /// Row i of eq. (57) for one of the free rigid bodies: its entries for those of another.
  double condensed(const TimeLevel &level, const Mover &mover, unsigned int i, const Mover &other,
                   unsigned int j) const;
  void find_couplings(const UpSystem &system);
  /// Farthest that a part of the body moves [m].
  static double reach(const Mover &mover, const Generalised &motion);
  bool is_falling(const Mover &mover) const;

  const Space<dim> &space;
  const Grid<dim> &grid;
  Scene<dim> &scene;
  const MPI_Comm communicator;
  const Basis basis;

  std::vector<std::unique_ptr<Mover>> movers;
  std::vector<std::unique_ptr<Touch>> touches;
  std::vector<std::array<Index, 3 * dim>> couplings;
  const ActiveNodes<dim> *nodes = nullptr;
  const dealii::AffineConstraints<double> *held = nullptr;

  // Of a step.
  TimeLevel stage;
  Vector gravity; ///< [m/s^2]
  double step_start = 0.;
  double earlier_share = 0.;    ///< weight of the stage before in the step over that of this one
  bool is_first_stage = false;  ///< the next one
  bool predicting = false;      ///< the stage has no solution yet
  bool tangent_changed = false; ///< since the matrix was made
  bool responses_known = false; ///< the movers' `response` belongs to the matrix
  double guessed = 0.;          ///< forces beyond the multipliers: root of the sum of squares [N]
  double multiplier_norm = 0.;  ///< [N]
};

template <int dim>
template <typename Action>
void ImplicitContact<dim>::for_each_coupling(const Action &action) const
{
  std::vector<Index> list(3 * dim);
  for (const auto &coupling : couplings) {
    list.clear();
    for (const Index unknown : coupling)
      if (unknown != dealii::numbers::invalid_dof_index)
        list.push_back(unknown);
    action(list);
  }
}
} // namespace peat
