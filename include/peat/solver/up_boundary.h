#pragma once

#include <peat/solver/implicit_contact.h>
#include <peat/solver/implicit_parameters.h>
#include <peat/solver/scene.h>
#include <peat/solver/up_form.h>

#include <deal.II/lac/affine_constraints.h>

#include <vector>

namespace peat {
/// What the conditions of a scene mean for the unknowns of a Space: which are prescribed, and what acts on
/// the bodies' surfaces and the mesh's faces.
///
/// On faces of the mesh nothing passes unless a condition says so. On a saturated body's own surface, where
/// no other saturated body lies behind it, the pressure is zero unless a condition says otherwise: prescribed
/// at nodes where the surface runs along a face of cells, and by a penalty where it cuts cells. Where a rigid
/// body lies on it, the contact says what the fluid meets.
template <int dim>
class UpBoundary
{
public:
  UpBoundary(const Space<dim> &space, const Scene<dim> &scene, const ImplicitContact<dim> &contact,
             double penalty);

  /// Find prescribed unknowns and the carriers of surface pieces; the surfaces are settled and located.
  /// `unused_unknowns` are those of this rank that nothing holds. Collective.
  void locate(const ActiveNodes<dim> &active, const std::vector<typename Space<dim>::Index> &unused_unknowns);

  /// Whether rigid bodies cover other pieces of surface than they did then. Collective.
  bool cover_changes() const;

  const dealii::AffineConstraints<double> &constraints() const { return homogeneous; }
  /// Only the unknowns that nothing holds.
  const dealii::AffineConstraints<double> &unused() const { return unused_only; }
  bool prescribes_pressure() const { return any_pressure; }

  // Tied displacements are one unknown, which stands for all of them in the equations.
  /// By block: the unknowns whose rows this rank may fill.
  const std::vector<dealii::IndexSet> &relevant() const { return rows; }
  /// Make a right side of forces on all unknowns: what acts on tied ones acts on the one that stands for
  /// them, and nothing acts on those that have no equation. Collective.
  void condense(BlockVector &forces) const;
  /// Complete a solution or another motion: tied unknowns get what they have in common, others that have no
  /// equation zero. Collective.
  void distribute(BlockVector &motion) const;
  void distribute(dealii::TrilinosWrappers::MPI::Vector &displacement) const;
  /// Add values at tied displacements to that of the unknown which stands for them. Collective.
  void gather(dealii::TrilinosWrappers::MPI::Vector &displacement) const;

  /// Set the prescribed displacements since `start` and pressures at `end` in a vector of this rank's
  /// unknowns.
  void prescribe(double start, double end, BlockVector &unknown) const;

  /// The same of velocities: means over the time from `time` to `time + dt`.
  void prescribe_velocity(double time, double dt, dealii::TrilinosWrappers::MPI::Vector &velocity) const;

  /// Add surface forces, fluxes and penalties.
  void assemble(const TimeLevel &level, const StepState &state, BlockVector &residual, BlockMatrix *matrix);

  /// What was prescribed holds against: sums over this rank's prescribed unknowns of the residual there.
  struct Reactions
  {
    double work = 0.;             ///< on a motion [J]
    dealii::Tensor<1, dim> force; ///< [N]
    double gross_force = 0.;      ///< [N]
    double outflow = 0.;          ///< [m^dim/s]
  };
  Reactions reactions(const TimeLevel &level, const BlockVector &residual,
                      const dealii::TrilinosWrappers::MPI::Vector &motion) const;
  /// The same of the surface forces and fluxes of the last assemble(); `motion` with ghosts.
  Reactions loads(const TimeLevel &level, const dealii::TrilinosWrappers::MPI::Vector &motion) const;

private:
  using Index = typename Space<dim>::Index;
  struct Motion
  {
    Index unknown;
    unsigned int component;
    dealii::Point<dim> position;
    const Condition<dim> *condition; ///< nullptr: nothing moves it
  };
  /// Displacements that are the same.
  struct Tie
  {
    Index common;               ///< stands for all
    std::vector<Index> members; ///< the others that this rank knows of
  };
  struct GivenPressure
  {
    Index unknown;
    dealii::Point<dim> position;
    const Condition<dim> *condition; ///< nullptr: nothing but `otherwise`
    double otherwise;                ///< [Pa] where no condition says it: 0, or that of a drained contact
  };
  /// A piece of a body's surface: its carrier's unknowns, and how the pressure is prescribed on it.
  struct Piece
  {
    SurfacePoint<dim> point;
    const Body<dim> *body;
    std::vector<Index> displacement; ///< of component 0
    std::vector<double> N;
    bool weak_pressure = false;
    const ContactParameters<dim> *cover = nullptr; ///< of a rigid body on it
    const Condition<dim> *pressure = nullptr;
    double otherwise = 0.; ///< as in GivenPressure
    CellId cell;
    std::array<double, Space<dim>::n_pressures> M;
  };

  void find_motions();
  void find_ties(const std::vector<Index> &unused_unknowns);
  void make_constraints(const std::vector<Index> &unused_unknowns);
  void find_mesh_pressures();
  void find_pieces(const ActiveNodes<dim> &active);
  void carry(const ActiveNodes<dim> &active, Piece &piece) const;
  void find_pressure(Piece &piece);
  /// By another body that lets no fluid out; sets what acts where a drained contact does.
  bool is_covered(Piece &piece) const;
  void prescribe_face(const Piece &piece, unsigned int axis);
  void share_pressures();
  /// Calls an action with each piece of surface that a force acts on, and the force [N].
  template <typename Action>
  void for_each_force(double time, const Action &action) const;
  void add_surface_forces(const TimeLevel &level, BlockVector &residual);
  void add_fluxes(const TimeLevel &level, BlockVector &residual);
  void add_penalties(const TimeLevel &level, const StepState &state, BlockVector &residual,
                     BlockMatrix *matrix);

  const Space<dim> &space;
  const Grid<dim> &grid;
  const Scene<dim> &scene;
  const ImplicitContact<dim> &contact;
  const double penalty;
  dealii::AffineConstraints<double> homogeneous, unused_only;
  std::vector<dealii::IndexSet> rows;
  std::vector<Motion> motions;
  std::vector<Tie> ties;
  std::vector<GivenPressure> pressures;
  std::vector<Piece> pieces;
  bool any_pressure = false;
  Reactions acting;
};
} // namespace peat
