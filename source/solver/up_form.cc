#include <peat/solver/up_form.h>

#include <peat/material/mixture.h>

#include "form_filling.h"
#include "form_matrices.h"

#include <map>

namespace peat {
namespace {
Lanes sum_of_squares(const StressLanes &s)
{
  return s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
}

template <int dim, unsigned int reach>
class PointForm : public UpForm<dim>
{
public:
  PointForm(const Space<dim> &space, const bool projects) : space(space), cell(space, projects) {}

  unsigned int n_volumetric() const override { return cell.projection() ? Matrices::n_psi : 0; }
  void survey(const Body<dim> &body) override;
  void assemble(const Body<dim> &body, const TimeLevel &level, const StepState &state,
                const VolumeLoads<dim> &loads, double stabilisation, const UpSystem &system) override;
  void update_points(Body<dim> &body, const TimeLevel &level, const StepState &state,
                     const BlockVector &end_velocity, bool move, bool &finite) override;
  void book_seepage(const Body<dim> &body, const TimeLevel &level, const StepState &state,
                    const dealii::Tensor<1, dim> &gravity, StepWork &work) override;
  void add_momentum(const Body<dim> &body, dealii::TrilinosWrappers::MPI::Vector &momentum) override;
  void sum_mass(const Body<dim> &body, dealii::TrilinosWrappers::MPI::Vector &mass) override;
  void sum_inertia(const Body<dim> &body, dealii::TrilinosWrappers::MPI::Vector &inertia) override;
  void add_squares(const Body<dim> &body, const BlockVector &field, std::array<double, 2> &squares,
                   std::array<double, 2> &volumes) override;
  void sum_weight(const Body<dim> &body, const dealii::TrilinosWrappers::MPI::Vector &motion,
                  const VolumeLoads<dim> &loads, double time, dealii::Tensor<1, dim> &weight,
                  double &work) override;

private:
  using Points = FormPoints<dim, reach>;
  using Cell = FormCell<dim, reach>;
  using PointValues = typename Cell::State;
  using Matrices = CellMatrices<dim, reach>;
  static constexpr unsigned int n_u = Points::n_nodes * dim, n_p = Space<dim>::n_pressures;

  void add_residual(const Body<dim> &body, const Points &points, const TimeLevel &level,
                    const PointValues &at, const VolumeLoads<dim> &loads, bool has_pressure,
                    GrossResidual &gross);
  void add_fluid_residual(const Body<dim> &body, const Points &points, const TimeLevel &level,
                          const PointValues &at, const VolumeLoads<dim> &loads, GrossResidual &gross);
  Lanes fluid_storage_rate(const Body<dim> &body, const Points &points, const TimeLevel &level,
                           const PointValues &at, const VolumeLoads<dim> &loads) const;
  void add_matrices(const Body<dim> &body, std::size_t batch, const TimeLevel &level,
                    const VolumeLoads<dim> &loads, bool has_pressure);
  void book_seepage(const Body<dim> &body, const Points &points, const TimeLevel &level,
                    const PointValues &at, const dealii::Tensor<1, dim> &gravity, StepWork &work) const;
  void distribute(const TimeLevel &level, bool has_pressure, const UpSystem &system);
  void add_pressure_mass(const TimeLevel &level, const UpSystem &system);
  void add_split(const TimeLevel &level, bool has_pressure, const UpSystem &system);
  template <typename Term>
  void sum_over_nodes(const Body<dim> &body, dealii::TrilinosWrappers::MPI::Vector &sums, const Term &term);
  void stabilise(const Body<dim> &body, const Slice &slice, const TimeLevel &level, double strength,
                 bool with_matrix);
  /// For the stabilisation [1/Pa]: the larger of 1/M (one-dimensional optimum) and 1/(4 G) at the start of
  /// the step.
  double compliance(const Body<dim> &body) const;
  void begin_cell(const Body<dim> &body, CellId cell);
  /// Of the points of the present cell, with regard to how full it is.
  Lanes mobility(const Body<dim> &body, Lanes porosity) const
  {
    return filled * body.material().mixture()->mobility(porosity);
  }

