#pragma once

#include <peat/base/parameters.h>
#include <peat/solver/space.h>

namespace peat {
/// The section `Implicit solver`: how the u-p finite element method, and the material points where they are
/// used implicitly, are discretised in space and time.
struct ImplicitParameters
{
  explicit ImplicitParameters(Section section);

  Nodes element = Nodes::q2;     ///< of the finite element method
  double stabilisation = 1.;     ///< of the pressure where it has the displacement's degree
  double surface_penalty = 100.; ///< of pressures prescribed on surfaces that cut cells, in kappa/h

  double fixed_step = 0.;       ///< [s]; 0: automatic
  double step_factor = 1.;      ///< dynamic: step over h/c_u
  double spectral_radius = 0.8; ///< of generalised-alpha at infinity
  unsigned int start_steps = 2; ///< of dynamics that are taken as two steps of backward Euler each
  double first_step = 0.;       ///< quasi-static [s]; 0: automatic
  double step_tolerance = 3e-3; ///< quasi-static: error of a step
  double largest_growth = 3.;   ///< of quasi-static steps

  double newton_tolerance = 1e-9;
  unsigned int newton_iterations = 20;
};
} // namespace peat
