#pragma once

#include <peat/base/parameters.h>
#include <peat/points/layout.h>
#include <peat/transfer/weights.h>

#include <limits>
#include <string>
#include <vector>

namespace peat {
/// How a dynamic stage of material points steps in time.
enum class Scheme {
  automatic,      ///< what is estimated to cost least of those that apply
  explicit_steps, ///< steps that follow undrained waves and the diffusion of pressures
  semi_implicit,  ///< pore pressures from a linear system, steps that follow the skeleton's wave
  implicit        ///< motion and pressures from one system, steps that follow what changes
};

/// The words that the parameter file has for them, in the order of the enumeration.
const std::vector<std::string> &scheme_names();
Scheme scheme_of(const std::string &name);
std::string name_of(Scheme scheme);

/// The section `Explicit MPM`: how the explicit and the semi-implicit material point method are discretised.
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
  double pressure_stabilisation = 1.; ///< factor on the term on alternating pressures; semi-implicit
  double pressure_tolerance = 1e-6;   ///< of the linear system; semi-implicit
  double pressure_filter = 0.;        ///< rate of the filter in units of c_u / h
  double step_factor = 0.8;           ///< step over stable step
  double fixed_step = 0.;             ///< [s]; 0: automatic
  bool seepage_inertia = true;        ///< keep rho_f a in Darcy's law

  // What a stage decides.
  bool implicit_pressure = false;                           ///< semi-implicit
  double largest_step = std::numeric_limits<double>::max(); ///< [s], for the accuracy of waves
};
} // namespace peat
