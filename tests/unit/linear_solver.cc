// The linear solver of the u-p form: iterations over mesh, conductivity, step, nu and inertia; direct against
// iterative; kept preconditioners; what it says when it fails. Also to be run with mpirun -np 2 and 3.

#define BOOST_TEST_MODULE linear_solver
#define BOOST_TEST_NO_MAIN
#define BOOST_TEST_ALTERNATIVE_INIT_API
#include <boost/test/unit_test.hpp>

#include <peat/base/error.h>
#include <peat/solver/linear_solver.h>

#include <deal.II/base/mpi.h>

#include <sstream>

#include "poroelastic_problem.h"
#include "section.h"

using namespace peat;
using Vector = LinearSolver::BlockVector;

namespace {
LinearSolverParameters parameters_with(const LinearSolverParameters::Method method)
{
  LinearSolverParameters parameters(ParameterFile::describing().root());
  parameters.method = method;
  return parameters;
}

constexpr auto direct = LinearSolverParameters::Method::direct;
constexpr auto iterative = LinearSolverParameters::Method::iterative;

template <int dim>
Vector solution_of(const PoroelasticCase &setting, const LinearSolverParameters &parameters,
                   unsigned int &iterations)
{
  const PoroelasticProblem<dim> problem(setting, MPI_COMM_WORLD);
  LinearSolver solver(parameters, "the test");
  solver.reinit(problem.unknowns());
  solver.prepare(problem.matrix, problem.data());
  Vector solution(problem.rhs);
  solution = 0.;
  iterations = solver.solve(solution, problem.rhs);
  return solution;
}

std::string name(const PoroelasticCase &c)
{
  std::ostringstream text;
  text << c.n_cells << " cells, Q" << c.degree << ", nu " << c.poisson << ", k " << c.conductivity << ", dt "
       << c.dt << (c.dynamic ? " dynamic" : "") << (c.seepage_inertia ? " with G" : "")
       << (c.projected ? " projected" : "") << (c.drained_top ? "" : " undrained")
       << (c.sliver < 1. ? " sliver" : "");
  return text.str();
}

/// Iterations within the bound, and the direct solution.
template <int dim>
void check(const PoroelasticCase &setting, const unsigned int bound)
{
  unsigned int n, n_direct;
  const Vector found = solution_of<dim>(setting, parameters_with(iterative), n);
  const Vector exact = solution_of<dim>(setting, parameters_with(direct), n_direct);
  BOOST_TEST(n <= bound, name(setting) + ": " + std::to_string(n) + " iterations");
  BOOST_TEST(n_direct <= 3u);
  for (unsigned int b = 0; b < exact.n_blocks(); ++b) {
    Vector difference(found);
    difference -= exact;
    std::ostringstream text;
    text << name(setting) << ": block " << b << " differs by "
         << difference.block(b).l2_norm() / exact.block(b).l2_norm();
    // A sliver's own rows count little in the residual.
    BOOST_TEST(difference.block(b).l2_norm() <=
                   (setting.sliver < 1. ? 1e-7 : 1e-8) * exact.block(b).l2_norm(),
               text.str());
  }
}
} // namespace

BOOST_AUTO_TEST_CASE(conductivity_and_step)
{
  PoroelasticCase setting;
  setting.half_load = true;
  setting.n_cells = 16;
  for (const double k : {1e-2, 1e-7, 1e-12})
    for (const double dt : {1e-5, 1e-3, 1e-1}) {
      setting.conductivity = k;
      setting.dt = dt;
      setting.dynamic = true;
      check<2>(setting, 45);
      setting.seepage_inertia = true;
      check<2>(setting, 45);
      setting.seepage_inertia = setting.dynamic = false;
      check<2>(setting, 45);
    }
}

BOOST_AUTO_TEST_CASE(nearly_incompressible)
{
  PoroelasticCase setting;
  setting.half_load = setting.projected = true;
  setting.poisson = 0.499;
  setting.conductivity = 1e-7;
  for (const unsigned int n : {8u, 24u}) {
    setting.n_cells = n;
    for (const double dt : {1e-5, 1e-4, 1e-3, 1e-1}) {
      setting.dt = dt;
      setting.dynamic = true;
      check<2>(setting, 60);
      setting.dynamic = false;
      check<2>(setting, 60);
    }
  }
  setting.saturated = false;
  check<2>(setting, 60);
}

BOOST_AUTO_TEST_CASE(three_dimensions)
{
  PoroelasticCase setting;
  setting.half_load = setting.dynamic = setting.seepage_inertia = true;
  setting.n_cells = 4;
  check<3>(setting, 40);
  setting.poisson = 0.499;
  setting.projected = true;
  check<3>(setting, 50);
  setting.saturated = false;
  check<3>(setting, 50);
}

