#pragma once

#include <peat/grid/active_nodes.h>

#include <array>
#include <vector>

namespace peat {
/// What moves in the place of nodes that hold next to no material, with linear shape functions.
///
/// A point that has just passed a face of cells has a finite gradient of the shape function of the node
/// beyond, and next to none of its value: that node's acceleration and flux have no bound, and no step is
/// short enough for them. So the less material such a node a has, the less of its own motion counts, and the
/// more that of the straight line through the two nodes behind it, b and c (theory.md, equation 27a):
///
///   v_a <- s v_a + (1 - s) ((1 + e) v_b - e v_c),   s = m_a / (0.35 m_b) < 1
///
/// with e = h_ab / h_bc, or less where c has hardly more material than a. This is a change of shape
/// functions: N_a becomes s N_a, and b and c get the rest. What points bring to nodes follows the transposed
/// rule. Their sum is still one, what is linear in place stays so, power and momentum are kept.
///
/// What a, b, c are is looked for in each step, since it follows the points' motion without a jump. Nodes
/// behind may be small themselves (at corners); so there are levels, at most one for each direction. All
/// functions are collective.
template <int dim>
class NodeExtension
{
public:
  /// The nodes have new numbers.
  /// @param given by node and component, dim columns: the motion is prescribed there. A node on a wall
  ///        follows nodes on that wall only; which its flux need not, since what is so far from a wall is not
  ///        closed by it.
  void reinit(const ActiveNodes<dim> &nodes, const std::vector<char> &given);
  /// Find small nodes and those behind them.
  /// @param sums as the points bring them: rows with `stride` columns, the first of which is the mass; column
  ///        `resistance` that of the flux, if >= 0
  void find(const double *sums, unsigned int stride, int resistance);
  /// Whether no rank has any.
  bool is_empty() const { return n_levels == 0; }

  /// Of the points' contributions to nodes make those to what moves: rows with `stride` columns, of which n
  /// from `first` on. A linear form of the nodes' motion: forces, masses, areas.
  void fold(double *data, unsigned int stride, unsigned int first, unsigned int n) const;
  /// Momentum, dim columns from `first` on: velocities of b and c that are those of a linear field stay so.
  void fold_momentum(double *data, unsigned int stride, unsigned int first) const;
  /// Areas that a surface has at the nodes, one column: not taken from nodes farther behind.
  void fold_areas(double *data) const;
  /// From what moves, the motion of the nodes as the points see it; n columns.
  void unfold(double *data, unsigned int n) const;
  /// From what unit forces on what moves do, about what they do on nodes; n columns.
  void unfold_compliance(double *data, unsigned int n) const;

private:
  /// Node a and two behind it.
  struct Line
  {
    std::array<std::uint32_t, 3> node; ///< the last may be no_index
    double share;                      ///< 1 - s, or its part where several nodes behind weigh the same
    double slope;                      ///< e
    std::array<double, 3> mass;        ///< of the nodes, with what higher levels have brought [kg]
  };
  struct Candidate
  {
    std::uint32_t node;
    std::array<std::uint32_t, 2 * dim> behind, beyond; ///< by direction; no_index: not that way
    std::array<double, 2 * dim> ratio; ///< of the first cell's size on that way to the second's
    std::array<char, 2 * dim> mine;    ///< this rank has the first cell on that way, and adds up for all
  };

  void sort_into_levels(const std::vector<Line> &lines);
  /// Add to data what action(line, delta) finds from it; delta has n columns for each of the three nodes.
  template <typename Action>
  void at_level(unsigned int level, double *data, unsigned int stride, unsigned int first, unsigned int n,
                const Action &action) const;

  const ActiveNodes<dim> *active = nullptr;
  bool parallel = false;
  std::vector<Candidate> candidates;
  std::array<std::vector<Line>, dim> levels; ///< those of the first have nodes behind that are not small
  unsigned int n_levels = 0;                 ///< that any rank has
  // Of a step, here to keep their memory.
  std::vector<Line> found;
  std::vector<double> mass, level_of, next_level; ///< by node
  mutable std::vector<double> deltas, nodal;
};
} // namespace peat
