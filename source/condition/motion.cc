#include <peat/condition/condition.h>

#include "components.h"

// Conditions on the motion. A node's prescribed component has the given velocity, and as acceleration the
// rate of that velocity; what the points bring along is not pushed into them at once, they follow through the
// stresses.

namespace peat {
namespace {
template <int dim>
void require_mesh(const Section &section, const Place<dim> &place)
{
  if (!place.on_mesh())
    section.fail("Where",
                 "this kind of condition acts on faces of the mesh or a region, not on a body's surface");
}

/// Nodes that stand still: in all components, or in the one normal to their face of the mesh.
template <int dim, bool normal_only>
class Standing : public Condition<dim>
{
public:
  Standing(const Section &section, const Place<dim> &place) : Condition<dim>(section, place)
  {
    require_mesh(section, place);
    if (normal_only && place.boundaries.empty() && !section.describing())
      section.fail("Where",
                   "a roller needs faces of the mesh; use 'velocity' with 'Components' for a region");
  }
  bool prescribes(const unsigned int boundary, const unsigned int component) const override
  {
    return !normal_only || component == boundary / 2;
  }
  void constrain_motion(const ActiveNodes<dim> &, NodalFields<dim> &fields) const override
  {
    for (auto *field : {&fields.velocity, &fields.acceleration, &fields.new_velocity})
      clear(*field);
  }
  void constrain_velocity(const ActiveNodes<dim> &, double, double,
                          std::vector<double> &velocity) const override
  {
    clear(velocity);
  }

private:
  void clear(std::vector<double> &field) const
  {
    for (const auto &selection : this->selections)
      for (const std::uint32_t i : selection.nodes)
        for (unsigned int d = 0; d < dim; ++d)
          if (!normal_only || int(d) == selection.boundary / 2)
            field[std::size_t(i) * dim + d] = 0.;
  }
};
template <int dim>
using Fixed = Standing<dim, false>;
template <int dim>
using Roller = Standing<dim, true>;
const ConditionMember<Fixed> fixed("fixed", "no motion.");
const ConditionMember<Roller> roller("roller", "no motion normal to the face.");

/// What prescribed velocity and displacement share: which components, and a velocity per node and time.
template <int dim>
class PrescribedMotion : public Condition<dim>
{
public:
  PrescribedMotion(Section section, const Place<dim> &place, const std::string &unit, const std::string &text)
      : Condition<dim>(section, place), value(dim == 2 ? "0, 0" : "0, 0, 0", {}, {})
  {
    require_mesh(section, place);
    std::vector<std::string> components = axis_names<dim>();
    section.add("Value", value, dim, unit, text);
    section.add("Components", components, axis_names<dim>(),
                "The components that are prescribed; the others stay free.");
    section.require_start("Value", value);
    prescribed = named_components<dim>(section, components);
  }
  bool prescribes(unsigned int, const unsigned int component) const override { return prescribed[component]; }

  void constrain_motion(const ActiveNodes<dim> &nodes, NodalFields<dim> &fields) const override
  {
    for_each(nodes, [&](const double *x, const std::size_t row, const unsigned int d) {
      const double before = velocity_during(x, fields.time - fields.dt, fields.dt, d);
      const double now = velocity_during(x, fields.time, fields.dt, d);
      fields.velocity[row + d] = before;
      fields.acceleration[row + d] = (now - before) / fields.dt;
      fields.new_velocity[row + d] = now;
    });
  }
  void constrain_velocity(const ActiveNodes<dim> &nodes, const double end_time, const double dt,
                          std::vector<double> &velocity) const override
  {
    for_each(nodes, [&](const double *x, const std::size_t row, const unsigned int d) {
      velocity[row + d] = velocity_during(x, end_time - dt, dt, d);
    });
  }
  double displacement_increment(const double *x, const double t, const double dt,
                                const unsigned int d) const override
  {
    return dt * velocity_during(x, t, dt, d);
  }

protected:
  /// The velocity that holds in the step from t to t + dt.
  virtual double velocity_during(const double *x, double t, double dt, unsigned int d) const = 0;
  Function value;

private:
  template <typename Action>
  void for_each(const ActiveNodes<dim> &nodes, const Action &action) const
  {
    double x[3] = {0., 0., 0.};
    for (const auto &selection : this->selections)
      for (const std::uint32_t i : selection.nodes) {
        for (unsigned int d = 0; d < dim; ++d)
          x[d] = nodes.position(i)[d];
        for (unsigned int d = 0; d < dim; ++d)
          if (prescribed[d])
            action(x, std::size_t(i) * dim, d);
      }
  }
  std::array<bool, dim> prescribed;
};

template <int dim>
class PrescribedVelocity : public PrescribedMotion<dim>
{
public:
  PrescribedVelocity(const Section &section, const Place<dim> &place)
      : PrescribedMotion<dim>(section, place, "m/s", "The prescribed velocity.")
  {}

protected:
  double velocity_during(const double *x, const double t, const double dt,
                         const unsigned int d) const override
  {
    return this->value.value(x, t + dt, d);
  }

public:
  /// Simpson's rule: steps of an implicit solver are long.
  double displacement_increment(const double *x, const double t, const double dt,
                                const unsigned int d) const override
  {
    return dt / 6. *
           (this->value.value(x, t, d) + 4. * this->value.value(x, t + 0.5 * dt, d) +
            this->value.value(x, t + dt, d));
  }
};
const ConditionMember<PrescribedVelocity> velocity("velocity", "a given velocity.");

template <int dim>
class PrescribedDisplacement : public PrescribedMotion<dim>
{
public:
  PrescribedDisplacement(const Section &section, const Place<dim> &place)
      : PrescribedMotion<dim>(section, place, "m",
                              "The prescribed displacement; its value at t = 0 is where it starts.")
  {}

protected:
  double velocity_during(const double *x, const double t, const double dt,
                         const unsigned int d) const override
  {
    return (this->value.value(x, std::max(t, 0.) + dt, d) - this->value.value(x, std::max(t, 0.), d)) / dt;
  }
};
const ConditionMember<PrescribedDisplacement> displacement("displacement", "a given displacement.");
} // namespace
} // namespace peat
