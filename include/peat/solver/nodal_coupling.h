#pragma once

#include <vector>

namespace peat {
/// How the nodes of a continuum answer to a change of the pore pressure that is tried, one row a node with
/// dim columns.
struct NodalResponse
{
  std::vector<double> acceleration; ///< [m/s^2]
  std::vector<double> flux;         ///< [m/s]
  /// Flux by a unit force of the pressure on the node [m/(s N)], 0 where conditions leave no choice.
  std::vector<double> conductance;
  /// Whether what it is coupled with holds the node, so that a force on it does not accelerate it as if it
  /// were free.
  std::vector<char> held;
};

/// What ties nodes to each other and to other things while pore pressures are solved for.
class NodalCoupling
{
public:
  virtual ~NodalCoupling() = default;

  /// Make of accelerations and fluxes that nodes would have alone (in continua without pore fluid: none)
  /// those that they have together. Linear; accelerations and fluxes must come out symmetric and positive
  /// semidefinite in the forces on nodes. Collective.
  virtual void restrain() = 0;
};
} // namespace peat
