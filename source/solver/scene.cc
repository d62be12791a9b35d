#include <peat/solver/scene.h>

#include <algorithm>

namespace peat {
template <int dim>
bool Scene<dim>::is_saturated() const
{
  for (const auto &body : bodies)
    if (body->material().mixture())
      return true;
  return false;
}

template <int dim>
bool Scene<dim>::has_body_force() const
{
  return std::any_of(conditions.begin(), conditions.end(),
                     [](const auto &condition) { return condition->has_body_force(); });
}

template <int dim>
dealii::types::particle_index Scene<dim>::n_global_points() const
{
  dealii::types::particle_index n = 0;
  for (const auto &body : bodies)
    n += body->n_global_points();
  return n;
}

template <int dim>
Body<dim> &Scene<dim>::body(const std::string &name) const
{
  for (const auto &body : bodies)
    if (body->name() == name)
      return *body;
  throw InputError("there is no body '" + name + "'");
}

template struct Scene<2>;
template struct Scene<3>;
} // namespace peat
