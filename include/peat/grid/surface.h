#pragma once

#include <deal.II/base/point.h>
#include <deal.II/base/tensor.h>

#include <array>
#include <cstdint>
#include <vector>

namespace peat {
/// A piece of a body's surface: where it is, how large, and which nodes feel what acts on it.
template <int dim>
struct SurfacePoint
{
  static constexpr unsigned int n_nodes = 1 << dim;
  dealii::Point<dim> initial_position;
  dealii::Point<dim> position;
  dealii::Tensor<1, dim> area; ///< outward normal times area [m^(dim-1)]
  bool adjoins = false;        ///< another body lay behind it at the start: no load acts there
  std::array<std::uint32_t, n_nodes> node;
  std::array<double, n_nodes> N;
};

template <int dim>
using Surface = std::vector<SurfacePoint<dim>>;
} // namespace peat
