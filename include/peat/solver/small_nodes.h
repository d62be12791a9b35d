#pragma once

#include <peat/solver/up_form.h>

#include <array>
#include <vector>

namespace peat {
/// Nodes of material points that see hardly any material: next to their own equations, which may leave them
/// anywhere, they are held to the straight line through the two nodes behind them (theory.md, section 10).
///
/// In the metric of the nodes' masses, so that what is small is held by little. The forces are those of the
/// motion in a step alone, and of none that is linear in place.
template <int dim>
class SmallNodes
{
public:
  explicit SmallNodes(const Space<dim> &space) : space(space) {}

  /// Find the nodes. `mass` [kg] has ghosts; `speed` is that of a wave in the skeleton [m/s].
  void survey(const dealii::TrilinosWrappers::MPI::Vector &mass, double speed);

  /// Displacements of nodes without any mass.
  const std::vector<typename Space<dim>::Index> &unused() const { return without_mass; }

  /// Call an action with the three unknowns of each line that assemble() may ever couple.
  template <typename Action>
  void for_each_line(const Action &action) const;

  void assemble(const TimeLevel &level, const StepState &state,
                const dealii::AffineConstraints<double> &constraints, BlockVector &residual,
                BlockMatrix *matrix) const;

private:
  using Index = typename Space<dim>::Index;
  /// A node and the two behind it: their unknowns of component 0, and sizes of the cells between them.
  struct Line
  {
    std::array<Index, 3> node;
    double near, far;
  };
  struct Link
  {
    Line line;
    double stiffness; ///< [N/m]
    double mass;      ///< [kg]
  };
  /// Lines whose middle node is this rank's.
  template <typename Action>
  void for_each_own_line(const Action &action) const;

  const Space<dim> &space;
  std::vector<Index> without_mass;
  std::vector<Link> links;
};

template <int dim>
template <typename Action>
void SmallNodes<dim>::for_each_own_line(const Action &action) const
{
  const Grid<dim> &grid = space.grid();
  for (const auto &middle : space.displacement_nodes()) {
    if (!space.owned()[0].is_element(middle.displacement[0]))
      continue;
    auto lattice = grid.locate(middle.position);
    for (unsigned int d = 0; d < dim; ++d)
      if (middle.position[d] >= grid.planes(d).back())
        lattice[d] = grid.n_cells(d);
    for (unsigned int d = 0; d < dim; ++d) {
      if (lattice[d] == 0 || lattice[d] == grid.n_cells(d))
        continue;
      auto below = lattice, above = lattice;
      --below[d];
      ++above[d];
      const NodeId first = grid.node_at(below), last = grid.node_at(above);
      if (first == no_index || last == no_index)
        continue;
      const auto *a = space.node_at(first), *b = space.node_at(last);
      if (!a || !b)
        continue;
      const double lower = middle.position[d] - a->position[d], upper = b->position[d] - middle.position[d];
      action(Line{{{a->displacement[0], middle.displacement[0], b->displacement[0]}}, lower, upper});
      action(Line{{{b->displacement[0], middle.displacement[0], a->displacement[0]}}, upper, lower});
    }
  }
}

template <int dim>
template <typename Action>
void SmallNodes<dim>::for_each_line(const Action &action) const
{
  for_each_own_line([&](const Line &line) { action(line.node); });
}
} // namespace peat
