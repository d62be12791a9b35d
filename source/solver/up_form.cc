#include <peat/solver/up_form.h>

#include <peat/material/mixture.h>

#include "form_points.h"

namespace peat {
namespace {
/// Gathers the entries of a vector at a cell's unknowns.
void gather(const BlockVector &vector, const dealii::types::global_dof_index *unknowns, const unsigned int n,
            const dealii::types::global_dof_index offset, const unsigned int block, double *result)
{
  const auto &part = vector.block(block);
  for (unsigned int i = 0; i < n; ++i)
    result[i] = part(unknowns[i] - offset);
}

Lanes sum_of_squares(const StressLanes &s)
{
  return s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
}

template <int dim, unsigned int reach>
class PointForm : public UpForm<dim>
{
public:
  explicit PointForm(const Space<dim> &space) : space(space) {}

  void assemble(const Body<dim> &body, const TimeLevel &level, const StepState &state,
                const VolumeLoads<dim> &loads, double stabilisation,
                const dealii::AffineConstraints<double> &constraints, BlockVector &residual,
                BlockMatrix *matrix, dealii::TrilinosWrappers::SparseMatrix *pressure_mass,
                GrossResidual &gross) override;
  void update_points(Body<dim> &body, const TimeLevel &level, const StepState &state,
                     const BlockVector &end_velocity, const dealii::Tensor<1, dim> &gravity, bool move,
                     StepWork &work) override;
  void add_momentum(const Body<dim> &body, dealii::TrilinosWrappers::MPI::Vector &momentum) override;
  void sum_mass(const Body<dim> &body, dealii::TrilinosWrappers::MPI::Vector &mass) override;
  void sum_inertia(const Body<dim> &body, dealii::TrilinosWrappers::MPI::Vector &inertia) override;
  void sum_weight(const Body<dim> &body, const StepState &state, const VolumeLoads<dim> &loads, double time,
                  dealii::Tensor<1, dim> &weight, double &work) override;

private:
  using Points = FormPoints<dim, reach>;
  static constexpr unsigned int n_u = Points::n_nodes * dim, n_p = Space<dim>::n_pressures;

  /// The nodal values of a cell.
  struct CellValues
  {
    double U[n_u], v_history[n_u], a_history[n_u], end_velocity[n_u];
    double P[n_p], rate_history[n_p], old_P[n_p];
    bool has_pressure;
  };
  void load(const CellId cell, const bool saturated, const TimeLevel &level, const StepState &state,
            CellValues &values) const;
  /// Stress, pressure and rates of eight points at the level's time.
  struct PointValues
  {
    GradientLanes gradient; ///< of U
    StressLanes stress;
    std::array<Lanes, max_state_columns> memory;
    std::array<Lanes, dim> acceleration, pressure_gradient;
    Lanes velocity_divergence, old_pressure, pressure, pressure_rate;
  };
  void evaluate(const Body<dim> &body, const Points &points, const TimeLevel &level, const CellValues &values,
                double mean_pressure, PointValues &at) const;
  void add_residual(const Body<dim> &body, const Points &points, const TimeLevel &level,
                    const PointValues &at, const VolumeLoads<dim> &loads, bool has_pressure,
                    GrossResidual &gross);
  void add_matrices(const Body<dim> &body, const Points &points, const PointValues &at, bool has_pressure);
  void add_pressure_mass(const TimeLevel &level, const dealii::AffineConstraints<double> &constraints,
                         dealii::TrilinosWrappers::SparseMatrix &matrix);
  template <typename Term>
  void sum_over_nodes(const Body<dim> &body, dealii::TrilinosWrappers::MPI::Vector &sums, const Term &term);
  void stabilise(const Body<dim> &body, const Slice &slice, const TimeLevel &level, const CellValues &values,
                 double strength, bool with_matrix);

