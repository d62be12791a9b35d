#include "linear_preconditioner.h"
#include "persist_algebra.h"

#include <peat/base/error.h>

#include <deal.II/base/mpi.h>

#include <Amesos.h>
#include <Teuchos_ParameterList.hpp>

namespace peat {
namespace {
using BlockMatrix = LinearSolver::BlockMatrix;

/// First number of a block's unknowns in the system.
int offset(const BlockMatrix &matrix, const unsigned int block)
{
  return block == 0 ? 0 : matrix.block(0, 0).m();
}

/// Calls visit(row, n, columns, values) for each owned row of each block, in the system's numbers.
template <typename Visit>
void for_rows(const BlockMatrix &matrix, const Visit &visit)
{
  std::vector<int> numbers;
  for (unsigned int i = 0; i < matrix.n_block_rows(); ++i)
    for (unsigned int j = 0; j < matrix.n_block_cols(); ++j) {
      const Epetra_CrsMatrix &block = matrix.block(i, j).trilinos_matrix();
      for (int row = 0; row < block.NumMyRows(); ++row) {
        int length, *columns;
        double *values;
        block.ExtractMyRowView(row, length, values, columns);
        numbers.resize(length);
        for (int k = 0; k < length; ++k)
          numbers[k] = offset(matrix, j) + block.GCID(columns[k]);
        visit(offset(matrix, i) + block.GRID(row), length, numbers.data(), values);
      }
    }
}
} // namespace

void DirectFactor::make_pattern(const BlockMatrix &matrix)
{
  std::vector<int> owned;
  for (unsigned int i = 0; i < matrix.n_block_rows(); ++i) {
    const Epetra_CrsMatrix &block = matrix.block(i, i).trilinos_matrix();
    for (int row = 0; row < block.NumMyRows(); ++row)
      owned.push_back(offset(matrix, i) + block.GRID(row));
  }
  solver.reset();
  const Epetra_Comm &communicator = matrix.block(0, 0).trilinos_matrix().Comm();
  map = std::make_unique<Epetra_Map>(-1, int(owned.size()), owned.data(), 0, communicator);
  std::vector<int> lengths(owned.size(), 0);
  for_rows(matrix,
           [&](const int row, const int n, const int *, const double *) { lengths[map->LID(row)] += n; });
  system = std::make_unique<Epetra_CrsMatrix>(Copy, *map, lengths.data(), true);
  for_rows(matrix, [&](const int row, const int n, const int *columns, const double *values) {
    system->InsertGlobalValues(row, n, values, columns);
  });
  system->FillComplete();
  system->OptimizeStorage();
  unknown = std::make_unique<Epetra_Vector>(*map);
  right_side = std::make_unique<Epetra_Vector>(*map);
  problem = std::make_unique<Epetra_LinearProblem>(system.get(), unknown.get(), right_side.get());
}

void DirectFactor::copy_values(const BlockMatrix &matrix)
{
  for_rows(matrix, [&](const int row, const int n, const int *columns, const double *values) {
    system->ReplaceGlobalValues(row, n, values, columns);
  });
}

void DirectFactor::complain() const
{
  throw NumericalError(
      "the equations of " + purpose +
      " have no unique solution: hold every body by its boundary conditions (or let inertia hold it) "
      "and look for cells with next to no material");
}

void DirectFactor::build(const BlockMatrix &matrix, const PreconditionerData &)
{
  if (system)
    copy_values(matrix);
  else
    make_pattern(matrix);
  factorise();
}

void DirectFactor::persist(Archive &archive, const BlockMatrix &matrix)
{
  if (archive.is_loading())
    make_pattern(matrix);
  persist_values(archive, *system);
  if (archive.is_loading())
    factorise();
}

void DirectFactor::factorise()
{
  if (!solver) {
    // MUMPS: 70 times faster than KLU on 20,000 unknowns of Q2/Q1 in 2-D. KLU is in every Trilinos.
    solver.reset(Amesos().Create("Amesos_Mumps", *problem));
    if (!solver)
      solver.reset(Amesos().Create("Amesos_Klu", *problem));
    Teuchos::ParameterList list;
    solver->SetParameters(list);
    if (solver->SymbolicFactorization() != 0)
      complain();
  }
  if (solver->NumericFactorization() != 0)
    complain();
}

void DirectFactor::vmult(LinearSolver::BlockVector &result, const LinearSolver::BlockVector &source) const
{
  int k = 0;
  for (unsigned int b = 0; b < source.n_blocks(); ++b)
    for (unsigned int i = 0; i < source.block(b).locally_owned_size(); ++i)
      (*right_side)[k++] = source.block(b).trilinos_vector()[0][i];
  if (solver->Solve() != 0)
    complain();
  k = 0;
  for (unsigned int b = 0; b < result.n_blocks(); ++b)
    for (unsigned int i = 0; i < result.block(b).locally_owned_size(); ++i)
      result.block(b).trilinos_vector()[0][i] = (*unknown)[k++];
}
} // namespace peat
