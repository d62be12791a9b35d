#pragma once

#include <deal.II/base/point.h>
#include <deal.II/base/tensor.h>

#include <array>
#include <cstdint>
#include <vector>

namespace peat {
/// Finds the nearest of many triangles: a binary tree of boxes.
class TriangleTree
{
public:
  using Place = dealii::Point<3>;
  using Triangle = std::array<unsigned int, 3>;

  /// Both must live as long as this.
  TriangleTree(const std::vector<Place> &vertices, const std::vector<Triangle> &triangles);

  /// The nearest point of the triangles.
  struct Nearest
  {
    Place point;
    double distance_square;
    unsigned int triangle;
    /// What of the triangle it lies on: corner 0, 1, 2; edge 3 + i from corner i to the next; 6: within.
    unsigned int part;
  };
  Nearest nearest(const Place &x) const;

private:
  struct Node
  {
    Place lower;
    Place upper;
    std::uint32_t begin; ///< of its triangles in `order`
    std::uint32_t end;
    std::uint32_t second; ///< second half; the first stands behind the node. 0: no halves
  };
  std::uint32_t build(std::uint32_t begin, std::uint32_t end);
  void search(std::uint32_t node, const Place &x, Nearest &best) const;

  const std::vector<Place> &vertices;
  const std::vector<Triangle> &triangles;
  std::vector<std::uint32_t> order;
  std::vector<Node> nodes;
};
} // namespace peat
