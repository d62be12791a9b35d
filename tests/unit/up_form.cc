#define BOOST_TEST_MODULE up_form
#include <boost/test/unit_test.hpp>

#include <peat/material/mixture.h>
#include <peat/solver/up_form.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_tools.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/lac/block_sparsity_pattern.h>
#include <deal.II/lac/full_matrix.h>

#include "output_scene.h"

// Residual and tangent of the weak form against the same integrals by deal.II's FEValues: random nodal
// values, on cells that are no squares, with rates, inertia, gravity and a state of the points that is not at
// rest.

BOOST_GLOBAL_FIXTURE(Mpi);

namespace {
constexpr double E = 2e7, nu = 0.35;
const double mu = E / (2. * (1. + nu)), bulk = E / (3. * (1. - 2. * nu));

TimeLevel some_level(const bool inertia)
{
  TimeLevel level;
  level.share = 0.6;
  level.velocity = 31.;
  level.acceleration = 870.;
  level.old_velocity = -23.;
  level.pressure_rate = 41.;
  level.dt = 0.03;
  level.seepage_inertia = inertia;
  return level;
}

template <int dim>
struct Field
{
  dealii::Tensor<1, dim> velocity;
  dealii::SymmetricTensor<2, dim> stress;
  double stress_zz = 0., pressure = 0.;
};

/// What the points have at t_n.
template <int dim>
Field<dim> at_start(const dealii::Point<dim> &x)
{
  Field<dim> field;
  for (unsigned int d = 0; d < dim; ++d) {
    field.velocity[d] = 0.1 * (d + 1.) - 0.3 * x[d] + 0.2 * x[0] * x[1];
    for (unsigned int e = d; e < dim; ++e)
      field.stress[d][e] = 1e3 * (1. + d - 0.4 * e + x[d] * x[e] - 2. * x[0]);
  }
  field.stress_zz = dim == 2 ? 700. * x[1] : field.stress[dim - 1][dim - 1];
  field.pressure = 2e3 * (1. + 0.5 * x[0] - x[1]);
  return field;
}

/// Saturated ground in part of a mesh of cells that are no squares.
template <int dim>
std::string ground(const std::string &element)
{
  const bool flat = dim == 2;
  return std::string("set Dimension = ") + (flat ? "2" : "3") +
         "\nset Method = fem\nsubsection Grid\n set Lower corner = " + (flat ? "0, 0" : "0, 0, 0") +
         "\n set Upper corner = " + (flat ? "2, 2" : "2, 2, 2") +
         "\n set Cells = " + (flat ? "6, 4" : "4, 2, 6") +
         "\nend\nsubsection Materials\n subsection sand\n  set Porosity = 0.4\n"
         "  set Hydraulic conductivity = 1e-4\n  subsection linear elastic\n   set Young modulus = 2e7\n"
         "   set Poisson ratio = 0.35\n  end\n end\nend\n"
         "subsection Bodies\n subsection ground\n  set Material = sand\n  set Shape = " +
         (flat ? "box(0, 0, 1, 1)" : "box(0, 0, 0, 1, 1, 1)") +
         "\n end\nend\nsubsection Stages\n subsection run\n  set Duration = 1\n end\nend\n"
         "subsection Implicit solver\n set Element = " +
         element + "\nend\n";
}

template <int dim>
struct Problem
{
  Problem(const std::string &element, const bool projects)
      : world(World<dim>::make_case(ground<dim>(element))), projects(projects),
        space(world.grid, world.parameters->implicit.element), body(*world.scene.bodies.front())
  {
    std::vector<CellId> cells;
    for (const Slice &slice : body.slices())
      cells.push_back(slice.cell);
    space.distribute(cells, cells);
    const Layout &layout = body.layout();
    for (const std::uint32_t handle : body.handles()) {
      const Field<dim> field = at_start<dim>(body.position(handle));
      double *row = body.row(handle);
      for (unsigned int d = 0; d < dim; ++d)
        row[layout.velocity + d] = field.velocity[d];
      const unsigned int places[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};
      for (unsigned int c = 0; c < (dim == 2 ? 4 : 6); ++c) {
        const auto [i, j] = places[c];
        row[layout.stress + c] = i < dim && j < dim ? field.stress[i][j] : field.stress_zz;
      }
      row[layout.pressure] = field.pressure;
    }
    loads.gravity[dim - 1] = -9.81;
    set(state.unknown, 1e-3, 1e4, 1);
    set(state.rate_history, 0.5, 3e4, 2);
    set(state.second_history, 20., 0., 3);
    // Of a field that is linear in place, nodes and points have the same.
    BlockVector own(space.owned(), comm);
    own.block(0) = state.second_history.block(0);
    for (const auto &node : space.pressure_nodes())
      own.block(1)(node.pressure - space.first_pressure()) = at_start<dim>(node.position).pressure;
    state.second_history = own;
  }

