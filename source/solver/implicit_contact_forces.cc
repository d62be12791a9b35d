#include <peat/solver/implicit_contact.h>

#include <peat/material/mixture.h>

#include <deal.II/base/mpi.h>

#include "cell_shapes.h"
#include "implicit_contact_data.h"

// The forces of implicit contact, and their derivatives.

namespace peat {
template <int dim>
dealii::Tensor<1, dim> ImplicitContact<dim>::displacement(const Place &place, const BodyVector &field) const
{
  Vector u;
  for (unsigned int k = 0; k < place.n; ++k)
    for (unsigned int d = 0; d < dim; ++d)
      u[d] += place.weight[k] * field(place.unknown[k][d]);
  return u;
}

template <int dim>
double ImplicitContact<dim>::fluid_force(const Touch &touch, const ContactSite<dim> &site,
                                         const StepState &state) const
{
  if (!touch.parameters.law->on_effective_stress() || !space.has_pressure())
    return 0.;
  double alpha = 0.;
  for (const Body<dim> *body : touch.bodies)
    if (const Mixture *mixture = body->material().mixture())
      alpha = mixture->biot_coefficient();
  if (touch.parameters.interface == ContactParameters<dim>::Interface::drained)
    return alpha * touch.parameters.pressure * site.area;
  // In the cell below the surface, at its place or the nearest one there.
  const CellId cell = grid.cell_at(grid.locate(site.x + 0.25 * grid.smallest_cell_size() * site.normal));
  if (cell == no_index || !space.is_saturated(cell))
    return 0.;
  std::array<double, Space<dim>::n_pressures> M;
  shape_functions<dim, 2>(grid, cell, site.x, M.data());
  double p = 0.;
  for (unsigned int i = 0; i < M.size(); ++i)
    p += M[i] * state.unknown.block(1)(space.pressures(cell)[i] - space.first_pressure());
  return alpha * p * site.area;
}

template <int dim>
bool ImplicitContact<dim>::predict(const Touch &touch, Place &place, const Vector &relative,
                                   const Vector &n) const
{
  // Forces on the way to the first solution are the penalty's, far from those that come out: whether sites
  // part or slide is asked after it.
  if (place.mode == ContactMode::open)
    return false;
  if (place.is_known) {
    place.force = place.known_force - place.tangent * (relative - place.known_relative);
    return true;
  }
  if (place.gap > 0.)
    return false;
  const bool bears_shear = touch.parameters.law->shear_limit(1., 1., false) > 0.;
  place.mode = bears_shear ? ContactMode::sticks : ContactMode::slides;
  place.tangent = place.penalty * outer_product(n, n);
  for (unsigned int d = 0; d < dim && bears_shear; ++d)
    for (unsigned int e = 0; e < dim; ++e)
      place.tangent[d][e] += place.penalty * place.free[d] * ((d == e) - n[d] * n[e]);
  place.force = -(place.tangent * relative);
  return true;
}

template <int dim>
void ImplicitContact<dim>::respond(const Touch &touch, const ContactSite<dim> &site, Place &place,
                                   const Vector &relative, const double fluid) const
{
  const ContactLaw &law = *touch.parameters.law;
  const Vector &n = site.normal;
  const double penalty = place.penalty;
  dealii::Tensor<2, dim> freedom;
  for (unsigned int d = 0; d < dim; ++d)
    freedom[d][d] = place.free[d];
  place.relative = relative;
  if (law.ties()) {
    place.mode = ContactMode::sticks;
    place.tangent = penalty * freedom;
    place.force = place.multiplier - place.tangent * relative;
    return;
  }

  if (predicting && predict(touch, place, relative, n))
    return;

  // Equation (55) of theory.md. With inertia a step's impulse obeys the law, and so does its mean force:
  // weight times the last stage's with what earlier ones have given to it.
  const bool means = stage.acceleration > 0. && place.is_known;
  const double history = means ? earlier_share : 0., weight = 1. / (1. + history);
  place.slip = Vector();
  const bool slid = place.mode == ContactMode::slides;
  const Vector before = history * place.known_force;
  const Vector multiplier = place.multiplier + before;
  const double gap = place.gap + n * relative;
  const double least = place.gap == 0. ? -law.tension_limit(site.area) : 0.;
  double normal_force = weight * (multiplier * n - penalty * gap);
  if (normal_force <= least) {
    place.mode = ContactMode::open;
    place.force = -before;
    place.tangent = dealii::Tensor<2, dim>();
    return;
  }
  normal_force = std::max(normal_force, least);
  place.force = normal_force / weight * n - before;
  place.tangent = penalty * outer_product(n, n);

  Vector along = freedom * (relative - (n * relative) * n);
  along -= (along * n) * n;
  const Vector shear = weight * (multiplier - (multiplier * n) * n - penalty * along);
  const double wanted = shear.norm();
  const double bearing = std::max(0., normal_force - fluid);
  const double limit = law.shear_limit(bearing, site.area, slid);
  // What would slide back has stuck on the way: friction must not push it to and fro.
  const bool turns_back = place.matrix_mode == ContactMode::slides && shear * place.matrix_slip < 0.;
  if (limit > 0. && (wanted <= limit || turns_back)) {
    place.mode = ContactMode::sticks;
    place.force += shear / weight;
    place.tangent += penalty * (freedom - outer_product(freedom * n, n));
    return;
  }
  // Equation (56).
  place.mode = ContactMode::slides;
  if (wanted == 0. || limit == 0.)
    return;
  const double friction = std::min(wanted, law.shear_limit(bearing, site.area, true));
  place.slip = shear / wanted;
  place.force += friction / weight * place.slip;
  const double ratio =
      bearing > 0. ? (friction - std::min(friction, law.shear_limit(0., site.area, true))) / bearing : 0.;
  place.tangent += penalty * ratio * outer_product(place.slip, n);
  dealii::Tensor<2, dim> across = freedom - outer_product(freedom * n, n);
  across -= outer_product(place.slip, place.slip);
  place.tangent += friction / wanted * penalty * across;
}

template <int dim>
void ImplicitContact<dim>::evaluate(const StepState &state)
{
  constexpr double turned = 1e-2;
  enum { changed, excess, multipliers, n_common };
  constexpr unsigned int n_own = n_motions + 2;
  std::vector<double> sums(n_common + movers.size() * n_own, 0.);
  for (const auto &touch : touches) {
    Mover &mover = touch->mover;
    double *own = nullptr;
    for (std::size_t m = 0; m < movers.size(); ++m)
      if (movers[m].get() == &mover)
        own = &sums[n_common + m * n_own];
    for (Place &place : touch->places) {
      const ContactSite<dim> &site = touch->sites[place.site];
      const Vector relative =
          displacement(place, state.unknown.block(0)) - mover.rigid.velocity_at(site.x, mover.displacement);
      respond(*touch, site, place, relative, fluid_force(*touch, site, state));
      const Generalised wrench = mover.rigid.wrench(place.force, site.x);
      for (unsigned int i = 0; i < n_motions; ++i)
        own[i] -= wrench[i];
      own[n_motions] += place.force.norm();
      own[n_motions + 1] += place.mode != ContactMode::open;
      sums[changed] += place.mode != place.matrix_mode || (place.slip - place.matrix_slip).norm() > turned;
      for (unsigned int k = 0; k < place.n; ++k) {
        const double square = place.weight[k] * place.weight[k];
        sums[excess] += square * (place.force - place.multiplier).norm_square();
        sums[multipliers] += square * place.multiplier.norm_square();
      }
    }
  }
  if (!touches.empty())
    dealii::Utilities::MPI::sum(sums, communicator, sums);
  tangent_changed = sums[changed] > 0.;
  guessed = std::sqrt(sums[excess]);
  multiplier_norm = std::sqrt(sums[multipliers]);
  for (std::size_t m = 0; m < movers.size(); ++m) {
    Mover &mover = *movers[m];
    const double *own = &sums[n_common + m * n_own];
    for (unsigned int i = 0; i < n_motions; ++i)
      mover.force[i] = own[i];
    mover.force_scale = own[n_motions];
    mover.n_closed = own[n_motions + 1];
    if (!mover.rigid.is_prescribed())
      find_residual(mover);
  }
}

template <int dim>
void ImplicitContact<dim>::find_residual(Mover &mover) const
{
  const bool has_inertia = stage.acceleration > 0.;
  mover.residual = mover.force;
  // Without inertia what nothing can bear stays where it is.
  if (has_inertia || mover.may_touch) {
    const Vector weight = mover.weight(gravity);
    mover.force_scale += weight.norm();
    for (unsigned int d = 0; d < dim; ++d)
      mover.residual[d] += weight[d];
  }
  if (has_inertia) {
    const Generalised acceleration = stage.acceleration * mover.displacement + mover.acceleration_history +
                                     stage.old_velocity * mover.start;
    const auto mass = mover.rigid.mass_matrix();
    mover.residual -= mass * acceleration;
    // What would stop it within the stage.
    mover.force_scale += std::abs(stage.old_velocity) * Generalised(mass * mover.start).norm();
    if constexpr (dim == 3) {
      // Euler's equations, with the inertia at the start of the step.
      const Generalised rate = stage.velocity * mover.displacement + mover.rate_history;
      const Generalised momentum = mass * rate;
      Vector spin, turning;
      for (unsigned int d = 0; d < 3; ++d) {
        spin[d] = rate[3 + d];
        turning[d] = momentum[3 + d];
      }
      const Vector moment = cross_product_3d(spin, turning);
      for (unsigned int d = 0; d < 3; ++d)
        mover.residual[3 + d] -= moment[d];
    }
  }
  double square = 0.;
  for (unsigned int i = 0; i < n_motions; ++i)
    if (mover.rigid.is_free(i))
      square += std::pow(mover.residual[i] / (i < dim ? 1. : mover.radius), 2);
    else
      mover.residual[i] = 0.;
  mover.imbalance = std::sqrt(square);
}

template <int dim>
void ImplicitContact<dim>::augment(const StepState &state)
{
  if (movers.empty())
    return;
  predicting = false;
  evaluate(state);
  for (const auto &touch : touches)
    for (Place &place : touch->places)
      // The force of a site that has changed its state is the penalty's guess, a thousand times too large.
      if (place.mode == place.matrix_mode || place.mode == ContactMode::open)
        place.multiplier = place.force;
}

template <int dim>
void ImplicitContact<dim>::assemble(const TimeLevel &level, const StepState &state, const UpSystem &system)
{
  // A static state is one of the bodies alone.
  if (movers.empty() || level.velocity == 0.)
    return;
  evaluate(state);
  for (const auto &touch : touches)
    for (const Place &place : touch->places)
      for (unsigned int k = 0; k < place.n; ++k)
        for (unsigned int d = 0; d < dim; ++d)
          system.residual.block(0)(place.unknown[k][d]) += place.weight[k] * place.force[d];
  if (!system.matrix)
    return;

  std::vector<Index> list;
  dealii::FullMatrix<double> local;
  for (const auto &touch : touches)
    for (Place &place : touch->places) {
      place.matrix_mode = place.mode;
      place.matrix_slip = place.slip;
      if (place.mode == ContactMode::open)
        continue;
      const unsigned int n = place.n * dim;
      list.resize(n);
      local.reinit(n, n);
      for (unsigned int i = 0; i < n; ++i) {
        list[i] = place.unknown[i / dim][i % dim];
        for (unsigned int j = 0; j < n; ++j)
          local(i, j) = place.weight[i / dim] * place.weight[j / dim] * place.tangent[i % dim][j % dim];
      }
      system.constraints.distribute_local_to_global(local, list, *system.matrix);
      if (system.split)
        system.constraints.distribute_local_to_global(local, list, system.split->shear);
    }
  tangent_changed = false;
  find_couplings(system);
}

template <int dim>
void ImplicitContact<dim>::find_couplings(const UpSystem &system)
{
  responses_known = false;
  for (const auto &one : movers) {
    Mover &mover = *one;
    mover.is_coupled = false;
    if (mover.rigid.is_prescribed())
      continue;
    mover.is_coupled = mover.n_closed > 0;
    mover.slope = {};
    if (!mover.is_coupled)
      continue;
    for (unsigned int j = 0; j < n_motions; ++j) {
      mover.coupling[j].reinit(system.residual);
      mover.reaction[j].reinit(system.residual);
    }
    for (const auto &touch : touches) {
      if (&touch->mover != &mover)
        continue;
      for (const Place &place : touch->places) {
        if (place.mode == ContactMode::open)
          continue;
        const ContactSite<dim> &site = touch->sites[place.site];
        for (unsigned int j = 0; j < n_motions; ++j) {
          Generalised unit;
          unit[j] = 1.;
          const Vector v = mover.rigid.velocity_at(site.x, unit);
          const Vector on_bodies = place.tangent * v, on_rigid = transpose(place.tangent) * v;
          for (unsigned int k = 0; k < place.n; ++k)
            for (unsigned int d = 0; d < dim; ++d) {
              mover.coupling[j].block(0)(place.unknown[k][d]) += place.weight[k] * on_bodies[d];
              mover.reaction[j].block(0)(place.unknown[k][d]) += place.weight[k] * on_rigid[d];
            }
          const Generalised column = mover.rigid.wrench(on_bodies, site.x);
          for (unsigned int i = 0; i < n_motions; ++i)
            mover.slope[i][j] += column[i];
        }
      }
    }
    for (unsigned int j = 0; j < n_motions; ++j)
      for (BlockVector *vector : {&mover.coupling[j], &mover.reaction[j]}) {
        vector->compress(dealii::VectorOperation::add);
        system.constraints.set_zero(*vector);
      }
    const dealii::ArrayView<double> entries(mover.slope.front().data(), n_motions * n_motions);
    dealii::Utilities::MPI::sum(dealii::ArrayView<const double>(entries), communicator, entries);
  }
}

#define PEAT_INSTANTIATE(dim)                                                                                \
  template void ImplicitContact<dim>::augment(const StepState &);                                            \
  template void ImplicitContact<dim>::assemble(const TimeLevel &, const StepState &, const UpSystem &);      \
  template dealii::Tensor<1, dim> ImplicitContact<dim>::displacement(const Place &, const BodyVector &) const;
PEAT_INSTANTIATE(2)
PEAT_INSTANTIATE(3)
#undef PEAT_INSTANTIATE
} // namespace peat
