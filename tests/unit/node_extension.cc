#define BOOST_TEST_MODULE node_extension
#include <boost/test/unit_test.hpp>

#include <peat/solver/node_extension.h>

#include <deal.II/base/mpi.h>

#include <cmath>
#include <functional>

#include "mpi_fixture.h"
#include "section.h"

// Nodes with next to no material follow the line through those behind them: a change of shape functions that
// keeps their sum, linear fields, power and momentum. Also to be run with mpirun -np 2 and 3.

using namespace peat;

namespace {
BOOST_GLOBAL_FIXTURE(Mpi);

/// The same on every rank, by where the node is.
template <int dim>
double some(const dealii::Point<dim> &x, const unsigned int what)
{
  double sum = 1. + what;
  for (unsigned int d = 0; d < dim; ++d)
    sum = 7.3 * sum + x[d];
  return std::sin(sum);
}

template <int dim>
double linear(const dealii::Point<dim> &x, const unsigned int component)
{
  double sum = 0.3 + component;
  for (unsigned int d = 0; d < dim; ++d)
    sum += (1. + 0.4 * d - 0.9 * component) * x[d];
  return sum;
}

/// A block of points, two along each edge of a cell, that have passed faces of a graded mesh by `ahead` [cell
/// sizes].
template <int dim>
struct Block
{
  static constexpr unsigned int mass = 0, momentum = 1, force = 1 + dim, resistance = 1 + 2 * dim,
                                n_columns = 2 + 2 * dim;
  Grid<dim> grid;
  ActiveNodes<dim> nodes;
  std::vector<double> sums;
  std::vector<char> given;
  NodeExtension<dim> extension;

  Block(const double ahead, const MPI_Comm comm, const int given_layer = -1)
      : grid(from_text("set Lower corner = 0, 0" + std::string(dim == 3 ? ", 0" : "") +
                           "\nset Upper corner = 5, 4" + (dim == 3 ? ", 4" : "") + "\nset Cells = 5, 4" +
                           (dim == 3 ? ", 4" : "") + "\nset Grading = 2, 0.5" + (dim == 3 ? ", 1" : ""),
                       [](const Section &section) { return GridParameters<dim>(section); }),
             comm),
        nodes(grid, 2)
  {
    const auto is_occupied = [&](const CellId cell) {
      for (unsigned int d = 0; d < dim; ++d)
        if (grid.lattice(cell)[d] >= 2 + (ahead > 0.))
          return false;
      return true;
    };
    std::vector<CellId> cells;
    for (CellId cell = 0; cell < grid.n_local_cells(); ++cell)
      if (grid.is_owned(cell) && is_occupied(cell))
        cells.push_back(cell);
    nodes.rebuild(cells);
    nodes.rebuild(cells, with_neighbours(grid, nodes.exchanged_nodes()));
    sums.assign(nodes.size() * std::size_t(n_columns), 0.);
    for (const CellId cell : cells)
      add_points(cell, ahead);
    nodes.sum_over_ranks(sums.data(), n_columns);
    given.assign(nodes.size() * std::size_t(dim), 0);
    for (unsigned int i = 0; i < nodes.size(); ++i)
      given[i * dim + 1] = grid.node_lattice(nodes.grid_node(i))[1] == given_layer;
    for (unsigned int i = 0; i < nodes.size(); ++i)
      for (unsigned int d = 0; d < dim; ++d) {
        double *row = &sums[i * std::size_t(n_columns)];
        row[momentum + d] = row[mass] * linear(nodes.position(i), d);
        row[force + d] = some(nodes.position(i), d);
      }
    extension.reinit(nodes, given);
    extension.find(sums.data(), n_columns, resistance);
  }

  /// Points at (i/2 + ahead) cells from the mesh's corner, in the first two cells and what lies beyond.
  void add_points(const CellId cell, const double ahead)
  {
    for (unsigned int p = 0; p < (1u << dim); ++p) {
      double xi[3] = {}, m = grid.volume(cell) / (1u << dim);
      bool is_there = true;
      for (unsigned int d = 0; d < dim; ++d) {
        const double offset = 0.5 * (p >> d & 1);
        xi[d] = offset + (ahead > 0. ? ahead : 0.25);
        is_there = is_there && (grid.lattice(cell)[d] < 2 || offset == 0.);
      }
      for (unsigned int v = 0; v < (1u << dim) && is_there; ++v) {
        double weight = 1.;
        for (unsigned int d = 0; d < dim; ++d)
          weight *= v >> d & 1 ? xi[d] : 1. - xi[d];
        double *row = &sums[nodes.cell_nodes(cell)[nodes.own_node(v)] * std::size_t(n_columns)];
        row[mass] += weight * m;
        row[resistance] += 30. * weight * m;
      }
    }
  }

  double total(const std::function<double(unsigned int)> &value) const
  {
    double sum = 0.;
    for (unsigned int i = 0; i < nodes.size(); ++i)
      if (nodes.is_owned(i))
        sum += value(i);
    return dealii::Utilities::MPI::sum(sum, grid.communicator());
  }

  double total(const std::vector<double> &rows, const unsigned int column) const
  {
    return total([&](const unsigned int i) { return rows[i * std::size_t(n_columns) + column]; });
  }

  void fold(std::vector<double> &rows) const
  {
    extension.fold_momentum(rows.data(), n_columns, momentum);
    extension.fold(rows.data(), n_columns, mass, 1);
    extension.fold(rows.data(), n_columns, force, n_columns - force);
  }

  std::vector<double> field(double (*value)(const dealii::Point<dim> &, unsigned int)) const
  {
    std::vector<double> result;
    for (unsigned int i = 0; i < nodes.size(); ++i)
      for (unsigned int d = 0; d < dim; ++d)
        result.push_back(value(nodes.position(i), d));
    return result;
  }

