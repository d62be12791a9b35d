#include <peat/solver/linear_solver.h>

#include <peat/base/error.h>
#include <peat/base/text.h>

#include <deal.II/lac/solver_control.h>
#include <deal.II/lac/solver_gmres.h>

#include <cmath>
#include <sstream>

#include "linear_preconditioner.h"

namespace peat {
namespace {
constexpr unsigned int basis_size = 60; // of FGMRES; two vectors each

/// More iterations than this after `first` of the fresh preconditioner, and a new one pays.
unsigned int tolerated(const unsigned int first)
{
  return 2 * first + 5;
}

std::string short_number(const double value)
{
  std::ostringstream text;
  text.precision(3);
  text << value;
  return text.str();
}
} // namespace

LinearSolverParameters::LinearSolverParameters(Section section)
{
  std::string name = "auto";
  section.add(
      "Method", name, {"auto", "direct", "iterative"},
      "How linear systems are solved. 'direct': LU factors, no matter what the material; the cost grows fast "
      "with "
      "the size in 3-D. 'iterative': FGMRES with a block preconditioner and algebraic multigrid; its cost "
      "grows with the number of unknowns only. 'auto': direct up to the direct limit.");
  method = name == "auto" ? Method::automatic : name == "direct" ? Method::direct : Method::iterative;
  section.add(
      "Direct limit in 2-D", direct_limit_2d, any(""),
      "Number of unknowns up to which 'auto' is direct in two dimensions. A larger one buys speed when many "
      "steps share a matrix, and costs memory.");
  section.add("Direct limit in 3-D", direct_limit_3d, any(""),
              "Number of unknowns up to which 'auto' is direct in three dimensions.");
  section.add(
      "Tolerance", tolerance, strictly_between(0., 1.),
      "Residual over right-hand side at which a solution is good enough. A looser one saves iterations, and "
      "leaves what it leaves to the next Newton step.");
  section.add("Iterations", max_iterations, Range{"", 1.},
              "Largest number of iterations before the run ends with an error. 10 to 40 are usual.");
}

LinearSolver::LinearSolver(const LinearSolverParameters &parameters, std::string purpose)
    : parameters(parameters), purpose(std::move(purpose))
{}

LinearSolver::~LinearSolver() = default;

void LinearSolver::reinit(DisplacementUnknowns new_unknowns)
{
  unknowns = std::move(new_unknowns);
  matrix = nullptr;
  preconditioner.reset();
  is_fresh = is_worn = false;
}

bool LinearSolver::would_be_direct(const dealii::types::global_dof_index n_unknowns) const
{
  if (parameters.method != LinearSolverParameters::Method::automatic)
    return parameters.method == LinearSolverParameters::Method::direct;
  return n_unknowns <= (unknowns.dim == 2 ? parameters.direct_limit_2d : parameters.direct_limit_3d);
}

void LinearSolver::prepare(const BlockMatrix &new_matrix, const PreconditionerData &new_data,
                           const Reuse reuse)
{
  matrix = &new_matrix;
  data = new_data;
  if (!preconditioner || reuse == Reuse::nothing) {
    direct = would_be_direct(matrix->m());
    if (direct)
      preconditioner = std::make_unique<DirectFactor>(purpose);
    else
      preconditioner = std::make_unique<BlockPreconditioner>(unknowns);
    build();
  } else if (reuse == Reuse::pattern || is_worn)
    build();
  else
    is_fresh = false;
  find_scaling();
}

void LinearSolver::persist(Archive &archive, const BlockMatrix &pattern, const bool keeps)
{
  archive.begin("linear solver");
  if (keeps) {
    if (archive.is_loading() && would_be_direct(pattern.m())) {
      preconditioner = std::make_unique<DirectFactor>(purpose);
      direct = true;
    }
    preconditioner->persist(archive, pattern);
  }
  archive(is_worn, fresh_iterations, n_builds);
}

void LinearSolver::build()
{
  preconditioner->build(*matrix, data);
  ++n_builds;
  is_fresh = true;
  is_worn = false;
  fresh_iterations = 0;
}

void LinearSolver::find_scaling()
{
  const unsigned int n_blocks = matrix->n_block_rows();
  std::vector<dealii::IndexSet> owned;
  for (unsigned int b = 0; b < n_blocks; ++b)
    owned.push_back(matrix->block(b, b).locally_owned_range_indices());
  if (mixed())
    owned.push_back(data.volumetric_compliance->locally_owned_elements());
  for (BlockVector *vector : {&scaling, &inverse_scaling, &scratch, &unknown, &right_side})
    vector->reinit(owned, matrix->block(0, 0).get_mpi_communicator());

  scaling.block(0) = absolute_diagonal(mixed() ? *data.shear : matrix->block(0, 0));
  if (n_blocks == 2) {
    // the diagonal of the Schur complement, as SIMPLE approximates it
    scaling.block(1) = diagonal_of_product(matrix->block(1, 0), absolute_diagonal(matrix->block(0, 0)));
    scaling.block(1) += absolute_diagonal(matrix->block(1, 1));
  }
  if (mixed()) {
    scaling.block(n_blocks) = *data.volumetric_compliance;
    scaling.block(n_blocks) += *data.shear_compliance;
  }
  for (unsigned int b = 0; b < scaling.n_blocks(); ++b)
    for (unsigned int i = 0; i < scaling.block(b).locally_owned_size(); ++i) {
      double &factor = scaling.block(b).trilinos_vector()[0][i];
      const double root = std::sqrt(factor);
      factor = 1. / root;
      inverse_scaling.block(b).trilinos_vector()[0][i] = root;
    }
}

/// Row-scaled operator and preconditioner: residuals of different units count alike, unknowns are not scaled.
struct LinearSolver::ScaledRows
{
  const BlockOperator &matrix;
  const BlockVector &scaling;
  void vmult(BlockVector &result, const BlockVector &source) const
  {
    matrix.vmult(result, source);
    result.scale(scaling);
  }
};

struct LinearSolver::ScaledInverse
{
  const Preconditioner &inverse;
  const BlockVector &inverse_scaling;
  BlockVector &scratch;
  void vmult(BlockVector &result, const BlockVector &source) const
  {
    scratch = source;
    scratch.scale(inverse_scaling);
    inverse.vmult(result, scratch);
  }
};

unsigned int LinearSolver::iterate(const double target, bool &converged)
{
  const BlockOperator block_operator(*matrix, mixed() ? data : PreconditionerData());
  const ScaledRows rows{block_operator, scaling};
  const ScaledInverse inverse{*preconditioner, inverse_scaling, scratch};
  dealii::SolverControl control(parameters.max_iterations, target);
  control.log_result(false);
  dealii::SolverFGMRES<BlockVector> solver(control,
                                           dealii::SolverFGMRES<BlockVector>::AdditionalData(basis_size));
  try {
    solver.solve(rows, unknown, right_side, inverse);
    converged = true;
  } catch (const dealii::SolverControl::NoConvergence &) {
    converged = false;
  }
  reached = control.last_value();
  return control.last_step();
}

double LinearSolver::take_up(const BlockVector &solution, const BlockVector &rhs)
{
  for (unsigned int b = 0; b < rhs.n_blocks(); ++b) {
    right_side.block(b) = rhs.block(b);
    unknown.block(b) = solution.block(b);
  }
  if (mixed()) {
    const unsigned int last = rhs.n_blocks();
    right_side.block(last) = 0.;
    // pi = W^-1 G^T u
    data.gradient->Tvmult(unknown.block(last), solution.block(0));
    for (unsigned int i = 0; i < unknown.block(last).locally_owned_size(); ++i)
      unknown.block(last).trilinos_vector()[0][i] /= data.volumetric_compliance->trilinos_vector()[0][i];
  }
  right_side.scale(scaling);
  return right_side.l2_norm();
}

unsigned int LinearSolver::solve(BlockVector &solution, const BlockVector &rhs)
{
  const double size = take_up(solution, rhs);
  if (!std::isfinite(size))
    throw NumericalError("the forces of " + purpose + " are not finite numbers");
  if (size == 0.) {
    solution = 0.;
    return 0;
  }
  const double target = parameters.tolerance * size;
  bool converged;
  unsigned int n = iterate(target, converged);
  if (!converged && !is_fresh) {
    build();
    n += iterate(target, converged);
  }
  if (!converged)
    throw NumericalError(
        "the linear equations of " + purpose + " are solved only to " + short_number(reached / size) +
        " after " + std::to_string(n) + " iterations, not to the Tolerance " +
        short_number(parameters.tolerance) +
        ": set Method = direct, or more Iterations, and look for cells with next to no material");
  for (unsigned int b = 0; b < solution.n_blocks(); ++b)
    solution.block(b) = unknown.block(b);
  if (fresh_iterations == 0)
    fresh_iterations = std::max(n, 1u);
  is_worn = n > tolerated(fresh_iterations);
  return n;
}
} // namespace peat
