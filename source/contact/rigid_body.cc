#include <peat/contact/rigid_body.h>

#include <peat/base/text.h>
#include <peat/contact/shape_moments.h>

#include <deal.II/base/symmetric_tensor.h>

#include <cmath>
#include <limits>

namespace peat {
namespace {
using Tensor1 = dealii::Tensor<1, 1>;
using Tensor2 = dealii::Tensor<1, 2>;
using Tensor3 = dealii::Tensor<1, 3>;

/// Velocity at the end of an arm by a spin about its start.
Tensor2 spin_times_arm(const Tensor1 &spin, const Tensor2 &arm)
{
  return Tensor2({-spin[0] * arm[1], spin[0] * arm[0]});
}
Tensor3 spin_times_arm(const Tensor3 &spin, const Tensor3 &arm)
{
  return cross_product_3d(spin, arm);
}

/// Moment of a force at the end of an arm about its start.
Tensor1 moment(const Tensor2 &arm, const Tensor2 &force)
{
  return Tensor1({arm[0] * force[1] - arm[1] * force[0]});
}
Tensor3 moment(const Tensor3 &arm, const Tensor3 &force)
{
  return cross_product_3d(arm, force);
}

dealii::Tensor<2, 2> rotation_by(const Tensor1 &angle)
{
  const double c = std::cos(angle[0]), s = std::sin(angle[0]);
  return dealii::Tensor<2, 2>({{c, -s}, {s, c}});
}

/// Rodrigues' formula, for axis times angle.
dealii::Tensor<2, 3> rotation_by(const Tensor3 &vector)
{
  const double angle = vector.norm();
  // sin(a)/a and (1 - cos(a))/a^2
  const double half = 0.5 * angle;
  const double sine = angle > 1e-4 ? std::sin(angle) / angle : 1. - angle * angle / 6.;
  const double versine = half > 1e-4 ? 0.5 * std::pow(std::sin(half) / half, 2) : 0.5 - half * half / 6.;
  const dealii::Tensor<2, 3> cross(
      {{0., -vector[2], vector[1]}, {vector[2], 0., -vector[0]}, {-vector[1], vector[0], 0.}});
  return dealii::unit_symmetric_tensor<3>() + sine * cross + versine * (cross * cross);
}

/// Axis times angle of a rotation, the angle from 0 to pi.
Tensor3 vector_of(const dealii::Tensor<2, 3> &R)
{
  const Tensor3 twice_sine({R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1]});
  const double sine = 0.5 * twice_sine.norm(), cosine = 0.5 * (trace(R) - 1.);
  const double angle = std::atan2(sine, cosine);
  if (sine > 1e-6)
    return angle / (2. * sine) * twice_sine;
  if (cosine > 0.)
    return 0.5 * twice_sine;
  // Half a turn: (R + 1)/2 is the square of the axis.
  unsigned int longest = 0;
  for (unsigned int d = 1; d < 3; ++d)
    if (R[d][d] > R[longest][longest])
      longest = d;
  Tensor3 axis;
  for (unsigned int d = 0; d < 3; ++d)
    axis[d] = 0.25 * (R[d][longest] + R[longest][d]) + (d == longest ? 0.5 : 0.);
  return angle / axis.norm() * (axis * twice_sine < 0. ? -axis : axis);
}

/// The nearest rotation to a matrix that is one up to round-off.
template <int dim>
dealii::Tensor<2, dim> orthonormal(const dealii::Tensor<2, dim> &R)
{
  return 1.5 * R - 0.5 * (R * (transpose(R) * R));
}

/// Inertia from the integral of (x - c)(x - c)^T, by density.
dealii::Tensor<2, 1> inertia_of(const dealii::Tensor<2, 2> &second)
{
  dealii::Tensor<2, 1> result;
  result[0][0] = trace(second);
  return result;
}
dealii::Tensor<2, 3> inertia_of(const dealii::Tensor<2, 3> &second)
{
  return trace(second) * dealii::Tensor<2, 3>(dealii::unit_symmetric_tensor<3>()) - second;
}

dealii::Tensor<2, 1> given_inertia(const std::array<double, 1> &I)
{
  dealii::Tensor<2, 1> result;
  result[0][0] = I[0];
  return result;
}
dealii::Tensor<2, 3> given_inertia(const std::array<double, 6> &I)
{
  return dealii::Tensor<2, 3>({{I[0], I[3], I[5]}, {I[3], I[1], I[4]}, {I[5], I[4], I[2]}});
}

dealii::Tensor<2, 1> turned_inertia(const dealii::Tensor<2, 1> &I, const dealii::Tensor<2, 2> &)
{
  return I;
}
dealii::Tensor<2, 3> turned_inertia(const dealii::Tensor<2, 3> &I, const dealii::Tensor<2, 3> &R)
{
  return R * I * transpose(R);
}

/// The mean of a function of time over an interval: Gauss' rule with four points.
double mean_over(const Function &function, const double t, const double dt, const unsigned int component)
{
  constexpr double abscissa[4] = {0.069431844202973712, 0.330009478207571868, 0.669990521792428132,
                                  0.930568155797026288};
  constexpr double weight[2] = {0.173927422568726929, 0.326072577431273071};
  constexpr double origin[3] = {0., 0., 0.};
  double mean = 0.;
  for (unsigned int g = 0; g < 4; ++g)
    mean += weight[g == 1 || g == 2] * function.value(origin, t + dt * abscissa[g], component);
  return mean;
}
} // namespace

