#pragma once

#include <peat/solver/implicit_contact.h>

// What the implicit contact keeps of rigid bodies, contacts and sites.

namespace peat {
/// A rigid body and its motion in a step.
template <int dim>
struct ImplicitContact<dim>::Mover
{
  explicit Mover(RigidBody<dim> &rigid) : rigid(rigid)
  {
    const Bounds<dim> box = rigid.bounds();
    radius = 0.5 * (box.upper - box.lower).norm();
  }

  Vector weight(const Vector &g) const { return rigid.mass() * g; }

  RigidBody<dim> &rigid;
  double radius;          ///< that rotations are measured with [m]
  bool may_touch = false; ///< some contact names it

  Generalised displacement; ///< since t_n: [m], [rad]
  Generalised start;        ///< motion at t_n
  Generalised first_rate;   ///< of the stage before
  Generalised rate;         ///< of the last stage that was booked
  Generalised rate_history, acceleration_history;
  Generalised step;  ///< of the last iteration
  Generalised moved; ///< since it entered
  double scale = 0.; ///< largest way so far, twice [m]

  Generalised force;         ///< of contact on it, about the centre [N], [N m]
  Generalised force_sum;     ///< of the step
  Generalised residual;      ///< what it lacks for balance
  double imbalance = 0.;     ///< its norm [N]
  double force_scale = 0.;   ///< of all forces on it [N]
  unsigned int n_closed = 0; ///< sites that touch it

  // Of the matrix: force on it and on the unknowns by each other's motion.
  bool is_coupled = false;
  std::array<std::array<double, n_motions>, n_motions> slope{};
  std::array<BlockVector, n_motions> coupling; ///< forces on the unknowns by its motion
  std::array<BlockVector, n_motions> reaction; ///< forces on it by the unknowns
  std::array<BlockVector, n_motions> response; ///< the unknowns' answer to its motion
};

/// A site in a step.
template <int dim>
struct ImplicitContact<dim>::Place
{
  std::uint32_t site;
  unsigned int n = 0; ///< nodes that carry it
  std::array<double, 3> weight{};
  std::array<std::array<Index, dim>, 3> unknown;
  Vector free;                        ///< 1 in components in which some node is free, else 0
  double gap = 0.;                    ///< at the start of the step, not negative [m]
  double penalty = 0.;                ///< [N/m]
  Vector multiplier;                  ///< force on the bodies [N]
  Vector force;                       ///< the same, with what the present gap adds
  bool is_known = false;              ///< an earlier stage of the step has found it
  Vector known_force, known_relative; ///< there
  Vector relative;                    ///< displacement of the bodies' surface less that of the rigid one [m]
  ContactMode mode = ContactMode::sticks;
  dealii::Tensor<2, dim> tangent; ///< minus the force's derivative with `relative` [N/m]
  Vector slip;                    ///< direction of the friction on the bodies; where it slides
  // That the matrix knows.
  ContactMode matrix_mode = ContactMode::open;
  Vector matrix_slip;
};

/// A contact of a rigid body.
template <int dim>
struct ImplicitContact<dim>::Touch
{
  Touch(const ContactParameters<dim> &parameters, Mover &mover, const Grid<dim> &grid, const Basis basis,
        const std::vector<const Body<dim> *> &bodies, const double sign)
      : parameters(parameters), mover(mover), bodies(bodies), sign(sign),
        surface(grid, basis, mover.rigid, bodies, sites)
  {}

  const ContactParameters<dim> &parameters;
  Mover &mover;
  const std::vector<const Body<dim> *> bodies;
  const double sign; ///< -1: reports are of the body, not of the rigid one
  std::vector<ContactSite<dim>> sites;
  RigidSites<dim> surface;
  std::vector<Place> places;

  // Of the step: force on the bodies, normal force, area.
  std::array<double, dim + 2> sums{};
  double gap = ContactSite<dim>::far; ///< smallest, at the end [m]
};
} // namespace peat
