#pragma once

#include <peat/base/archive.h>
#include <peat/base/parameters.h>
#include <peat/grid/shape.h>

#include <deal.II/base/point.h>
#include <deal.II/base/tensor.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace peat {
/// One subsection of `Rigid bodies`.
template <int dim>
struct RigidBodyParameters
{
  static constexpr unsigned int n_rotations = dim == 2 ? 1 : 3;
  static constexpr unsigned int n_motions = dim + n_rotations;

  explicit RigidBodyParameters(Section section);

  Section section;
  std::string name;
  std::shared_ptr<const Shape<dim>> shape;
  bool prescribed = false;

  // Of a free body.
  double density = 0.; ///< [kg/m^3]; 0: `mass` is given
  double mass = 0.;    ///< [kg], 2-D [kg/m]; 0: `density` is given
  /// About the centre of mass [kg m^2], 2-D [kg m]: one number, or xx, yy, zz, xy, yz, zx; all zero: from the
  /// shape.
  std::array<double, dim == 2 ? 1 : 6> inertia{};
  std::array<bool, n_motions> is_free{};
  std::array<double, dim> initial_velocity{}; ///< [m/s]
  double fall_height = 0.;                    ///< [m]; whoever knows gravity adds it to the velocity
  std::array<double, n_rotations> initial_spin{};

  // Of a prescribed one: functions of time.
  bool by_displacement = false; ///< else by velocity
  Function velocity;            ///< [m/s]
  Function displacement;        ///< [m]
  Function spin;                ///< [rad/s]

private:
  void read_free();
  void read_prescribed();
};

/// A body that moves without deforming, on the same terms in 2-D (per metre of depth) and 3-D. All quantities
/// are in the axes of the mesh and refer to the centre of mass (of a prescribed body: to the centroid of its
/// shape).
///
/// A step: begin_step() gives the velocity that the body has at its end without contact, add_impulse() what
/// contact adds, end_step() moves the body with the result. Every rank holds the same body and does the same
/// with it; what add_impulse() gets must be summed over the ranks.
template <int dim>
class RigidBody
{
public:
  static constexpr unsigned int n_rotations = RigidBodyParameters<dim>::n_rotations;
  static constexpr unsigned int n_motions = RigidBodyParameters<dim>::n_motions;
  using Vector = dealii::Tensor<1, dim>;
  /// A spin, an angle, a moment. 2-D: one number, counter-clockwise positive. 3-D: right-hand rule.
  using Rotational = dealii::Tensor<1, n_rotations>;
  /// Translation, then rotation: (velocity, spin), (force, moment) or (impulse, angular impulse).
  using Generalised = dealii::Tensor<1, n_motions>;
  using Matrix = dealii::Tensor<2, n_motions>;

  explicit RigidBody(const RigidBodyParameters<dim> &parameters);

  const std::string &name() const { return parameters.name; }
  const Section &section() const { return parameters.section; }
  bool is_prescribed() const { return parameters.prescribed; }
  /// As given, at the start.
  const Shape<dim> &reference_shape() const { return *parameters.shape; }

  // Where it is now.

  const dealii::Point<dim> &center() const { return center_now; }
  /// Carries directions from the start to now.
  const dealii::Tensor<2, dim> &rotation() const { return turned; }
  /// 2-D: the angle since the start [rad], more than a turn counts on. 3-D: axis times angle of rotation(),
  /// the angle from 0 to pi.
  Rotational rotation_vector() const;
  dealii::Point<dim> to_reference(const dealii::Point<dim> &x) const;
  dealii::Point<dim> to_present(const dealii::Point<dim> &reference) const;

  /// Signed distance to the surface, negative inside [m]; see Shape::distance().
  double distance(const dealii::Point<dim> &x) const;
  /// Unit vector out of the body, from the nearest point of the surface if x is outside and towards it if x
  /// is inside; see Shape::normal().
  Vector normal(const dealii::Point<dim> &x) const;
  /// A box that contains the body now.
  Bounds<dim> bounds() const;

  // How it moves.

  const Vector &velocity() const { return center_velocity; } ///< of the centre [m/s]
  const Rotational &spin() const { return spin_now; }        ///< [rad/s]
  Vector velocity_at(const dealii::Point<dim> &x) const { return velocity_at(x, motion()); }
  /// The velocity at x that belongs to a motion.
  Vector velocity_at(const dealii::Point<dim> &x, const Generalised &motion) const;
  Generalised motion() const;

  /// Infinite if prescribed [kg], 2-D [kg/m].
  double mass() const { return total_mass; }
  /// Impulse for a unit of each component of the motion, free or not; symmetric. Prescribed: zero.
  Matrix mass_matrix() const;
  /// Whether a component of the motion is free.
  bool is_free(const unsigned int component) const
  {
    return !parameters.prescribed && parameters.is_free[component];
  }
  /// Change of motion by a unit generalised impulse: symmetric, zero for what does not move freely.
  /// Prescribed: zero.
  Matrix inverse_mass() const;
  /// Change of velocity at x1 by a unit impulse at x2 [1/kg], symmetric when x1 = x2:
  /// velocity_at(x1, inverse_mass() * wrench(J, x2)) = mobility(x1, x2) * J.
  dealii::Tensor<2, dim> mobility(const dealii::Point<dim> &x1, const dealii::Point<dim> &x2) const;
  /// The force (impulse) at x, and its moment about the centre.
  Generalised wrench(const Vector &force, const dealii::Point<dim> &x) const;

  /// Of a free body; a prescribed one has none.
  double kinetic_energy() const;
  Vector momentum() const;
  /// About a place [kg m^2/s], 2-D [kg m/s].
  Rotational angular_momentum(const dealii::Point<dim> &about = dealii::Point<dim>()) const;

  // A step.

  /// Begin the step from t to t + dt. A free body gets the impulse of gravity; a prescribed one the mean
  /// velocity and spin of the step, with which end_step() arrives exactly where it is to be.
  void begin_step(double t, double dt, const Vector &gravity);
  /// Components that are not free do not feel it.
  void add_impulse(const Vector &impulse, const dealii::Point<dim> &x) { add_impulse(wrench(impulse, x)); }
  void add_impulse(const Generalised &impulse);
  /// Move. Second order in time in free flight, where translation is exact under constant gravity, and a body
  /// that turns freely keeps its energy and angular momentum to round-off. In a step with impulses the
  /// translation is that of symplectic Euler, as the points' is.
  void end_step();

  /// Move a free body, as an implicit step has found it.
  /// @param displacement of the centre [m], and rotation vector [rad]
  /// @param motion from now on
  void move(const Generalised &displacement, const Generalised &motion);

  /// What bodies in contact exert on it, about its centre; set by the contact, for output [N], [N m].
  Vector last_force;
  Rotational last_moment;

  /// What changes from step to step.
  void persist(Archive &archive);

private:
  /// About the centre, now.
  dealii::Tensor<2, n_rotations> inertia() const;
  /// Inverse of the inertia as far as rotation is free.
  dealii::Tensor<2, n_rotations> inverse_inertia() const;
  void turn(const Rotational &by);
  void turn_freely(double dt);

  const RigidBodyParameters<dim> parameters;
  dealii::Point<dim> reference_center;
  double total_mass;
  dealii::Tensor<2, n_rotations> reference_inertia;

  dealii::Point<dim> center_now;
  dealii::Tensor<2, dim> turned;
  Rotational angle; ///< 2-D only
  Vector center_velocity;
  Rotational spin_now;

  // Of the step that has begun.
  double step_length = 0.;
  Vector gravity_change; ///< of the velocity
  bool has_impulse = false;
};
} // namespace peat
