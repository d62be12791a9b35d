#include <peat/condition/condition.h>

// Forces and fluid that come from nowhere: for manufactured solutions, centrifuges, wells.

namespace peat {
namespace {
template <int dim>
void require_region(const Section &section, const Place<dim> &place)
{
  if (!section.describing() && (!place.on_mesh() || !place.boundaries.empty()))
    section.fail("Where", "this kind of condition acts in a 'region'");
}

template <int dim>
double value_at(const Function &value, const dealii::Point<dim> &x, const double t, const unsigned int d)
{
  double place[3] = {0., 0., 0.};
  for (unsigned int k = 0; k < dim; ++k)
    place[k] = x[k];
  return value.value(place, t, d);
}

template <int dim>
class BodyForce : public Condition<dim>
{
public:
  BodyForce(Section section, const Place<dim> &place)
      : Condition<dim>(section, place), value(dim == 2 ? "0, 0" : "0, 0, 0", {}, {})
  {
    require_region(section, place);
    section.add("Value", value, dim, "m/s^2", "Force per mass, on top of gravity.");
    section.require_start("Value", value);
  }

  void add_loads(const ActiveNodes<dim> &nodes, const Surface<dim> &, NodalFields<dim> &fields) const override
  {
    for (const auto &selection : this->selections)
      for (const std::uint32_t i : selection.nodes) {
        if (!nodes.is_owned(i))
          continue;
        const double mass = fields.sums[std::size_t(i) * fields.n_sums];
        for (unsigned int d = 0; d < dim; ++d)
          fields.force[std::size_t(i) * dim + d] += mass * value_at(value, nodes.position(i), fields.time, d);
      }
  }

  bool has_body_force() const override { return true; }
  dealii::Tensor<1, dim> body_force(const dealii::Point<dim> &x, const double t) const override
  {
    dealii::Tensor<1, dim> result;
    if (this->place.contains_node(x, 0.))
      for (unsigned int d = 0; d < dim; ++d)
        result[d] = value_at(value, x, t, d);
    return result;
  }

private:
  Function value;
};
const ConditionMember<BodyForce> body_force("body force", "a given force per mass in a region.");

template <int dim>
class FluidSource : public Condition<dim>
{
public:
  FluidSource(Section section, const Place<dim> &place) : Condition<dim>(section, place), value("0", {}, {})
  {
    require_region(section, place);
    section.add("Value", value, 1, "1/s", "Volume of fluid produced per volume and time.");
    section.require_start("Value", value);
  }

  bool has_fluid_source() const override { return true; }
  double fluid_source(const dealii::Point<dim> &x, const double t) const override
  {
    return this->place.contains_node(x, 0.) ? value_at(value, x, t, 0) : 0.;
  }

private:
  Function value;
};
const ConditionMember<FluidSource> fluid_source("fluid source",
                                                "pore fluid produced in a region; for the implicit solvers.");
} // namespace
} // namespace peat
