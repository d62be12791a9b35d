#pragma once

#include <peat/grid/grid.h>
#include <peat/transfer/weights.h>

namespace peat {
/// The shape functions of a cell at a place within it (one outside counts as the nearest inside), x fastest.
template <int dim, unsigned int reach>
void shape_functions(const Grid<dim> &grid, const CellId cell, const dealii::Point<dim> &x, double *N)
{
  std::array<DirectionWeights<reach>, dim> w;
  for (unsigned int d = 0; d < dim; ++d) {
    const double inside =
        std::min(std::max(x[d], grid.lower(cell, d)), grid.lower(cell, d) + grid.size(cell, d));
    evaluate_direction(broadcast(inside), Lanes{}, CellInterval::of(grid, cell, d), w[d]);
  }
  constexpr unsigned int n = dim == 2 ? reach * reach : reach * reach * reach;
  for (unsigned int i = 0; i < n; ++i) {
    N[i] = 1.;
    for (unsigned int d = 0, rest = i; d < dim; ++d, rest /= reach)
      N[i] *= w[d].value[rest % reach][0];
  }
}
} // namespace peat
