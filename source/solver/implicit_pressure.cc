#include <peat/solver/implicit_pressure.h>

#include <deal.II/base/mpi.h>
#include <deal.II/lac/trilinos_sparsity_pattern.h>

#include <Teuchos_ParameterList.hpp>
#include <ml_MultiLevelPreconditioner.h>
#include <ml_utils.h>

#include <algorithm>
#include <cmath>

#include "persist_algebra.h"

namespace peat {
namespace {
/// With more iterations than these the diagonal alone is a poor preconditioner.
constexpr unsigned int most_with_diagonal = 25;
/// Mid-step velocity: new velocity minus this times dt a.
constexpr double half = 0.5;

/// Turn the values around a node into what alternates in them, in two directions at least, times a factor and
/// the response to it: of directions x and y; in 3-D of x and y, x and z, y and z, all three.
inline void damp_alternation(double (&value)[4], const double factor, const double *response)
{
  const double alternating = factor * response[0] * (value[0] - value[1] - value[2] + value[3]);
  value[0] = value[3] = alternating;
  value[1] = value[2] = -alternating;
}

inline void damp_alternation(double (&value)[8], const double factor, const double *response)
{
  double sum[4], difference[4];
  for (unsigned int v = 0; v < 4; ++v) {
    sum[v] = value[v] + value[v + 4];
    difference[v] = value[v] - value[v + 4];
  }
  const double along = difference[0] - difference[3], across = difference[1] - difference[2];
  const double xy = factor * response[0] * (sum[0] - sum[1] - sum[2] + sum[3]),
               xz = factor * response[1] * (along - across), yz = factor * response[2] * (along + across),
               xyz = factor * response[3] * (difference[0] + difference[3] - difference[1] - difference[2]);
  const double here[4] = {xyz + (xz + yz), (yz - xz) - xyz, (xz - yz) - xyz, xyz - (xz + yz)};
  for (unsigned int v = 0; v < 4; ++v) {
    const double same = v == 0 || v == 3 ? xy : -xy;
    value[v] = same + here[v];
    value[v + 4] = same - here[v];
  }
}
} // namespace

template <int dim>
ImplicitPressure<dim>::ImplicitPressure(const ActiveNodes<dim> &active, NodalResponse &response,
                                        const double alpha, const bool seepage_inertia,
                                        const double stabilisation, const NodeExtension<dim> *const extension)
    : active(active), response(response), alpha(alpha), seepage_inertia(seepage_inertia),
      stabilisation(stabilisation), extension(extension), communicator(active.grid().communicator())
{}

template <int dim>
void ImplicitPressure<dim>::renumber(const std::vector<CellId> &cells)
{
  cell_of_unknown = cells;
  const std::size_t n = cells.size();
  dealii::types::global_dof_index mine = n, before = 0;
  const int ierr = MPI_Exscan(&mine, &before, 1, DEAL_II_DOF_INDEX_MPI_TYPE, MPI_SUM, communicator);
  AssertThrowMPI(ierr);
  if (dealii::Utilities::MPI::this_mpi_process(communicator) == 0)
    before = 0;
  dealii::IndexSet owned(dealii::Utilities::MPI::sum(mine, communicator));
  owned.add_range(before, before + n);
  for (Vector *vector : {&x, &change, &right_side, &diagonal, &r, &z, &direction, &image})
    vector->reinit(owned, communicator);

  corner.resize(n);
  for (std::size_t k = 0; k < n; ++k)
    for (unsigned int v = 0; v < n_corners; ++v)
      corner[k][v] = active.cell_nodes(cells[k])[active.own_node(v)];

  // Each node is told which unknowns are around it, by where their cells lie; and how many they are.
  constexpr unsigned int columns = n_corners + 1;
  std::vector<double> around(active.size() * columns, -1.), count(active.size(), 0.);
  for (std::size_t k = 0; k < n; ++k)
    for (unsigned int v = 0; v < n_corners; ++v) {
      around[corner[k][v] * std::size_t(columns) + v] = before + k;
      count[corner[k][v]] += 1.;
    }
  active.max_over_ranks(around.data(), columns);
  active.sum_over_ranks(count.data(), 1);
  unbroken.assign(active.size(), 0);
  filling.assign(active.size(), 0.);
  spacing.resize(active.size() * dim);
  for (std::size_t i = 0; i < active.size(); ++i) {
    unsigned int n_cells = 0;
    for (unsigned int v = 0; v < n_corners; ++v)
      n_cells += around[i * columns + v] >= 0.;
    unbroken[i] = n_cells == n_corners && count[i] == n_corners;
    filling[i] = double(n_cells) / n_corners;
    const auto lattice = active.grid().node_lattice(active.grid_node(i));
    for (unsigned int d = 0; d < dim; ++d) {
      const auto &planes = active.grid().planes(d);
      const int last = planes.size() - 1, below = std::max(lattice[d] - 1, 0),
                above = std::min(lattice[d] + 1, last);
      spacing[i * dim + d] = (planes[above] - planes[below]) / (above - below);
    }
  }
  find_alternating(around, before);
  neighbour.resize(n);
  for (std::size_t k = 0; k < n; ++k)
    for (unsigned int face = 0; face < 2 * dim; ++face) {
      const unsigned int bit = 1u << (face / 2), v = face % 2 ? bit : 0;
      neighbour[k][face] = around[corner[k][v] * std::size_t(columns) + (v ^ bit)];
    }
  multigrid.reset();
}

template <int dim>
void ImplicitPressure<dim>::find_alternating(const std::vector<double> &around, const double before)
{
  constexpr std::size_t columns = n_corners + 1;
  const double end = before + cell_of_unknown.size();
  inner.clear();
  std::vector<char> is_inner(active.size(), 0);
  for (std::size_t i = 0; i < active.size(); ++i) {
    if (!unbroken[i])
      continue;
    const double *unknown = &around[i * columns];
    if (std::all_of(unknown, unknown + n_corners, [&](const double u) { return u >= before && u < end; })) {
      is_inner[i] = 1;
      inner.push_back({std::uint32_t(i), {}});
      std::transform(unknown, unknown + n_corners, inner.back().unknowns.begin(),
                     [&](const double u) { return std::uint32_t(u - before); });
    }
  }
  outer.clear();
  for (std::size_t k = 0; k < corner.size(); ++k)
    for (unsigned int v = 0; v < n_corners; ++v)
      if (const std::uint32_t i = corner[k][v]; unbroken[i] && !is_inner[i])
        outer.push_back({i, std::uint32_t(k), v});
}

template <int dim>
void ImplicitPressure<dim>::find_responses(const NodeFreedom<dim> &freedom, const NodalFields<dim> &nodal)
{
  using S = Sums<dim>;
  const std::size_t n = active.size();
  mobility.resize(n * dim);
  conductance.resize(n * dim);
  yield.resize(n * dim);
  q.resize(n * dim);
  const double inertia = seepage_inertia ? 1. : 0.;
  for (std::size_t i = 0; i < n; ++i) {
    const double *sum = &nodal.sums[i * nodal.n_sums];
    const double flow = sum[S::resistance] > 0. ? weight / sum[S::resistance] : 0.;
    for (unsigned int d = 0; d < dim; ++d) {
      const std::size_t row = i * dim + d;
      mobility[row] = sum[S::mass] > 0. && freedom.moves[row] ? weight * alpha / sum[S::mass] : 0.;
      // What holds a node bears the force on it. That is the other extreme, but Y is small where it matters.
      const double free_motion = response.held.empty() || !response.held[row] ? mobility[row] / weight : 0.;
      conductance[row] =
          freedom.flows[row] ? flow * (1. - inertia * sum[S::fluid_inertia] * free_motion) : 0.;
      yield[row] = dt * dt * half * alpha * mobility[row] + dt * conductance[row];
    }
  }
  walls.clear();
  for (const auto &[i, wall] : freedom.walls) {
    // A wall that is tilted where only some components may move would make the flux's part unsymmetric.
    dealii::Tensor<2, dim> free;
    for (unsigned int d = 0; d < dim; ++d)
      free[d][d] = conductance[std::size_t(i) * dim + d];
    const auto squared = transpose(wall) * wall;
    walls.emplace_back(i, 0.5 * (squared * free + free * squared));
    for (unsigned int d = 0; d < dim; ++d) {
      const std::size_t row = std::size_t(i) * dim + d;
      conductance[row] = 0.;
      yield[row] = dt * dt * half * alpha * mobility[row];
    }
  }
  if (!response.conductance.empty())
    response.conductance = conductance;
  seen_yield = yield;
  if (extension)
    extension->unfold_compliance(seen_yield.data(), dim);
}

template <int dim>
void ImplicitPressure<dim>::find_mode_responses()
{
  const std::size_t n = active.size();
  mode_response.assign(n * n_modes, 0.);
  if (dealii::Utilities::MPI::n_mpi_processes(communicator) > 1)
    mode.resize(n * n_modes);
  if (stabilisation == 0.)
    return;
  for (std::size_t i = 0; i < n; ++i) {
    if (!unbroken[i])
      continue;
    double volume = 1., along[dim];
    for (unsigned int d = 0; d < dim; ++d) {
      const double h = spacing[i * dim + d];
      volume *= h;
      along[d] = 4. * seen_yield[i * dim + d] / (h * h);
    }
    for (unsigned int m = 0; m < n_modes; ++m)
      for (unsigned int d = 0; d < dim; ++d)
        if (mode_directions[m] >> d & 1)
          mode_response[i * n_modes + m] +=
              stabilisation * along[d] * volume * volume / (n_corners * n_corners);
  }
}

template <int dim>
void ImplicitPressure<dim>::find_right_side(const dealii::Tensor<1, dim> &gravity,
                                            const NodalFields<dim> &nodal)
{
  using S = Sums<dim>;
  // What has to vanish at rest, and what its parts would be if none cancelled another.
  carry.resize(active.size() * dim);
  gross.resize(active.size() * dim);
  for (std::size_t i = 0; i < active.size(); ++i) {
    const double *sum = &nodal.sums[i * nodal.n_sums];
    const double flow = sum[S::resistance] > 0. ? 1. / sum[S::resistance] : 0.;
    for (unsigned int d = 0; d < dim; ++d) {
      const std::size_t row = i * dim + d;
      carry[row] =
          -dt * (alpha * (nodal.new_velocity[row] - half * dt * nodal.acceleration[row]) + nodal.flux[row]);
      gross[row] = dt * (alpha * std::abs(nodal.new_velocity[row]) +
                         flow * (std::abs(sum[S::pressure_force + d]) + std::abs(nodal.pressure_load[row]) +
                                 sum[S::fluid_inertia] * std::abs(gravity[d])));
    }
  }
  if (extension) {
    extension->unfold(carry.data(), dim);
    extension->unfold(gross.data(), dim);
  }
  double sum_of_squares = 0.;
  for (std::size_t k = 0; k < sums.storage.size(); ++k) {
    double sum = 0., parts = 0.;
    for (std::uint32_t e = sums.entry_begin[k]; e < sums.entry_begin[k + 1]; ++e)
      for (unsigned int d = 0; d < dim; ++d) {
        sum += sums.slopes[e * std::size_t(dim) + d] * carry[sums.entry_node[e] * std::size_t(dim) + d];
        parts += std::abs(sums.slopes[e * std::size_t(dim) + d]) *
                 gross[sums.entry_node[e] * std::size_t(dim) + d];
      }
    right_side.local_element(k) = sum;
    r.local_element(k) = sum - sums.storage[k] * x.local_element(k);
    parts += sums.storage[k] * std::abs(x.local_element(k));
    sum_of_squares += parts * parts / diagonal.local_element(k);
  }
  add_stabilisation(x, -1., r);
  constexpr double relative = 1e-15;
  round_off = relative * relative * sum_of_squares;
}

template <int dim>
void ImplicitPressure<dim>::to_nodes(const Vector &pressures)
{
  std::fill(q.begin(), q.end(), 0.);
  const std::uint32_t *node = sums.entry_node.data();
  const double *slope = sums.slopes.data();
  for (std::size_t k = 0; k < sums.storage.size(); ++k) {
    const double p = pressures.local_element(k);
    for (std::uint32_t e = sums.entry_begin[k]; e < sums.entry_begin[k + 1]; ++e, ++node, slope += dim) {
      double *at_node = &q[*node * std::size_t(dim)];
      for (unsigned int d = 0; d < dim; ++d)
        at_node[d] += p * slope[d];
    }
  }
  active.sum_over_ranks(q.data(), dim);
  if (extension)
    extension->fold(q.data(), dim, 0, dim);
}

template <int dim>
void ImplicitPressure<dim>::find_accelerations_and_fluxes()
{
  for (std::size_t row = 0; row < q.size(); ++row) {
    response.acceleration[row] = mobility[row] * q[row];
    response.flux[row] = conductance[row] * q[row];
  }
  for (const auto &[i, tensor] : walls)
    for (unsigned int d = 0; d < dim; ++d)
      for (unsigned int c = 0; c < dim; ++c)
        response.flux[std::size_t(i) * dim + d] += tensor[d][c] * q[std::size_t(i) * dim + c];
}

template <int dim>
void ImplicitPressure<dim>::apply(const Vector &pressures, Vector &result)
{
  // From here on q is G q.
  if (response.acceleration.empty()) {
    through_walls.clear();
    for (const auto &[i, tensor] : walls) {
      dealii::Tensor<1, dim> force;
      for (unsigned int d = 0; d < dim; ++d)
        force[d] = q[std::size_t(i) * dim + d];
      through_walls.push_back(dt * (tensor * force));
    }
    for (std::size_t row = 0; row < q.size(); ++row)
      q[row] *= yield[row];
    for (std::size_t w = 0; w < walls.size(); ++w)
      for (unsigned int d = 0; d < dim; ++d)
        q[std::size_t(walls[w].first) * dim + d] += through_walls[w][d];
  } else
    for (std::size_t row = 0; row < q.size(); ++row)
      q[row] = dt * (half * dt * alpha * response.acceleration[row] + response.flux[row]);
  if (extension)
    extension->unfold(q.data(), dim);

  const std::uint32_t *node = sums.entry_node.data();
  const double *slope = sums.slopes.data();
  for (std::size_t k = 0; k < sums.storage.size(); ++k) {
    double sum[dim] = {};
    for (std::uint32_t e = sums.entry_begin[k]; e < sums.entry_begin[k + 1]; ++e, ++node, slope += dim) {
      const double *at_node = &q[*node * std::size_t(dim)];
      for (unsigned int d = 0; d < dim; ++d)
        sum[d] += slope[d] * at_node[d];
    }
    double total = sums.storage[k] * pressures.local_element(k);
    for (unsigned int d = 0; d < dim; ++d)
      total += sum[d];
    result.local_element(k) = total;
  }
  add_stabilisation(pressures, 1., result);
}

template <int dim>
void ImplicitPressure<dim>::add_stabilisation(const Vector &pressures, const double factor,
                                              Vector &result) const
{
  if (stabilisation == 0.)
    return;
  const double *pressure = pressures.begin();
  double *image = result.begin();
  for (const auto &[i, unknowns] : inner) {
    double value[n_corners];
    for (unsigned int v = 0; v < n_corners; ++v)
      value[v] = pressure[unknowns[v]];
    damp_alternation(value, factor, &mode_response[i * n_modes]);
    for (unsigned int v = 0; v < n_corners; ++v)
      image[unknowns[v]] += value[v];
  }
  if (dealii::Utilities::MPI::n_mpi_processes(communicator) == 1)
    return;
  const auto sign = [](const OuterCorner &at, const unsigned int m) {
    return __builtin_parity(at.corner & mode_directions[m]) ? -1. : 1.;
  };
  std::fill(mode.begin(), mode.end(), 0.);
  for (const OuterCorner &at : outer)
    for (unsigned int m = 0; m < n_modes; ++m)
      mode[at.node * std::size_t(n_modes) + m] += sign(at, m) * pressures.local_element(at.unknown);
  active.sum_over_ranks(mode.data(), n_modes);
  for (const OuterCorner &at : outer)
    for (unsigned int m = 0; m < n_modes; ++m) {
      const std::size_t row = at.node * std::size_t(n_modes) + m;
      result.local_element(at.unknown) += sign(at, m) * factor * mode_response[row] * mode[row];
    }
}

template <int dim>
void ImplicitPressure<dim>::find_diagonal()
{
  std::vector<std::uint32_t> wall_of_node(walls.empty() ? 0 : active.size(), no_index);
  for (std::size_t w = 0; w < walls.size(); ++w)
    wall_of_node[walls[w].first] = w;
  for (std::size_t k = 0; k < sums.storage.size(); ++k) {
    double sum = sums.storage[k];
    for (std::uint32_t e = sums.entry_begin[k]; e < sums.entry_begin[k + 1]; ++e) {
      const std::size_t i = sums.entry_node[e];
      const double *value = &sums.slopes[e * std::size_t(dim)];
      for (unsigned int d = 0; d < dim; ++d)
        sum += value[d] * value[d] * seen_yield[i * dim + d];
      if (!walls.empty() && wall_of_node[i] != no_index)
        for (unsigned int d = 0; d < dim; ++d)
          for (unsigned int c = 0; c < dim; ++c)
            sum += dt * value[d] * walls[wall_of_node[i]].second[d][c] * value[c];
    }
    for (unsigned int v = 0; v < n_corners; ++v)
      for (unsigned int m = 0; m < n_modes; ++m)
        sum += mode_response[corner[k][v] * std::size_t(n_modes) + m];
    diagonal.local_element(k) = sum;
  }
}

template <int dim>
void ImplicitPressure<dim>::number_star()
{
  using S = dealii::types::global_dof_index;
  const dealii::IndexSet &owned = x.locally_owned_elements();
  dealii::TrilinosWrappers::SparsityPattern pattern(owned, owned, communicator, 2 * dim + 1);
  const S first = cell_of_unknown.empty() ? 0 : owned.nth_index_in_set(0);
  for (std::size_t k = 0; k < cell_of_unknown.size(); ++k) {
    pattern.add(first + k, first + k);
    for (const double other : neighbour[k])
      if (other >= 0.)
        pattern.add(first + k, S(other));
  }
  pattern.compress();
  star.reinit(pattern);
}

template <int dim>
void ImplicitPressure<dim>::fill_star()
{
  // Full cells with the stabilisation have this operator; others nearly.
  using S = dealii::types::global_dof_index;
  const S first = star.local_range().first;
  const Grid<dim> &grid = active.grid();
  for (std::size_t k = 0; k < sums.storage.size(); ++k) {
    double own = sums.storage[k];
    for (unsigned int face = 0; face < 2 * dim; ++face) {
      const unsigned int d = face / 2;
      double coupling = 0.;
      for (unsigned int v = 0; v < n_corners; ++v)
        if ((v >> d & 1) == face % 2) {
          const std::size_t i = corner[k][v];
          double volume = 1.;
          for (unsigned int e = 0; e < dim; ++e)
            volume *= spacing[i * dim + e];
          coupling += seen_yield[i * dim + d] * volume * volume * filling[i];
        }
      const double h = grid.size(cell_of_unknown[k], d);
      coupling *= 2. / n_corners / (h * h);
      if (neighbour[k][face] >= 0.) {
        star.set(first + k, S(neighbour[k][face]), -coupling);
        own += coupling;
      } else
        own += 2. * coupling;
    }
    star.set(first + k, first + k, own);
  }
  star.compress(dealii::VectorOperation::insert);
  // ML adds 1e-12 to the diagonal of the coarsest level, whatever stands there; these are small numbers. To
  // conjugate gradients the factor means nothing.
  double largest = 0.;
  for (std::size_t k = 0; k < sums.storage.size(); ++k)
    largest = std::max(largest, star.diag_element(first + k));
  star *= 1. / dealii::Utilities::MPI::max(largest, communicator);
}

template <int dim>
void ImplicitPressure<dim>::make_multigrid()
{
  Teuchos::ParameterList list;
  ML_Epetra::SetDefaults("SA", list);
  list.set("ML output", 0);
  list.set("aggregation: type", "Uncoupled");
  list.set("smoother: type", "Chebyshev");
  list.set("smoother: sweeps", 1);
  list.set("smoother: Chebyshev alpha", 10.);
  list.set("coarse: type", "Amesos-KLU");
  list.set("coarse: max size", 1000);
  multigrid = std::make_unique<dealii::TrilinosWrappers::PreconditionAMG>();
  ML_set_random_seed(multigrid_seed);
  multigrid->initialize(star, list);
}

template <int dim>
void ImplicitPressure<dim>::precondition(const Vector &residual, Vector &result) const
{
  if (multigrid)
    multigrid->vmult(result, residual);
  else
    for (std::size_t k = 0; k < sums.storage.size(); ++k)
      result.local_element(k) = residual.local_element(k) / diagonal.local_element(k);
}

template <int dim>
double ImplicitPressure<dim>::squared_norm(const Vector &vector) const
{
  double sum = 0.;
  for (std::size_t k = 0; k < sums.storage.size(); ++k)
    sum += vector.local_element(k) * vector.local_element(k) / diagonal.local_element(k);
  return sum;
}

template <int dim>
void ImplicitPressure<dim>::judge_preconditioner(const unsigned int n_iterations)
{
  if (!multigrid)
    wants_multigrid = wants_multigrid || n_iterations > most_with_diagonal;
  else if (fresh_iterations == 0)
    fresh_iterations = n_iterations;
  else if (n_iterations > 2 * fresh_iterations + 5)
    multigrid.reset();
}

template <int dim>
void ImplicitPressure<dim>::update(NodalFields<dim> &nodal)
{
  using S = Sums<dim>;
  for (std::size_t k = 0; k < sums.storage.size(); ++k)
    x.local_element(k) += change.local_element(k);
  const bool coupled = !response.acceleration.empty();
  for (std::size_t i = 0; i < active.size(); ++i) {
    double *sum = &nodal.sums[i * nodal.n_sums];
    for (unsigned int d = 0; d < dim; ++d) {
      const std::size_t row = i * dim + d;
      sum[S::force + d] += weight * alpha * q[row];
      sum[S::pressure_force + d] += weight * q[row];
      const double a = mobility[row] * q[row];
      nodal.acceleration[row] += a;
      nodal.new_velocity[row] += dt * a;
      nodal.flux[row] += coupled ? response.flux[row] : conductance[row] * q[row];
    }
  }
  if (coupled)
    return;
  for (const auto &[i, tensor] : walls)
    for (unsigned int d = 0; d < dim; ++d)
      for (unsigned int c = 0; c < dim; ++c)
        nodal.flux[std::size_t(i) * dim + d] += tensor[d][c] * q[std::size_t(i) * dim + c];
}

template <int dim>
void ImplicitPressure<dim>::finish(const NodalFields<dim> &nodal)
{
  outflow = squeezed = 0.;
  // In the place of what was tried.
  std::vector<double> &motion = q, &flux = carry;
  flux = nodal.flux;
  for (std::size_t row = 0; row < motion.size(); ++row)
    motion[row] = alpha * (nodal.new_velocity[row] - half * dt * nodal.acceleration[row]);
  if (extension) {
    extension->unfold(motion.data(), dim);
    extension->unfold(flux.data(), dim);
  }
  for (std::size_t k = 0; k < sums.storage.size(); ++k)
    for (std::uint32_t e = sums.entry_begin[k]; e < sums.entry_begin[k + 1]; ++e)
      for (unsigned int d = 0; d < dim; ++d) {
        const std::size_t row = sums.entry_node[e] * std::size_t(dim) + d;
        const double value = dt * sums.slopes[e * std::size_t(dim) + d];
        outflow += value * flux[row];
        squeezed += value * motion[row];
      }
}

template <int dim>
void ImplicitPressure<dim>::begin()
{
  std::copy(sums.last_increment.begin(), sums.last_increment.end(), x.begin());
}

template <int dim>
void ImplicitPressure<dim>::prepare(const NodeFreedom<dim> &freedom, const dealii::Tensor<1, dim> &gravity,
                                    const NodalFields<dim> &nodal)
{
  dt = nodal.dt;
  find_responses(freedom, nodal);
  find_mode_responses();
  find_diagonal();
  find_right_side(gravity, nodal);
  if (!wants_multigrid || multigrid)
    return;
  number_star();
  fill_star();
  make_multigrid();
  fresh_iterations = 0;
  ++multigrids_made;
}

template <int dim>
void ImplicitPressure<dim>::persist(Archive &archive)
{
  archive.begin("implicit pressure");
  bool has_multigrid = multigrid != nullptr;
  archive(outflow, squeezed, wants_multigrid, fresh_iterations, multigrids_made, has_multigrid);
  if (!has_multigrid)
    return;
  if (archive.is_loading())
    number_star();
  persist_values(archive, star);
  if (archive.is_loading())
    make_multigrid();
}

template class ImplicitPressure<2>;
template class ImplicitPressure<3>;
} // namespace peat
