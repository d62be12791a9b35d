#pragma once

#include <peat/solver/explicit_mpm.h>

#include <deal.II/base/tensor.h>

namespace peat {
/// Sums over all points of all bodies and ranks, and over the free rigid bodies.
template <int dim>
struct Totals
{
  double mass = 0.;           ///< [kg]
  double fluid_volume = 0.;   ///< sum V (n + p/Q) [m^dim]
  double kinetic_energy = 0.; ///< [J]
  double elastic_energy = 0.; ///< [J]
  double fluid_energy = 0.;   ///< sum V p^2 / (2 Q) [J]
  double largest_speed = 0.;  ///< [m/s]
  dealii::Tensor<1, dim> momentum;
  dealii::Tensor<1, dim> center; ///< of mass [m]

  double energy() const { return kinetic_energy + elastic_energy + fluid_energy; }
  /// What counts where the equations have no inertia: there velocities carry neither momentum nor energy.
  Totals without_inertia() const;
};

/// Collective.
template <int dim>
Totals<dim> totals(const Scene<dim> &scene, MPI_Comm communicator);

/// Keeps the balances of a run: what the points hold against what the ledger says went in.
template <int dim>
class Balances
{
public:
  Balances(const Totals<dim> &start) : start(start) {}

  /// Collective; `ledger` is this rank's share.
  void update(const Totals<dim> &now, const Ledger<dim> &ledger, MPI_Comm communicator);

  /// From now on the equations have inertia, or not; `now` is what the points hold.
  void count_inertia(bool inertia, const Totals<dim> &now);

  /// Bodies have come in, which changed the totals.
  void admit(const Totals<dim> &before, const Totals<dim> &after);

  const Ledger<dim> &ledger() const { return book; }
  /// Relative errors; the largest so far.
  double mass_error = 0.;
  double fluid_error = 0.;
  double momentum_error = 0.;
  double energy_error = 0.;
  /// Energy that the scheme took out (positive) or put in [J].
  double numerical_dissipation = 0.;

private:
  /// Of what points hold, what the equations of this stage know of.
  Totals<dim> counted(const Totals<dim> &sums) const { return has_inertia ? sums : sums.without_inertia(); }

  Totals<dim> start;
  bool has_inertia = true;
  Ledger<dim> book;
  double momentum_scale = 0.;
  double energy_scale = 0.;
};
} // namespace peat
