#pragma once

#include <peat/solver/linear_solver.h>

#include <deal.II/lac/trilinos_precondition.h>

#include <Amesos_BaseSolver.h>
#include <Epetra_CrsMatrix.h>
#include <Epetra_LinearProblem.h>
#include <Epetra_Vector.h>

namespace peat {
using TrilinosMatrix = dealii::TrilinosWrappers::SparseMatrix;
using TrilinosVector = dealii::TrilinosWrappers::MPI::Vector;

/// An approximate inverse of the block matrix.
class LinearSolver::Preconditioner
{
public:
  virtual ~Preconditioner() = default;
  /// Make it for this matrix. Collective.
  virtual void build(const BlockMatrix &matrix, const PreconditionerData &data) = 0;
  /// See LinearSolver::persist(). Collective.
  virtual void persist(Archive &archive, const BlockMatrix &matrix) = 0;
  virtual void vmult(BlockVector &result, const BlockVector &source) const = 0;
};

/// LU factors of the whole system by Amesos. The pattern is analysed once.
class DirectFactor : public LinearSolver::Preconditioner
{
public:
  /// Throws NumericalError(`purpose` ...) if the matrix is singular.
  explicit DirectFactor(std::string purpose) : purpose(std::move(purpose)) {}
  void build(const LinearSolver::BlockMatrix &matrix, const PreconditionerData &data) override;
  void vmult(LinearSolver::BlockVector &result, const LinearSolver::BlockVector &source) const override;
  void persist(Archive &archive, const LinearSolver::BlockMatrix &matrix) override;

private:
  void factorise();
  void make_pattern(const LinearSolver::BlockMatrix &matrix);
  void copy_values(const LinearSolver::BlockMatrix &matrix);
  void complain() const;

  const std::string purpose;
  std::unique_ptr<Epetra_Map> map;          ///< p unknowns are numbered after all u unknowns
  std::unique_ptr<Epetra_CrsMatrix> system; ///< the blocks in one
  mutable std::unique_ptr<Epetra_Vector> unknown, right_side;
  std::unique_ptr<Epetra_LinearProblem> problem;
  std::unique_ptr<Amesos_BaseSolver> solver;
};

/// Algebraic multigrid (ML, smoothed aggregation) for one symmetric positive definite block.
class Multigrid
{
public:
  /// n_components unknowns stand together at each place; the near-null space is constant in each. Scales the
  /// matrix: ML adds 1e-12 to the diagonal of the coarsest level, whatever stands there. Compliances are of
  /// that size, and long waves would be lost.
  void build(TrilinosMatrix &matrix, unsigned int n_components);
  /// Displacements, whose stiffnesses are large numbers; modes [n_modes * n_owned] span the near-null space,
  /// places are those of the nodes, by direction, in steps from node to node. Both must live as long as this.
  void build(const TrilinosMatrix &matrix, const std::vector<double> &modes,
             const std::vector<std::vector<double>> &places);
  /// Of a matrix that build() has scaled: its values; reading makes the hierarchy of them.
  void persist(Archive &archive, TrilinosMatrix &matrix, unsigned int n_components);
  void vmult(TrilinosVector &result, const TrilinosVector &source) const;

private:
  void make(const TrilinosMatrix &matrix, unsigned int n_components);

