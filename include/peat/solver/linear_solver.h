#pragma once

#include <peat/base/parameters.h>
#include <peat/solver/up_form.h>

#include <memory>

namespace peat {
struct LinearSolverParameters
{
  explicit LinearSolverParameters(Section section);
};

class LinearSolver
{
public:
  explicit LinearSolver(const LinearSolverParameters &parameters);
  ~LinearSolver();
  void prepare(const BlockMatrix &matrix);
  unsigned int solve(BlockVector &solution, const BlockVector &right_side);

private:
  struct Direct;
  std::unique_ptr<Direct> direct;
};
} // namespace peat
