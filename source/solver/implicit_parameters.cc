#include <peat/solver/implicit_parameters.h>

namespace peat {
ImplicitParameters::ImplicitParameters(Section section)
{
  std::string name = "taylor-hood";
  section.add(
      "Element", name, {"taylor-hood", "q1"},
      "Elements of the finite element method. 'taylor-hood': FE_Q(2) for displacements and FE_Q(1) for "
      "pressures. 'q1': FE_Q(1) for both, with stabilised pressures; a quarter (2-D) of the unknowns, "
      "and one order less in the displacements.");
  element = name == "q1" ? Nodes::q1 : Nodes::q2;
  section.add("Pressure stabilisation", stabilisation, nonnegative(""),
              "Factor on the polynomial pressure projection of elements of equal degree and of material "
              "points; 1 is free of overshoot in one dimension.");
  section.add(
      "Surface penalty", surface_penalty, positive(""),
      "Strength, in units of mobility over cell size, with which a pressure is prescribed on surfaces "
      "that cut cells.");
  section.add("Time step", fixed_step, nonnegative("s"), "Constant time step; 0: automatic.");
  section.add("Step factor", step_factor, positive(""),
              "Dynamic steps over the time h/c_u in which an undrained wave crosses a cell.");
  section.add(
      "Spectral radius", spectral_radius, between(0., 1.),
      "Of generalised-alpha for infinite frequencies: 1 keeps them (trapezoidal rule), 0 removes them in "
      "a step. Second-order accurate for all.");
  section.add(
      "Start steps", start_steps, between(0., 1000.),
      "So many first steps of a dynamic stage are taken as two steps of backward Euler each: they damp "
      "what a load that jumps excites.");
  section.add(
      "First step", first_step, nonnegative("s"),
      "First step of a quasi-static stage; 0: h^2/(4 c_v), the time in which pressures diffuse over half "
      "a cell.");
  section.add("Step tolerance", step_tolerance, positive(""),
              "Quasi-static: estimated error of a step, relative to the largest values so far, that decides "
              "its length.");
  section.add("Largest growth", largest_growth, {"", 1., 100., false, true},
              "Quasi-static: most by which a step is longer than the one before.");
  section.add(
      "Newton tolerance", newton_tolerance, strictly_between(0., 1e-2),
      "Norm of the residual of momentum and of fluid mass at which an iteration ends, relative to the "
      "largest so far.");
  section.add("Newton iterations", newton_iterations, between(1., 1000.), "At the most, for a step.");
}
} // namespace peat
