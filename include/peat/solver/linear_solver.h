#pragma once

#include <peat/base/archive.h>
#include <peat/base/parameters.h>

#include <deal.II/base/point.h>
#include <deal.II/lac/trilinos_block_sparse_matrix.h>
#include <deal.II/lac/trilinos_parallel_block_vector.h>
#include <deal.II/lac/trilinos_sparse_matrix.h>
#include <deal.II/lac/trilinos_vector.h>

#include <memory>
#include <string>
#include <vector>

namespace peat {
/// The section `Linear solver`: how the linear systems of implicit and static steps are solved.
struct LinearSolverParameters
{
  explicit LinearSolverParameters(Section section);

  enum class Method { automatic, direct, iterative };

  Method method = Method::automatic;
  /// Largest number of unknowns for which `automatic` is direct.
  unsigned int direct_limit_2d = 60000;
  unsigned int direct_limit_3d = 4000;
  double tolerance = 1e-11; ///< residual over right-hand side, in the norm of LinearSolver
  unsigned int max_iterations = 200;
};

/// The displacement unknowns that this rank owns, in the order of its index set: what rigid-body modes are
/// made of. The components of a node stand together.
struct DisplacementUnknowns
{
  unsigned int dim = 2;
  std::vector<dealii::Point<3>> positions; ///< [n_owned] of the node [m]; z = 0 in 2-D
  std::vector<unsigned int> components;    ///< [n_owned] 0 ... dim - 1
  /// [n_owned] or empty: held fixed, i.e. its row is a diagonal entry alone.
  std::vector<bool> fixed;
};

/// What the preconditioner wants to know beside the matrix; assembled in the same loop. All pointers may be
/// null; for how long they must live, see prepare().
///
/// With A = c_a M + c_k K, B = -c_k Q_c (see LinearSolver):
struct PreconditionerData
{
  using Matrix = dealii::TrilinosWrappers::SparseMatrix;
  using Vector = dealii::TrilinosWrappers::MPI::Vector;

  /// c_k int alpha^2 / (lambda + 2 mu / dim) N_p N_p, the fixed-stress mass, with constraints as in D. If the
  /// volumetric part of A is projected (below), what the projection does not see meets no lambda:  c_k int
  /// alpha^2 [Pi N_p Pi N_p / (lambda + 2 mu / dim) + (N_p - Pi N_p)(N_p - Pi N_p) / (2 mu)]. Needed by the
  /// iterative method if there is a p block that couples.
  const Matrix *pressure_mass = nullptr;
  /// c_a M lumped in proportion to its diagonal (Hinton, Rock & Zienkiewicz 1976): c_a int rho N_u N_u
  /// times 1.25^dim for Q2, 1.5^dim for Q1. The factor matters with G. Null if c_a = 0 (quasi-static).
  /// Entries of fixed unknowns do not matter but must not be 0.
  const Vector *inertia = nullptr;

  /// For nearly incompressible skeletons (nu > 0.45) only, all or none; then the volumetric part of A
  /// must be c_k int lambda Pi(div N_u) Pi(div N_u) with the cell-wise L2 projection Pi onto a space with an
  /// orthogonal basis psi that is stable with the displacement: P1 for Q2, P0 for Q1.
  const Matrix *shear = nullptr;    ///< A without its volumetric part, constraints as in A
  const Matrix *gradient = nullptr; ///< int div(N_u) psi [n_u][n_psi]; rows of fixed unknowns are 0
  const Vector *volumetric_compliance = nullptr; ///< int psi psi / (c_k lambda), diagonal [n_psi]
  const Vector *shear_compliance = nullptr;      ///< int psi psi / (2 c_k mu), diagonal [n_psi]
  /// c_k int alpha psi N_p / int psi psi [n_psi][n_p], the projection on the cells; columns of constrained
  /// unknowns are 0. Only with a p block that couples.
  const Matrix *projection = nullptr;
  unsigned int n_psi_per_cell = 1; ///< these stand together, the constant first
};

/// Solves the block systems of the u-p form,
///
///     [ A  B ] [u]   [f_u]      A = c_a M + c_k K
///     [ C  D ] [p] = [f_p]      B = -c_k Q_c,  Q_c = int alpha div(N_u) N_p
///                               C = B^T - (c_k c_g / c_v) G
///                               D = -(c_k / c_v) (c_p S + c_h H)
///
/// or the 1 x 1 system A u = f_u. The p rows must carry the factor -c_k / c_v, so that the system without G
/// is symmetric (indefinite). Rows of constrained unknowns hold a diagonal entry of any sign and nothing
/// else; their columns are empty.
///
/// All methods are FGMRES; they differ in the preconditioner: a factorisation of the whole system (then it
/// converges at once, and a factorisation of an earlier matrix still serves), or the block triangular one of
/// `BlockPreconditioner`. Residuals are measured row by row relative to the root of the diagonal, which makes
/// rows of different units and of cells that are hardly filled comparable.
class LinearSolver
{
public:
  using BlockMatrix = dealii::TrilinosWrappers::BlockSparseMatrix;
  using BlockVector = dealii::TrilinosWrappers::MPI::BlockVector;

