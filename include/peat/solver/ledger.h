#pragma once

#include <deal.II/base/tensor.h>

namespace peat {
/// What has gone into the bodies since the start; one rank's share until it is summed over the ranks.
template <int dim>
struct Ledger
{
  double external_work = 0.; ///< of tractions, gravity, prescribed motion and local damping [J]
  double gravity_work = 0.;  ///< of gravity alone [J]
  double contact_dissipation =
      0.; ///< what contact takes out: friction, and velocities that it makes equal [J]
  double seepage_dissipation = 0.; ///< integral of |w|^2 / kappa [J]
  double seepage_work = 0.;  ///< all that Darcy's law takes from the fluid's energy p^2 / (2 Q), negative [J]
  double fluid_outflow = 0.; ///< of pore fluid through the boundaries [m^dim]
  double fluid_squeezed =
      0.; ///< pore volume lost by compression that V n does not show (small strain) [m^dim]
  dealii::Tensor<1, dim> impulse; ///< of all external forces and local damping [N s]
  double gross_impulse = 0.;      ///< integral of the sum of the external forces' magnitudes on nodes [N s]
};
} // namespace peat