template <int dim>
RigidBody<dim>::RigidBody(const RigidBodyParameters<dim> &parameters) : parameters(parameters)
{
  const ShapeMoments<dim> integrals = moments(*parameters.shape);
  if (!(integrals.volume > 0.))
    parameters.section.fail("Shape", "rigid body '" + name() + "' is empty");
  reference_center = integrals.centroid;
  total_mass = parameters.prescribed     ? std::numeric_limits<double>::infinity()
               : parameters.density > 0. ? parameters.density * integrals.volume
                                         : parameters.mass;
  if (!parameters.prescribed) {
    reference_inertia = given_inertia(parameters.inertia);
    if (reference_inertia.norm() == 0.)
      reference_inertia = total_mass / integrals.volume * inertia_of(integrals.second);
  }

  center_now = reference_center;
  turned = dealii::unit_symmetric_tensor<dim>();
  for (unsigned int d = 0; d < dim; ++d)
    center_velocity[d] = parameters.initial_velocity[d];
  for (unsigned int r = 0; r < n_rotations; ++r)
    spin_now[r] = parameters.initial_spin[r];
}

template <int dim>
typename RigidBody<dim>::Rotational RigidBody<dim>::rotation_vector() const
{
  if constexpr (dim == 2)
    return angle;
  else
    return vector_of(turned);
}

template <int dim>
dealii::Point<dim> RigidBody<dim>::to_reference(const dealii::Point<dim> &x) const
{
  return reference_center + transpose(turned) * (x - center_now);
}

template <int dim>
dealii::Point<dim> RigidBody<dim>::to_present(const dealii::Point<dim> &reference) const
{
  return center_now + turned * (reference - reference_center);
}

template <int dim>
double RigidBody<dim>::distance(const dealii::Point<dim> &x) const
{
  return parameters.shape->distance(to_reference(x));
}

template <int dim>
dealii::Tensor<1, dim> RigidBody<dim>::normal(const dealii::Point<dim> &x) const
{
  return turned * parameters.shape->normal(to_reference(x));
}

template <int dim>
Bounds<dim> RigidBody<dim>::bounds() const
{
  const Bounds<dim> box = parameters.shape->bounds();
  const dealii::Point<dim> middle = to_present(box.center());
  Bounds<dim> result{middle, middle};
  for (unsigned int d = 0; d < dim; ++d) {
    double reach = 0.;
    for (unsigned int e = 0; e < dim; ++e)
      reach += 0.5 * std::abs(turned[d][e]) * (box.upper[e] - box.lower[e]);
    result.lower[d] -= reach;
    result.upper[d] += reach;
  }
  return result;
}

template <int dim>
typename RigidBody<dim>::Generalised RigidBody<dim>::motion() const
{
  Generalised result;
  for (unsigned int d = 0; d < dim; ++d)
    result[d] = center_velocity[d];
  for (unsigned int r = 0; r < n_rotations; ++r)
    result[dim + r] = spin_now[r];
  return result;
}

