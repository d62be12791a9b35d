#include "triangle_tree.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace peat {
namespace {
using Place = TriangleTree::Place;

struct NearestOfTriangle
{
  Place point;
  unsigned int part;
};

/// By the regions of a triangle's plane in which its corners, edges and face are nearest: C. Ericson,
/// Real-Time Collision Detection (2005), section 5.1.5.
NearestOfTriangle nearest_of(const Place &a, const Place &b, const Place &c, const Place &x)
{
  const auto ab = b - a, ac = c - a, ax = x - a;
  const double d1 = ab * ax, d2 = ac * ax;
  if (d1 <= 0. && d2 <= 0.)
    return {a, 0};
  const auto bx = x - b;
  const double d3 = ab * bx, d4 = ac * bx;
  if (d3 >= 0. && d4 <= d3)
    return {b, 1};
  const double beyond_ab = d1 * d4 - d3 * d2;
  if (beyond_ab <= 0. && d1 >= 0. && d3 <= 0.)
    return {a + d1 / (d1 - d3) * ab, 3};
  const auto cx = x - c;
  const double d5 = ab * cx, d6 = ac * cx;
  if (d6 >= 0. && d5 <= d6)
    return {c, 2};
  const double beyond_ca = d5 * d2 - d1 * d6;
  if (beyond_ca <= 0. && d2 >= 0. && d6 <= 0.)
    return {a + d2 / (d2 - d6) * ac, 5};
  const double beyond_bc = d3 * d6 - d5 * d4;
  if (beyond_bc <= 0. && d4 - d3 >= 0. && d5 - d6 >= 0.)
    return {b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b), 4};
  const double sum = beyond_ab + beyond_bc + beyond_ca;
  return {a + beyond_ca / sum * ab + beyond_ab / sum * ac, 6};
}

double distance_square(const Place &lower, const Place &upper, const Place &x)
{
  double result = 0.;
  for (unsigned int d = 0; d < 3; ++d) {
    const double beyond = std::max({0., lower[d] - x[d], x[d] - upper[d]});
    result += beyond * beyond;
  }
  return result;
}
} // namespace

TriangleTree::TriangleTree(const std::vector<Place> &vertices, const std::vector<Triangle> &triangles)
    : vertices(vertices), triangles(triangles), order(triangles.size())
{
  std::iota(order.begin(), order.end(), 0u);
  nodes.reserve(triangles.size());
  build(0, order.size());
}

std::uint32_t TriangleTree::build(const std::uint32_t begin, const std::uint32_t end)
{
  constexpr std::uint32_t n_in_leaf = 4;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Node node{Place(infinity, infinity, infinity), Place(-infinity, -infinity, -infinity), begin, end, 0};
  for (std::uint32_t i = begin; i < end; ++i)
    for (const unsigned int v : triangles[order[i]])
      for (unsigned int d = 0; d < 3; ++d) {
        node.lower[d] = std::min(node.lower[d], vertices[v][d]);
        node.upper[d] = std::max(node.upper[d], vertices[v][d]);
      }
  const std::uint32_t index = nodes.size();
  nodes.push_back(node);
  if (end - begin <= n_in_leaf)
    return index;

  unsigned int longest = 0;
  for (unsigned int d = 1; d < 3; ++d)
    if (node.upper[d] - node.lower[d] > node.upper[longest] - node.lower[longest])
      longest = d;
  const auto middle = [&](const std::uint32_t t) {
    return vertices[triangles[t][0]][longest] + vertices[triangles[t][1]][longest] +
           vertices[triangles[t][2]][longest];
  };
  const std::uint32_t half = begin + (end - begin) / 2;
  std::nth_element(order.begin() + begin, order.begin() + half, order.begin() + end,
                   [&](const std::uint32_t a, const std::uint32_t b) { return middle(a) < middle(b); });
  build(begin, half);
  nodes[index].second = build(half, end);
  return index;
}

TriangleTree::Nearest TriangleTree::nearest(const Place &x) const
{
  Nearest best{Place(), std::numeric_limits<double>::infinity(), 0, 0};
  search(0, x, best);
  return best;
}

void TriangleTree::search(const std::uint32_t index, const Place &x, Nearest &best) const
{
  const Node &node = nodes[index];
  if (node.second == 0) {
    for (std::uint32_t i = node.begin; i < node.end; ++i) {
      const Triangle &t = triangles[order[i]];
      const NearestOfTriangle found = nearest_of(vertices[t[0]], vertices[t[1]], vertices[t[2]], x);
      const double square = (found.point - x).norm_square();
      if (square < best.distance_square)
        best = {found.point, square, order[i], found.part};
    }
    return;
  }
  std::uint32_t near = index + 1, far = node.second;
  double near_square = distance_square(nodes[near].lower, nodes[near].upper, x),
         far_square = distance_square(nodes[far].lower, nodes[far].upper, x);
  if (far_square < near_square) {
    std::swap(near, far);
    std::swap(near_square, far_square);
  }
  if (near_square < best.distance_square)
    search(near, x, best);
  if (far_square < best.distance_square)
    search(far, x, best);
}
} // namespace peat
