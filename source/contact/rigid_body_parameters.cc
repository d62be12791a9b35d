#include <peat/base/text.h>
#include <peat/contact/rigid_body.h>

#include <deal.II/base/symmetric_tensor.h>

#include <algorithm>
#include <cmath>

namespace peat {
namespace {
template <int dim>
std::vector<std::string> component_names()
{
  if (dim == 2)
    return {"x", "y", "rotation"};
  return {"x", "y", "z", "rotation x", "rotation y", "rotation z"};
}

std::string zeros(const unsigned int n)
{
  return join(std::vector<std::string>(n, "0"));
}

/// A contact needs to know how deep a place is, and a rigid body where it ends.
template <int dim>
void check_shape(const Section &section, const std::string &name, const Shape<dim> &shape)
{
  if (!shape.is_distance())
    section.fail("Shape", "rigid body '" + name +
                              "' needs a shape whose surface has a known distance everywhere; 'inside' says "
                              "only what is inside");
  const Bounds<dim> box = shape.bounds();
  for (unsigned int d = 0; d < dim; ++d)
    if (!std::isfinite(box.lower[d]) || !std::isfinite(box.upper[d]))
      section.fail("Shape", "rigid body '" + name + "' extends to infinity in direction " +
                                std::string(1, "xyz"[d]) + "; cut it with intersection(..., box(...))");
}

/// A body's moments of inertia are positive, and none is larger than the other two together.
void check_inertia(const Section &section, const std::array<double, 6> &I)
{
  const dealii::SymmetricTensor<2, 3> tensor(
      dealii::Tensor<2, 3>({{I[0], I[3], I[5]}, {I[3], I[1], I[4]}, {I[5], I[4], I[2]}}));
  const auto principal = eigenvalues(tensor);
  if (!(principal[2] > 0.))
    section.fail("Moment of inertia",
                 "the tensor is not positive definite: its smallest principal moment is " +
                     to_text(principal[2]) + " kg m^2");
  if (principal[0] > (principal[1] + principal[2]) * (1. + 1e-9))
    section.fail("Moment of inertia", "no body has the principal moments " +
                                          to_text({principal[0], principal[1], principal[2]}) +
                                          " kg m^2: the largest exceeds the sum of the others");
}

void check_inertia(const Section &, const std::array<double, 1> &) {}

template <std::size_t n>
std::array<double, n> as_array(const std::vector<double> &values)
{
  std::array<double, n> result;
  std::copy_n(values.begin(), n, result.begin());
  return result;
}
} // namespace

template <int dim>
RigidBodyParameters<dim>::RigidBodyParameters(Section section) : section(section), name(section.name())
{
  std::string shape_text = dim == 2 ? "box(0, 0, 1, 1)" : "box(0, 0, 0, 1, 1, 1)", motion = "free";
  this->section.add("Shape", shape_text,
                    "Its region at the start, as that of a body; with a surface of known "
                    "distance and of finite size.");
  this->section.add(
      "Motion", motion, {"free", "prescribed"},
      "'free': it has mass and follows gravity and contact. 'prescribed': its motion is given.");
  section.require("Shape", "rigid body '" + name + "'");
  shape = parse_shape<dim>(shape_text, section.constants(), section.origin("Shape"));
  check_shape(section, name, *shape);
  prescribed = motion == "prescribed";
  const std::vector<std::string> of_free = {
      "Density",          "Mass",         "Moment of inertia", "Free components",
      "Initial velocity", "Initial spin", "Fall height"};
  const std::vector<std::string> of_prescribed = {"Velocity", "Displacement", "Spin"};
  for (const std::string &key : prescribed ? of_free : of_prescribed)
    if (section.has(key))
      section.fail(key, "belongs to 'Motion = " + std::string(prescribed ? "free" : "prescribed") + "'");
  if (!prescribed || section.describing())
    read_free();
  if (prescribed || section.describing())
    read_prescribed();
}

template <int dim>
void RigidBodyParameters<dim>::read_free()
{
  const std::string per_depth = dim == 2 ? "/m" : "";
  const std::vector<std::string> components = component_names<dim>();
  std::vector<std::string> free = components;
  std::vector<double> moments(inertia.size(), 0.), velocity_values(dim, 0.), spin_values(n_rotations, 0.);
  section.add("Density", density, positive("kg/m^3"),
              "Of a free body: mass and inertia follow from its shape.");
  section.add("Mass", mass, positive("kg" + per_depth), "Of a free body, in place of the density.");
  section.add("Moment of inertia", moments, moments.size(), dim == 2 ? nonnegative("kg m") : any("kg m^2"),
              dim == 2
                  ? "With 'Mass': about the centre of mass; 0: as if the mass were spread evenly."
                  : "With 'Mass': the tensor about the centre of mass, xx, yy, zz, xy, yz, zx (xy = -sum m "
                    "x y); all 0: as if the mass were spread evenly.");
  section.add("Free components", free, components,
              "The components of a free body's motion that are free; the "
              "others stay as at the start.");
  section.add("Initial velocity", velocity_values, dim, any("m/s"), "Of a free body's centre.");
  section.add("Fall height", fall_height, nonnegative("m"),
              "Adds the velocity of a free fall from this height, along gravity at the time when the first "
              "stage with motion begins.");
  section.add("Initial spin", spin_values, n_rotations, any("rad/s"),
              dim == 2 ? "Of a free body; counter-clockwise." : "Of a free body, about x, y, z.");
  inertia = as_array < dim == 2 ? 1 : 6 > (moments);
  initial_velocity = as_array<dim>(velocity_values);
  initial_spin = as_array<n_rotations>(spin_values);
  const bool has_inertia = section.has("Moment of inertia");
  if (section.describing())
    return;

  if (!section.has("Mass"))
    section.require("Density", "without a 'Mass' free rigid body '" + name + "'");
  if (section.has("Mass") && section.has("Density"))
    section.fail("Mass", "rigid body '" + name + "' has a 'Density' already; give only one of the two");
  if (has_inertia && !section.has("Mass"))
    section.fail("Moment of inertia", "belongs to 'Mass'; with 'Density' it follows from the shape");
  if (std::any_of(inertia.begin(), inertia.end(), [](const double I) { return I != 0.; }))
    check_inertia(section, inertia);
  for (unsigned int c = 0; c < n_motions; ++c) {
    const auto n = std::count(free.begin(), free.end(), components[c]);
    if (n > 1)
      section.fail("Free components", "'" + components[c] + "' stands twice");
    is_free[c] = n == 1;
    const bool translates = c < dim;
    const double start = translates ? initial_velocity[c] : initial_spin[c - dim];
    if (!is_free[c] && start != 0.)
      section.fail(translates ? "Initial velocity" : "Initial spin",
                   "the component '" + components[c] + "' is not free and must be 0");
  }
}

template <int dim>
void RigidBodyParameters<dim>::read_prescribed()
{
  velocity = displacement = Function(zeros(dim), {}, {});
  spin = Function(zeros(n_rotations), {}, {});
  section.add("Velocity", velocity, dim, "m/s", "Of a prescribed body's centre; may depend on t.");
  section.add(
      "Displacement", displacement, dim, "m",
      "Of a prescribed body's centre, in place of the velocity; may depend on t. Its value at t = 0 is "
      "where it starts.");
  section.add("Spin", spin, n_rotations, "rad/s",
              dim == 2 ? "Of a prescribed body, counter-clockwise; may depend on t."
                       : "Of a prescribed body, about x, y, z; may depend on t.");
  if (section.describing())
    return;
  by_displacement = section.has("Displacement");
  if (by_displacement && section.has("Velocity"))
    section.fail("Displacement",
                 "rigid body '" + name + "' has a 'Velocity' already; give only one of the two");
  for (const auto &[key, function] :
       {std::make_pair("Velocity", &velocity), std::make_pair("Displacement", &displacement),
        std::make_pair("Spin", &spin)}) {
    if (!function->is_uniform())
      section.fail(key, "may depend on t but not on place");
    section.require_start(key, *function);
  }
}

template struct RigidBodyParameters<2>;
template struct RigidBodyParameters<3>;
} // namespace peat