  const Space<dim> &space;
  std::map<const Body<dim> *, std::vector<double>> filling_of; ///< by cells; nothing where it is 1
  double filled = 1.;                                          ///< of the present cell
  Cell cell;
  std::vector<dealii::types::global_dof_index> unknowns;
  dealii::Vector<double> local_residual;
  dealii::FullMatrix<double> local_matrix;
  Matrices matrices;
};

template <int dim, unsigned int reach>
void PointForm<dim, reach>::survey(const Body<dim> &body)
{
  if (reach == 4 && body.material().mixture())
    filling_of[&body] = filling(space.grid(), body);
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::begin_cell(const Body<dim> &body, const CellId cell)
{
  const auto known = filling_of.find(&body);
  filled = known == filling_of.end() ? 1. : known->second[cell];
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
        r -= V * total[symmetric_index[d][e]] * points.dN[i][e];
      local_residual[i * dim + d] += sum(r);
    }
  if (has_pressure)
    add_fluid_residual(body, points, level, at, loads, gross);
}

template <int dim, unsigned int reach>
Lanes PointForm<dim, reach>::fluid_storage_rate(const Body<dim> &body, const Points &points,
                                                const TimeLevel &level, const PointValues &at,
                                                const VolumeLoads<dim> &loads) const
{
  const Mixture &mixture = *body.material().mixture();
  Lanes rate =
      mixture.storage(at.porosity) * at.pressure_rate + mixture.biot_coefficient() * at.velocity_divergence;
  for (const Condition<dim> *condition : loads.fluids)
    for (unsigned int l = 0; l < points.n; ++l)
      rate[l] -= condition->fluid_source(points.position(body, l), level.time);
  return rate;
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::add_fluid_residual(const Body<dim> &body, const Points &points,
                                               const TimeLevel &level, const PointValues &at,
                                               const VolumeLoads<dim> &loads, GrossResidual &gross)
{
  const Mixture &mixture = *body.material().mixture();
  const double scale = level.fluid_scale(), inertia = level.seepage_inertia ? 1. : 0.;
  const Lanes V = points.volume, storage = fluid_storage_rate(body, points, level, at, loads);
  const Lanes mobility = V * this->mobility(body, at.porosity);
  Lanes slope = {};
  for (unsigned int d = 0; d < dim; ++d)
    slope += at.pressure_gradient[d] * at.pressure_gradient[d];
  gross[1] += std::abs(scale) *
              sum(mobility * sqrt(slope) / space.grid().smallest_cell_size() +
                  V * level.pressure_rate * mixture.storage(at.porosity) * sqrt(at.pressure * at.pressure));
  std::array<Lanes, dim> flux;
  for (unsigned int d = 0; d < dim; ++d)
    flux[d] = mobility * (mixture.fluid_density() * (loads.gravity[d] - inertia * at.acceleration[d]) -
                          at.pressure_gradient[d]);
  for (unsigned int i = 0; i < n_p; ++i) {
    Lanes r = -V * storage * points.M[i];
    for (unsigned int d = 0; d < dim; ++d)
      r += flux[d] * points.dM[i][d];
    local_residual[n_u + i] += scale * sum(r);
  }
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::add_matrices(const Body<dim> &body, const std::size_t batch,
                                         const TimeLevel &level, const VolumeLoads<dim> &loads,
                                         const bool has_pressure)
{
  const PointValues &here = cell.state(batch);
  const Mixture *mixture = body.material().mixture();
  PointCoefficients c;
  c.finite_strain = body.material().law().finite_strain();
  body.material().law().tangent(here.law_stress, here.memory.data(), c.tangent);
  c.law_stress = here.law_stress;
  c.total_stress = here.stress;
  for (unsigned int i = 0; i < 3 && mixture; ++i)
    c.total_stress[i] -= mixture->biot_coefficient() * here.pressure;
  c.volume_at_start = here.volume_at_start;
  c.volume_ratio = c.finite_strain ? 1. + here.dilatation : broadcast(1.);
  if (has_pressure) {
    c.alpha = mixture->biot_coefficient();
    c.fluid_density = mixture->fluid_density();
    c.storage = mixture->storage(here.porosity);
    c.mobility = mobility(body, here.porosity);
  }
  if (has_pressure && c.finite_strain) {
    // n gains 1 - n per volumetric strain. 1/Q is linear in it.
    constexpr double step = 1e-5;
    const Lanes solid = 1. - here.porosity;
    c.storage_rate =
        fluid_storage_rate(body, cell.points(batch), level, here, loads) +
        here.pressure_rate * solid * (mixture->storage(broadcast(1.)) - mixture->storage(broadcast(0.)));
    c.mobility_slope =
        solid * (mobility(body, here.porosity + step) - mobility(body, here.porosity - step)) / (2. * step);
    const double inertia = level.seepage_inertia ? 1. : 0.;
    for (unsigned int d = 0; d < dim; ++d) {
      c.p_slope[d] = here.pressure_gradient[d];
      c.drive[d] = mixture->fluid_density() * (loads.gravity[d] - inertia * here.acceleration[d]) -
                   here.pressure_gradient[d];
    }
    c.velocity_gradient = here.velocity_gradient;
  }
  matrices.add(cell.points(batch), c, cell.projection() ? &cell.projection()->functions(batch) : nullptr,
               has_pressure);
}

template <int dim, unsigned int reach>
double PointForm<dim, reach>::compliance(const Body<dim> &body) const
{
  double largest = 0.;
  std::array<Lanes, 36> tangent;
  std::array<Lanes, max_state_columns> memory;
  for (std::size_t b = 0; b < cell.n_batches(); ++b) {
    const Points &some = cell.points(b);
    for (unsigned int c = 0; c < body.layout().n_state; ++c)
      memory[c] = some.load(body.layout().state + c);
    body.material().law().tangent(some.stress(body.layout()), memory.data(), tangent);
    for (unsigned int l = 0; l < some.n; ++l)
      largest = std::max({largest, 1. / tangent[0][l], tangent[21][l] > 0. ? 0.25 / tangent[21][l] : 0.});
  }
  return largest;
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::stabilise(const Body<dim> &body, const Slice &slice, const TimeLevel &level,
                                      const double strength, const bool with_matrix)
{
  if (level.pressure_rate == 0.)
    return;
  // Polynomial pressure projection (Dohrmann and Bochev 2004; White and Borja 2008): tau (q - mean q)(p_t -
  // mean p_t), on the cell and scaled by how full it is.
  const Mixture &mixture = *body.material().mixture();
  const double volume = cell.volume_at_start();
  double h = std::numeric_limits<double>::max();
  for (unsigned int d = 0; d < dim; ++d)
    h = std::min(h, space.grid().size(slice.cell, d));
  const double softness = compliance(body);
  // Inertia stiffens the skeleton against what alternates from node to node; waves that steps resolve are not
  // to feel the term.
  const double inertia = mixture.density() * h * h / 12. * level.acceleration / level.share;
  const double yield = std::pow(1. / (1. + inertia * softness), 2);
  const double tau =
      strength * std::max(0., yield * (softness * 3. * std::pow(mixture.biot_coefficient(), 2) +
                                       2. * mixture.storage()) -
                                  12. * mixture.mobility() * level.dt / (h * h));
  if (tau == 0.)
    return;
  for (unsigned int i = 0; i < n_p; ++i)
    for (unsigned int j = 0; j < n_p; ++j) {
      double product = 1.;
      for (unsigned int d = 0; d < dim; ++d)
        product *= ((i ^ j) >> d) & 1 ? 1. / 6. : 1. / 3.;
      const double entry = tau * volume * (product - 1. / (n_p * n_p)) * level.fluid_scale();
      local_residual[n_u + i] -=
          entry * (level.pressure_rate * (cell.values().P[j] - cell.values().old_P[j]) +
                   cell.values().rate_history[j]);
      if (with_matrix)
        local_matrix(n_u + i, n_u + j) += level.pressure_rate * entry;
    }
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::assemble(const Body<dim> &body, const TimeLevel &level, const StepState &state,
                                     const VolumeLoads<dim> &loads, const double stabilisation,
                                     const UpSystem &system)
{
  const bool saturated = body.material().mixture() != nullptr;
  const bool has_pressure = saturated && space.has_pressure();
  const unsigned int n = n_u + (has_pressure ? n_p : 0);
  unknowns.resize(n);
  local_residual.reinit(n);
  if (system.matrix)
    local_matrix.reinit(n, n);
  for (const Slice &slice : body.slices()) {
    begin_cell(body, slice.cell);
    cell.load(slice.cell, saturated, level, state);
    local_residual = 0.;
    cell.evaluate(body, slice, level, saturated && !has_pressure ? mean_pressure(body, slice) : 0.);
    for (std::size_t b = 0; b < cell.n_batches(); ++b)
      add_residual(body, cell.points(b), level, cell.state(b), loads, has_pressure, system.gross);
    if (system.matrix) {
      matrices.clear(slice.end - slice.begin, body.material().law().finite_strain());
      for (std::size_t b = 0; b < cell.n_batches(); ++b)
        add_matrices(body, b, level, loads, has_pressure);
      matrices.multiply(level, cell.norms(), has_pressure, local_matrix);
    }
    if (has_pressure && stabilisation > 0.)
      stabilise(body, slice, level, stabilisation, system.matrix != nullptr);

    std::copy_n(space.displacements(slice.cell), n_u, unknowns.begin());
    if (has_pressure)
      std::copy_n(space.pressures(slice.cell), n_p, unknowns.begin() + n_u);
    system.residual.add(unknowns, local_residual);
    if (system.matrix)
      distribute(level, has_pressure, system);
  }
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::distribute(const TimeLevel &level, const bool has_pressure,
                                       const UpSystem &system)
{
  system.constraints.distribute_local_to_global(local_matrix, unknowns, *system.matrix);
  if (system.pressure_mass && has_pressure)
    add_pressure_mass(level, system);
  if (system.split)
    add_split(level, has_pressure, system);
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::add_pressure_mass(const TimeLevel &level, const UpSystem &system)
{
  const auto mass = matrices.pressure_mass(cell.norms());
  for (unsigned int i = 0; i < n_p; ++i)
    for (unsigned int j = 0; j < n_p; ++j) {
      const auto row = unknowns[n_u + i], column = unknowns[n_u + j];
      if (row == column ||
          (!system.constraints.is_constrained(row) && !system.constraints.is_constrained(column)))
        system.pressure_mass->add(row - space.first_pressure(), column - space.first_pressure(),
                                  level.share * mass(i, j));
    }
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::add_split(const TimeLevel &level, const bool has_pressure, const UpSystem &system)
{
  VolumetricSplit &split = *system.split;
  const auto &norms = *cell.norms();
  const auto volumetric = matrices.volumetric(norms, has_pressure);
  dealii::FullMatrix<double> shear(n_u, n_u);
  for (unsigned int i = 0; i < n_u; ++i)
    for (unsigned int j = 0; j < n_u; ++j) {
      shear(i, j) = local_matrix(i, j);
      for (unsigned int k = 0; k < Matrices::n_psi; ++k)
        shear(i, j) -= level.share * volumetric.modulus[k] / norms[k] * volumetric.gradient(k, i) *
                       volumetric.gradient(k, j);
    }
  const std::vector<dealii::types::global_dof_index> displacements(unknowns.begin(), unknowns.begin() + n_u);
  system.constraints.distribute_local_to_global(shear, displacements, split.shear);
  for (unsigned int k = 0; k < Matrices::n_psi; ++k) {
    const auto number = split.next++;
    for (unsigned int i = 0; i < n_u; ++i) {
      const auto row = equation_of(system.constraints, displacements[i]);
      if (!system.constraints.is_constrained(row))
        split.gradient.add(row, number, volumetric.gradient(k, i));
    }
    split.volumetric_compliance(number) = norms[k] / (level.share * volumetric.modulus[k]);
    split.shear_compliance(number) = norms[k] / (2. * level.share * volumetric.shear_modulus);
    for (unsigned int i = 0; i < n_p && has_pressure; ++i)
      if (!system.constraints.is_constrained(unknowns[n_u + i]))
        split.projection.add(number, unknowns[n_u + i] - space.first_pressure(),
                             level.share * volumetric.projection(k, i));
  }
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::update_points(Body<dim> &body, const TimeLevel &level, const StepState &state,
                                          const BlockVector &end_velocity, const bool move, bool &finite)
{
  const Layout &layout = body.layout();
  const Mixture *mixture = body.material().mixture();
  TimeLevel end = level;
  end.share = 1.;
  for (const Slice &slice : body.slices()) {
    cell.load(slice.cell, mixture != nullptr, level, state);
    cell.load_end_velocity(slice.cell, end_velocity);
    const auto &values = cell.values();
    cell.evaluate(body, slice, end, 0.);
    for (std::size_t b = 0; b < cell.n_batches(); ++b) {
      const Points &some = cell.points(b);
      const PointValues &here = cell.state(b);
      some.store(body, layout, here.stress, here.memory.data());
      if (values.has_pressure)
        some.store(layout.pressure, here.pressure);
      Lanes check = here.stress[0] + here.stress[1] + here.stress[2] + here.stress[3] + here.pressure;
      for (unsigned int d = 0; d < dim; ++d) {
        const Lanes u = some.value(values.U, d), v = some.value(values.end_velocity, d);
        some.store(layout.displacement + d, some.load(layout.displacement + d) + u);
        some.store(layout.velocity + d, v);
        check += v;
      }
      if (layout.velocity_gradient >= 0) {
        const GradientLanes L = some.gradient(values.end_velocity);
        for (unsigned int d = 0; d < dim; ++d)
          for (unsigned int e = 0; e < dim; ++e)
            some.store(layout.velocity_gradient + d * dim + e, L[3 * d + e]);
      }
      finite = finite && std::isfinite(sum(check));
      some.deform(body, here.gradient, values.U, move);
    }
  }
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::book_seepage(const Body<dim> &body, const TimeLevel &level,
                                         const StepState &state, const dealii::Tensor<1, dim> &gravity,
                                         StepWork &work)
{
  if (!body.material().mixture() || !space.has_pressure())
    return;
  for (const Slice &slice : body.slices()) {
    begin_cell(body, slice.cell);
    cell.load(slice.cell, true, level, state);
    cell.evaluate(body, slice, level, 0.);
    for (std::size_t b = 0; b < cell.n_batches(); ++b)
      book_seepage(body, cell.points(b), level, cell.state(b), gravity, work);
  }
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::book_seepage(const Body<dim> &body, const Points &points, const TimeLevel &level,
                                         const PointValues &at, const dealii::Tensor<1, dim> &gravity,
                                         StepWork &work) const
{
  const Mixture &mixture = *body.material().mixture();
  const double inertia = level.seepage_inertia ? 1. : 0.;
  Lanes squared = {};
  for (unsigned int d = 0; d < dim; ++d) {
    const Lanes R =
        mixture.fluid_density() * (gravity[d] - inertia * at.acceleration[d]) - at.pressure_gradient[d];
    squared += R * R;
  }
  const Lanes squeezed = mixture.biot_coefficient() * at.velocity_divergence;
  work.seepage_dissipation += level.dt * sum(points.volume * mobility(body, at.porosity) * squared);
  work.seepage_work += level.dt * sum(points.volume * at.pressure *
                                      (mixture.storage(at.porosity) * at.pressure_rate + squeezed));
  if (!body.material().law().finite_strain())
    work.fluid_squeezed += level.dt * sum(points.volume * squeezed);
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
void PointForm<dim, reach>::add_squares(const Body<dim> &body, const BlockVector &field,
                                        std::array<double, 2> &squares, std::array<double, 2> &volumes)
{
  const bool has_pressure = body.material().mixture() && space.has_pressure();
  double U[n_u], P[n_p];
  for (const Slice &slice : body.slices()) {
    for (unsigned int i = 0; i < n_u; ++i)
      U[i] = field.block(0)(space.displacements(slice.cell)[i]);
    for (unsigned int i = 0; i < n_p && has_pressure; ++i)
      P[i] = field.block(1)(space.pressures(slice.cell)[i] - space.first_pressure());
    for (std::uint32_t begin = slice.begin; begin < slice.end; begin += n_lanes) {
      const Points points(space.grid(), body, slice, begin);
      for (unsigned int d = 0; d < dim; ++d) {
        const Lanes u = points.value(U, d);
        squares[0] += sum(points.volume * u * u);
      }
      volumes[0] += sum(points.volume);
      if (!has_pressure)
        continue;
      const Lanes p = points.pressure(P);
      squares[1] += sum(points.volume * p * p);
      volumes[1] += sum(points.volume);
    }
  }
}

template <int dim, unsigned int reach>
void PointForm<dim, reach>::sum_weight(const Body<dim> &body,
                                       const dealii::TrilinosWrappers::MPI::Vector &motion,
                                       const VolumeLoads<dim> &loads, const double time,
                                       dealii::Tensor<1, dim> &weight, double &work)
{
  double U[n_u];
  for (const Slice &slice : body.slices()) {
    for (unsigned int i = 0; i < n_u; ++i)
      U[i] = motion(space.displacements(slice.cell)[i]);
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

void VolumetricSplit::clear()
{
  shear = 0.;
  gradient = 0.;
  if (projection.m() > 0)
    projection = 0.;
  next = first;
}

void VolumetricSplit::compress()
{
  shear.compress(dealii::VectorOperation::add);
  gradient.compress(dealii::VectorOperation::add);
  if (projection.m() > 0)
    projection.compress(dealii::VectorOperation::add);
  volumetric_compliance.compress(dealii::VectorOperation::insert);
  shear_compliance.compress(dealii::VectorOperation::insert);
}

template <int dim>
std::unique_ptr<UpForm<dim>> UpForm<dim>::make(const Space<dim> &space, const bool projects)
{
  switch (space.nodes()) {
  case Nodes::q1:
    return std::make_unique<PointForm<dim, 2>>(space, projects);
  case Nodes::q2:
    return std::make_unique<PointForm<dim, 3>>(space, projects);
  default:
    return std::make_unique<PointForm<dim, 4>>(space, projects);
  }
}

template class UpForm<2>;
template class UpForm<3>;
} // namespace peat
