#pragma once

#include <peat/solver/implicit_pressure.h>
#include <peat/solver/nodal_coupling.h>

#include <vector>

namespace peat {
/// What implicit pressures cost so far.
struct PressureWork
{
  unsigned long solves = 0;
  unsigned long iterations = 0;
  unsigned long multigrids = 0; ///< preconditioners made
};

/// The pore pressures of all continua of a semi-implicit step: one symmetric, positive definite system, in
/// which continua meet by what couples their nodes alone. Solved by conjugate gradients; each continuum has
/// its own preconditioner.
template <int dim>
class PressureSystem
{
public:
  /// @param coupling nullptr: nodes are free, and each continuum is alone
  /// @param tolerance residual over right-hand side, in the norm of the inverse diagonal
  void reinit(std::vector<ImplicitPressure<dim> *> pressures, NodalCoupling *coupling, double tolerance,
              MPI_Comm communicator);

  bool is_empty() const { return members.empty(); }
  /// Find the changes of the members' increments from what they have prepared, and what these do to the
  /// nodes. Throws NumericalError on every rank if they do not converge. Collective.
  void solve();
  PressureWork work() const;
  void persist(Archive &archive) { archive(n_solves, n_iterations); }

private:
  using Member = ImplicitPressure<dim>;
  template <typename Term>
  double sum(const Term &term) const;
  unsigned int iterate();
  /// What the members' nodes, and those that are coupled with them, make of the forces on them.
  void find_answers();

  std::vector<Member *> members;
  NodalCoupling *coupling = nullptr;
  double tolerance = 0.;
  MPI_Comm communicator = MPI_COMM_NULL;
  unsigned long n_solves = 0, n_iterations = 0;
};
} // namespace peat
