#pragma once

#include <peat/condition/condition.h>
#include <peat/contact/contact.h>
#include <peat/contact/rigid_body.h>
#include <peat/points/body.h>
#include <peat/points/tracers.h>

#include <mpi.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace peat {
/// What a contact reports; on the first body of the parameter file by the second.
template <int dim>
struct ContactState
{
  dealii::Tensor<1, dim> force;                         ///< [N]
  double normal_force = 0.;                             ///< compression positive [N]
  double area = 0.;                                     ///< that bears force [m^(dim-1)]
  double gap = std::numeric_limits<double>::infinity(); ///< smallest; infinite if far apart [m]
};

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
  std::vector<ContactParameters<dim>> contacts;
  /// What the last step found, by contact; of an implicit solver nothing.
  std::map<std::string, ContactState<dim>> contact_states;

  bool is_saturated() const;
  bool has_body_force() const;
  dealii::types::particle_index n_global_points() const;
  Body<dim> &body(const std::string &name) const;
  /// The body whose shape contained the place at the start, or -1.
  int body_at(const dealii::Point<dim> &x, double tolerance) const;

  /// What moves and changes; conditions and contacts have no memory. Collective.
  void persist(Archive &archive);

  /// Bodies (places in `bodies`) that move with one velocity field.
  std::vector<std::vector<std::size_t>> continua;
};

/// What Scene::continua is to be, of bodies with all their points where the parameter file puts them: bodies
/// that touch each other, or are tied, without a contact that separates them, move as one; all do if there
/// are no contacts. Throws an InputError if a contact is to separate bodies that others tie together.
/// Collective.
template <int dim>
std::vector<std::vector<std::size_t>> find_continua(const Scene<dim> &scene, MPI_Comm communicator);
} // namespace peat
