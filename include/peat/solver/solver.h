#pragma once

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
};
} // namespace peat
