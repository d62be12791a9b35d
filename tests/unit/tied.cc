#define BOOST_TEST_MODULE tied
#include <boost/test/unit_test.hpp>

#include <peat/condition/condition.h>

#include <deal.II/base/mpi.h>

#include <random>

#include "mpi_fixture.h"
#include "section.h"

// What nodes that are tied make of velocities: one value in the tied components, with their momentum, and
// nothing elsewhere. Also to be run with mpirun -np 2 and 3.

using namespace peat;

namespace {
BOOST_GLOBAL_FIXTURE(Mpi);

const MPI_Comm comm = MPI_COMM_WORLD;

template <int dim>
dealii::Tensor<1, dim> momentum(const ActiveNodes<dim> &nodes, const NodalFields<dim> &fields,
                                const std::vector<double> &motion)
{
  dealii::Tensor<1, dim> sum;
  for (unsigned int i = 0; i < nodes.size(); ++i)
    if (nodes.is_owned(i))
      for (unsigned int d = 0; d < dim; ++d)
        sum[d] += fields.mass(i) * motion[i * dim + d];
  return dealii::Utilities::MPI::sum(sum, comm);
}

/// `held`: whether a place is tied; in the last direction.
template <int dim, typename Held>
void check(const std::string &lines, const Held &held)
{
  const std::string corner = dim == 2 ? "4, 3" : "4, 3, 2";
  const auto parameters = from_text("set Lower corner = 0, 0" + std::string(dim == 3 ? ", 0" : "") +
                                        "\nset Upper corner = " + corner + "\nset Cells = " + corner,
                                    [](const Section &section) { return GridParameters<dim>(section); });
  const Grid<dim> grid(parameters, comm);
  ActiveNodes<dim> nodes(grid, 2);
  std::vector<CellId> cells;
  for (CellId cell = 0; cell < grid.n_local_cells(); ++cell)
    if (grid.is_owned(cell))
      cells.push_back(cell);
  nodes.rebuild(cells);

  // The same on every rank, by where the node is.
  const auto some = [&](const unsigned int node, const unsigned int what) {
    double x = 1. + what;
    for (unsigned int d = 0; d < dim; ++d)
      x = 7.3 * x + nodes.position(node)[d];
    return 1.5 + std::sin(x);
  };
  NodalFields<dim> fields;
  fields.n_sums = 1;
  std::vector<double> motion;
  for (unsigned int i = 0; i < nodes.size(); ++i) {
    fields.sums.push_back(some(i, dim));
    for (unsigned int d = 0; d < dim; ++d)
      motion.push_back(some(i, d));
  }
  const std::vector<double> before = motion;

  from_text(lines, [&](const Section &section) {
    const auto condition = make_condition<dim>(section, {});
    for (unsigned int d = 0; d < dim; ++d) {
      BOOST_TEST(condition->ties(d) == (d == dim - 1));
      BOOST_TEST(!condition->prescribes(2 * dim - 1, d));
    }
    condition->select(nodes);
    condition->tie(nodes, fields, motion);
    const std::vector<double> once = motion;
    condition->tie(nodes, fields, motion);
    for (std::size_t row = 0; row < motion.size(); ++row)
      BOOST_TEST(std::abs(motion[row] - once[row]) < 1e-14);
    return 0;
  });

  BOOST_TEST((momentum(nodes, fields, motion) - momentum(nodes, fields, before)).norm() < 1e-12);
  double common = -1e300;
  for (unsigned int i = 0; i < nodes.size(); ++i)
    if (held(nodes.position(i)))
      common = motion[i * dim + dim - 1];
  common = dealii::Utilities::MPI::max(common, comm);
  BOOST_TEST(common > 0.5);
  for (unsigned int i = 0; i < nodes.size(); ++i)
    for (unsigned int d = 0; d < dim; ++d) {
      const std::size_t row = i * dim + d;
      if (d == dim - 1 && held(nodes.position(i)))
        BOOST_TEST(std::abs(motion[row] - common) < 1e-14);
      else
        BOOST_TEST(motion[row] == before[row]);
    }
}
} // namespace

BOOST_AUTO_TEST_CASE(face)
{
  check<2>("set Where = top\nset Kind = tied\nset Components = y", [](const auto &x) { return x[1] == 3.; });
  check<3>("set Where = top\nset Kind = tied\nset Components = z", [](const auto &x) { return x[2] == 2.; });
}

BOOST_AUTO_TEST_CASE(faces_that_share_an_edge)
{
  check<2>("set Where = top, right\nset Kind = tied\nset Components = y",
           [](const auto &x) { return x[1] == 3. || x[0] == 4.; });
}

BOOST_AUTO_TEST_CASE(region)
{
  check<2>("set Where = region\nset Region = box(0.5, 1.5, 3.5, 2.5)\nset Kind = tied\nset Components = y",
           [](const auto &x) { return x[1] == 2. && x[0] > 0.5 && x[0] < 3.5; });
}
