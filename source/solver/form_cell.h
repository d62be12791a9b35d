#pragma once

#include "form_projection.h"

// What the points of a cell see of a step: motion, stress, pressure and their rates at the level's time.

namespace peat {
/// The points of one body in one cell at a level of time.
template <int dim, unsigned int reach>
class FormCell
{
public:
  using Points = FormPoints<dim, reach>;
  using Projection = CellProjection<dim, reach>;
  static constexpr unsigned int n_u = Points::n_nodes * dim, n_p = Space<dim>::n_pressures;

  /// Nodal values.
  struct Values
  {
    double U[n_u], v_history[n_u], a_history[n_u], end_velocity[n_u], moved[n_u];
    double P[n_p], rate_history[n_p], old_P[n_p];
    bool has_pressure, has_moved;
  };
  /// Of eight points.
  struct State
  {
    GradientLanes gradient; ///< of u - u_n, referred to the start of the step
    Lanes volume_at_start;
    Lanes dilatation;       ///< that the law sees: J - 1, or the trace of the strain
    StressLanes law_stress; ///< as the law has it
    StressLanes stress;     ///< that acts: with the projected mean
    std::array<Lanes, max_state_columns> memory;
    std::array<Lanes, dim> acceleration, pressure_gradient;
    Lanes gross_acceleration; ///< what it would be if its parts did not cancel each other
    GradientLanes velocity_gradient;
    Lanes velocity_divergence, porosity, old_pressure, pressure, pressure_rate;
  };

  /// `projects`: the law sees volumetric strains by their projections on cells.
  FormCell(const Space<dim> &space, const bool projects) : space(space), projects(projects) {}

  void load(CellId cell, bool saturated, const TimeLevel &level, const StepState &state);
  void load_end_velocity(CellId cell, const BlockVector &velocity);
  const Values &values() const { return nodal; }

  /// Find the state of the points of a slice from the loaded values; `mean_pressure` acts where nodes have
  /// none. Under finite strain the points' volumes and slopes are then those at the level's time.
  void evaluate(const Body<dim> &body, const Slice &slice, const TimeLevel &level, double mean_pressure);
  std::size_t n_batches() const { return batches.size(); }
  const Points &points(const std::size_t b) const { return batches[b]; }
  const State &state(const std::size_t b) const { return states[b]; }
  /// Null without projection.
  const Projection *projection() const { return projects ? &projector : nullptr; }
  const std::array<double, Projection::n_functions> *norms() const
  {
    return projects ? &projector.norms() : nullptr;
  }
  double volume_at_start() const;

private:
  void find_motion(bool finite_strain, const TimeLevel &level, Points &points, State &at) const;
  void find_stress(const Body<dim> &body);
  void find_rates(const Body<dim> &body, const TimeLevel &level, double mean_pressure, const Points &points,
                  State &at) const;
  /// The displacement gradient of the step with the projected dilatation.
  GradientLanes seen_gradient(const State &at, Lanes dilatation, bool finite_strain) const;
  static void gather(const dealii::TrilinosWrappers::MPI::Vector &vector,
                     const dealii::types::global_dof_index *unknowns, unsigned int n,
                     dealii::types::global_dof_index offset, double *result);
  static GradientLanes inverse(const GradientLanes &h, Lanes J);

