#pragma once

#include <peat/condition/condition.h>
#include <peat/contact/rigid_body.h>
#include <peat/points/body.h>
#include <peat/points/tracers.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace peat {
/// The bodies, the conditions on them and the tracers that move with them: what a stage of a run works on.
template <int dim>
struct Scene
{
  std::vector<std::unique_ptr<Body<dim>>> bodies;
  std::vector<std::unique_ptr<Condition<dim>>> conditions;
  /// Surfaces on which conditions act, by body.
  std::map<std::string, Tracers<dim>> surfaces;
  std::unique_ptr<Tracers<dim>> probes;
  Function gravity;
  std::vector<std::unique_ptr<RigidBody<dim>>> rigid_bodies;

  bool is_saturated() const;
  bool has_body_force() const;
  dealii::types::particle_index n_global_points() const;
  Body<dim> &body(const std::string &name) const;
};
} // namespace peat
