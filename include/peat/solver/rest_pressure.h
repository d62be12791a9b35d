#pragma once

#include <peat/solver/scene.h>
#include <peat/transfer/weights.h>

namespace peat {
/// Change the points' pore pressures as little as needed for the explicit step to leave them alone: the flux
/// that the step would find for a skeleton at rest then has no divergence in the mean of any cell
/// (hydrostatic pressures, or steady seepage). Pressures within a cell are changed alike.
///
/// With G p = sum V p grad N on nodes and the nodal resistances, this is the symmetric, positive
/// semi-definite system G^T W (G p + loads) = 0 for one pressure a cell and body, solved by conjugate
/// gradients without a matrix. What G does not see (checkerboards) stays as it is.
///
/// `active` are the explicit step's nodes, on which the surfaces of the scene have been located. Collective.
/// Throws NumericalError if it does not converge.
template <int dim>
void balance_pressures(Scene<dim> &scene, const ActiveNodes<dim> &active, double time);
} // namespace peat
