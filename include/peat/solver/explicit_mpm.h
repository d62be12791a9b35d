#pragma once

#include <peat/solver/contact_solver.h>
#include <peat/solver/continuum.h>
#include <peat/solver/pressure_system.h>
#include <peat/solver/solver.h>
#include <peat/solver/time_step.h>

namespace peat {
/// The explicit coupled material point method (theory.md, a step). Bodies and tracers belong to the caller,
/// and live as long as this.
template <int dim>
class ExplicitMPM : public Solver<dim>
{
public:
  /// `carried` is what has gone in before the start (by this rank).
  ExplicitMPM(const SchemeParameters &scheme, const Grid<dim> &grid, Scene<dim> &scene, double start_time,
              const Ledger<dim> &carried = {});

  /// Number the nodes that carry material and everything that depends on them. Collective.
  void prepare();

  /// Advance by dt. Throws NumericalError on every rank if a point is lost or a number is not finite on any.
  void step(double dt);

  StableStep stable_step() const;
  double time() const override { return now; }
  void set_time(const double time) override { now = time; }
  /// Of this stage; all zero with explicit pressures.
  PressureWork pressure_work() const { return pressures.work(); }
  /// Of all bodies together.
  const ActiveNodes<dim> &nodes() const override;
  const NodalFields<dim> &fields() const override;
  const Ledger<dim> &ledger() const override { return book; }
  void persist(Archive &archive) override;

private:
  void find_flux();
  /// Implicit pressures, with what bodies in contact make of them.
  void solve_pressure();
  void relocate_points();
  void gather_flux() const;

  const SchemeParameters &scheme;
  const Grid<dim> &grid;
  Scene<dim> &scene;
  std::vector<std::unique_ptr<Continuum<dim>>> continua;
  ContactSolver<dim> contact;
  PressureSystem<dim> pressures;
  /// Where there are contacts: the nodes of all, and what pictures ask for on them.
  std::unique_ptr<ActiveNodes<dim>> all_nodes;
  mutable NodalFields<dim> all_fields;

  double now;
  Ledger<dim> book;
};
} // namespace peat
