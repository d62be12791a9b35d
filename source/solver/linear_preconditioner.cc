#include "linear_preconditioner.h"

#include <peat/base/error.h>

#include <deal.II/lac/solver_control.h>
#include <deal.II/lac/solver_gmres.h>

#include <EpetraExt_MatrixMatrix.h>
#include <Epetra_Import.h>
#include <Teuchos_ParameterList.hpp>
#include <ml_MultiLevelPreconditioner.h>

#include <cmath>

namespace peat {
namespace {
Teuchos::ParameterList multigrid_settings()
{
  Teuchos::ParameterList list;
  ML_Epetra::SetDefaults("SA", list);
  list.set("ML output", 0);
  list.set("aggregation: type", "Uncoupled");
  list.set("smoother: type", "Chebyshev");
  list.set("smoother: sweeps", 3);
  list.set("coarse: type", "Amesos-KLU");
  list.set("coarse: max size", 1000);
  return list;
}

/// a A + b B for matrices of different patterns but the same maps.
void sum(TrilinosMatrix &result, const TrilinosMatrix &A, const double a, const TrilinosMatrix &B, const double b)
{
  Epetra_CrsMatrix *total = nullptr;
  EpetraExt::MatrixMatrix::Add(A.trilinos_matrix(), false, a, B.trilinos_matrix(), false, b, total);
  const std::unique_ptr<Epetra_CrsMatrix> owner(total);
  total->FillComplete(A.trilinos_matrix().DomainMap(), A.trilinos_matrix().RangeMap());
  result.reinit(*total);
}

/// Constrained rows hold a diagonal of any sign: multigrid wants it positive.
void make_diagonal_positive(TrilinosMatrix &matrix)
{
  const TrilinosVector diagonal = absolute_diagonal(matrix);
  const auto range = matrix.local_range();
  for (auto row = range.first; row < range.second; ++row)
    matrix.set(row, row, diagonal(row));
  matrix.compress(dealii::VectorOperation::insert);
}

TrilinosVector inverse(const TrilinosVector &vector)
{
  TrilinosVector result(vector);
  for (unsigned int i = 0; i < result.locally_owned_size(); ++i)
    result.trilinos_vector()[0][i] = 1. / vector.trilinos_vector()[0][i];
  return result;
}
} // namespace

TrilinosVector absolute_diagonal(const TrilinosMatrix &matrix)
{
  TrilinosVector result(matrix.locally_owned_range_indices(), matrix.get_mpi_communicator());
  Epetra_Vector diagonal(matrix.trilinos_matrix().RowMap());
  matrix.trilinos_matrix().ExtractDiagonalCopy(diagonal);
  for (int i = 0; i < diagonal.MyLength(); ++i)
    result.trilinos_vector()[0][i] = diagonal[i] == 0. ? 1. : std::abs(diagonal[i]);
  return result;
}

TrilinosVector diagonal_of_product(const TrilinosMatrix &C, const TrilinosVector &diagonal_of_A)
{
  const Epetra_CrsMatrix &matrix = C.trilinos_matrix();
  Epetra_Vector of_columns(matrix.ColMap());
  if (matrix.Importer())
    of_columns.Import(diagonal_of_A.trilinos_vector(), *matrix.Importer(), Insert);
  else
    of_columns = *diagonal_of_A.trilinos_vector()(0);
  TrilinosVector result(C.locally_owned_range_indices(), C.get_mpi_communicator());
  for (int row = 0; row < matrix.NumMyRows(); ++row) {
    int length, *columns;
    double *values, total = 0.;
    matrix.ExtractMyRowView(row, length, values, columns);
    for (int k = 0; k < length; ++k)
      total += values[k] * values[k] / of_columns[columns[k]];
    result.trilinos_vector()[0][row] = total;
  }
  return result;
}

std::vector<double> rigid_body_modes(const DisplacementUnknowns &unknowns)
{
  const unsigned int dim = unknowns.dim, n_rotations = dim == 2 ? 1 : 3;
  const std::size_t n = unknowns.positions.size();
  dealii::Point<3> middle;
  for (const auto &x : unknowns.positions)
    middle += (x - dealii::Point<3>()) / double(n);
  std::vector<double> modes((dim + n_rotations) * n, 0.);
  for (std::size_t i = 0; i < n; ++i) {
    if (!unknowns.fixed.empty() && unknowns.fixed[i])
      continue;
    const auto x = unknowns.positions[i] - middle;
    const unsigned int component = unknowns.components[i];
    modes[component * n + i] = 1.;
    for (unsigned int r = 0; r < n_rotations; ++r) {
      const unsigned int axis = dim == 2 ? 2 : r, first = (axis + 1) % 3, second = (axis + 2) % 3;
      if (component == first)
        modes[(dim + r) * n + i] = -x[second];
      else if (component == second)
        modes[(dim + r) * n + i] = x[first];
    }
  }
  return modes;
}

void Multigrid::build(const TrilinosMatrix &matrix)
{
  Teuchos::ParameterList list = multigrid_settings();
  amg.initialize(matrix, list);
}

void Multigrid::build(const TrilinosMatrix &matrix, const unsigned int dim, const std::vector<double> &modes)
{
  Teuchos::ParameterList list = multigrid_settings();
  list.set("PDE equations", int(dim));
  list.set("null space: type", "pre-computed");
  list.set("null space: add default vectors", false);
  list.set("null space: dimension", int(dim == 2 ? 3 : 6));
  // ML takes a plain pointer and only reads from it; a rank without unknowns still needs one.
  static double nothing = 0.;
  list.set("null space: vectors", modes.empty() ? &nothing : const_cast<double *>(modes.data()));
  amg.initialize(matrix, list);
}

void SchurInverse::build(const LinearSolver::BlockMatrix &matrix, const PreconditionerData &data)
{
  const TrilinosMatrix &D = matrix.block(1, 1);
  if (data.pressure_mass)
    sum(stiff, *data.pressure_mass, 1., D, -1.);
  else {
    stiff.copy_from(D);
    stiff *= -1.;
  }
  make_diagonal_positive(stiff);
  stiff_inverse.build(stiff);
  has_inertia = data.inertia != nullptr;
  if (has_inertia) {
    TrilinosMatrix product;
    matrix.block(1, 0).mmult(product, matrix.block(0, 1), inverse(*data.inertia));
    sum(inert, product, 1., D, -1.);
    make_diagonal_positive(inert);
    inert_inverse.build(inert);
  }
  scratch.reinit(stiff.locally_owned_range_indices(), stiff.get_mpi_communicator());
}

void SchurInverse::vmult(TrilinosVector &result, const TrilinosVector &source) const
{
  stiff_inverse.vmult(result, source);
  if (has_inertia) {
    inert_inverse.vmult(scratch, source);
    result += scratch;
  }
}

struct DisplacementInverse::Saddle
{
  const DisplacementInverse &owner;
  void vmult(BlockVector &result, const BlockVector &source) const
  {
    owner.data.shear->vmult(result.block(0), source.block(0));
    owner.data.gradient->vmult_add(result.block(0), source.block(1));
    owner.data.gradient->Tvmult(result.block(1), source.block(0));
    owner.pressure_scratch = source.block(1);
    owner.pressure_scratch.scale(*owner.data.volumetric_compliance);
    result.block(1) -= owner.pressure_scratch;
  }
};

struct DisplacementInverse::SaddleInverse
{
  const DisplacementInverse &owner;
  void vmult(BlockVector &result, const BlockVector &source) const
  {
    TrilinosVector &pi = result.block(1), &work = owner.pressure_scratch;
    pi = source.block(1);
    pi.scale(owner.stiff_inverse);
    if (owner.data.inertia) {
      owner.inert_inverse.vmult(work, source.block(1));
      pi += work;
    }
    owner.force_scratch = source.block(0);
    owner.data.gradient->vmult_add(owner.force_scratch, pi);
    pi *= -1.;
    owner.multigrid.vmult(result.block(0), owner.force_scratch);
  }
};

void DisplacementInverse::build(const TrilinosMatrix &matrix, const PreconditionerData &new_data,
                                const unsigned int dim, const std::vector<double> &modes)
{
  data = new_data;
  mixed = data.shear != nullptr;
  multigrid.build(mixed ? *data.shear : matrix, dim, modes);
  if (mixed)
    build_saddle();
}

void DisplacementInverse::build_saddle()
{
  const TrilinosVector &volumetric = *data.volumetric_compliance;
  pressure_scratch = volumetric;
  pressure_scratch += *data.shear_compliance;
  stiff_inverse = inverse(pressure_scratch);
  if (data.inertia) {
    // G^T diag(c_a M)^-1 G + W
    data.gradient->Tmmult(inert, *data.gradient, inverse(*data.inertia));
    const auto range = inert.local_range();
    for (auto row = range.first; row < range.second; ++row)
      inert.add(row, row, volumetric(row));
    inert.compress(dealii::VectorOperation::add);
    inert_inverse.build(inert);
  }
  const std::vector<dealii::IndexSet> owned{data.shear->locally_owned_range_indices(),
                                            volumetric.locally_owned_elements()};
  for (BlockVector *vector : {&unknown, &right_side, &scratch, &scaling, &inverse_scaling})
    vector->reinit(owned, data.shear->get_mpi_communicator());
  force_scratch = unknown.block(0);
  scaling.block(0) = inverse(absolute_diagonal(*data.shear));
  scaling.block(1) = stiff_inverse;
  for (unsigned int b = 0; b < 2; ++b)
    for (unsigned int i = 0; i < scaling.block(b).locally_owned_size(); ++i) {
      double &factor = scaling.block(b).trilinos_vector()[0][i];
      factor = std::sqrt(factor);
      inverse_scaling.block(b).trilinos_vector()[0][i] = 1. / factor;
    }
}

void DisplacementInverse::vmult(TrilinosVector &result, const TrilinosVector &source) const
{
  if (!mixed) {
    multigrid.vmult(result, source);
    return;
  }
  const Saddle matrix{*this};
  const SaddleInverse approximate{*this};
  using System = ScaledSystem<Saddle, SaddleInverse>;
  const System system{matrix, approximate, scaling, inverse_scaling, scratch};
  right_side.block(0) = source;
  right_side.block(1) = 0.;
  right_side.scale(scaling);
  unknown = 0.;
  const double reduction = 0.05;
  dealii::IterationNumberControl control(20, reduction * right_side.l2_norm());
  control.log_result(false);
  dealii::SolverFGMRES<BlockVector> solver(control, dealii::SolverFGMRES<BlockVector>::AdditionalData(22));
  solver.solve(System::Rows{system}, unknown, right_side, System::Columns{system});
  result = unknown.block(0);
}

BlockPreconditioner::BlockPreconditioner(const DisplacementUnknowns &unknowns)
    : dim(unknowns.dim), modes(rigid_body_modes(unknowns))
{}

void BlockPreconditioner::build(const LinearSolver::BlockMatrix &new_matrix, const PreconditionerData &data)
{
  matrix = &new_matrix;
  displacement.build(matrix->block(0, 0), data, dim, modes);
  if (matrix->n_block_rows() == 2)
    schur.build(*matrix, data);
  u_scratch.reinit(matrix->block(0, 0).locally_owned_range_indices(), matrix->get_mpi_communicator());
}

void BlockPreconditioner::vmult(LinearSolver::BlockVector &result, const LinearSolver::BlockVector &source) const
{
  u_scratch = source.block(0);
  if (matrix->n_block_rows() == 2) {
    schur.vmult(result.block(1), source.block(1));
    matrix->block(0, 1).vmult_add(u_scratch, result.block(1)); // p = -S^-1 f_p
    result.block(1) *= -1.;
  }
  displacement.vmult(result.block(0), u_scratch);
}
} // namespace peat
