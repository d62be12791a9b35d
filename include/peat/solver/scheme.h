#pragma once

#include <peat/base/parameters.h>
#include <peat/points/layout.h>
#include <peat/transfer/weights.h>

#include <string>

namespace peat {
/// The section `Explicit MPM`: how the explicit material point method is discretised.
struct SchemeParameters
{
  explicit SchemeParameters(Section section);

  /// When in the step stresses follow the velocities.
  enum class StressUpdate {
    last,         ///< USL: from the nodes' new velocities
    modified_last ///< MUSL: from the points' new velocities, mapped back to the nodes
  };

  SchemeFields fields() const
  {
    SchemeFields fields;
    fields.extent = basis == Basis::gimp;
    fields.velocity_gradient = affine;
    fields.pressure_rate = implicit_pressure;
    return fields;
  }
  /// Share of the points' own velocity that survives a step of length dt.
  double retention(double dt) const;

  Basis basis;
  StressUpdate stress_update;
  bool affine;                        ///< the points' velocity is mapped with its gradient
  bool grid_velocity;                 ///< the points take the grid's velocity each step (PIC)
  double relaxation_time = 0.;        ///< of the points' velocity towards the grid's [s]; 0: never
  double local_damping = 0.;          ///< share of the out-of-balance force that opposes the velocity
  bool pressure_of_cells = true;      ///< pore pressure acts with its mean over the points of a cell
  bool implicit_pressure = false;     ///< pore pressures of a step follow from a linear system
  double pressure_stabilisation = 1.; ///< factor on the term on alternating pressures; implicit pressures
  double pressure_tolerance = 1e-6;   ///< of the linear system; implicit pressures
  double pressure_filter = 0.;        ///< rate of the filter in units of c_u / h
  double step_factor = 0.8;           ///< step over stable step
  double fixed_step = 0.;             ///< [s]; 0: automatic
  bool seepage_inertia = true;        ///< keep rho_f a in Darcy's law
};
} // namespace peat