  bool has_material(const unsigned int i) const { return sums[i * std::size_t(n_columns)] > 0.; }
};

template <int dim>
void check_what_is_kept()
{
  const Block<dim> block(1e-3, MPI_COMM_WORLD);
  constexpr unsigned int n = Block<dim>::n_columns;
  BOOST_TEST(!block.extension.is_empty());
  std::vector<double> folded = block.sums;
  block.fold(folded);
  double least_share = 1.;
  for (unsigned int i = 0; i < block.nodes.size(); ++i)
    if (block.has_material(i))
      least_share = std::min(least_share, folded[i * n] / block.sums[i * n]);
  // Small nodes keep next to nothing, and none gives more than it has.
  least_share = dealii::Utilities::MPI::min(least_share, MPI_COMM_WORLD);
  BOOST_TEST(least_share > 0.);
  BOOST_TEST(least_share < 0.1);

  // Sums of values of order one over fewer than 200 nodes.
  constexpr double round_off = 1e-12;
  for (unsigned int column = 0; column < n; ++column)
    BOOST_TEST(std::abs(block.total(folded, column) - block.total(block.sums, column)) < round_off);

  // Where the points' velocities are linear, so are what moves and what points see of it.
  std::vector<double> seen = block.field(&linear<dim>);
  block.extension.unfold(seen.data(), dim);
  for (unsigned int i = 0; i < block.nodes.size(); ++i)
    for (unsigned int d = 0; d < dim && block.has_material(i); ++d) {
      const double expected = linear(block.nodes.position(i), d);
      BOOST_TEST(std::abs(seen[i * dim + d] - expected) < round_off);
      // A node of little mass has the round-off of its neighbours' momentum.
      const double m = folded[i * n];
      BOOST_TEST(std::abs(folded[i * n + Block<dim>::momentum + d] - m * expected) < round_off);
    }

  // The power of the points' forces on what they see is that of the folded forces on what moves.
  const std::vector<double> moves = block.field(&some<dim>);
  seen = moves;
  block.extension.unfold(seen.data(), dim);
  const auto power = [&](const std::vector<double> &rows, const std::vector<double> &velocity) {
    return block.total([&](const unsigned int i) {
      double sum = 0.;
      for (unsigned int d = 0; d < dim; ++d)
        sum += rows[i * n + Block<dim>::force + d] * velocity[i * dim + d];
      return sum;
    });
  };
  const double change = dealii::Utilities::MPI::max(seen != moves ? 1. : 0., MPI_COMM_WORLD);
  BOOST_TEST(change == 1.);
  BOOST_TEST(std::abs(power(block.sums, seen) - power(folded, moves)) < round_off);
}

template <int dim>
void check_partition()
{
  const Block<dim> block(0.02, MPI_COMM_WORLD), alone(0.02, MPI_COMM_SELF);
  std::vector<double> folded = block.sums, expected = alone.sums;
  block.fold(folded);
  alone.fold(expected);
  std::vector<double> seen = block.field(&some<dim>), seen_alone = alone.field(&some<dim>);
  block.extension.unfold(seen.data(), dim);
  alone.extension.unfold(seen_alone.data(), dim);
  for (unsigned int i = 0; i < block.nodes.size(); ++i) {
    const auto lattice = block.grid.node_lattice(block.nodes.grid_node(i));
    const std::uint32_t j = alone.nodes.index_of(alone.grid.node_at(lattice));
    if (j == no_index)
      continue;
    for (unsigned int c = 0; c < Block<dim>::n_columns; ++c)
      BOOST_TEST(std::abs(folded[i * Block<dim>::n_columns + c] - expected[j * Block<dim>::n_columns + c]) <
                 1e-13);
    for (unsigned int d = 0; d < dim; ++d)
      BOOST_TEST(std::abs(seen[i * dim + d] - seen_alone[j * dim + d]) < 1e-13);
  }
}

template <int dim>
void check_given()
{
  // The uppermost layer of nodes has next to no material, and its motion along y is prescribed.
  const Block<dim> block(1e-3, MPI_COMM_WORLD, 3);
  std::vector<double> seen = block.field(&some<dim>);
  for (unsigned int i = 0; i < block.nodes.size(); ++i)
    if (block.given[i * dim + 1])
      seen[i * dim + 1] = 0.;
  block.extension.unfold(seen.data(), dim);
  for (unsigned int i = 0; i < block.nodes.size(); ++i)
    if (block.given[i * dim + 1])
      BOOST_TEST(seen[i * dim + 1] == 0.);
}

template <int dim>
void check_full_cells()
{
  const Block<dim> block(0., MPI_COMM_WORLD);
  BOOST_TEST(block.extension.is_empty());
  std::vector<double> folded = block.sums, seen = block.field(&some<dim>);
  block.fold(folded);
  block.extension.unfold(seen.data(), dim);
  BOOST_TEST(folded == block.sums);
  BOOST_TEST(seen == block.field(&some<dim>));
}
} // namespace

BOOST_AUTO_TEST_CASE(sums_linear_fields_and_power_are_kept)
{
  check_what_is_kept<2>();
  check_what_is_kept<3>();
}

BOOST_AUTO_TEST_CASE(the_partition_does_not_matter)
{
  check_partition<2>();
  check_partition<3>();
}

BOOST_AUTO_TEST_CASE(what_is_prescribed_stays_so)
{
  check_given<2>();
  check_given<3>();
}

BOOST_AUTO_TEST_CASE(full_cells_are_left_alone)
{
  check_full_cells<2>();
  check_full_cells<3>();
}
