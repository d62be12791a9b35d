#pragma once

#include <peat/base/archive.h>
#include <peat/condition/nodal_fields.h>
#include <peat/grid/active_nodes.h>
#include <peat/solver/ledger.h>

namespace peat {
/// What a run asks of whatever moves its scene on.
template <int dim>
class Solver
{
public:
  virtual ~Solver() = default;

  virtual double time() const = 0;
  /// Correct the round-off of many small steps, where the time is known.
  virtual void set_time(double time) = 0;
  virtual const ActiveNodes<dim> &nodes() const = 0;
  virtual const NodalFields<dim> &fields() const = 0;
  virtual const Ledger<dim> &ledger() const = 0;

  /// What the next step depends on beside the scene. Reading takes the place of the preparations of a new
  /// solver, after the scene has been read. Collective.
  virtual void persist(Archive &archive) = 0;
};
} // namespace peat