  /// Which matrices of a sequence share a preconditioner.
  enum class Reuse {
    nothing,        ///< the matrix is new, also in its pattern
    pattern,        ///< new values
    preconditioner, ///< values that changed little: keep the preconditioner while it works
  };

  /// Parameters are kept by reference. `purpose` stands in messages: "the implicit step of stage 'impact'".
  LinearSolver(const LinearSolverParameters &parameters, std::string purpose);
  ~LinearSolver();

  /// Set-up from the unknowns, once per numbering. The next prepare() makes everything new.
  void reinit(DisplacementUnknowns unknowns);

  /// Call when the matrix changed. Matrix and data are kept by reference, those of a kept preconditioner too:
  /// assemble in place, or let them live until one is made from others. Collective.
  void prepare(const BlockMatrix &matrix, const PreconditionerData &data, Reuse reuse = Reuse::pattern);

  /// Solve from the initial guess in `solution`; returns the number of iterations. Throws a NumericalError on
  /// every rank if the tolerance is not reached. Collective.
  unsigned int solve(BlockVector &solution, const BlockVector &rhs);

  /// What the next prepare() goes by. With `keeps`, that may be the preconditioner, which is written as what
  /// it was made of, and made of that again: factors in the pattern of `matrix`; multigrid in place of one
  /// that prepare() has made of other values, which leaves in `matrix` and data what it was made of.
  /// Collective.
  void persist(Archive &archive, const BlockMatrix &matrix, bool keeps);

  bool is_direct() const { return direct; }
  /// Whether a system of so many unknowns will be solved directly: what only a preconditioner needs then need
  /// not be assembled.
  bool would_be_direct(dealii::types::global_dof_index n_unknowns) const;
  /// Number of preconditioners or factorisations made so far.
  unsigned int n_preconditioners() const { return n_builds; }

  class Preconditioner;

private:
  void build();
  void find_scaling();
  /// Solves for the volumetric stress beside u and p.
  bool mixed() const { return !direct && data.shear != nullptr; }
  /// Fills `unknown` and `right_side`; returns the norm of the latter.
  double take_up(const BlockVector &solution, const BlockVector &rhs);
  unsigned int iterate(double target, bool &converged);

  struct ScaledRows;
  struct ScaledInverse;

  const LinearSolverParameters &parameters;
  const std::string purpose;
  DisplacementUnknowns unknowns;
  const BlockMatrix *matrix = nullptr;
  PreconditionerData data;
  BlockVector scaling;                      ///< of the rows: 1 / sqrt(diagonal)
  BlockVector inverse_scaling;              ///< its inverse
  BlockVector unknown, right_side, scratch; ///< with the volumetric stress, if it is solved for
  double reached = 0.;                      ///< residual of the last solve

  std::unique_ptr<Preconditioner> preconditioner;
  bool direct = false;
  bool is_fresh = false;             ///< the preconditioner was made from the present matrix
  bool is_worn = false;              ///< it took many more iterations than at first
  unsigned int fresh_iterations = 0; ///< of the first solve with this preconditioner; 0: none yet
  unsigned int n_builds = 0;
};
} // namespace peat
