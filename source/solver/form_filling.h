#pragma once

#include <peat/points/body.h>

#include <deal.II/base/mpi.h>

#include <algorithm>
#include <array>
#include <vector>

// How much material is in a cell, where domains of points reach over its faces.

namespace peat {
namespace detail {
/// Shares of a point's domain in the cell of its centre and the two beside it, in a direction. What lies
/// outside the mesh does not count.
template <int dim>
std::array<double, 3> domain_shares(const Grid<dim> &grid, const int i, const unsigned int d, const double x,
                                    const double extent)
{
  const auto &planes = grid.planes(d);
  std::array<double, 3> shares{0., 1., 0.};
  double sum = 0.;
  for (int k = 0; k < 3; ++k) {
    const int cell = i + k - 1;
    if (cell < 0 || cell >= grid.n_cells(d))
      continue;
    shares[k] =
        std::max(0., std::min(x + extent, planes[cell + 1]) - std::max(x - extent, planes[cell])) / extent;
    sum += shares[k];
  }
  for (double &share : shares)
    share /= sum;
  return shares;
}
} // namespace detail

/// For each cell with points of a body of wide domains: the volume of all its domains in the cell over that
/// of the points whose centres lie there. Collective.
///
/// The pressure is a Q1 function of cells, and points bring their volumes to the cell of their centre. Where
/// the lattice of points is not that of the mesh, cells have by turns a point more or less than fits in; as
/// conductances in a row they would let through the harmonic mean, which is always less.
template <int dim>
std::vector<double> filling(const Grid<dim> &grid, const Body<dim> &body)
{
  const Layout &layout = body.layout();
  constexpr unsigned int n_cells = dim == 2 ? 9 : 27;
  std::vector<double> filled(grid.n_local_cells(), 0.), centred(grid.n_local_cells(), 0.);
  for (const Slice &slice : body.slices()) {
    const auto home = grid.lattice(slice.cell);
    for (std::uint32_t p = slice.begin; p < slice.end; ++p) {
      const std::uint32_t handle = body.handles()[p];
      const double *row = body.row(handle);
      std::array<std::array<double, 3>, dim> shares;
      for (unsigned int d = 0; d < dim; ++d)
        shares[d] = detail::domain_shares(grid, home[d], d, body.position(handle)[d], row[layout.extent + d]);
      centred[slice.cell] += row[layout.volume];
      for (unsigned int c = 0; c < n_cells; ++c) {
        auto lattice = home;
        double volume = row[layout.volume];
        for (unsigned int d = 0, rest = c; d < dim; ++d, rest /= 3) {
          volume *= shares[d][rest % 3];
          lattice[d] += int(rest % 3) - 1;
        }
        if (volume > 0.)
          if (const CellId cell = grid.cell_at(lattice); cell != no_index)
            filled[cell] += volume;
      }
    }
  }
  // What reaches into cells of other ranks.
  if (dealii::Utilities::MPI::n_mpi_processes(grid.communicator()) > 1) {
    std::vector<double> abroad;
    for (CellId cell = 0; cell < grid.n_local_cells(); ++cell)
      if (filled[cell] > 0. && !grid.is_owned(cell)) {
        for (unsigned int d = 0; d < dim; ++d)
          abroad.push_back(grid.lattice(cell)[d]);
        abroad.push_back(filled[cell]);
      }
    const auto of_ranks = dealii::Utilities::MPI::all_gather(grid.communicator(), abroad);
    const unsigned int me = dealii::Utilities::MPI::this_mpi_process(grid.communicator());
    for (unsigned int rank = 0; rank < of_ranks.size(); ++rank)
      for (std::size_t i = 0; rank != me && i < of_ranks[rank].size(); i += dim + 1) {
        typename Grid<dim>::Lattice lattice;
        for (unsigned int d = 0; d < dim; ++d)
          lattice[d] = int(of_ranks[rank][i + d]);
        const CellId cell = grid.cell_at(lattice);
        if (cell != no_index && grid.is_owned(cell))
          filled[cell] += of_ranks[rank][i + dim];
      }
  }
  for (CellId cell = 0; cell < grid.n_local_cells(); ++cell)
    filled[cell] = centred[cell] > 0. ? filled[cell] / centred[cell] : 1.;
  return filled;
}
} // namespace peat
