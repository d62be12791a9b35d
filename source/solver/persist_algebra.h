#pragma once

#include <peat/base/archive.h>

#include <deal.II/lac/trilinos_parallel_block_vector.h>
#include <deal.II/lac/trilinos_sparse_matrix.h>

#include <Epetra_CrsMatrix.h>

namespace peat {
/// This rank's values of a vector or matrix, which when reading has its size or pattern already.
inline void persist_values(Archive &archive, dealii::TrilinosWrappers::MPI::Vector &vector)
{
  archive.bytes(vector.trilinos_vector()[0], vector.locally_owned_size() * sizeof(double));
}

inline void persist_values(Archive &archive, dealii::TrilinosWrappers::MPI::BlockVector &vector)
{
  for (unsigned int b = 0; b < vector.n_blocks(); ++b)
    persist_values(archive, vector.block(b));
}

/// Call an action with the values of each of this rank's rows and their number.
template <typename Action>
void for_each_row(const Epetra_CrsMatrix &matrix, const Action &action)
{
  for (int row = 0; row < matrix.NumMyRows(); ++row) {
    int length, *columns;
    double *values;
    matrix.ExtractMyRowView(row, length, values, columns);
    action(values, length);
  }
}

inline void persist_values(Archive &archive, const Epetra_CrsMatrix &matrix)
{
  for_each_row(matrix, [&](double *values, const int n) { archive.bytes(values, n * sizeof(double)); });
}

inline void persist_values(Archive &archive, dealii::TrilinosWrappers::SparseMatrix &matrix)
{
  persist_values(archive, matrix.trilinos_matrix());
}
} // namespace peat
