#pragma once

#include <peat/transfer/kernels.h>

// Points to nodes. The sums of a cell are kept in registers, one lane a node, while its points are visited
// one by one: with 4, 8, 16 or 64 nodes a cell this needs no reduction over lanes at the end.

namespace peat {
/// A register (or two, or four) of as many doubles.
template <unsigned int width>
struct NodeVector;
template <>
struct NodeVector<4>
{
  typedef double type __attribute__((vector_size(4 * sizeof(double))));
};
template <>
struct NodeVector<8>
{
  typedef double type __attribute__((vector_size(8 * sizeof(double))));
};

/// The nodes of a cell in chunks of as many as a register holds, x running fastest.
template <int dim, unsigned int reach>
struct NodeChunks
{
  static constexpr unsigned int n_nodes = dim == 2 ? reach * reach : reach * reach * reach;
  static constexpr unsigned int width = n_nodes < 8 ? n_nodes : 8;
  static constexpr unsigned int n = n_nodes / width;
  using Vector = typename NodeVector<width>::type;

  /// Whether a point's domain leaves out all nodes of a chunk: in 3-D a chunk is part of one layer of nodes.
  template <typename PointwiseWeights>
  static bool is_out_of_reach(const PointwiseWeights &w, const unsigned int point, const unsigned int chunk)
  {
    return dim == 3 && reach == 4 && w.value[dim - 1][point][chunk / 2] == 0.;
  }

  /// The weights of one direction, spread over the nodes of a chunk.
  static Vector spread(const double *w, const unsigned int direction, const unsigned int chunk)
  {
    if constexpr (width == 4) {
      return direction == 0 ? Vector{w[0], w[1], w[0], w[1]} : Vector{w[0], w[0], w[1], w[1]};
    } else if constexpr (reach == 2) {
      if (direction == 0)
        return Vector{w[0], w[1], w[0], w[1], w[0], w[1], w[0], w[1]};
      if (direction == 1)
        return Vector{w[0], w[0], w[1], w[1], w[0], w[0], w[1], w[1]};
      return Vector{w[0], w[0], w[0], w[0], w[1], w[1], w[1], w[1]};
    } else {
      if (direction == 0)
        return Vector{w[0], w[1], w[2], w[3], w[0], w[1], w[2], w[3]};
      const double *pair = direction == 1 ? w + (2 * chunk) % 4 : w + chunk / 2;
      const double a = pair[0], b = direction == 1 ? pair[1] : pair[0];
      return Vector{a, a, a, a, b, b, b, b};
    }
  }
};

/// The 1-D weights of eight points, stored so that those of one point can be read: [direction][point][node].
template <int dim, unsigned int reach>
struct PointwiseWeights
{
  alignas(64) double value[dim][n_lanes][reach];
  alignas(64) double slope[dim][n_lanes][reach];

  explicit PointwiseWeights(const Weights<dim, reach> &w)
  {
    for (unsigned int d = 0; d < dim; ++d)
      for (unsigned int k = 0; k < reach; ++k)
        for (unsigned int l = 0; l < n_lanes; ++l) {
          value[d][l][k] = w[d].value[k][l];
          slope[d][l][k] = w[d].slope[k][l];
        }
  }
};

/// Shape functions of one point at a chunk of nodes.
template <int dim, unsigned int reach>
struct ShapeAtNodes
{
  using Chunks = NodeChunks<dim, reach>;
  using Vector = typename Chunks::Vector;
  Vector N;
  std::array<Vector, dim> dN;

  ShapeAtNodes(const PointwiseWeights<dim, reach> &w, const unsigned int point, const unsigned int chunk)
  {
    std::array<Vector, dim> value;
    for (unsigned int d = 0; d < dim; ++d)
      value[d] = Chunks::spread(w.value[d][point], d, chunk);
    if constexpr (dim == 2) {
      N = value[0] * value[1];
      dN[0] = Chunks::spread(w.slope[0][point], 0, chunk) * value[1];
      dN[1] = Chunks::spread(w.slope[1][point], 1, chunk) * value[0];
    } else {
      const Vector xy = value[0] * value[1];
      N = xy * value[2];
      dN[0] = Chunks::spread(w.slope[0][point], 0, chunk) * (value[1] * value[2]);
      dN[1] = Chunks::spread(w.slope[1][point], 1, chunk) * (value[0] * value[2]);
      dN[2] = Chunks::spread(w.slope[2][point], 2, chunk) * xy;
    }
  }

  /// The values alone, where no gradient is needed.
  static Vector value(const PointwiseWeights<dim, reach> &w, const unsigned int point,
                      const unsigned int chunk)
  {
    Vector product =
        Chunks::spread(w.value[0][point], 0, chunk) * Chunks::spread(w.value[1][point], 1, chunk);
    if constexpr (dim == 3)
      product *= Chunks::spread(w.value[2][point], 2, chunk);
    return product;
  }
};

} // namespace peat
