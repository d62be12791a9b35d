#include <peat/solver/scheme.h>

#include <algorithm>
#include <cmath>

namespace peat {
const std::vector<std::string> &scheme_names()
{
  static const std::vector<std::string> names = {"auto", "explicit", "semi-implicit", "implicit"};
  return names;
}

Scheme scheme_of(const std::string &name)
{
  const auto &names = scheme_names();
  return static_cast<Scheme>(std::find(names.begin(), names.end(), name) - names.begin());
}

std::string name_of(const Scheme scheme)
{
  return scheme_names()[static_cast<unsigned int>(scheme)];
}

SchemeParameters::SchemeParameters(Section section)
{
  std::string basis_name = "gimp", transfer = "aflip", update = "auto";
  section.add(
      "Basis", basis_name, {"q1", "gimp"},
      "Shape functions of the points. 'q1': FE_Q(1), cheapest, for points that stay in their cells. 'gimp': "
      "FE_Q(1) averaged over the point's domain, ten to a hundred times less noise when points cross faces.");
  section.add(
      "Transfer", transfer, {"aflip", "flip", "pic"},
      "How velocities go from points to nodes and back. 'aflip': points add the grid's acceleration, and "
      "bring "
      "their velocity to the nodes together with its gradient; keeps rotation and waves. 'flip': without the "
      "gradient, which smooths waves and lets small bodies lose their spin. 'pic': points take the grid's "
      "velocity; damps strongly.");
  section.add("Stress update", update, {"auto", "usl", "musl"},
              "When stresses follow the velocities. 'usl': from the nodes' new velocities, cheapest. 'musl': "
              "from the "
              "points' new velocities mapped back to the nodes. 'auto': usl.");
  section.add("Relaxation time", relaxation_time, nonnegative("s"),
              "Time in which the points' velocities relax to the grid's in 'aflip' and 'flip'; damps noise "
              "at a rate that "
              "does not depend on the step. 0: never.");
  section.add("Local damping", local_damping, between(0., 0.99),
              "Share of each node's out-of-balance force that acts against its velocity; for dynamic "
              "relaxation to rest.");
  std::string pressure = "cell";
  section.add(
      "Pressure", pressure, {"cell", "point"},
      "How pore pressure acts. 'cell': with its mean over the points of a cell, and following the mean rate "
      "there; "
      "does not lock. 'point': each point on its own; locks in 2-D and 3-D with more than one point a cell.");
  pressure_of_cells = pressure == "cell";
  section.add("Pressure stabilisation", pressure_stabilisation, nonnegative(""),
              "Semi-implicit: factor on the term that keeps pressures of neighbouring cells from "
              "alternating; it acts on increments alone, and vanishes where they are linear in place.");
  section.add("Pressure tolerance", pressure_tolerance, strictly_between(0., 1.),
              "Semi-implicit: residual of the linear system over its right-hand side.");
  section.add("Pressure filter", pressure_filter, nonnegative(""),
              "Rate, in units of c_u/h, at which pore pressures of points go to the mean of their cell; "
              "conserves the "
              "fluid's volume.");
  section.add("Step factor", step_factor, strictly_between(0., 100.), "Step over the stable step.");
  section.add("Time step", fixed_step, nonnegative("s"), "A fixed step; 0 for the automatic one.");
  basis = basis_name == "q1" ? Basis::q1 : Basis::gimp;
  affine = transfer == "aflip";
  grid_velocity = transfer == "pic";
  stress_update = update == "musl" ? StressUpdate::modified_last : StressUpdate::last;
}

double SchemeParameters::retention(const double dt) const
{
  if (grid_velocity)
    return 0.;
  return relaxation_time > 0. ? std::exp(-dt / relaxation_time) : 1.;
}
} // namespace peat