  void set(BlockVector &vector, const double of_motion, const double of_pressure,
           const unsigned int seed) const
  {
    BlockVector own(space.owned(), comm);
    for (dealii::types::global_dof_index i = 0; i < own.size(); ++i)
      own(i) = (i < space.first_pressure() ? of_motion : of_pressure) * std::sin(12.9898 * (i + 1) * seed);
    vector.reinit(space.owned(), space.relevant(), comm);
    vector = own;
  }

  World<dim> world;
  const bool projects;
  Space<dim> space;
  Body<dim> &body;
  StepState state;
  VolumeLoads<dim> loads;
};

/// The L2 projection of values at quadrature points onto linear functions (Q2) or constants (Q1).
template <int dim>
std::vector<double> project(const dealii::FEValues<dim> &cell, const unsigned int degree,
                            const std::vector<double> &values)
{
  const unsigned int n = degree == 2 ? dim + 1 : 1;
  const auto function = [&](const unsigned int k, const unsigned int q) {
    return k == 0 ? 1. : cell.quadrature_point(q)[k - 1];
  };
  dealii::FullMatrix<double> gram(n, n);
  dealii::Vector<double> moments(n), coefficients(n);
  for (unsigned int q = 0; q < values.size(); ++q)
    for (unsigned int k = 0; k < n; ++k) {
      moments(k) += cell.JxW(q) * function(k, q) * values[q];
      for (unsigned int l = 0; l < n; ++l)
        gram(k, l) += cell.JxW(q) * function(k, q) * function(l, q);
    }
  gram.gauss_jordan();
  gram.vmult(coefficients, moments);
  std::vector<double> result(values.size(), 0.);
  for (unsigned int q = 0; q < values.size(); ++q)
    for (unsigned int k = 0; k < n; ++k)
      result[q] += coefficients(k) * function(k, q);
  return result;
}

/// Residual and minus its derivative by FEValues, dense.
template <int dim>
void integrate(const Problem<dim> &problem, const TimeLevel &level, dealii::Vector<double> &residual,
               dealii::FullMatrix<double> &matrix)
{
  const Space<dim> &space = problem.space;
  const Grid<dim> &grid = problem.world.grid;
  const Mixture &mixture = *problem.body.material().mixture();
  const unsigned int degree = space.nodes() == Nodes::q2 ? 2 : 1;
  const dealii::FE_Q<dim> element_u(degree), element_p(1);
  const auto order_u = dealii::FETools::lexicographic_to_hierarchic_numbering<dim>(degree);
  const auto order_p = dealii::FETools::lexicographic_to_hierarchic_numbering<dim>(1);
  const dealii::QGauss<dim> quadrature(degree + 1);
  dealii::FEValues<dim> u(grid.mapping(), element_u, quadrature,
                          dealii::update_values | dealii::update_gradients | dealii::update_JxW_values |
                              dealii::update_quadrature_points);
  dealii::FEValues<dim> p(grid.mapping(), element_p, quadrature,
                          dealii::update_values | dealii::update_gradients);
  const unsigned int n_nodes = element_u.dofs_per_cell, n_p = element_p.dofs_per_cell,
                     n_q = quadrature.size();
  const double alpha = mixture.biot_coefficient(), rho = mixture.density(), rho_f = mixture.fluid_density();
  const double kappa = mixture.mobility(), storage = mixture.storage(), scale = level.fluid_scale();
  const double s = level.share, inertia = level.seepage_inertia ? 1. : 0.;
  using Vector = dealii::Tensor<1, dim>;

  for (const auto &cell : grid.triangulation().active_cell_iterators()) {
    const CellId id = cell->active_cell_index();
    if (!space.is_solid(id))
      continue;
    u.reinit(cell);
    p.reinit(cell);
    const auto *dof_u = space.displacements(id);
    const auto *dof_p = space.pressures(id);
    std::vector<double> div_step(n_q, 0.);
    std::vector<std::vector<double>> div_shape(n_nodes * dim, std::vector<double>(n_q));
    for (unsigned int q = 0; q < n_q; ++q)
      for (unsigned int i = 0; i < n_nodes; ++i)
        for (unsigned int d = 0; d < dim; ++d) {
          div_shape[i * dim + d][q] = u.shape_grad(order_u[i], q)[d];
          div_step[q] += s * u.shape_grad(order_u[i], q)[d] * problem.state.unknown(dof_u[i * dim + d]);
        }
    auto seen_step = div_step;
    auto seen_shape = div_shape;
    if (problem.projects) {
      seen_step = project(u, degree, div_step);
      for (auto &one : seen_shape)
        one = project(u, degree, one);
    }
    for (unsigned int q = 0; q < n_q; ++q) {
      const double w = u.JxW(q);
      const Field<dim> start = at_start<dim>(u.quadrature_point(q));
      dealii::Tensor<2, dim> step, rate;
      Vector acceleration = level.old_velocity * start.velocity;
      for (unsigned int i = 0; i < n_nodes; ++i)
        for (unsigned int d = 0; d < dim; ++d) {
          const auto index = dof_u[i * dim + d];
          const double U = problem.state.unknown(index);
          step[d] += s * U * u.shape_grad(order_u[i], q);
          rate[d] += (level.velocity * U + problem.state.rate_history(index)) * u.shape_grad(order_u[i], q);
          acceleration[d] +=
              (level.acceleration * U + problem.state.second_history(index)) * u.shape_value(order_u[i], q);
        }
      double P = 0., history = 0.;
      Vector slope;
      for (unsigned int i = 0; i < n_p; ++i) {
        const double value = problem.state.unknown(dof_p[i]), old = problem.state.second_history(dof_p[i]);
        P += value * p.shape_value(order_p[i], q);
        history += problem.state.rate_history(dof_p[i]) * p.shape_value(order_p[i], q);
        slope += (s * value + (1. - s) * old) * p.shape_grad(order_p[i], q);
      }
      const double pressure = s * P + (1. - s) * start.pressure;
      dealii::SymmetricTensor<2, dim> stress = start.stress + 2. * mu * dealii::symmetrize(step);
      for (unsigned int d = 0; d < dim; ++d)
        stress[d][d] += bulk * seen_step[q] - 2. * mu / 3. * div_step[q] - alpha * pressure;
      const double filling =
          storage * (level.pressure_rate * (P - start.pressure) + history) + alpha * dealii::trace(rate);
      const Vector flux = kappa * (rho_f * (problem.loads.gravity - inertia * acceleration) - slope);

      for (unsigned int i = 0; i < n_nodes; ++i) {
        const double N = u.shape_value(order_u[i], q);
        const Vector dN = u.shape_grad(order_u[i], q);
        for (unsigned int d = 0; d < dim; ++d) {
          const auto row = dof_u[i * dim + d];
          residual(row) += w * (rho * (problem.loads.gravity[d] - acceleration[d]) * N - (stress * dN)[d]);
          for (unsigned int j = 0; j < n_nodes; ++j) {
            const Vector dM = u.shape_grad(order_u[j], q);
            for (unsigned int e = 0; e < dim; ++e) {
              double entry = mu * (dN[e] * dM[d] + (d == e ? dN * dM : 0.)) - 2. * mu / 3. * dN[d] * dM[e];
              entry += bulk * seen_shape[i * dim + d][q] * seen_shape[j * dim + e][q];
              matrix(row, dof_u[j * dim + e]) +=
                  w *
                  (s * entry + (d == e ? level.acceleration * rho * N * u.shape_value(order_u[j], q) : 0.));
            }
          }
          for (unsigned int j = 0; j < n_p; ++j) {
            const double M = p.shape_value(order_p[j], q);
            matrix(row, dof_p[j]) -= w * s * alpha * M * dN[d];
            matrix(dof_p[j], row) +=
                w * scale *
                (alpha * level.velocity * M * dN[d] +
                 inertia * kappa * rho_f * level.acceleration * N * p.shape_grad(order_p[j], q)[d]);
          }
        }
      }
      for (unsigned int i = 0; i < n_p; ++i) {
        residual(dof_p[i]) +=
            w * scale * (flux * p.shape_grad(order_p[i], q) - filling * p.shape_value(order_p[i], q));
        for (unsigned int j = 0; j < n_p; ++j)
          matrix(dof_p[i], dof_p[j]) +=
              w * scale *
              (level.pressure_rate * storage * p.shape_value(order_p[i], q) * p.shape_value(order_p[j], q) +
               s * kappa * p.shape_grad(order_p[i], q) * p.shape_grad(order_p[j], q));
      }
    }
  }
}

template <int dim>
void compare(const std::string &element, const bool projects, const bool inertia)
{
  const Problem<dim> problem(element, projects);
  const Space<dim> &space = problem.space;
  const TimeLevel level = some_level(inertia);
  const auto n = space.n_unknowns();
  dealii::Vector<double> expected(n);
  dealii::FullMatrix<double> expected_matrix(n, n);
  integrate(problem, level, expected, expected_matrix);

  dealii::BlockDynamicSparsityPattern pattern(space.owned());
  for (dealii::types::global_dof_index i = 0; i < n; ++i)
    for (dealii::types::global_dof_index j = 0; j < n; ++j)
      pattern.add(i, j);
  BlockMatrix matrix;
  matrix.reinit(space.owned(), pattern, comm);
  BlockVector residual(space.owned(), comm);
  dealii::AffineConstraints<double> free;
  free.close();
  GrossResidual gross{};
  UpSystem system{free, residual, gross};
  system.matrix = &matrix;
  const auto form = UpForm<dim>::make(space, projects);
  form->assemble(problem.body, level, problem.state, problem.loads, 0., system);
  residual.compress(dealii::VectorOperation::add);
  matrix.compress(dealii::VectorOperation::add);

  // By blocks, whose entries have different units: the largest difference over the largest entry.
  const auto first = space.first_pressure();
  double largest[4] = {}, difference[4] = {}, largest_r[2] = {}, difference_r[2] = {};
  for (dealii::types::global_dof_index i = 0; i < n; ++i) {
    const unsigned int b = i >= first;
    largest_r[b] = std::max(largest_r[b], std::abs(expected(i)));
    difference_r[b] = std::max(difference_r[b], std::abs(expected(i) - residual(i)));
    for (dealii::types::global_dof_index j = 0; j < n; ++j) {
      const unsigned int c = 2 * b + (j >= first);
      largest[c] = std::max(largest[c], std::abs(expected_matrix(i, j)));
      difference[c] = std::max(difference[c], std::abs(expected_matrix(i, j) - matrix.el(i, j)));
    }
  }
  for (unsigned int b = 0; b < 2; ++b)
    BOOST_TEST(difference_r[b] < 1e-12 * largest_r[b],
               dim << "-D " << element << " residual " << b << ": " << difference_r[b] / largest_r[b]);
  for (unsigned int c = 0; c < 4; ++c)
    BOOST_TEST(difference[c] < 1e-12 * largest[c],
               dim << "-D " << element << " matrix " << c << ": " << difference[c] / largest[c]);
}
} // namespace