/// More unknowns may cost no more than so many iterations more.
BOOST_AUTO_TEST_CASE(iterations_on_finer_meshes)
{
  const auto iterations = [](const PoroelasticCase &setting, const auto &dimension) {
    unsigned int n;
    solution_of<dimension.value>(setting, parameters_with(iterative), n);
    return n;
  };
  PoroelasticCase setting;
  setting.half_load = true;
  const auto check_growth = [&](const auto &dimension, const unsigned int coarse, const unsigned int fine,
                                const unsigned int bound, const unsigned int most_more) {
    setting.n_cells = coarse;
    const unsigned int few = iterations(setting, dimension);
    setting.n_cells = fine;
    const unsigned int many = iterations(setting, dimension);
    // Aggregates and sweeps of the smoother end at the borders of ranks.
    const bool parallel = dealii::Utilities::MPI::n_mpi_processes(MPI_COMM_WORLD) > 1;
    BOOST_TEST(many <= bound + (parallel ? 8 : 0),
               name(setting) + ": " + std::to_string(many) + " iterations");
    BOOST_TEST(many <= few + most_more + (parallel ? 3 : 0), name(setting) + ": " + std::to_string(many) +
                                                                 " iterations, and " + std::to_string(few) +
                                                                 " on the coarser mesh");
  };
  const std::integral_constant<int, 2> plane;
  const std::integral_constant<int, 3> solid;
  setting.conductivity = 1e-12;
  setting.dt = 0.1;
  check_growth(plane, 32, 64, 30, 4);
  check_growth(solid, 6, 10, 28, 4);
  // On coarse meshes inertia alone counts, and there is hardly anything to do.
  setting.dynamic = setting.seepage_inertia = true;
  setting.conductivity = 1e-2;
  setting.dt = 1e-4;
  check_growth(plane, 64, 96, 25, 4);
  setting.conductivity = 1e-7;
  setting.dt = 1e-3;
  check_growth(plane, 64, 96, 25, 4);
}

BOOST_AUTO_TEST_CASE(special_boundaries_and_cells)
{
  PoroelasticCase setting;
  setting.half_load = true;
  setting.n_cells = 16;
  for (const bool dynamic : {false, true}) {
    setting.dynamic = dynamic;
    setting.drained_top = false; // traction and no flux on the same face
    check<2>(setting, 45);
    setting.drained_top = true;
    setting.sliver = 1e-6;
    check<2>(setting, 45);
    setting.sliver = 1.;
  }
  setting.saturated = false;
  check<2>(setting, 40);
  setting.degree = 1;
  check<2>(setting, 30);
}

BOOST_AUTO_TEST_CASE(kept_preconditioners)
{
  PoroelasticCase setting;
  setting.dynamic = true;
  const PoroelasticProblem<2> first(setting, MPI_COMM_WORLD);
  setting.young *= 1.1;
  const PoroelasticProblem<2> close(setting, MPI_COMM_WORLD);
  setting.young *= 1000.;
  const PoroelasticProblem<2> far(setting, MPI_COMM_WORLD);
  for (const auto method : {direct, iterative}) {
    const LinearSolverParameters parameters = parameters_with(method);
    LinearSolver solver(parameters, "the test");
    solver.reinit(first.unknowns());
    Vector solution(first.rhs);
    const auto solve = [&](const PoroelasticProblem<2> &problem) {
      solver.prepare(problem.matrix, problem.data(), LinearSolver::Reuse::preconditioner);
      solution = 0.;
      const unsigned int n = solver.solve(solution, problem.rhs);
      Vector residual(problem.rhs);
      problem.matrix.residual(residual, solution, problem.rhs);
      BOOST_TEST(residual.block(0).l2_norm() <= 1e-9 * problem.rhs.l2_norm());
      return n;
    };
    solve(first);
    BOOST_TEST(solve(close) < 30u);
    BOOST_TEST(solver.n_preconditioners() == 1u);
    // Far from the matrix it was made for, the old one is given up at once or at the next prepare().
    solve(far);
    solve(far);
    BOOST_TEST(solver.n_preconditioners() == 2u);
    // From the solution, there is nothing to do.
    BOOST_TEST(solver.solve(solution, far.rhs) <= 1u);
    const Vector nothing = [&] {
      Vector zero(far.rhs);
      zero = 0.;
      return zero;
    }();
    BOOST_TEST(solver.solve(solution, nothing) == 0u);
    BOOST_TEST(solution.l2_norm() == 0.);
  }
}

BOOST_AUTO_TEST_CASE(failure_in_the_users_words)
{
  LinearSolverParameters parameters = parameters_with(iterative);
  parameters.max_iterations = 3;
  unsigned int n;
  BOOST_CHECK_EXCEPTION(
      solution_of<2>(PoroelasticCase(), parameters, n), NumericalError, [](const auto &error) {
        const std::string text = error.what();
        return text.find("the test") != std::string::npos && text.find("3 iterations") != std::string::npos &&
               text.find("Method = direct") != std::string::npos && text.find('\n') == std::string::npos;
      });
}

BOOST_AUTO_TEST_CASE(parameters)
{
  const auto read = [](const std::string &lines) {
    return from_text(lines, [](const Section &section) { return LinearSolverParameters(section); });
  };
  const LinearSolverParameters parameters =
      read("set Method = iterative\nset Tolerance = 1e-6\nset Iterations = 7");
  BOOST_TEST((parameters.method == iterative));
  BOOST_TEST(parameters.tolerance == 1e-6);
  BOOST_TEST(parameters.max_iterations == 7u);
  BOOST_TEST((read("").method == LinearSolverParameters::Method::automatic));
  BOOST_CHECK_THROW(read("set Method = magic"), InputError);
  BOOST_CHECK_THROW(read("set Iterations = 0"), InputError);
}

int main(int argc, char **argv)
{
  const dealii::Utilities::MPI::MPI_InitFinalize mpi(argc, argv, 1);
  return boost::unit_test::unit_test_main([] { return true; }, argc, argv);
}
