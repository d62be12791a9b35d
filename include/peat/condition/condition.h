#pragma once

#include <peat/base/parameters.h>
#include <peat/base/registry.h>
#include <peat/condition/nodal_fields.h>
#include <peat/grid/shape.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace peat {
/// Where a condition acts: faces of the mesh, a region of nodes, or the surface of a body (or its part that
/// looks in one direction).
template <int dim>
struct Place
{
  Place(Section section, const std::vector<std::string> &body_names);

  std::vector<unsigned int> boundaries; ///< ids of mesh faces
  std::string body;                     ///< whose surface; "" if none
  int direction = -1;                   ///< of that surface, numbered like mesh faces; -1 for all of it
  std::shared_ptr<const Shape<dim>>
      region; ///< nodes, or the part of the surface, inside; nullptr for no restriction

  bool on_mesh() const { return body.empty(); }
  bool contains(const SurfacePoint<dim> &point) const;
  /// Whether a node of the mesh lies in the region (within tolerance()), if there is one.
  bool contains_node(const dealii::Point<dim> &x, const double tolerance) const
  {
    return !region || region->distance(x) <= tolerance;
  }
  static double tolerance(const Grid<dim> &grid) { return 1e-9 * grid.smallest_cell_size(); }
};

/// A boundary condition or load. It sees nodal fields and never points; it acts where it overrides a stage of
/// the step.
template <int dim>
class Condition
{
public:
  Condition(Section section, Place<dim> place)
      : section(section), place(std::move(place)), name(section.name())
  {}
  virtual ~Condition() = default;

  /// One of the same kind with its own lists of nodes: bodies in contact have different nodes.
  std::unique_ptr<Condition> copy() const { return copier(*this); }

  /// Whose surface it needs, or "".
  const std::string &surface_of() const { return place.body; }

  /// Remake lists of nodes; called when the set of active nodes has changed.
  virtual void select(const ActiveNodes<dim> &nodes);

  /// Add to `force` or `pressure_load`, each rank for its own part.
  virtual void add_loads(const ActiveNodes<dim> &, const Surface<dim> &, NodalFields<dim> &) const {}
  /// Prescribe `velocity`, `acceleration` (of the start) and new velocities.
  virtual void constrain_motion(const ActiveNodes<dim> &, NodalFields<dim> &) const {}
  /// Prescribe another velocity field than `new_velocity` in the same way (re-mapped velocities).
  virtual void constrain_velocity(const ActiveNodes<dim> &, double /*end_time*/, double /*dt*/,
                                  std::vector<double> & /*velocity*/) const
  {}
  /// Prescribe `flux`.
  virtual void constrain_flux(const ActiveNodes<dim> &, const Surface<dim> &, NodalFields<dim> &) const {}
  /// Mesh faces for which this condition replaces the default, an impermeable wall.
  virtual std::vector<unsigned int> opened_boundaries() const { return {}; }
  /// Whether it says what the pore fluid does at its place. Only one condition may, and the body there is
  /// saturated.
  virtual bool concerns_fluid() const { return false; }
  /// Whether it prescribes this component of the motion on a mesh face. Only one condition may.
  virtual bool prescribes(unsigned int /*boundary*/, unsigned int /*component*/) const { return false; }

  /// Whether this component of the motion is the same at all nodes of its place. No other condition may
  /// prescribe or tie it at any of them.
  virtual bool ties(unsigned int /*component*/) const { return false; }
  /// Make of velocities or accelerations what tied nodes have in common: their mean, weighted by the nodes'
  /// masses in `fields`, so that momentum stays what it is. Linear. Collective.
  virtual void tie(const ActiveNodes<dim> &, const NodalFields<dim> & /*fields*/,
                   std::vector<double> & /*motion*/) const
  {}

  // What an implicit solver asks, which has other nodes than an explicit step. `x` are three coordinates.

  /// Displacement [m] in the time from t to t + dt of a component that it prescribes.
  virtual double displacement_increment(const double * /*x*/, double /*t*/, double /*dt*/,
                                        unsigned int /*component*/) const
  {
    return 0.;
  }
  /// Force [N] on a piece of a body's surface.
  virtual dealii::Tensor<1, dim> force(const SurfacePoint<dim> &, double /*t*/) const { return {}; }
  /// Force per mass [m/s^2] on the material at x.
  virtual dealii::Tensor<1, dim> body_force(const dealii::Point<dim> & /*x*/, double /*t*/) const
  {
    return {};
  }
  virtual bool has_body_force() const { return false; }
  /// Volume of fluid that is produced per volume and time [1/s] at x.
  virtual double fluid_source(const dealii::Point<dim> & /*x*/, double /*t*/) const { return 0.; }
  virtual bool has_fluid_source() const { return false; }
  /// What the pore fluid meets at its place, with the value of it: a pressure [Pa] or a flux outwards [m/s].
  enum class Fluid { free, pressure, flux, impermeable };
  virtual Fluid fluid() const { return Fluid::free; }
  virtual double fluid_value(const double * /*x*/, double /*t*/) const { return 0.; }

  const Section section;
  const Place<dim> place;
  const std::string name;

private:
  template <template <int> class Member>
  friend struct ConditionMember;
  std::unique_ptr<Condition> (*copier)(const Condition &) = nullptr;

protected:
  /// Active nodes on the mesh faces and in the region of `place`, per mesh face (region only: one list).
  struct Selection
  {
    int boundary; ///< -1: a region
    std::vector<std::uint32_t> nodes;
  };
  std::vector<Selection> selections;
};

/// Reads one subsection of `Conditions`.
template <int dim>
std::unique_ptr<Condition<dim>> make_condition(Section section, const std::vector<std::string> &body_names);

/// A member of the family of conditions: one .cc, one line
///   const ConditionMember<Roller> member("roller", "Sentence.");
template <int dim>
struct ConditionEntry
{
  std::string text;
  std::function<std::unique_ptr<Condition<dim>>(const Section &, const Place<dim> &)> make;
};

template <int dim>
std::map<std::string, ConditionEntry<dim>> &condition_family();

template <template <int> class Member>
struct ConditionMember
{
  ConditionMember(const std::string &name, const std::string &text)
  {
    condition_family<2>()[name] = {text, make<2>};
    condition_family<3>()[name] = {text, make<3>};
  }

private:
  template <int dim>
  static std::unique_ptr<Condition<dim>> make(const Section &section, const Place<dim> &place)
  {
    std::unique_ptr<Condition<dim>> condition = std::make_unique<Member<dim>>(section, place);
    condition->copier = [](const Condition<dim> &original) -> std::unique_ptr<Condition<dim>> {
      return std::make_unique<Member<dim>>(static_cast<const Member<dim> &>(original));
    };
    return condition;
  }
};
} // namespace peat
