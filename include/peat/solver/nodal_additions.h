#pragma once

#include <peat/grid/active_nodes.h>

namespace peat {
/// Vectors that are to be added at a few nodes. Whatever rank notes one, all ranks that know the node add the
/// same.
template <int dim>
class NodalAdditions
{
public:
  /// `nodes` must live as long as this.
  void reinit(const ActiveNodes<dim> &nodes)
  {
    active = &nodes;
    values.assign(nodes.size() * std::size_t(dim), 0.);
    noted.clear();
  }

  void note(const std::uint32_t node, const dealii::Tensor<1, dim> &value)
  {
    noted.push_back(node);
    for (unsigned int d = 0; d < dim; ++d)
      values[std::size_t(node) * dim + d] += value[d];
  }

  /// Call add(row, value) for each row (node * dim + component) with something to add, and forget it.
  /// Collective.
  template <typename Add>
  void add_up(const bool parallel, const Add &add)
  {
    const auto hand_over = [&](const std::size_t row) {
      if (values[row] != 0.)
        add(row, values[row]);
      values[row] = 0.;
    };
    if (parallel) {
      active->sum_over_ranks(values.data(), dim);
      for (std::size_t row = 0; row < values.size(); ++row)
        hand_over(row);
    } else
      for (const std::uint32_t node : noted)
        for (unsigned int d = 0; d < dim; ++d)
          hand_over(std::size_t(node) * dim + d);
    noted.clear();
  }

private:
  const ActiveNodes<dim> *active = nullptr;
  std::vector<double> values;
  std::vector<std::uint32_t> noted;
};
} // namespace peat