  const Space<dim> &space;
  std::vector<dealii::types::global_dof_index> unknowns;
  dealii::Vector<double> local_residual;
  dealii::FullMatrix<double> local_matrix;
  StackedPoints<dim, reach> stacked;
};

template <int dim, unsigned int reach>
void PointForm<dim, reach>::load(const CellId cell, const bool saturated, const TimeLevel &level,
                                 const StepState &state, CellValues &values) const
{
  const auto *u = space.displacements(cell);
  gather(state.unknown, u, n_u, 0, 0, values.U);
  std::fill_n(values.v_history, n_u, 0.);
  std::fill_n(values.a_history, n_u, 0.);
  gather(state.rate_history, u, n_u, 0, 0, values.v_history);
  if (level.acceleration > 0.)
    gather(state.second_history, u, n_u, 0, 0, values.a_history);
  values.has_pressure = saturated && space.has_pressure();
  if (!values.has_pressure)
    return;
  const auto *p = space.pressures(cell);
  gather(state.unknown, p, n_p, space.first_pressure(), 1, values.P);
  gather(state.rate_history, p, n_p, space.first_pressure(), 1, values.rate_history);
  gather(state.second_history, p, n_p, space.first_pressure(), 1, values.old_P);
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::evaluate(const Body<dim> &body, const Points &points, const TimeLevel &level,
                                     const CellValues &values, const double mean_pressure,
                                     PointValues &at) const
{
  const Layout &layout = body.layout();
  at.gradient = points.gradient(values.U);
  GradientLanes part;
  for (unsigned int c = 0; c < 9; ++c)
    part[c] = level.share * at.gradient[c];
  at.stress = points.stress(layout);
  for (unsigned int c = 0; c < layout.n_state; ++c)
    at.memory[c] = points.load(layout.state + c);
  body.material().law().update(part, at.stress, at.memory.data());

  at.velocity_divergence = level.velocity * (at.gradient[0] + at.gradient[4] + at.gradient[8]);
  const GradientLanes history = points.gradient(values.v_history);
  at.velocity_divergence += history[0] + history[4] + history[8];
  for (unsigned int d = 0; d < dim; ++d)
    at.acceleration[d] = level.acceleration * points.value(values.U, d) + points.value(values.a_history, d);

  at.old_pressure = layout.pressure >= 0 ? points.load(layout.pressure) : Lanes{};
  at.pressure = broadcast(mean_pressure);
  at.pressure_rate = Lanes{};
  at.pressure_gradient.fill(Lanes{});
  if (!values.has_pressure)
    return;
  const Lanes P = points.pressure(values.P);
  at.pressure = level.share * P + (1. - level.share) * at.old_pressure;
  at.pressure_rate = level.pressure_rate * (P - at.old_pressure);
  if (level.pressure_rate > 0.)
    at.pressure_rate += points.pressure(values.rate_history);
  for (unsigned int d = 0; d < dim; ++d) {
    at.pressure_gradient[d] = level.share * points.pressure_slope(values.P, d);
    if (level.share < 1.)
      at.pressure_gradient[d] += (1. - level.share) * points.pressure_slope(values.old_P, d);
  }
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::add_residual(const Body<dim> &body, const Points &points, const TimeLevel &level,
                                         const PointValues &at, const VolumeLoads<dim> &loads,
                                         const bool has_pressure, GrossResidual &gross)
{
  const Mixture *mixture = body.material().mixture();
  const Lanes V = points.volume, m = points.mass;
  std::array<Lanes, dim> force;
  for (unsigned int d = 0; d < dim; ++d)
    force[d] = m * (loads.gravity[d] - at.acceleration[d]);
  for (const Condition<dim> *condition : loads.forces)
    for (unsigned int l = 0; l < points.n; ++l) {
      const auto b = condition->body_force(points.position(body, l), level.time);
      for (unsigned int d = 0; d < dim; ++d)
        force[d][l] += m[l] * b[d];
    }

  StressLanes total = at.stress;
  if (mixture)
    for (unsigned int c = 0; c < 3; ++c)
      total[c] -= mixture->biot_coefficient() * at.pressure;
  gross[0] += sum(V * (sqrt(sum_of_squares(at.stress)) + sqrt(at.pressure * at.pressure))) /
              space.grid().smallest_cell_size();
  for (unsigned int i = 0; i < Points::n_nodes; ++i)
    for (unsigned int d = 0; d < dim; ++d) {
      Lanes r = points.N[i] * force[d];
      for (unsigned int e = 0; e < dim; ++e)
        r -= V * total[Points::stress_index[d][e]] * points.dN[i][e];
      local_residual[i * dim + d] += sum(r);
    }
  if (!has_pressure)
    return;

  const double scale = level.fluid_scale(), inertia = level.seepage_inertia ? 1. : 0.;
  const Lanes porosity = points.porosity(body.layout(), *mixture);
  Lanes storage =
      mixture->storage(porosity) * at.pressure_rate + mixture->biot_coefficient() * at.velocity_divergence;
  for (const Condition<dim> *condition : loads.fluids)
    for (unsigned int l = 0; l < points.n; ++l)
      storage[l] -= condition->fluid_source(points.position(body, l), level.time);
  const Lanes mobility = V * mixture->mobility(porosity);
  Lanes slope = {};
  for (unsigned int d = 0; d < dim; ++d)
    slope += at.pressure_gradient[d] * at.pressure_gradient[d];
  gross[1] += std::abs(scale) *
              sum(mobility * sqrt(slope) / space.grid().smallest_cell_size() +
                  V * level.pressure_rate * mixture->storage(porosity) * sqrt(at.pressure * at.pressure));
  std::array<Lanes, dim> flux;
  for (unsigned int d = 0; d < dim; ++d)
    flux[d] = mobility * (mixture->fluid_density() * (loads.gravity[d] - inertia * at.acceleration[d]) -
                          at.pressure_gradient[d]);
  for (unsigned int i = 0; i < n_p; ++i) {
    Lanes r = -V * storage * points.M[i];
    for (unsigned int d = 0; d < dim; ++d)
      r += flux[d] * points.dM[i][d];
    local_residual[n_u + i] += scale * sum(r);
  }
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::add_matrices(const Body<dim> &body, const Points &points, const PointValues &at,
                                         const bool has_pressure)
{
  std::array<Lanes, 36> tangent;
  body.material().law().tangent(at.stress, at.memory.data(), tangent);
  const Mixture *mixture = has_pressure ? body.material().mixture() : nullptr;
  typename StackedPoints<dim, reach>::Coefficients c{};
  if (mixture) {
    const Lanes porosity = points.porosity(body.layout(), *mixture);
    c.alpha = mixture->biot_coefficient();
    c.fluid_density = mixture->fluid_density();
    c.storage = mixture->storage(porosity);
    c.mobility = mixture->mobility(porosity);
  }
  stacked.add(points, tangent, c, has_pressure);
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::stabilise(const Body<dim> &body, const Slice &slice, const TimeLevel &level,
                                      const CellValues &values, const double strength, const bool with_matrix)
{
  // Polynomial pressure projection (Dohrmann and Bochev 2004; White and Borja 2008): tau (q - mean q)(p_t -
  // mean p_t), on the cell and scaled by how full it is.
  const Mixture &mixture = *body.material().mixture();
  double volume = 0.;
  for (std::uint32_t i = slice.begin; i < slice.end; ++i)
    volume += body.row(body.handles()[i])[body.layout().volume];
  double h = std::numeric_limits<double>::max();
  for (unsigned int d = 0; d < dim; ++d)
    h = std::min(h, space.grid().size(slice.cell, d));
  const double tau =
      strength * std::max(0., stacked.compliance() * 3. * std::pow(mixture.biot_coefficient(), 2) +
                                  2. * mixture.storage() - 12. * mixture.mobility() * level.dt / (h * h));
  if (tau == 0. || level.pressure_rate == 0.)
    return;
  for (unsigned int i = 0; i < n_p; ++i)
    for (unsigned int j = 0; j < n_p; ++j) {
      double product = 1.;
      for (unsigned int d = 0; d < dim; ++d)
        product *= ((i ^ j) >> d) & 1 ? 1. / 6. : 1. / 3.;
      const double entry = tau * volume * (product - 1. / (n_p * n_p)) * level.fluid_scale();
      local_residual[n_u + i] -=
          entry * (level.pressure_rate * (values.P[j] - values.old_P[j]) + values.rate_history[j]);
      if (with_matrix)
        local_matrix(n_u + i, n_u + j) += level.pressure_rate * entry;
    }
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::assemble(const Body<dim> &body, const TimeLevel &level, const StepState &state,
                                     const VolumeLoads<dim> &loads, const double stabilisation,
                                     const dealii::AffineConstraints<double> &constraints,
                                     BlockVector &residual, BlockMatrix *matrix,
                                     dealii::TrilinosWrappers::SparseMatrix *pressure_mass,
                                     GrossResidual &gross)
{
  const bool saturated = body.material().mixture() != nullptr;
  const bool has_pressure = saturated && space.has_pressure();
  const unsigned int n = n_u + (has_pressure ? n_p : 0);
  unknowns.resize(n);
  local_residual.reinit(n);
  if (matrix)
    local_matrix.reinit(n, n);
  CellValues values;
  PointValues at;
  for (const Slice &slice : body.slices()) {
    load(slice.cell, saturated, level, state, values);
    const double mean = saturated && !has_pressure ? mean_pressure(body, slice) : 0.;
    local_residual = 0.;
    stacked.clear(slice.end - slice.begin);
    for (std::uint32_t begin = slice.begin; begin < slice.end; begin += n_lanes) {
      const Points points(space.grid(), body, slice, begin);
      evaluate(body, points, level, values, mean, at);
      add_residual(body, points, level, at, loads, has_pressure, gross);
      if (matrix || (has_pressure && stabilisation > 0.))
        add_matrices(body, points, at, has_pressure);
    }
    if (matrix)
      stacked.multiply(level, has_pressure, local_matrix);
    if (has_pressure && stabilisation > 0.)
      stabilise(body, slice, level, values, stabilisation, matrix != nullptr);

    std::copy_n(space.displacements(slice.cell), n_u, unknowns.begin());
    if (has_pressure)
      std::copy_n(space.pressures(slice.cell), n_p, unknowns.begin() + n_u);
    residual.add(unknowns, local_residual);
    if (matrix)
      constraints.distribute_local_to_global(local_matrix, unknowns, *matrix);
    if (matrix && pressure_mass && has_pressure)
      add_pressure_mass(level, constraints, *pressure_mass);
  }
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::add_pressure_mass(const TimeLevel &level,
                                              const dealii::AffineConstraints<double> &constraints,
                                              dealii::TrilinosWrappers::SparseMatrix &matrix)
{
  const auto mass = stacked.pressure_mass();
  for (unsigned int i = 0; i < n_p; ++i)
    for (unsigned int j = 0; j < n_p; ++j) {
      const auto row = unknowns[n_u + i], column = unknowns[n_u + j];
      if (row == column || (!constraints.is_constrained(row) && !constraints.is_constrained(column)))
        matrix.add(row - space.first_pressure(), column - space.first_pressure(), level.share * mass(i, j));
    }
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::update_points(Body<dim> &body, const TimeLevel &level, const StepState &state,
                                          const BlockVector &end_velocity,
                                          const dealii::Tensor<1, dim> &gravity, const bool move,
                                          StepWork &work)
{
  const Layout &layout = body.layout();
  const Law &law = body.material().law();
  const Mixture *mixture = body.material().mixture();
  const double inertia = level.seepage_inertia ? 1. : 0.;
  CellValues values;
  PointValues at;
  TimeLevel end = level;
  end.share = 1.;
  for (const Slice &slice : body.slices()) {
    load(slice.cell, mixture != nullptr, level, state, values);
    gather(end_velocity, space.displacements(slice.cell), n_u, 0, 0, values.end_velocity);
    for (std::uint32_t begin = slice.begin; begin < slice.end; begin += n_lanes) {
      const Points points(space.grid(), body, slice, begin);
      if (values.has_pressure) {
        evaluate(body, points, level, values, 0., at);
        const Lanes porosity = points.porosity(layout, *mixture);
        Lanes squared = {};
        for (unsigned int d = 0; d < dim; ++d) {
          const Lanes R = mixture->fluid_density() * (gravity[d] - inertia * at.acceleration[d]) -
                          at.pressure_gradient[d];
          squared += R * R;
        }
        const Lanes squeezed = mixture->biot_coefficient() * at.velocity_divergence;
        work.seepage_dissipation += level.dt * sum(points.volume * mixture->mobility(porosity) * squared);
        work.seepage_work += level.dt * sum(points.volume * at.pressure *
                                            (mixture->storage(porosity) * at.pressure_rate + squeezed));
        if (!law.finite_strain())
          work.fluid_squeezed += level.dt * sum(points.volume * squeezed);
      }
      evaluate(body, points, end, values, 0., at);
      points.store(body, layout, at.stress, at.memory.data());
      if (values.has_pressure)
        points.store(layout.pressure, at.pressure);
      Lanes check = at.stress[0] + at.stress[1] + at.stress[2] + at.stress[3] + at.pressure;
      for (unsigned int d = 0; d < dim; ++d) {
        const Lanes u = points.value(values.U, d), v = points.value(values.end_velocity, d);
        points.store(layout.displacement + d, points.load(layout.displacement + d) + u);
        points.store(layout.velocity + d, v);
        check += v;
      }
      if (layout.velocity_gradient >= 0) {
        const GradientLanes L = points.gradient(values.end_velocity);
        for (unsigned int d = 0; d < dim; ++d)
          for (unsigned int e = 0; e < dim; ++e)
            points.store(layout.velocity_gradient + d * dim + e, L[3 * d + e]);
      }
      work.finite = work.finite && std::isfinite(sum(check));
      points.deform(body, at.gradient, values.U, move);
    }
  }
}

template <int dim, unsigned int reach>
template <typename Term>
void PointForm<dim, reach>::sum_over_nodes(const Body<dim> &body, dealii::TrilinosWrappers::MPI::Vector &sums,
                                           const Term &term)
{
  unknowns.resize(n_u);
  local_residual.reinit(n_u);
  for (const Slice &slice : body.slices()) {
    local_residual = 0.;
    for (std::uint32_t begin = slice.begin; begin < slice.end; begin += n_lanes) {
      const Points points(space.grid(), body, slice, begin);
      for (unsigned int d = 0; d < dim; ++d) {
        for (unsigned int i = 0; i < Points::n_nodes; ++i)
          local_residual[i * dim + d] += sum(points.mass * points.N[i] * term(points, i, d));
      }
    }
    std::copy_n(space.displacements(slice.cell), n_u, unknowns.begin());
    sums.add(unknowns, local_residual);
  }
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::add_momentum(const Body<dim> &body,
                                         dealii::TrilinosWrappers::MPI::Vector &momentum)
{
  sum_over_nodes(body, momentum, [&](const Points &points, unsigned int, const unsigned int d) {
    return points.load(body.layout().velocity + d);
  });
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::sum_mass(const Body<dim> &body, dealii::TrilinosWrappers::MPI::Vector &mass)
{
  sum_over_nodes(body, mass, [](const Points &, unsigned int, unsigned int) { return broadcast(1.); });
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::sum_inertia(const Body<dim> &body, dealii::TrilinosWrappers::MPI::Vector &inertia)
{
  sum_over_nodes(body, inertia,
                 [](const Points &points, const unsigned int i, unsigned int) { return points.N[i]; });
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::sum_weight(const Body<dim> &body, const StepState &state,
                                       const VolumeLoads<dim> &loads, const double time,
                                       dealii::Tensor<1, dim> &weight, double &work)
{
  double U[n_u];
  for (const Slice &slice : body.slices()) {
    gather(state.unknown, space.displacements(slice.cell), n_u, 0, 0, U);
    for (std::uint32_t begin = slice.begin; begin < slice.end; begin += n_lanes) {
      const Points points(space.grid(), body, slice, begin);
      for (unsigned int l = 0; l < points.n; ++l) {
        auto acting = loads.gravity;
        for (const Condition<dim> *condition : loads.forces)
          acting += condition->body_force(points.position(body, l), time);
        weight += points.mass[l] * acting;
        for (unsigned int d = 0; d < dim; ++d)
          for (unsigned int i = 0; i < Points::n_nodes; ++i)
            work += points.mass[l] * acting[d] * points.N[i][l] * U[i * dim + d];
      }
    }
  }
}
} // namespace

template <int dim>
std::unique_ptr<UpForm<dim>> UpForm<dim>::make(const Space<dim> &space)
{
  switch (space.nodes()) {
  case Nodes::q1:
    return std::make_unique<PointForm<dim, 2>>(space);
  case Nodes::q2:
    return std::make_unique<PointForm<dim, 3>>(space);
  default:
    return std::make_unique<PointForm<dim, 4>>(space);
  }
}

template class UpForm<2>;
template class UpForm<3>;
} // namespace peat
