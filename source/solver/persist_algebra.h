#pragma once

#include <peat/base/archive.h>

#include <deal.II/lac/trilinos_parallel_block_vector.h>
#include <deal.II/lac/trilinos_sparse_matrix.h>

#include <Epetra_CrsMatrix.h>

namespace peat {
/// ML estimates eigenvalues from random vectors, of one sequence in a process: before it makes a hierarchy
/// this begins anew, so that one of the same matrix is the same in a run that goes on from a checkpoint.
constexpr int multigrid_seed = 1;

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

/// This rank's rows of a matrix whose pattern depends on values, as that of a product of others does. When
/// reading it is distributed already.
inline void persist_rows(Archive &archive, dealii::TrilinosWrappers::SparseMatrix &matrix)
{
  const Epetra_CrsMatrix &before = matrix.trilinos_matrix();
  std::vector<int> lengths, numbers;
  std::vector<double> entries;
  for (int row = 0; row < before.NumMyRows() && !archive.is_loading(); ++row) {
    int length, *columns;
    double *values;
    before.ExtractMyRowView(row, length, values, columns);
    lengths.push_back(length);
    for (int k = 0; k < length; ++k)
      numbers.push_back(before.GCID(columns[k]));
    entries.insert(entries.end(), values, values + length);
  }
  archive(lengths, numbers, entries);
  if (!archive.is_loading())
    return;
  Epetra_CrsMatrix read(Copy, before.RowMap(), lengths.data(), true);
  std::size_t next = 0;
  for (int row = 0; row < before.NumMyRows(); next += lengths[row++])
    read.InsertGlobalValues(before.GRID(row), lengths[row], &entries[next], &numbers[next]);
  read.FillComplete(before.DomainMap(), before.RangeMap());
  matrix.reinit(read);
}
} // namespace peat
