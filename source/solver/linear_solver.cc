#include <peat/solver/linear_solver.h>

#include <deal.II/lac/sparse_direct.h>

namespace peat {
LinearSolverParameters::LinearSolverParameters(Section) {}
struct LinearSolver::Direct
{
  dealii::SparsityPattern pattern;
  dealii::SparseMatrix<double> matrix;
  dealii::SparseDirectUMFPACK factors;
};
LinearSolver::LinearSolver(const LinearSolverParameters &) {}
LinearSolver::~LinearSolver() = default;
void LinearSolver::prepare(const BlockMatrix &m)
{
  direct = std::make_unique<Direct>();
  const auto n = m.m();
  dealii::DynamicSparsityPattern dsp(n, n);
  std::vector<unsigned int> offset = {0};
  for (unsigned int b = 0; b < m.n_block_rows(); ++b)
    offset.push_back(offset.back() + m.block(b, b).m());
  for (unsigned int r = 0; r < m.n_block_rows(); ++r)
    for (unsigned int c = 0; c < m.n_block_cols(); ++c)
      for (auto e = m.block(r, c).begin(); e != m.block(r, c).end(); ++e)
        dsp.add(offset[r] + e->row(), offset[c] + e->column());
  direct->pattern.copy_from(dsp);
  direct->matrix.reinit(direct->pattern);
  for (unsigned int r = 0; r < m.n_block_rows(); ++r)
    for (unsigned int c = 0; c < m.n_block_cols(); ++c)
      for (auto e = m.block(r, c).begin(); e != m.block(r, c).end(); ++e)
        direct->matrix.add(offset[r] + e->row(), offset[c] + e->column(), e->value());
  direct->factors.initialize(direct->matrix);
}
unsigned int LinearSolver::solve(BlockVector &x, const BlockVector &b)
{
  dealii::Vector<double> v(b.size());
  for (unsigned int i = 0; i < b.size(); ++i)
    v(i) = b(i);
  direct->factors.solve(v);
  for (unsigned int i = 0; i < b.size(); ++i)
    x(i) = v(i);
  x.compress(dealii::VectorOperation::insert);
  return 1;
}
} // namespace peat
