#include <peat/solver/pressure_system.h>

#include <peat/base/error.h>

#include <deal.II/base/mpi.h>

#include <cmath>
#include <sstream>

namespace peat {
namespace {
constexpr unsigned int most_iterations = 2000;
} // namespace

template <int dim>
void PressureSystem<dim>::reinit(std::vector<ImplicitPressure<dim> *> pressures,
                                 NodalCoupling *nodal_coupling, const double accuracy, MPI_Comm all_ranks)
{
  members = std::move(pressures);
  coupling = nodal_coupling;
  tolerance = accuracy;
  communicator = all_ranks;
}

template <int dim>
template <typename Term>
double PressureSystem<dim>::sum(const Term &term) const
{
  double result = 0.;
  for (Member *member : members)
    result += term(*member);
  return result;
}

template <int dim>
void PressureSystem<dim>::find_answers()
{
  if (!coupling)
    return;
  for (Member *member : members)
    member->find_accelerations_and_fluxes();
  coupling->restrain();
}

template <int dim>
unsigned int PressureSystem<dim>::iterate()
{
  const auto over_ranks = [&](const double mine) { return dealii::Utilities::MPI::sum(mine, communicator); };
  const auto squared_norm = [&](typename Member::Vector Member::*vector) {
    return over_ranks(sum([&](const Member &member) { return member.squared_norm(member.*vector); }));
  };
  // What is looked for is the change of the increment.
  const double size = std::sqrt(squared_norm(&Member::right_side));
  const double round_off = std::sqrt(over_ranks(sum([](const Member &member) { return member.round_off; })));
  const double target = std::max(tolerance * size, round_off);
  for (Member *member : members)
    member->change = 0.;
  double rho_before = 0.;
  for (unsigned int iteration = 0;; ++iteration) {
    const double norm = std::sqrt(squared_norm(&Member::r));
    if (norm <= target)
      return iteration;
    if (iteration >= most_iterations || !(norm < std::numeric_limits<double>::max())) {
      std::ostringstream text;
      text << "the pore pressure of an implicit step did not converge in " << iteration
           << " iterations: residual " << norm / size
           << " of the right-hand side; use a smaller 'Step factor'";
      throw NumericalError(text.str());
    }
    for (Member *member : members)
      member->precondition(member->r, member->z);
    const double rho = sum([](const Member &member) { return member.r * member.z; });
    for (Member *member : members) {
      member->direction.sadd(iteration > 0 ? rho / rho_before : 0., 1., member->z);
      member->to_nodes(member->direction);
    }
    rho_before = rho;
    find_answers();
    for (Member *member : members)
      member->apply(member->direction, member->image);
    const double length = rho / sum([](const Member &member) { return member.direction * member.image; });
    for (Member *member : members) {
      member->change.add(length, member->direction);
      member->r.add(-length, member->image);
    }
  }
}

template <int dim>
void PressureSystem<dim>::solve()
{
  const unsigned int n = iterate();
  ++n_solves;
  n_iterations += n;
  for (Member *member : members) {
    member->judge_preconditioner(n);
    member->to_nodes(member->change);
  }
  find_answers();
}

template <int dim>
PressureWork PressureSystem<dim>::work() const
{
  PressureWork work;
  work.solves = n_solves;
  work.iterations = n_iterations;
  for (const Member *member : members)
    work.multigrids += member->n_multigrids();
  return work;
}

template class PressureSystem<2>;
template class PressureSystem<3>;
} // namespace peat