  const Space<dim> &space;
  const bool projects;
  Values nodal;
  std::vector<Points> batches;
  std::vector<State> states;
  Projection projector;
  std::vector<Lanes> projected;
};

template <int dim, unsigned int reach>
void FormCell<dim, reach>::gather(const dealii::TrilinosWrappers::MPI::Vector &vector,
                                  const dealii::types::global_dof_index *unknowns, const unsigned int n,
                                  const dealii::types::global_dof_index offset, double *result)
{
  for (unsigned int i = 0; i < n; ++i)
    result[i] = vector(unknowns[i] - offset);
}

template <int dim, unsigned int reach>
void FormCell<dim, reach>::load(const CellId cell, const bool saturated, const TimeLevel &level,
                                const StepState &state)
{
  const auto *u = space.displacements(cell);
  gather(state.unknown.block(0), u, n_u, 0, nodal.U);
  std::fill_n(nodal.a_history, n_u, 0.);
  gather(state.rate_history.block(0), u, n_u, 0, nodal.v_history);
  if (level.acceleration > 0.)
    gather(state.second_history.block(0), u, n_u, 0, nodal.a_history);
  nodal.has_moved = state.moved.size() > 0;
  if (nodal.has_moved)
    gather(state.moved, u, n_u, 0, nodal.moved);
  nodal.has_pressure = saturated && space.has_pressure();
  if (!nodal.has_pressure)
    return;
  const auto *p = space.pressures(cell);
  const auto offset = space.first_pressure();
  gather(state.unknown.block(1), p, n_p, offset, nodal.P);
  gather(state.rate_history.block(1), p, n_p, offset, nodal.rate_history);
  gather(state.second_history.block(1), p, n_p, offset, nodal.old_P);
}

template <int dim, unsigned int reach>
void FormCell<dim, reach>::load_end_velocity(const CellId cell, const BlockVector &velocity)
{
  gather(velocity.block(0), space.displacements(cell), n_u, 0, nodal.end_velocity);
}

template <int dim, unsigned int reach>
double FormCell<dim, reach>::volume_at_start() const
{
  double volume = 0.;
  for (const State &some : states)
    volume += sum(some.volume_at_start);
  return volume;
}

template <int dim, unsigned int reach>
void FormCell<dim, reach>::evaluate(const Body<dim> &body, const Slice &slice, const TimeLevel &level,
                                    const double mean_pressure)
{
  const bool finite = body.material().law().finite_strain();
  batches.clear();
  for (std::uint32_t begin = slice.begin; begin < slice.end; begin += n_lanes)
    batches.emplace_back(space.grid(), body, slice, begin);
  states.resize(batches.size());
  if (projects)
    projector.reinit(space.grid(), body, slice, batches);
  for (std::size_t b = 0; b < batches.size(); ++b)
    find_motion(finite, level, batches[b], states[b]);
  find_stress(body);
  for (std::size_t b = 0; b < batches.size(); ++b)
    find_rates(body, level, mean_pressure, batches[b], states[b]);
}

/// (I + h)^-1, where J = det(I + h).
template <int dim, unsigned int reach>
GradientLanes FormCell<dim, reach>::inverse(const GradientLanes &h, const Lanes J)
{
  GradientLanes F = h;
  for (unsigned int c = 0; c < 9; c += 4)
    F[c] += 1.;
  GradientLanes result = {F[4] * F[8] - F[5] * F[7], F[2] * F[7] - F[1] * F[8], F[1] * F[5] - F[2] * F[4],
                          F[5] * F[6] - F[3] * F[8], F[0] * F[8] - F[2] * F[6], F[2] * F[3] - F[0] * F[5],
                          F[3] * F[7] - F[4] * F[6], F[1] * F[6] - F[0] * F[7], F[0] * F[4] - F[1] * F[3]};
  for (Lanes &component : result)
    component /= J;
  return result;
}

template <int dim, unsigned int reach>
void FormCell<dim, reach>::find_motion(const bool finite, const TimeLevel &level, Points &points,
                                       State &at) const
{
  at.volume_at_start = points.volume;
  if (finite && nodal.has_moved) {
    // Volumes of points follow the motion, shape functions do not.
    const GradientLanes before = points.gradient(nodal.moved);
    points.push_forward(inverse(before, 1. + volume_change(before)), broadcast(1.));
  }
  at.gradient = points.gradient(nodal.U);
  for (Lanes &component : at.gradient)
    component *= level.share;
  at.dilatation = at.gradient[0] + at.gradient[4] + at.gradient[8];
  if (!finite)
    return;
  at.dilatation = volume_change(at.gradient);
  const Lanes J = 1. + at.dilatation;
  points.push_forward(inverse(at.gradient, J), J);
}

template <int dim, unsigned int reach>
GradientLanes FormCell<dim, reach>::seen_gradient(const State &at, const Lanes dilatation,
                                                  const bool finite) const
{
  GradientLanes seen = at.gradient;
  if (!finite) {
    for (unsigned int c = 0; c < 9; c += 4)
      seen[c] += (dilatation - at.dilatation) / 3.;
    return seen;
  }
  // (Pi J/J)^(1/3) - 1, accurate for tiny strains.
  const Lanes stretch = map((log_one_plus(dilatation) - log_one_plus(at.dilatation)) / 3.,
                            [](const double x) { return std::expm1(x); });
  for (unsigned int c = 0; c < 9; ++c)
    seen[c] += stretch * at.gradient[c];
  for (unsigned int c = 0; c < 9; c += 4)
    seen[c] += stretch;
  return seen;
}

template <int dim, unsigned int reach>
void FormCell<dim, reach>::find_stress(const Body<dim> &body)
{
  const Layout &layout = body.layout();
  const Law &law = body.material().law();
  projected.resize(states.size());
  for (std::size_t b = 0; b < states.size(); ++b)
    projected[b] = states[b].dilatation;
  if (projects)
    projector.project(projected);
  for (std::size_t b = 0; b < states.size(); ++b) {
    State &at = states[b];
    const GradientLanes seen = projects ? seen_gradient(at, projected[b], law.finite_strain()) : at.gradient;
    at.dilatation = projected[b];
    at.stress = at.law_stress = batches[b].stress(layout);
    for (unsigned int c = 0; c < layout.n_state; ++c)
      at.memory[c] = batches[b].load(layout.state + c);
    law.update(seen, at.law_stress, at.memory.data());
    projected[b] = (trace(at.law_stress) - trace(at.stress)) / 3.;
  }
  if (projects)
    projector.project(projected);
  for (std::size_t b = 0; b < states.size(); ++b) {
    State &at = states[b];
    const Lanes shift = trace(at.stress) / 3. + projected[b] - trace(at.law_stress) / 3.;
    at.stress = at.law_stress;
    for (unsigned int c = 0; c < 3 && projects; ++c)
      at.stress[c] += shift;
  }
}

template <int dim, unsigned int reach>
void FormCell<dim, reach>::find_rates(const Body<dim> &body, const TimeLevel &level,
                                      const double mean_pressure, const Points &points, State &at) const
{
  const Layout &layout = body.layout();
  at.velocity_gradient = points.gradient(nodal.v_history);
  const GradientLanes of_step = points.gradient(nodal.U);
  for (unsigned int c = 0; c < 9; ++c)
    at.velocity_gradient[c] += level.velocity * of_step[c];
  at.velocity_divergence = at.velocity_gradient[0] + at.velocity_gradient[4] + at.velocity_gradient[8];
  Lanes parts = {};
  for (unsigned int d = 0; d < dim; ++d) {
    const Lanes of_motion = level.acceleration * points.value(nodal.U, d),
                of_history = points.value(nodal.a_history, d);
    at.acceleration[d] = of_motion + of_history;
    parts += of_motion * of_motion + of_history * of_history;
    if (level.old_velocity != 0.) {
      const Lanes of_velocity = level.old_velocity * points.load(layout.velocity + d);
      at.acceleration[d] += of_velocity;
      parts += of_velocity * of_velocity;
    }
  }
  at.gross_acceleration = sqrt(parts);

  at.old_pressure = layout.pressure >= 0 ? points.load(layout.pressure) : Lanes{};
  at.pressure = broadcast(mean_pressure);
  at.pressure_rate = Lanes{};
  at.pressure_gradient.fill(Lanes{});
  if (!nodal.has_pressure)
    return;
  const Mixture &mixture = *body.material().mixture();
  at.porosity = points.porosity(layout, mixture);
  if (layout.porosity >= 0)
    at.porosity = 1. - (1. - at.porosity) / (1. + volume_change(at.gradient));
  const Lanes P = points.pressure(nodal.P);
  at.pressure = level.share * P + (1. - level.share) * at.old_pressure;
  at.pressure_rate = level.pressure_rate * (P - at.old_pressure);
  if (level.pressure_rate > 0.)
    at.pressure_rate += points.pressure(nodal.rate_history);
  for (unsigned int d = 0; d < dim; ++d) {
    at.pressure_gradient[d] = level.share * points.pressure_slope(nodal.P, d);
    if (level.share < 1.)
      at.pressure_gradient[d] += (1. - level.share) * points.pressure_slope(nodal.old_P, d);
  }
}

/// Mean over the points of a cell by their volumes.
template <int dim>
double mean_pressure(const Body<dim> &body, const Slice &slice)
{
  double V = 0., Vp = 0.;
  for (std::uint32_t i = slice.begin; i < slice.end; ++i) {
    const double *row = body.row(body.handles()[i]);
    V += row[body.layout().volume];
    Vp += row[body.layout().volume] * row[body.layout().pressure];
  }
  return Vp / V;
}
} // namespace peat
