#include <peat/solver/totals.h>

#include <peat/material/mixture.h>

#include <deal.II/base/mpi.h>

namespace peat {
namespace {
template <int dim>
void add(const Body<dim> &body, Totals<dim> &sum)
{
  const Layout &layout = body.layout();
  const Law &law = body.material().law();
  const Mixture *mixture = body.material().mixture();
  constexpr unsigned int n_stress = dim == 2 ? 4 : 6;
  const std::uint32_t n = body.n_local_points();
  for (std::uint32_t begin = 0; begin < n; begin += n_lanes) {
    StressLanes stress = {};
    Lanes state[max_state_columns] = {};
    for (unsigned int l = 0; l < n_lanes; ++l) {
      const double *row = body.row(std::min(begin + l, n - 1));
      for (unsigned int c = 0; c < n_stress; ++c)
        stress[c][l] = row[layout.stress + c];
      for (unsigned int c = 0; c < layout.n_state; ++c)
        state[c][l] = row[layout.state + c];
    }
    const Lanes psi = law.stored_energy(stress, state);
    for (unsigned int l = 0; l < n_lanes && begin + l < n; ++l) {
      const double *row = body.row(begin + l);
      const double m = row[layout.mass], V = row[layout.volume];
      double v2 = 0.;
      for (unsigned int d = 0; d < dim; ++d) {
        v2 += row[layout.velocity + d] * row[layout.velocity + d];
        sum.momentum[d] += m * row[layout.velocity + d];
        sum.center[d] += m * body.position(begin + l)[d];
      }
      sum.mass += m;
      sum.kinetic_energy += 0.5 * m * v2;
      sum.elastic_energy += V * psi[l];
      sum.largest_speed = std::max(sum.largest_speed, std::sqrt(v2));
      if (mixture) {
        const double porosity = layout.porosity >= 0 ? row[layout.porosity] : mixture->porosity();
        const double content = V * row[layout.pressure] * mixture->storage(broadcast(porosity))[0];
        sum.fluid_volume += V * porosity + content;
        sum.fluid_energy += 0.5 * content * row[layout.pressure];
      }
    }
  }
}
} // namespace

template <int dim>
Totals<dim> totals(const Scene<dim> &scene, MPI_Comm communicator)
{
  Totals<dim> sum;
  for (const auto &body : scene.bodies)
    add(*body, sum);
  if (dealii::Utilities::MPI::this_mpi_process(communicator) == 0)
    for (const auto &rigid : scene.rigid_bodies)
      if (!rigid->is_prescribed()) {
        sum.mass += rigid->mass();
        sum.kinetic_energy += rigid->kinetic_energy();
        sum.momentum += rigid->momentum();
        sum.center += rigid->mass() * rigid->center();
        sum.largest_speed = std::max(sum.largest_speed, rigid->velocity().norm());
      }
  std::vector<double> values = {sum.mass, sum.fluid_volume, sum.kinetic_energy, sum.elastic_energy,
                                sum.fluid_energy};
  for (unsigned int d = 0; d < dim; ++d) {
    values.push_back(sum.momentum[d]);
    values.push_back(sum.center[d]);
  }
  dealii::Utilities::MPI::sum(values, communicator, values);
  sum.mass = values[0];
  sum.fluid_volume = values[1];
  sum.kinetic_energy = values[2];
  sum.elastic_energy = values[3];
  sum.fluid_energy = values[4];
  for (unsigned int d = 0; d < dim; ++d) {
    sum.momentum[d] = values[5 + 2 * d];
    sum.center[d] = values[6 + 2 * d] / sum.mass;
  }
  sum.largest_speed = dealii::Utilities::MPI::max(sum.largest_speed, communicator);
  return sum;
}

template <int dim>
Totals<dim> Totals<dim>::without_inertia() const
{
  Totals<dim> rest = *this;
  rest.kinetic_energy = rest.largest_speed = 0.;
  rest.momentum = dealii::Tensor<1, dim>();
  return rest;
}

template <int dim>
void Balances<dim>::count_inertia(const bool inertia, const Totals<dim> &now)
{
  const Totals<dim> before = counted(now);
  has_inertia = inertia;
  const Totals<dim> after = counted(now);
  start.kinetic_energy += after.kinetic_energy - before.kinetic_energy;
  start.momentum += after.momentum - before.momentum;
}

template <int dim>
void Balances<dim>::update(const Totals<dim> &sums, const Ledger<dim> &ledger, MPI_Comm communicator)
{
  const Totals<dim> now = counted(sums);
  std::vector<double> values = {ledger.external_work, ledger.gravity_work,       ledger.seepage_dissipation,
                                ledger.seepage_work,  ledger.fluid_outflow,      ledger.fluid_squeezed,
                                ledger.gross_impulse, ledger.contact_dissipation};
  for (unsigned int d = 0; d < dim; ++d)
    values.push_back(ledger.impulse[d]);
  dealii::Utilities::MPI::sum(values, communicator, values);
  book.external_work = values[0];
  book.gravity_work = values[1];
  book.seepage_dissipation = values[2];
  book.seepage_work = values[3];
  book.fluid_outflow = values[4];
  book.fluid_squeezed = values[5];
  book.gross_impulse = values[6];
  book.contact_dissipation = values[7];
  for (unsigned int d = 0; d < dim; ++d)
    book.impulse[d] = values[8 + d];

  mass_error = std::max(mass_error, std::abs(now.mass - start.mass) / start.mass);
  if (start.fluid_volume > 0.)
    fluid_error = std::max(fluid_error, std::abs(now.fluid_volume - start.fluid_volume + book.fluid_outflow +
                                                 book.fluid_squeezed) /
                                            start.fluid_volume);
  momentum_scale =
      std::max({momentum_scale, book.gross_impulse, start.momentum.norm(), now.mass * now.largest_speed});
  if (momentum_scale > 0.)
    momentum_error =
        std::max(momentum_error, (now.momentum - start.momentum - book.impulse).norm() / momentum_scale);

  numerical_dissipation =
      start.energy() + book.external_work + book.seepage_work - book.contact_dissipation - now.energy();
  energy_scale = std::max(
      {energy_scale, now.energy(), start.energy(), std::abs(book.external_work), book.seepage_dissipation});
  if (energy_scale > 0.)
    energy_error = std::abs(numerical_dissipation) / energy_scale;
}

template <int dim>
void Balances<dim>::admit(const Totals<dim> &sums_before, const Totals<dim> &sums_after)
{
  const Totals<dim> before = counted(sums_before), after = counted(sums_after);
  start.mass += after.mass - before.mass;
  start.fluid_volume += after.fluid_volume - before.fluid_volume;
  start.kinetic_energy += after.kinetic_energy - before.kinetic_energy;
  start.elastic_energy += after.elastic_energy - before.elastic_energy;
  start.fluid_energy += after.fluid_energy - before.fluid_energy;
  start.momentum += after.momentum - before.momentum;
}

template struct Totals<2>;
template struct Totals<3>;
template Totals<2> totals<2>(const Scene<2> &, MPI_Comm);
template Totals<3> totals<3>(const Scene<3> &, MPI_Comm);
template class Balances<2>;
template class Balances<3>;
} // namespace peat
