#pragma once

#include <peat/transfer/kernels.h>

#include "scatter.h"

namespace peat {
/// The kernels for one combination of basis and phases.
template <int dim, unsigned int reach, bool saturated>
class PointKernels : public Kernels<dim>
{
public:
  void scatter(const Body<dim> &body, const ActiveNodes<dim> &nodes, const PressureUpdate &pressure,
               double *sums, const unsigned int stride, CellSums *cell_sums) const override;
  void advance_and_remap(Body<dim> &body, const ActiveNodes<dim> &nodes, const double *a, const double *v,
                         const char *spin_only, const VelocityUpdate &update,
                         double *momentum) const override;
  void deform(Body<dim> &body, const ActiveNodes<dim> &nodes, const double *v, const double *w,
              const char *spin_only, const double dt, const PressureUpdate &pressure,
              StepFindings &findings) const override;
  void advance_and_deform(Body<dim> &body, const ActiveNodes<dim> &nodes, const double *a, const double *v,
                          const double *w, const char *spin_only, const VelocityUpdate &update,
                          const PressureUpdate &pressure, StepFindings &findings) const override;

private:
  using Chunks = NodeChunks<dim, reach>;
  using NodeLanes = typename Chunks::Vector;
  static constexpr unsigned int n_stress = dim == 2 ? 4 : 6;

  /// Up to eight points of one cell. Lanes without a point repeat the last one.
  template <typename Row>
  struct Batch
  {
    unsigned int n;
    std::array<std::uint32_t, n_lanes> handle;
    std::array<Row *, n_lanes> row;

    Lanes load(const int column) const
    {
      return Lanes{row[0][column], row[1][column], row[2][column], row[3][column],
                   row[4][column], row[5][column], row[6][column], row[7][column]};
    }
    Lanes load_position(const Body<dim> &body, const unsigned int d) const
    {
      const auto x = [&](const unsigned int l) { return body.position(handle[l])[d]; };
      return Lanes{x(0), x(1), x(2), x(3), x(4), x(5), x(6), x(7)};
    }
    void store(const int column, const Lanes x) const
    {
      for (unsigned int l = 0; l < n; ++l)
        row[l][column] = x[l];
    }
  };

  template <typename BodyType, typename Row>
  static void collect(BodyType &body, const Slice &slice, const std::uint32_t begin, Batch<Row> &batch)
  {
    batch.n = std::min(n_lanes, slice.end - begin);
    for (unsigned int l = 0; l < n_lanes; ++l) {
      batch.handle[l] = body.handles()[begin + std::min(l, batch.n - 1)];
      batch.row[l] = body.row(batch.handle[l]);
    }
  }

  static std::array<CellInterval, dim> intervals(const ActiveNodes<dim> &nodes, const CellId cell)
  {
    std::array<CellInterval, dim> result;
    for (unsigned int d = 0; d < dim; ++d)
      result[d] = CellInterval::of(nodes.grid(), cell, d);
    return result;
  }

  template <typename Row>
  static void evaluate(const Body<dim> &body, const Batch<Row> &batch,
                       const std::array<CellInterval, dim> &cell, std::array<Lanes, dim> &x,
                       Weights<dim, reach> &w)
  {
    for (unsigned int d = 0; d < dim; ++d) {
      x[d] = batch.load_position(body, d);
      evaluate_direction(x[d], reach == 4 ? batch.load(body.layout().extent + d) : Lanes{}, cell[d], w[d]);
    }
  }

  /// Copy the nodal components of a cell's nodes: [component][node].
  template <unsigned int n_components = dim>
  static void gather(const double *field, const std::uint32_t *cell_nodes, double (*local)[Chunks::n_nodes])
  {
    for (unsigned int i = 0; i < Chunks::n_nodes; ++i)
      for (unsigned int c = 0; c < n_components; ++c)
        local[c][i] = field[std::size_t(cell_nodes[i]) * n_components + c];
  }