  double factor = 1.; ///< on the matrix
  dealii::TrilinosWrappers::PreconditionAMG amg;
};

/// Approximate inverse of a Schur complement  S = E + N (c_a M + c_k K)^-1 N^T  of pressures (E: compliance
/// and conduction, N: divergence) by
///
///     S^-1 = (E + F)^-1 + (E + N diag(c_a M)^-1 N^T)^-1.
///
/// F is what N (c_k K)^-1 N^T is close to, the fixed-stress mass (White & Borja 2011; Kim, Tchelepi & Juanes
/// 2011): right where inertia does not count. The second term is right where nothing but inertia counts (as
/// Cahouet & Chabard 1988 do for Stokes flow). The harmonic sum of two operators lies between half the
/// smaller and the smaller, and so does N (...)^-1 N^T between F and the inertial one: one factor for all
/// steps and meshes. Without inertia the second term is absent.
class SchurInverse
{
public:
  void build(const LinearSolver::BlockMatrix &matrix, const PreconditionerData &data);
  void persist(Archive &archive);
  void vmult(TrilinosVector &result, const TrilinosVector &source) const;

private:
  // Multigrid refers to its matrix.
  TrilinosMatrix stiff; ///< E + F
  TrilinosMatrix inert; ///< E + N diag(c_a M)^-1 N^T
  Multigrid stiff_inverse, inert_inverse;
  bool has_inertia = false;
  mutable TrilinosVector scratch;
};

/// The operator that FGMRES sees: the block matrix, or, for nearly incompressible skeletons, the one with the
/// unknowns pi = lambda Pi(div u) added as a last block,
///
///     [ A_s  B   G ]      A_s: A without its volumetric part
///     [ C    D   0 ]      G: int div(N_u) psi
///     [ G^T  0  -W ]      W: volumetric compliance
///
/// from which the block matrix results when pi is eliminated. Multigrid on A itself needs iterations that
/// grow with sqrt(lambda / mu), because its coarse spaces lock; A_s knows no lambda. (Lee, Mardal & Winther
/// 2017 do the same with a total pressure.)
class BlockOperator
{
public:
  using BlockVector = LinearSolver::BlockVector;
  BlockOperator(const LinearSolver::BlockMatrix &matrix, const PreconditionerData &data)
      : matrix(matrix), data(data)
  {}
  void vmult(BlockVector &result, const BlockVector &source) const;

private:
  const LinearSolver::BlockMatrix &matrix;
  const PreconditionerData data;
};

/// Approximate inverse of the Schur complement  W + (F^-1 + L^-1)^-1  of pi, where W and F (volumetric and
/// shear compliance) are diagonal and L = G^T diag(c_a M)^-1 G. By the formula of Woodbury, used twice,
///
///     S^-1 = 1 / (W + F) + s (L + s W)^-1 s,        s = F / (W + F).
class VolumetricInverse
{
public:
  void build(const PreconditionerData &data);
  void persist(Archive &archive, const PreconditionerData &data);
  void vmult(TrilinosVector &result, const TrilinosVector &source) const;

private:
  TrilinosVector stiff_inverse; ///< 1 / (W + F)
  TrilinosVector share;         ///< s
  TrilinosMatrix inert;         ///< L + s W
  Multigrid inert_inverse;
  bool has_inertia = false;
  mutable TrilinosVector scratch;
};

/// Block triangular: pressures by the Schur complement, then displacements.
class BlockPreconditioner : public LinearSolver::Preconditioner
{
public:
  /// `unknowns` must live as long as this.
  explicit BlockPreconditioner(const DisplacementUnknowns &unknowns);
  void build(const LinearSolver::BlockMatrix &matrix, const PreconditionerData &data) override;
  void persist(Archive &archive, const LinearSolver::BlockMatrix &matrix) override;
  void vmult(LinearSolver::BlockVector &result, const LinearSolver::BlockVector &source) const override;

private:
  const TrilinosMatrix &stiffness() const { return data.shear ? *data.shear : matrix->block(0, 0); }
  /// p and pi = t + P p by elimination of t, the total pressure, from
  ///     [ -(W + S_t)   -W P           ] [t]   [f_pi            ]
  ///     [ -P^T W       -(E + P^T W P) ] [p] = [f_p + P^T f_pi  ]
  /// with P: projection, (W + S_t)^-1: VolumetricInverse, Schur complement for p: SchurInverse,
  /// in which u and p hardly meet: div u sees p - Pi p only.
  void solve_pressures(LinearSolver::BlockVector &result, const LinearSolver::BlockVector &source) const;

  const DisplacementUnknowns &unknowns;
  const std::vector<double> modes;
  std::vector<std::vector<double>> places;
  const LinearSolver::BlockMatrix *matrix = nullptr;
  PreconditionerData data;
  std::vector<double> values; ///< of the stiffness that `displacement` was made of; by now it has others
  Multigrid displacement;
  VolumetricInverse volumetric;
  SchurInverse schur;
  mutable TrilinosVector u_scratch, p_scratch, psi_scratch, projected;
};

/// The rigid-body modes of the unknowns, mode after mode: dim translations, then 1 or 3 rotations about the
/// middle; 0 at fixed unknowns. [n_modes * n_owned]
std::vector<double> rigid_body_modes(const DisplacementUnknowns &unknowns);

/// Where this rank's nodes stand among the planes of nodes of all ranks, by direction [dim][n_nodes].
/// Collective.
std::vector<std::vector<double>> lattice_places(const DisplacementUnknowns &unknowns, MPI_Comm communicator);

/// Diagonal of C diag(A)^-1 C^T.
TrilinosVector diagonal_of_product(const TrilinosMatrix &C, const TrilinosVector &diagonal_of_A);
/// The diagonal, without its signs; 1 where it is 0.
TrilinosVector absolute_diagonal(const TrilinosMatrix &matrix);
} // namespace peat
