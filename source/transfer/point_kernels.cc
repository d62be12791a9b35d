#include "point_kernels.h"

#include <peat/material/mixture.h>

namespace peat {
namespace {
/// Pore fluid quantities of a batch at its present porosity.
struct FluidLanes
{
  Lanes Q;
  Lanes kappa;
};

FluidLanes fluid_at_start(const Mixture *mixture)
{
  return mixture ? FluidLanes{broadcast(mixture->Q()), broadcast(mixture->mobility())} : FluidLanes{};
}

template <typename Batch>
FluidLanes fluid(const Mixture &mixture, const Layout &layout, const Batch &batch, const FluidLanes &at_start)
{
  if (layout.porosity < 0)
    return at_start;
  const Lanes n = batch.load(layout.porosity);
  return {1. / mixture.storage(n), mixture.mobility(n)};
}

Lanes determinant_of_step(const GradientLanes &du)
{
  const Lanes f0 = 1. + du[0], f4 = 1. + du[4], f8 = 1. + du[8];
  return f0 * (f4 * f8 - du[5] * du[7]) - du[1] * (du[3] * f8 - du[5] * du[6]) +
         du[2] * (du[3] * du[7] - f4 * du[6]);
}
} // namespace

template <int dim, unsigned int reach, bool saturated>
double PointKernels<dim, reach, saturated>::mean_pressure(const Body<dim> &body, const Slice &slice)
{
  const Layout &layout = body.layout();
  double sum = 0., volume = 0.;
  for (std::uint32_t i = slice.begin; i < slice.end; ++i) {
    const double *row = body.row(body.handles()[i]);
    sum += row[layout.volume] * row[layout.pressure];
    volume += row[layout.volume];
  }
  return sum / volume;
}

template <int dim, unsigned int reach, bool saturated>
void PointKernels<dim, reach, saturated>::sum_up(const Body<dim> &body, const Slice &slice,
                                                 const double last_step, CellSums &cell_sums)
{
  const Layout &layout = body.layout();
  const Mixture &mixture = *body.material().mixture();
  double storage = 0., rate = 0., volume = 0.;
  for (std::uint32_t i = slice.begin; i < slice.end; ++i) {
    const double *row = body.row(body.handles()[i]);
    const double V = row[layout.volume];
    storage +=
        V * (layout.porosity >= 0 ? mixture.storage(broadcast(row[layout.porosity]))[0] : mixture.storage());
    rate += V * row[layout.pressure_rate];
    volume += V;
  }
  cell_sums.storage.push_back(storage);
  cell_sums.last_increment.push_back(last_step * rate / volume);
}

template <int dim, unsigned int reach, bool saturated>
void PointKernels<dim, reach, saturated>::node_offsets(const std::array<CellInterval, dim> &cell,
                                                       NodeLanes (*offset)[Chunks::n])
{
  for (unsigned int d = 0; d < dim; ++d) {
    const double at[4] = {-cell[d].size_below, 0., cell[d].size, cell[d].size + cell[d].size_above};
    for (unsigned int chunk = 0; chunk < Chunks::n; ++chunk)
      offset[d][chunk] = Chunks::spread(reach == 4 ? at : at + 1, d, chunk);
  }
}

template <int dim, unsigned int reach, bool saturated>
void PointKernels<dim, reach, saturated>::scatter(const Body<dim> &body, const ActiveNodes<dim> &nodes,
                                                  const PressureUpdate &pressure, double *sums,
                                                  const unsigned int stride, CellSums *cell_sums) const
{
  if (body.layout().velocity_gradient >= 0)
    scatter_points<true>(body, nodes, pressure, sums, stride, cell_sums);
  else
    scatter_points<false>(body, nodes, pressure, sums, stride, cell_sums);
}

template <int dim, unsigned int reach, bool saturated>
template <bool affine>
void PointKernels<dim, reach, saturated>::scatter_points(const Body<dim> &body, const ActiveNodes<dim> &nodes,
                                                         const PressureUpdate &pressure, double *sums,
                                                         const unsigned int stride, CellSums *cell_sums)
{
  using S = Sums<dim>;
  constexpr unsigned int n_sums = S::n_columns(saturated);
  const Layout &layout = body.layout();
  const Mixture *mixture = body.material().mixture();
  const FluidLanes at_start = fluid_at_start(mixture);

  Batch<const double> batch;
  std::array<Lanes, dim> x;
  Weights<dim, reach> lane_weights;
  // Per point: what the node vectors are multiplied with.
  alignas(64) double momentum[dim][n_lanes], total_stress[6][n_lanes], darcy[3][n_lanes];
  alignas(64) double mC[dim * dim][n_lanes];
  alignas(64) NodeLanes offset[dim][Chunks::n];

  for (const Slice &slice : body.slices()) {
    const auto cell = intervals(nodes, slice.cell);
    const std::uint32_t *cell_nodes = nodes.cell_nodes(slice.cell);
    alignas(64) NodeLanes local[n_sums][Chunks::n] = {};
    if constexpr (affine)
      node_offsets(cell, offset);
    const double mean_p = saturated && pressure.cell_means ? mean_pressure(body, slice) : 0.;

    for (std::uint32_t begin = slice.begin; begin < slice.end; begin += n_lanes) {
      collect(body, slice, begin, batch);
      evaluate(body, batch, cell, x, lane_weights);
      const PointwiseWeights<dim, reach> w(lane_weights);
      const Lanes m = batch.load(layout.mass);
      for (unsigned int d = 0; d < dim; ++d)
        reinterpret_cast<Lanes &>(momentum[d]) = m * batch.load(layout.velocity + d);
      if constexpr (affine)
        for (unsigned int d = 0; d < dim; ++d)
          for (unsigned int e = 0; e < dim; ++e) {
            const Lanes c = m * batch.load(layout.velocity_gradient + d * dim + e);
            reinterpret_cast<Lanes &>(mC[d * dim + e]) = c;
            reinterpret_cast<Lanes &>(momentum[d]) -= c * (x[e] - cell[e].lower);
          }
      const Lanes V = batch.load(layout.volume);
      Lanes alpha_p = broadcast(0.);
      if constexpr (saturated) {
        const FluidLanes f = fluid(*mixture, layout, batch, at_start);
        const Lanes p = pressure.cell_means ? broadcast(mean_p) : batch.load(layout.pressure);
        alpha_p = mixture->biot_coefficient() * p;
        reinterpret_cast<Lanes &>(darcy[0]) = V / f.kappa;
        reinterpret_cast<Lanes &>(darcy[1]) = V * mixture->fluid_density();
        // One pressure a cell: sums of V grad N, which are multiplied with it at the end.
        reinterpret_cast<Lanes &>(darcy[2]) = pressure.cell_means ? V : V * p;
      }
      for (unsigned int c = 0; c < n_stress; ++c) {
        const Lanes s = batch.load(layout.stress + c);
        reinterpret_cast<Lanes &>(total_stress[c]) = V * (c < 3 ? s - alpha_p : s);
      }

      for (unsigned int chunk = 0; chunk < Chunks::n; ++chunk) {
        NodeLanes sum[n_sums];
        for (unsigned int c = 0; c < n_sums; ++c)
          sum[c] = local[c][chunk];
        for (unsigned int l = 0; l < batch.n; ++l) {
          if (Chunks::is_out_of_reach(w, l, chunk))
            continue;
          const ShapeAtNodes<dim, reach> shape(w, l, chunk);
          sum[S::mass] += m[l] * shape.N;
          if constexpr (affine)
            for (unsigned int d = 0; d < dim; ++d) {
              NodeLanes v = momentum[d][l] + mC[d * dim][l] * offset[0][chunk];
              for (unsigned int e = 1; e < dim; ++e)
                v += mC[d * dim + e][l] * offset[e][chunk];
              sum[S::momentum + d] += v * shape.N;
            }
          else
            for (unsigned int d = 0; d < dim; ++d)
              sum[S::momentum + d] += momentum[d][l] * shape.N;
          if constexpr (dim == 2) {
            sum[S::force] -= total_stress[0][l] * shape.dN[0] + total_stress[3][l] * shape.dN[1];
            sum[S::force + 1] -= total_stress[3][l] * shape.dN[0] + total_stress[1][l] * shape.dN[1];
          } else {
            sum[S::force] -= total_stress[0][l] * shape.dN[0] + total_stress[3][l] * shape.dN[1] +
                             total_stress[5][l] * shape.dN[2];
            sum[S::force + 1] -= total_stress[3][l] * shape.dN[0] + total_stress[1][l] * shape.dN[1] +
                                 total_stress[4][l] * shape.dN[2];
            sum[S::force + 2] -= total_stress[5][l] * shape.dN[0] + total_stress[4][l] * shape.dN[1] +
                                 total_stress[2][l] * shape.dN[2];
          }
          if constexpr (saturated) {
            sum[S::resistance] += darcy[0][l] * shape.N;
            sum[S::fluid_inertia] += darcy[1][l] * shape.N;
            for (unsigned int d = 0; d < dim; ++d)
              sum[S::pressure_force + d] += darcy[2][l] * shape.dN[d];
          }
        }
        for (unsigned int c = 0; c < n_sums; ++c)
          local[c][chunk] = sum[c];
      }
    }

    if constexpr (saturated) {
      if (cell_sums) {
        sum_up(body, slice, pressure.last_step, *cell_sums);
        for (unsigned int i = 0; i < Chunks::n_nodes; ++i) {
          double slope[dim];
          bool reached = false;
          for (unsigned int d = 0; d < dim; ++d) {
            slope[d] = local[S::pressure_force + d][i / Chunks::width][i % Chunks::width];
            reached = reached || slope[d] != 0.;
          }
          if (!reached)
            continue;
          cell_sums->entry_node.push_back(cell_nodes[i]);
          cell_sums->slopes.insert(cell_sums->slopes.end(), slope, slope + dim);
        }
        cell_sums->entry_begin.push_back(cell_sums->entry_node.size());
      }
      if (pressure.cell_means)
        for (unsigned int d = 0; d < dim; ++d)
          for (unsigned int chunk = 0; chunk < Chunks::n; ++chunk)
            local[S::pressure_force + d][chunk] *= mean_p;
    }
    for (unsigned int i = 0; i < Chunks::n_nodes; ++i) {
      double *out = sums + std::size_t(cell_nodes[i]) * stride;
      for (unsigned int c = 0; c < n_sums; ++c)
        out[c] += local[c][i / Chunks::width][i % Chunks::width];
    }
  }
}

template <int dim, unsigned int reach, bool saturated>
void PointKernels<dim, reach, saturated>::advance(const Body<dim> &body, const Batch<double> &batch,
                                                  const Weights<dim, reach> &w,
                                                  const double (*a)[Chunks::n_nodes],
                                                  const double (*v)[Chunks::n_nodes],
                                                  const VelocityUpdate &update,
                                                  std::array<Lanes, dim> &new_velocity)
{
  const int column = body.layout().velocity;
  for (unsigned int d = 0; d < dim; ++d) {
    Lanes velocity = broadcast(0.);
    if (update.retention > 0.)
      velocity = update.retention * (batch.load(column + d) + update.dt * interpolate<dim, reach>(a[d], w));
    if (update.retention < 1.)
      velocity += (1. - update.retention) * interpolate<dim, reach>(v[d], w);
    batch.store(column + d, velocity);
    new_velocity[d] = velocity;
  }
}

template <int dim, unsigned int reach, bool saturated>
void PointKernels<dim, reach, saturated>::advance_and_remap(Body<dim> &body, const ActiveNodes<dim> &nodes,
                                                            const double *a, const double *v,
                                                            const char *spin_only,
                                                            const VelocityUpdate &update,
                                                            double *momentum) const
{
  const Layout &layout = body.layout();
  Batch<double> batch;
  std::array<Lanes, dim> x, velocity;
  Weights<dim, reach> lane_weights;
  alignas(64) double local_a[dim][Chunks::n_nodes], local_v[dim][Chunks::n_nodes];
  alignas(64) double affine[dim * dim][n_lanes];
  alignas(64) NodeLanes offset[dim][Chunks::n];

  for (const Slice &slice : body.slices()) {
    const auto cell = intervals(nodes, slice.cell);
    const std::uint32_t *cell_nodes = nodes.cell_nodes(slice.cell);
    gather(a, cell_nodes, local_a);
    gather(v, cell_nodes, local_v);
    const bool spin = spin_only && spin_only[nodes.occupied_index(slice.cell)];
    node_offsets(cell, offset);
    alignas(64) NodeLanes local[dim][Chunks::n] = {};

    for (std::uint32_t begin = slice.begin; begin < slice.end; begin += n_lanes) {
      collect(body, slice, begin, batch);
      evaluate(body, batch, cell, x, lane_weights);
      advance(body, batch, lane_weights, local_a, local_v, update, velocity);
      if (layout.velocity_gradient >= 0) {
        Lanes C[dim][dim];
        fit_gradient(lane_weights, x, cell, local_v, C);
        if (spin)
          keep_spin(C);
        for (unsigned int d = 0; d < dim; ++d)
          for (unsigned int e = 0; e < dim; ++e) {
            reinterpret_cast<Lanes &>(affine[d * dim + e]) = C[d][e];
            velocity[d] -= C[d][e] * (x[e] - cell[e].lower);
          }
      }
      const PointwiseWeights<dim, reach> w(lane_weights);
      for (unsigned int chunk = 0; chunk < Chunks::n; ++chunk)
        for (unsigned int l = 0; l < batch.n; ++l) {
          const NodeLanes mN = batch.row[l][layout.mass] * ShapeAtNodes<dim, reach>::value(w, l, chunk);
          for (unsigned int d = 0; d < dim; ++d) {
            NodeLanes vd = velocity[d][l] + NodeLanes{};
            if (layout.velocity_gradient >= 0)
              for (unsigned int e = 0; e < dim; ++e)
                vd += affine[d * dim + e][l] * offset[e][chunk];
            local[d][chunk] += mN * vd;
          }
        }
    }
    for (unsigned int i = 0; i < Chunks::n_nodes; ++i)
      for (unsigned int d = 0; d < dim; ++d)
        momentum[std::size_t(cell_nodes[i]) * dim + d] += local[d][i / Chunks::width][i % Chunks::width];
  }
}

template <int dim, unsigned int reach, bool saturated>
template <typename Row>
Lanes PointKernels<dim, reach, saturated>::volumes(const Layout &layout, const Batch<Row> &batch)
{
  Lanes V = batch.load(layout.volume);
  for (unsigned int l = batch.n; l < n_lanes; ++l)
    V[l] = 0.;
  return V;
}

template <int dim, unsigned int reach, bool saturated>
Lanes PointKernels<dim, reach, saturated>::divergence_of(const Weights<dim, reach> &weights,
                                                         const double (*w)[Chunks::n_nodes])
{
  Lanes divergence = broadcast(0.);
  for (unsigned int d = 0; d < dim; ++d)
    divergence += derivative<dim, reach>(w[d], weights, d);
  return divergence;
}

template <int dim, unsigned int reach, bool saturated>
typename PointKernels<dim, reach, saturated>::Divergences
PointKernels<dim, reach, saturated>::mean_divergences(const Body<dim> &body, const Slice &slice,
                                                      const std::array<CellInterval, dim> &cell,
                                                      const double (*v)[Chunks::n_nodes],
                                                      const double (*w)[Chunks::n_nodes])
{
  Batch<const double> batch;
  std::array<Lanes, dim> x;
  Weights<dim, reach> weights;
  double sum_v = 0., sum_w = 0., volume = 0.;
  for (std::uint32_t begin = slice.begin; begin < slice.end; begin += n_lanes) {
    collect(body, slice, begin, batch);
    evaluate(body, batch, cell, x, weights);
    const Lanes V = volumes(body.layout(), batch);
    sum_v += sum(V * divergence_of(weights, v));
    sum_w += sum(V * divergence_of(weights, w));
    volume += sum(V);
  }
  return {broadcast(sum_v / volume), broadcast(sum_w / volume)};
}

template <int dim, unsigned int reach, bool saturated>
void PointKernels<dim, reach, saturated>::deform_batch(
    Body<dim> &body, const Batch<double> &batch, const std::array<CellInterval, dim> &cell,
    const std::array<Lanes, dim> &x, const Weights<dim, reach> &weights, const double (*v)[Chunks::n_nodes],
    const double (*w)[Chunks::n_nodes], const bool spin_only, const double dt, const Divergences *cell_mean,
    const PressureUpdate &pressure, const double *increment, StepFindings &findings)
{
  const Layout &layout = body.layout();
  const Law &law = body.material().law();

  // Kinematics of the step: the one place that knows about plane strain.
  std::array<Lanes, dim> velocity;
  GradientLanes du = {};
  Lanes divergence = broadcast(0.), speed_squared = broadcast(0.);
  const double inverse_dt = 1. / dt;
  for (unsigned int d = 0; d < dim; ++d) {
    Lanes gradient[dim];
    interpolate<dim, reach>(v[d], weights, velocity[d], gradient);
    speed_squared += velocity[d] * velocity[d];
    divergence += gradient[d];
    for (unsigned int e = 0; e < dim; ++e)
      du[3 * d + e] = dt * gradient[e];
  }

  if (layout.velocity_gradient >= 0) {
    Lanes C[dim][dim];
    if constexpr (reach == 4)
      fit_gradient(weights, x, cell, v, C);
    else
      for (unsigned int d = 0; d < dim; ++d)
        for (unsigned int e = 0; e < dim; ++e)
          C[d][e] = du[3 * d + e] * inverse_dt;
    if (spin_only)
      keep_spin(C);
    for (unsigned int d = 0; d < dim; ++d)
      for (unsigned int e = 0; e < dim; ++e)
        batch.store(layout.velocity_gradient + d * dim + e, C[d][e]);
  }

  StressLanes stress = {};
  for (unsigned int c = 0; c < n_stress; ++c)
    stress[c] = batch.load(layout.stress + c);
  Lanes state[max_state_columns];
  for (unsigned int c = 0; c < layout.n_state; ++c)
    state[c] = batch.load(layout.state + c);
  law.update(du, stress, state);
  for (unsigned int c = 0; c < n_stress; ++c)
    batch.store(layout.stress + c, stress[c]);
  for (unsigned int c = 0; c < layout.n_state; ++c)
    batch.store(layout.state + c, state[c]);
  Lanes check = stress[0] + stress[1] + stress[2] + speed_squared;

  if constexpr (saturated) {
    Lanes p = batch.load(layout.pressure);
    if (increment) {
      p += pressure.reach * *increment - 0.5 * pressure.last_step * batch.load(layout.pressure_rate);
      batch.store(layout.pressure_rate, broadcast(*increment * inverse_dt));
    } else {
      const Mixture &mixture = *body.material().mixture();
      const Divergences div = cell_mean ? *cell_mean : Divergences{divergence, divergence_of(weights, w)};
      const Lanes Q =
          layout.porosity < 0 ? broadcast(mixture.Q()) : 1. / mixture.storage(batch.load(layout.porosity));
      p -= dt * Q * (div.w + mixture.biot_coefficient() * div.v);
      const Lanes V = volumes(layout, batch);
      findings.fluid_outflow += dt * sum(V * div.w);
      if (layout.porosity < 0)
        findings.fluid_squeezed += dt * mixture.biot_coefficient() * sum(V * div.v);
    }
    batch.store(layout.pressure, p);
    check += p;
  }

  if (law.finite_strain()) {
    const Lanes dJ = determinant_of_step(du);
    batch.store(layout.volume, dJ * batch.load(layout.volume));
    if (layout.porosity >= 0)
      batch.store(layout.porosity, 1. - (1. - batch.load(layout.porosity)) / dJ);
    if constexpr (reach == 4)
      for (unsigned int d = 0; d < dim; ++d)
        batch.store(layout.extent + d, (1. + du[4 * d]) * batch.load(layout.extent + d));
  }

  // A comparison with NaN is false: what is not finite is found without a branch per point.
  Lanes outside = broadcast(0.);
  for (unsigned int d = 0; d < dim; ++d) {
    const Lanes step = dt * velocity[d];
    const Lanes new_x = x[d] + step;
    batch.store(layout.displacement + d, batch.load(layout.displacement + d) + step);
    outside = new_x >= cell[d].lower ? outside : broadcast(1.);
    outside = new_x <= cell[d].lower + cell[d].size ? outside : broadcast(1.);
    for (unsigned int l = 0; l < batch.n; ++l)
      body.position(batch.handle[l])[d] = new_x[l];
  }
  const Lanes healthy = check - check == 0. ? broadcast(0.) : broadcast(1.);
  if (sum(outside + healthy) > 0.)
    for (unsigned int l = 0; l < batch.n; ++l) {
      if (outside[l] > 0.)
        body.movers().push_back(batch.handle[l]);
      if (healthy[l] > 0.)
        findings.finite = false;
    }
}

template <int dim, unsigned int reach, bool saturated>
void PointKernels<dim, reach, saturated>::filter_pressure(Body<dim> &body, const Slice &slice,
                                                          const double share)
{
  const Layout &layout = body.layout();
  const Mixture &mixture = *body.material().mixture();
  double content = 0., capacity = 0.;
  const auto storage = [&](const double *row) {
    return row[layout.volume] *
           (layout.porosity >= 0 ? mixture.storage(broadcast(row[layout.porosity]))[0] : 1. / mixture.Q());
  };
  for (std::uint32_t i = slice.begin; i < slice.end; ++i) {
    const double *row = body.row(body.handles()[i]);
    const double S = storage(row);
    content += S * row[layout.pressure];
    capacity += S;
  }
  const double mean = content / capacity;
  for (std::uint32_t i = slice.begin; i < slice.end; ++i) {
    double &p = body.row(body.handles()[i])[layout.pressure];
    p += share * (mean - p);
  }
}

template <int dim, unsigned int reach, bool saturated>
void PointKernels<dim, reach, saturated>::deform(Body<dim> &body, const ActiveNodes<dim> &nodes,
                                                 const double *v, const double *w, const char *spin_only,
                                                 const double dt, const PressureUpdate &pressure,
                                                 StepFindings &findings) const
{
  Batch<double> batch;
  std::array<Lanes, dim> x;
  Weights<dim, reach> weights;
  alignas(64) double local_v[dim][Chunks::n_nodes], local_w[dim][Chunks::n_nodes];
  for (const Slice &slice : body.slices()) {
    const auto cell = intervals(nodes, slice.cell);
    const std::uint32_t *cell_nodes = nodes.cell_nodes(slice.cell);
    gather(v, cell_nodes, local_v);
    const bool spin = spin_only && spin_only[nodes.occupied_index(slice.cell)];
    const double *increment =
        pressure.increments ? pressure.increments + (&slice - body.slices().data()) : nullptr;
    const bool averaged = saturated && pressure.cell_means && !increment;
    Divergences mean{};
    if constexpr (saturated) {
      gather(w, cell_nodes, local_w);
      if (averaged)
        mean = mean_divergences(body, slice, cell, local_v, local_w);
    }
    for (std::uint32_t begin = slice.begin; begin < slice.end; begin += n_lanes) {
      collect(body, slice, begin, batch);
      evaluate(body, batch, cell, x, weights);
      deform_batch(body, batch, cell, x, weights, local_v, local_w, spin, dt, averaged ? &mean : nullptr,
                   pressure, increment, findings);
    }
    if (saturated && pressure.filter > 0.)
      filter_pressure(body, slice, pressure.filter);
  }
}

template <int dim, unsigned int reach, bool saturated>
void PointKernels<dim, reach, saturated>::advance_and_deform(Body<dim> &body, const ActiveNodes<dim> &nodes,
                                                             const double *a, const double *v,
                                                             const double *w, const char *spin_only,
                                                             const VelocityUpdate &update,
                                                             const PressureUpdate &pressure,
                                                             StepFindings &findings) const
{
  Batch<double> batch;
  std::array<Lanes, dim> x, velocity;
  Weights<dim, reach> weights;
  alignas(64) double local_a[dim][Chunks::n_nodes], local_v[dim][Chunks::n_nodes],
      local_w[dim][Chunks::n_nodes];
  for (const Slice &slice : body.slices()) {
    const auto cell = intervals(nodes, slice.cell);
    const std::uint32_t *cell_nodes = nodes.cell_nodes(slice.cell);
    gather(a, cell_nodes, local_a);
    gather(v, cell_nodes, local_v);
    const bool spin = spin_only && spin_only[nodes.occupied_index(slice.cell)];
    const double *increment =
        pressure.increments ? pressure.increments + (&slice - body.slices().data()) : nullptr;
    const bool averaged = saturated && pressure.cell_means && !increment;
    Divergences mean{};
    if constexpr (saturated) {
      gather(w, cell_nodes, local_w);
      if (averaged)
        mean = mean_divergences(body, slice, cell, local_v, local_w);
    }
    for (std::uint32_t begin = slice.begin; begin < slice.end; begin += n_lanes) {
      collect(body, slice, begin, batch);
      evaluate(body, batch, cell, x, weights);
      advance(body, batch, weights, local_a, local_v, update, velocity);
      deform_batch(body, batch, cell, x, weights, local_v, local_w, spin, update.dt,
                   averaged ? &mean : nullptr, pressure, increment, findings);
    }
    if (saturated && pressure.filter > 0.)
      filter_pressure(body, slice, pressure.filter);
  }
}

namespace {
template <int dim, unsigned int reach>
std::unique_ptr<Kernels<dim>> make_for(const bool saturated)
{
  if (saturated)
    return std::make_unique<PointKernels<dim, reach, true>>();
  return std::make_unique<PointKernels<dim, reach, false>>();
}
} // namespace

template <int dim>
std::unique_ptr<Kernels<dim>> Kernels<dim>::make(const Basis basis, const bool saturated)
{
  return basis == Basis::q1 ? make_for<dim, 2>(saturated) : make_for<dim, 4>(saturated);
}

template std::unique_ptr<Kernels<2>> Kernels<2>::make(Basis, bool);
template std::unique_ptr<Kernels<3>> Kernels<3>::make(Basis, bool);
} // namespace peat