template <int dim>
dealii::Tensor<1, dim> RigidBody<dim>::velocity_at(const dealii::Point<dim> &x,
                                                   const Generalised &motion) const
{
  Vector result;
  Rotational spin;
  for (unsigned int r = 0; r < n_rotations; ++r)
    spin[r] = motion[dim + r];
  for (unsigned int d = 0; d < dim; ++d)
    result[d] = motion[d];
  return result + spin_times_arm(spin, x - center_now);
}

template <int dim>
typename RigidBody<dim>::Generalised RigidBody<dim>::wrench(const Vector &force,
                                                            const dealii::Point<dim> &x) const
{
  Generalised result;
  const Rotational about_center = moment(x - center_now, force);
  for (unsigned int d = 0; d < dim; ++d)
    result[d] = force[d];
  for (unsigned int r = 0; r < n_rotations; ++r)
    result[dim + r] = about_center[r];
  return result;
}

template <int dim>
dealii::Tensor<2, RigidBody<dim>::n_rotations> RigidBody<dim>::inertia() const
{
  return turned_inertia(reference_inertia, turned);
}

template <int dim>
dealii::Tensor<2, RigidBody<dim>::n_rotations> RigidBody<dim>::inverse_inertia() const
{
  // What is not free gets a unit on the diagonal, and is taken out of the inverse again.
  dealii::Tensor<2, n_rotations> result = inertia();
  const double unit = trace(result);
  for (unsigned int r = 0; r < n_rotations; ++r)
    if (!parameters.is_free[dim + r])
      for (unsigned int s = 0; s < n_rotations; ++s)
        result[r][s] = result[s][r] = r == s ? unit : 0.;
  result = invert(result);
  for (unsigned int r = 0; r < n_rotations; ++r)
    if (!parameters.is_free[dim + r])
      result[r][r] = 0.;
  return result;
}

template <int dim>
typename RigidBody<dim>::Matrix RigidBody<dim>::inverse_mass() const
{
  Matrix result;
  if (parameters.prescribed)
    return result;
  const auto rotational = inverse_inertia();
  for (unsigned int d = 0; d < dim; ++d)
    result[d][d] = parameters.is_free[d] ? 1. / total_mass : 0.;
  for (unsigned int r = 0; r < n_rotations; ++r)
    for (unsigned int s = 0; s < n_rotations; ++s)
      result[dim + r][dim + s] = rotational[r][s];
  return result;
}

template <int dim>
typename RigidBody<dim>::Matrix RigidBody<dim>::mass_matrix() const
{
  Matrix result;
  if (parameters.prescribed)
    return result;
  const auto rotational = inertia();
  for (unsigned int d = 0; d < dim; ++d)
    result[d][d] = total_mass;
  for (unsigned int r = 0; r < n_rotations; ++r)
    for (unsigned int s = 0; s < n_rotations; ++s)
      result[dim + r][dim + s] = rotational[r][s];
  return result;
}

template <int dim>
dealii::Tensor<2, dim> RigidBody<dim>::mobility(const dealii::Point<dim> &x1,
                                                const dealii::Point<dim> &x2) const
{
  const Matrix inverse = inverse_mass();
  dealii::Tensor<2, dim> result;
  for (unsigned int e = 0; e < dim; ++e) {
    Vector unit;
    unit[e] = 1.;
    const Vector change = velocity_at(x1, inverse * wrench(unit, x2));
    for (unsigned int d = 0; d < dim; ++d)
      result[d][e] = change[d];
  }
  return result;
}

template <int dim>
double RigidBody<dim>::kinetic_energy() const
{
  return parameters.prescribed
             ? 0.
             : 0.5 * total_mass * center_velocity.norm_square() + 0.5 * (spin_now * (inertia() * spin_now));
}

template <int dim>
dealii::Tensor<1, dim> RigidBody<dim>::momentum() const
{
  return parameters.prescribed ? Vector() : total_mass * center_velocity;
}

template <int dim>
typename RigidBody<dim>::Rotational RigidBody<dim>::angular_momentum(const dealii::Point<dim> &about) const
{
  return parameters.prescribed ? Rotational() : inertia() * spin_now + moment(center_now - about, momentum());
}