BOOST_AUTO_TEST_CASE(against_fe_values)
{
  Directory directory;
  for (const bool projects : {false, true})
    for (const bool inertia : {false, true}) {
      compare<2>("taylor-hood", projects, inertia);
      compare<2>("q1", projects, inertia);
      compare<3>("taylor-hood", projects, inertia);
      compare<3>("q1", projects, inertia);
    }
}

/// The tangent is the derivative of the residual, under finite strain and with the velocities of points, too.
BOOST_AUTO_TEST_CASE(tangent_of_points)
{
  Directory directory;
  for (const std::string law : {"hencky", "neo-hookean"}) {
    World<2> world(World<2>::make_case(scene_text<2>(2, law, "")));
    Space<2> space(world.grid, Nodes::gimp);
    Body<2> &body = *world.scene.bodies.front();
    std::vector<CellId> cells;
    for (const Slice &slice : body.slices())
      cells.push_back(slice.cell);
    space.distribute(cells, cells);
    for (const std::uint32_t handle : body.handles()) {
      const Field<2> field = at_start<2>(body.position(handle));
      double *row = body.row(handle);
      for (unsigned int d = 0; d < 2; ++d)
        row[body.layout().velocity + d] = field.velocity[d];
      row[body.layout().pressure] = field.pressure;
    }
    const TimeLevel level = some_level(true);
    const auto form = UpForm<2>::make(space, true);
    const auto n = space.n_unknowns(), first = space.first_pressure();
    dealii::AffineConstraints<double> free;
    free.close();
    dealii::BlockDynamicSparsityPattern pattern(space.owned());
    for (dealii::types::global_dof_index i = 0; i < n; ++i)
      for (dealii::types::global_dof_index j = 0; j < n; ++j)
        pattern.add(i, j);
    BlockMatrix matrix;
    matrix.reinit(space.owned(), pattern, comm);
    BlockVector at(space.owned(), comm), direction(space.owned(), comm), image(space.owned(), comm);
    for (dealii::types::global_dof_index i = 0; i < n; ++i) {
      at(i) = (i < first ? 0.01 : 1e4) * std::sin(78.233 * (i + 1));
      direction(i) = (i < first ? 0.01 : 1e4) * std::sin(12.9898 * (i + 1));
    }
    StepState state;
    for (BlockVector *vector : {&state.unknown, &state.rate_history, &state.second_history})
      vector->reinit(space.owned(), space.relevant(), comm);
    GrossResidual gross{};
    const auto residual_at = [&](const double step, BlockMatrix *into) {
      BlockVector moved = at, residual(space.owned(), comm);
      moved.add(step, direction);
      state.unknown = moved;
      UpSystem system{free, residual, gross};
      system.matrix = into;
      form->assemble(body, level, state, VolumeLoads<2>(), 0., system);
      residual.compress(dealii::VectorOperation::add);
      return residual;
    };
    residual_at(0., &matrix);
    matrix.compress(dealii::VectorOperation::add);
    matrix.vmult(image, direction);
    // Central differences: second order in the step, here 1e-8 beside round-off of 1e-11.
    constexpr double step = 1e-4;
    BlockVector difference = residual_at(step, nullptr);
    difference -= residual_at(-step, nullptr);
    difference *= -0.5 / step;
    for (unsigned int b = 0; b < 2; ++b) {
      const double scale = image.block(b).l2_norm();
      difference.block(b) -= image.block(b);
      BOOST_TEST(difference.block(b).l2_norm() < 1e-6 * scale,
                 law << ", block " << b << ": " << difference.block(b).l2_norm() / scale);
    }
  }
}