  /// The gradient that points bring to the nodes with their velocity: of the linear field that fits the
  /// nodes' best, by their weights N (theory.md, equation 25a). With Q1 that is the gradient of the shape
  /// functions.
  static void fit_gradient(const Weights<dim, reach> &weights, const std::array<Lanes, dim> &x,
                           const std::array<CellInterval, dim> &cell, const double (*v)[Chunks::n_nodes],
                           Lanes (*C)[dim])
  {
    Weights<dim, reach> fit = weights;
    if constexpr (reach == 4)
      for (unsigned int d = 0; d < dim; ++d) {
        const double lower = cell[d].lower, upper = lower + cell[d].size;
        const double plane[4] = {lower - cell[d].size_below, lower, upper, upper + cell[d].size_above};
        // The mean is not zero where the edge of the mesh cuts a domain.
        Lanes mean = {}, square = {};
        for (unsigned int k = 0; k < reach; ++k) {
          const Lanes distance = plane[k] - x[d];
          mean += weights[d].value[k] * distance;
          square += weights[d].value[k] * distance * distance;
        }
        const double least = 1e-30 * cell[d].size * cell[d].size;
        const Lanes inverse = 1. / max(square - mean * mean, broadcast(least));
        for (unsigned int k = 0; k < reach; ++k)
          fit[d].slope[k] = weights[d].value[k] * (plane[k] - x[d] - mean) * inverse;
      }
    for (unsigned int d = 0; d < dim; ++d) {
      Lanes value;
      interpolate<dim, reach>(v[d], fit, value, C[d]);
    }
  }

  /// Of the velocity gradient what is a rotation. The skew part of a shear is none: in a cell that is long in
  /// one direction it would put velocities across it that are larger than the shear itself.
  static void keep_spin(Lanes (*C)[dim])
  {
    for (unsigned int d = 0; d < dim; ++d)
      for (unsigned int e = 0; e <= d; ++e) {
        const Lanes a = C[d][e], b = -C[e][d];
        const Lanes rate = a * b > 0. ? (a * a < b * b ? a : b) : broadcast(0.);
        C[d][e] = rate;
        C[e][d] = -rate;
      }
  }

  template <bool affine>
  static void scatter_points(const Body<dim> &body, const ActiveNodes<dim> &nodes,
                             const PressureUpdate &pressure, double *sums, const unsigned int stride,
                             CellSums *cell_sums);

  static void advance(const Body<dim> &body, const Batch<double> &batch, const Weights<dim, reach> &w,
                      const double (*a)[Chunks::n_nodes], const double (*v)[Chunks::n_nodes],
                      const VelocityUpdate &update, std::array<Lanes, dim> &new_velocity);

  /// div v and div w of a batch.
  struct Divergences
  {
    Lanes v;
    Lanes w;
  };

  static void deform_batch(Body<dim> &body, const Batch<double> &batch,
                           const std::array<CellInterval, dim> &cell, const std::array<Lanes, dim> &x,
                           const Weights<dim, reach> &weights, const double (*v)[Chunks::n_nodes],
                           const double (*w)[Chunks::n_nodes], const bool spin_only, const double dt,
                           const Divergences *cell_mean, const PressureUpdate &pressure,
                           const double *increment, StepFindings &findings);

  /// Volume-weighted means over the points of a cell, the same in all lanes.
  static Divergences mean_divergences(const Body<dim> &body, const Slice &slice,
                                      const std::array<CellInterval, dim> &cell,
                                      const double (*v)[Chunks::n_nodes], const double (*w)[Chunks::n_nodes]);
  /// Zero in lanes without a point.
  template <typename Row>
  static Lanes volumes(const Layout &layout, const Batch<Row> &batch);
  static Lanes divergence_of(const Weights<dim, reach> &weights, const double (*field)[Chunks::n_nodes]);
  static double mean_pressure(const Body<dim> &body, const Slice &slice);
  /// Storage and last increment of a cell; the slopes are scattered.
  static void sum_up(const Body<dim> &body, const Slice &slice, double last_step, CellSums &cell_sums);

  /// Places of the nodes that a cell's points reach, relative to the cell's lower corner.
  static void node_offsets(const std::array<CellInterval, dim> &cell, NodeLanes (*offset)[Chunks::n]);

  static void filter_pressure(Body<dim> &body, const Slice &slice, const double share);
};
} // namespace peat