template <int dim>
void RigidBody<dim>::begin_step(const double t, const double dt, const Vector &gravity)
{
  step_length = dt;
  has_impulse = false;
  gravity_change = Vector();
  if (!parameters.prescribed) {
    for (unsigned int d = 0; d < dim; ++d)
      if (parameters.is_free[d])
        gravity_change[d] = dt * gravity[d];
    center_velocity += gravity_change;
    return;
  }
  constexpr double origin[3] = {0., 0., 0.};
  for (unsigned int d = 0; d < dim; ++d)
    if (parameters.by_displacement) {
      // From where it is, so that round-off does not add up.
      const double arrives = reference_center[d] + parameters.displacement.value(origin, t + dt, d) -
                             parameters.displacement.value(origin, 0., d);
      center_velocity[d] = (arrives - center_now[d]) / dt;
    } else
      center_velocity[d] = mean_over(parameters.velocity, t, dt, d);
  for (unsigned int r = 0; r < n_rotations; ++r)
    spin_now[r] = mean_over(parameters.spin, t, dt, r);
}

template <int dim>
void RigidBody<dim>::add_impulse(const Generalised &impulse)
{
  has_impulse = true;
  const Generalised change = inverse_mass() * impulse;
  for (unsigned int d = 0; d < dim; ++d)
    center_velocity[d] += change[d];
  for (unsigned int r = 0; r < n_rotations; ++r)
    spin_now[r] += change[dim + r];
}

template <int dim>
void RigidBody<dim>::end_step()
{
  center_now += step_length * center_velocity;
  if (!has_impulse)
    center_now -= 0.5 * step_length * gravity_change;
  if (dim == 2 || parameters.prescribed)
    turn(step_length * spin_now);
  else {
    // Short enough for the iteration in turn_freely() to converge fast.
    constexpr double largest_angle = 0.1;
    const unsigned int n = 1 + static_cast<unsigned int>(step_length * spin_now.norm() / largest_angle);
    for (unsigned int i = 0; i < n; ++i)
      turn_freely(step_length / n);
  }
}

template <int dim>
void RigidBody<dim>::move(const Generalised &displacement, const Generalised &motion)
{
  Rotational by;
  for (unsigned int r = 0; r < n_rotations; ++r) {
    by[r] = displacement[dim + r];
    spin_now[r] = motion[dim + r];
  }
  for (unsigned int d = 0; d < dim; ++d) {
    center_now[d] += displacement[d];
    center_velocity[d] = motion[d];
  }
  turn(by);
}

template <int dim>
void RigidBody<dim>::turn(const Rotational &by)
{
  angle += by;
  if constexpr (dim == 2)
    turned = rotation_by(angle);
  else
    turned = orthonormal<dim>(rotation_by(by) * turned);
}

template <int dim>
void RigidBody<dim>::turn_freely(const double dt)
{
  if constexpr (dim == 3) {
    // Without moment the angular momentum is kept in the directions that are free, at the new attitude as
    // well. The mean spin of the step is that of the implicit midpoint rule in the body's axes.
    const dealii::Tensor<2, 3> before = turned;
    const Vector angular_momentum = inertia() * spin_now, spin_before = spin_now;
    Vector mean = spin_before;
    constexpr unsigned int most_iterations = 50;
    for (unsigned int i = 0; i < most_iterations; ++i) {
      const dealii::Tensor<2, 3> turn = rotation_by(dt * mean);
      turned = turn * before;
      spin_now = inverse_inertia() * angular_momentum;
      const Vector last = mean;
      mean = 0.5 * (spin_before + transpose(turn) * spin_now);
      for (unsigned int r = 0; r < 3; ++r)
        if (!parameters.is_free[dim + r])
          mean[r] = 0.;
      if ((mean - last).norm() <= 1e-14 * mean.norm())
        break;
    }
    turned = orthonormal(turned);
  } else
    turn(dt * spin_now);
}

template <int dim>
void RigidBody<dim>::persist(Archive &archive)
{
  archive.begin("rigid body " + name());
  archive(center_now, turned, angle, center_velocity, spin_now, last_force, last_moment);
}

template class RigidBody<2>;
template class RigidBody<3>;
} // namespace peat
