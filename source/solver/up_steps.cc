#include <peat/solver/up_solver.h>

#include <peat/material/mixture.h>

#include <deal.II/base/mpi.h>

#include <sstream>

// Steps: the levels of time at which the equations hold: static, those of a diagonally implicit Runge-Kutta
// method (quasi-static, and the dynamics of material points), and dynamic finite elements (generalised-alpha;
// theory.md, implicit solvers); and what goes along with the points after one.

namespace peat {
namespace {
/// Of the two-stage, second-order, L-stable diagonally implicit method (Alexander 1977).
const double stage_share = 1. - std::sqrt(0.5);
} // namespace

template <int dim>
void UpSolver<dim>::project_start()
{
  // Nodal pressures from the points': with no rates and no loads the storage term says (S p_n)_i = sum V p N
  // / Q.
  second = 0.;
  if (!unknowns.has_pressure())
    return;
  TimeLevel level = this->level(now, 0.);
  level.share = 0.;
  level.pressure_rate = 1.;
  level.acceleration = 1.;
  level.seepage_inertia = false;
  unknown = 0.;
  state.rate_history = 0.;
  state.second_history = 0.;
  residual = 0.;
  matrix = 0.;
  share_unknown();
  const UpSystem system{boundary.unused(), residual, gross, &matrix};
  for (const auto &body : scene.bodies)
    form->assemble(*body, level, state, {}, 0., system);
  residual.compress(dealii::VectorOperation::add);
  residual.block(0) = 0.;
  fill_empty_diagonal(level);
  prepare_linear_solver(level, false, false);
  matrix_is_valid = matrix_is_near = false;
  correction = 0.;
  linear_solver.solve(correction, residual);
  second.block(1) = correction.block(1);
}

template <int dim>
void UpSolver<dim>::solve_static()
{
  if (unknowns.has_pressure() && !boundary.prescribes_pressure())
    throw NumericalError(
        "a static state needs a place where the pore pressure is given: a free surface, or a "
        "condition of kind 'pressure'");
  TimeLevel level = this->level(now, 0.);
  rate = 0.;
  state.rate_history = 0.;
  state.second_history = second;
  unknown = second;
  unknown.block(0) = 0.;
  // One more iteration costs little, and rest is to be rest.
  solve(level, now, now, 1e-12);
  book_work(level, 1., unknown.block(0));
  accept(level, false);
  first_step_done = false;
}

template <int dim>
void UpSolver<dim>::start(const Mode stage_mode)
{
  mode = stage_mode;
  if (method == Method::material_points && contact.enter())
    prepare();
  damped_steps_left = parameters.start_steps;
  next_step = 0.;
  first_step_done = false;
  rate = 0.;
  change = 0.;
  change_scale = {};
  second.block(0) = 0.;
  if (runge_kutta())
    return;

  // First v and then a and p_t from one matrix: that of the rates alone, [[M, 0], [-G, -S]].
  TimeLevel level = this->level(now, 0.);
  level.share = 0.;
  level.acceleration = 1.;
  level.pressure_rate = unknowns.has_pressure() ? 1. : 0.;
  unknown = second;
  unknown.block(0) = 0.;
  state.rate_history = 0.;
  state.second_history = second;
  assemble(level, true);
  right_side = 0.;
  for (const auto &body : scene.bodies)
    form->add_momentum(*body, right_side.block(0));
  right_side.compress(dealii::VectorOperation::add);
  boundary.condense(right_side);
  correction = 0.;
  if (right_side.l2_norm() > 0.)
    linear_solver.solve(correction, right_side);
  boundary.distribute(correction);
  rate.block(0) = correction.block(0);
  boundary.prescribe_velocity(now, 1e-3 * suggested_step().dt, rate.block(0));

  BlockVector history = rate;
  if (unknowns.has_pressure())
    history.block(1) = 0.;
  state.rate_history = history;
  assemble(level, false);
  correction = 0.;
  if (right_side.l2_norm() > 0.)
    linear_solver.solve(correction, right_side);
  boundary.distribute(correction);
  second.block(0) = correction.block(0);
  if (unknowns.has_pressure())
    rate.block(1) = correction.block(1);
  matrix_is_valid = matrix_is_near = false;
}

template <int dim>
StableStep UpSolver<dim>::suggested_step() const
{
  if (parameters.fixed_step > 0.)
    return {parameters.fixed_step, "'Time step'"};
  if (runge_kutta() && next_step > 0.)
    return {next_step, "error of the step"};
  if (runge_kutta() && parameters.first_step > 0.)
    return {parameters.first_step, "'First step'"};
  StableStep best{std::numeric_limits<double>::max(), ""};
  const double h = grid.smallest_cell_size();
  for (const auto &body : scene.bodies) {
    const Material &material = body->material();
    const double M = material.initial_modulus();
    const Mixture *mixture = material.mixture();
    double dt = parameters.step_factor * h / std::sqrt(M / material.density());
    std::string limit = "wave over a cell in '" + body->name() + "'";
    if (mixture && mode == Mode::dynamic)
      dt = parameters.step_factor * h / mixture->undrained_speed(M);
    if (mixture && mode == Mode::quasi_static) {
      dt = 0.25 * h * h * (mixture->storage() + std::pow(mixture->biot_coefficient(), 2) / M) /
           mixture->mobility();
      limit = "diffusion over half a cell in '" + body->name() + "'";
    }
    if ((mixture || mode == Mode::dynamic) && dt < best.dt)
      best = {dt, limit};
  }
  return best;
}

template <int dim>
double UpSolver<dim>::step(const double latest)
{
  if (runge_kutta())
    return runge_kutta_step(latest);
  const double remaining = latest - now, wanted = suggested_step().dt;
  const double dt = remaining / std::ceil(remaining / wanted * (1. - 1e-12));
  dynamic_step(dt);
  return dt;
}

template <int dim>
void UpSolver<dim>::dynamic_step(const double dt)
{
  if (damped_steps_left == 0)
    return generalised_alpha_step(dt);
  --damped_steps_left;
  damped_step(0.5 * dt);
  damped_step(0.5 * dt);
}

template <int dim>
void UpSolver<dim>::damped_step(const double dt)
{
  TimeLevel level = this->level(now + dt, dt);
  level.velocity = level.pressure_rate = 1. / dt;
  level.acceleration = 1. / (dt * dt);
  BlockVector history = second;
  history.block(0).equ(-1. / dt, rate.block(0));
  state.rate_history = 0.;
  state.second_history = history;
  unknown = second;
  unknown.block(0).equ(dt, rate.block(0));
  solve(level, now, now + dt, parameters.newton_tolerance);
  book_work(level, 1., unknown.block(0));

  second.block(0).equ(-1. / dt, rate.block(0));
  rate.block(0).equ(1. / dt, unknown.block(0));
  second.block(0).add(1. / dt, rate.block(0));
  if (unknowns.has_pressure()) {
    rate.block(1).equ(1. / dt, unknown.block(1));
    rate.block(1).add(-1. / dt, second.block(1));
  }
  accept(level, false);
}

template <int dim>
void UpSolver<dim>::generalised_alpha_step(const double dt)
{
  // Chung and Hulbert (1993) for the motion, Jansen, Whiting and Hulbert (2000) for the pressure, with the
  // shares of the new values: of u, v, p, of a, and of p_t.
  const double r = parameters.spectral_radius;
  const double share = 1. / (1. + r), share_a = (2. - r) / (1. + r), share_p = 0.5 * (3. - r) / (1. + r);
  const double beta = 0.25 * std::pow(1. + share_a - share, 2), gamma = 0.5 + share_a - share;
  const double gamma_p = 0.5 + share_p - share;

  TimeLevel level = this->level(now + share * dt, dt);
  level.share = share;
  level.velocity = share * gamma / (beta * dt);
  level.acceleration = share_a / (beta * dt * dt);
  level.pressure_rate = share_p / (gamma_p * dt);

  BlockVector first = rate, next = second;
  first.block(0) *= 1. - share * gamma / beta;
  first.block(0).add(share * dt * (1. - 0.5 * gamma / beta), second.block(0));
  next.block(0) *= 1. - share_a * 0.5 / beta;
  next.block(0).add(-share_a / (beta * dt), rate.block(0));
  if (unknowns.has_pressure())
    first.block(1) *= 1. - share_p / gamma_p;
  state.rate_history = first;
  state.second_history = next;
  unknown = second;
  unknown.block(0).equ(dt, rate.block(0));
  unknown.block(0).add(0.5 * dt * dt, second.block(0));
  solve(level, now, now + dt, parameters.newton_tolerance);
  book_work(level, 1., unknown.block(0));

  first = rate;
  next.block(0) = second.block(0);
  rate.block(0).equ(gamma / (beta * dt), unknown.block(0));
  rate.block(0).add(1. - gamma / beta, first.block(0), dt * (1. - 0.5 * gamma / beta), next.block(0));
  second.block(0).equ(1. / (beta * dt * dt), unknown.block(0));
  second.block(0).add(-1. / (beta * dt), first.block(0), 1. - 0.5 / beta, next.block(0));
  if (unknowns.has_pressure()) {
    rate.block(1).equ(1. / (gamma_p * dt), unknown.block(1));
    rate.block(1).add(-1. / (gamma_p * dt), second.block(1), 1. - 1. / gamma_p, first.block(1));
  }
  accept(level, false);
}

template <int dim>
double UpSolver<dim>::runge_kutta_step(const double latest)
{
  constexpr unsigned int most_attempts = 30;
  double dt = std::min(suggested_step().dt, latest - now);
  double error_before = std::numeric_limits<double>::infinity();
  for (unsigned int attempt = 0; attempt < most_attempts; ++attempt) {
    // A rest that is shorter than a tenth of a step is shared with this one, unless it is round-off.
    constexpr double round_off = 1e-9;
    if (dt < (1. - round_off) * (latest - now) && latest - now < 1.1 * dt)
      dt = 0.5 * (latest - now);
    const bool ends_there = dt >= (1. - round_off) * (latest - now);
    if (ends_there)
      dt = latest - now;
    const Ledger<dim> book_before = book;
    const double error = try_stages(dt);
    // What jumps is no error that shorter steps could reduce: loads at the start of a stage, and what points
    // do that come to other nodes or surfaces that cut other cells.
    constexpr double reduced = 0.7;
    const bool jumps = std::isfinite(error) && (!first_step_done || error > reduced * error_before);
    error_before = error;
    const bool free = parameters.fixed_step > 0. || jumps;
    if (free || error <= parameters.step_tolerance) {
      // Only what is rejected shortens the steps, and not where that does not help: an error that has a
      // floor, as that of points which begin to reach other nodes, would else shorten them for ever.
      const double growth = std::min(parameters.largest_growth,
                                     0.8 * std::sqrt(parameters.step_tolerance / std::max(error, 1e-300)));
      const double wanted = std::max(next_step, dt);
      next_step = parameters.fixed_step > 0. ? parameters.fixed_step
                  : jumps                    ? wanted
                                             : std::max(dt * std::max(1., growth), ends_there ? wanted : 0.);
      // A step that hardly grows stays, and with it its factorisation.
      constexpr double hardly = 1.3;
      if (next_step > dt && next_step < hardly * dt && !ends_there)
        next_step = dt;
      first_step_done = true;
      accept(stage_level(dt, true), method == Method::material_points);
      return dt;
    }
    book = book_before;
    ++done.rejected_steps;
    dt *= std::max(0.2, 0.8 * std::sqrt(parameters.step_tolerance / error));
  }
  std::ostringstream text;
  text << "no step after t = " << now << " s is accurate to 'Step tolerance', the last was " << dt
       << " s; loads that jump belong to the start of a stage";
  if (!std::isfinite(error_before))
    text << "; " << failure;
  throw NumericalError(text.str());
}

template <int dim>
dealii::TrilinosWrappers::MPI::Vector UpSolver<dim>::mean_velocity() const
{
  dealii::TrilinosWrappers::MPI::Vector velocity(unknowns.owned()[0], grid.communicator()), mass(velocity);
  for (const auto &body : scene.bodies) {
    form->add_momentum(*body, velocity);
    form->sum_mass(*body, mass);
  }
  velocity.compress(dealii::VectorOperation::add);
  mass.compress(dealii::VectorOperation::add);
  for (const auto index : unknowns.owned()[0])
    if (mass(index) > 0.)
      velocity(index) /= mass(index);
  velocity.compress(dealii::VectorOperation::insert);
  boundary.distribute(velocity);
  return velocity;
}

template <int dim>
TimeLevel UpSolver<dim>::stage_level(const double dt, const bool last) const
{
  const double g = stage_share;
  TimeLevel level = this->level(now + (last ? dt : g * dt), dt);
  level.velocity = level.pressure_rate = 1. / (g * dt);
  if (mode == Mode::dynamic) {
    level.acceleration = 1. / (g * dt * g * dt);
    level.old_velocity = (last ? (1. - 2. * g) / g : -1.) / (g * dt);
  }
  return level;
}

template <int dim>
double UpSolver<dim>::try_stages(const double dt)
{
  // Where Newton's iterations fail a shorter step may do.
  if (parameters.fixed_step > 0.)
    return find_stages(dt);
  try {
    return find_stages(dt);
  } catch (const NumericalError &error) {
    failure = error.what();
    matrix_is_valid = false;
    return std::numeric_limits<double>::infinity();
  }
}

template <int dim>
double UpSolver<dim>::find_stages(const double dt)
{
  const double g = stage_share;
  state.rate_history = 0.;
  BlockVector old = second;
  old.block(0) = 0.;
  state.second_history = old;
  unknown = old;
  if (mode == Mode::dynamic && !linear)
    unknown.block(0).equ(g * dt, mean_velocity());
  TimeLevel level = stage_level(dt, false);
  contact.begin_step(now);
  contact.begin_stage(level, now, now + g * dt, 0., 0.);
  solve(level, now, now + g * dt, parameters.newton_tolerance);

  // k_1 = (Y_1 - y_n)/(g dt);  k_2 = (Y_2 - y_n)/(g dt) - (1 - g)/g k_1, of u and p, and of v, where v_2 is
  // that k_2: a_2 = Y_2/(g dt)^2 - 2 (1 - g)/(g^2 dt) k_1 + (1 - 2 g)/(g^2 dt) v_n
  BlockVector first = unknown;
  first -= old;
  first *= 1. / (g * dt);
  // Stages count by their weights in the step, 1 - g and g.
  BlockVector motion = first;
  motion *= dt;
  book_work(level, 1. - g, motion.block(0));
  BlockVector history = first;
  history *= -(1. - g) / g;
  state.rate_history = history;
  if (mode == Mode::dynamic) {
    BlockVector accelerations = old;
    accelerations.block(0).equ(-2. * (1. - g) / (g * g * dt), first.block(0));
    state.second_history = accelerations;
  }
  level = stage_level(dt, true);
  contact.begin_stage(level, now, now + dt, -(1. - g) / g,
                      mode == Mode::dynamic ? -2. * (1. - g) / (g * g * dt) : 0.);
  solve(level, now, now + dt, parameters.newton_tolerance);

  // Against the first-order y_n + dt k_1.
  BlockVector difference = unknown;
  difference -= old;
  for (unsigned int b = 0; b < unknowns.n_blocks(); ++b) {
    rate.block(b).equ(1. / (g * dt), difference.block(b));
    rate.block(b).add(1., history.block(b));
  }
  motion.equ(dt, rate);
  book_work(level, g, motion.block(0));
  difference.add(-dt, first);
  return estimated_error(difference);
}

template <int dim>
std::array<double, 2> UpSolver<dim>::mean_at_points(const BlockVector &field)
{
  ghosted_motion = field;
  std::array<double, 2> squares{}, volumes{};
  for (const auto &body : scene.bodies)
    form->add_squares(*body, ghosted_motion, squares, volumes);
  for (unsigned int b = 0; b < 2; ++b) {
    squares[b] = dealii::Utilities::MPI::sum(squares[b], grid.communicator());
    volumes[b] = dealii::Utilities::MPI::sum(volumes[b], grid.communicator());
    squares[b] = volumes[b] > 0. ? std::sqrt(squares[b] / volumes[b]) : 0.;
  }
  return squares;
}

template <int dim>
double UpSolver<dim>::estimated_error(const BlockVector &difference)
{
  BlockVector changed = change;
  changed += unknown;
  if (unknowns.has_pressure())
    changed.block(1) -= second.block(1);
  // Changes that are nothing beside a cell or the pressures need no accuracy.
  const std::array<double, 2> least = {1e-6 * grid.smallest_cell_size(), 1e-3 * mean_at_points(unknown)[1]};
  // At points: what nodes have that points do not see is no error.
  const auto changes = mean_at_points(changed), errors = mean_at_points(difference);
  double error = 0.;
  for (unsigned int b = 0; b < unknowns.n_blocks(); ++b) {
    change_scale[b] = std::max({change_scale[b], 2. * changes[b], least[b]});
    error = std::max(error, change_scale[b] > 0. ? errors[b] / change_scale[b] : 0.);
  }
  error = std::max(error, contact.estimated_error(parameters.step_tolerance));
  // Points must not pass a cell.
  if (method == Method::material_points) {
    const double farthest = unknown.block(0).linfty_norm() / (0.5 * grid.smallest_cell_size());
    error = std::max(error, parameters.step_tolerance * farthest * farthest);
  }
  return error;
}

template <int dim>
void UpSolver<dim>::book_work(const TimeLevel &level, const double share,
                              const dealii::TrilinosWrappers::MPI::Vector &motion)
{
  ghosted_motion.block(0) = motion;
  const VolumeLoads<dim> volume = volume_loads(level.time);
  dealii::Tensor<1, dim> weight;
  double gravity_work = 0.;
  StepWork work;
  for (const auto &body : scene.bodies) {
    if (volume.gravity.norm() > 0. || !volume.forces.empty())
      form->sum_weight(*body, ghosted_motion.block(0), volume, level.time, weight, gravity_work);
    form->book_seepage(*body, level, state, volume.gravity, work);
  }
  const auto held = boundary.reactions(level, residual, motion);
  const auto loads = boundary.loads(level, ghosted_motion.block(0));
  const double dt = share * level.dt;
  contact.book_work(level, share, ghosted_motion.block(0), book);
  book.impulse += dt * (held.force + loads.force + weight);
  book.gross_impulse += dt * (held.gross_force + loads.gross_force + weight.norm());
  book.external_work += share * (held.work + loads.work + gravity_work);
  book.gravity_work += share * gravity_work;
  book.fluid_outflow += dt * (held.outflow + loads.outflow);
  book.fluid_squeezed += share * work.fluid_squeezed;
  book.seepage_dissipation += share * work.seepage_dissipation;
  book.seepage_work += share * work.seepage_work;
}

namespace {
/// Applies an action to the rows of all points of scenes.
template <int dim, typename Action>
void for_each_point(const std::vector<Scene<dim> *> &scenes, const Action &action)
{
  for (Scene<dim> *scene : scenes)
    for (const auto &body : scene->bodies)
      for (const std::uint32_t handle : body->handles())
        action(body->layout(), body->row(handle));
}
} // namespace

template <int dim>
void UpSolver<dim>::set_horizontal_stress(const double K0)
{
  std::vector<Scene<dim> *> scenes = followers;
  scenes.push_back(&scene);
  for_each_point<dim>(scenes, [&](const Layout &layout, double *row) {
    double *stress = row + layout.stress;
    for (unsigned int d = 0; d < 3; ++d)
      if (d != dim - 1)
        stress[d] = K0 * stress[dim - 1];
    for (unsigned int c = 3; c < (dim == 2 ? 4 : 6); ++c)
      stress[c] = 0.;
  });
}

template <int dim>
void UpSolver<dim>::reset_displacements()
{
  std::vector<Scene<dim> *> scenes = followers;
  scenes.push_back(&scene);
  for_each_point<dim>(
      scenes, [&](const Layout &layout, double *row) { std::fill_n(row + layout.displacement, dim, 0.); });
  for (auto &[name, tracers] : scene.surfaces)
    tracers.restart();
  if (scene.probes)
    scene.probes->restart();
  total = 0.;
}

template <int dim>
void UpSolver<dim>::move_tracers()
{
  if (method == Method::finite_elements) {
    if (!scene.probes)
      return;
    ghosted_total = total;
    scene.probes->place(
        [&](const dealii::Point<dim> &x) { return unknowns.value(ghosted_total.block(0), x); });
    return;
  }
  // Tracers know vertices only; what lies between is what the points see, too.
  std::vector<double> step(std::size_t(active.size()) * dim, 0.);
  for (unsigned int i = 0; i < active.size(); ++i)
    if (const auto *node = unknowns.node_at(active.grid_node(i)))
      for (unsigned int d = 0; d < dim; ++d)
        step[std::size_t(i) * dim + d] = state.unknown.block(0)(node->displacement[d]);
  for (auto &[name, tracers] : scene.surfaces)
    tracers.move(step, 1., scene.body(name).material().law().finite_strain(), active);
  if (scene.probes) {
    scene.probes->locate(active);
    scene.probes->move(step, 1., false, active);
  }
}

template <int dim>
bool UpSolver<dim>::surfaces_change()
{
  const auto prescribed = [&] {
    std::vector<dealii::types::global_dof_index> unknowns;
    for (const auto &line : boundary.constraints().get_lines())
      unknowns.push_back(line.index);
    return unknowns;
  };
  const auto before = prescribed();
  for (auto &[name, tracers] : scene.surfaces) {
    tracers.settle(scene.body(name), active);
    tracers.locate(active);
  }
  boundary.locate(active, small_nodes.unused());
  return dealii::Utilities::MPI::max(int(prescribed() != before), grid.communicator()) > 0;
}

#define PEAT_INSTANTIATE(dim)                                                                                \
  template void UpSolver<dim>::set_horizontal_stress(double);                                                \
  template void UpSolver<dim>::reset_displacements();                                                        \
  template void UpSolver<dim>::project_start();                                                              \
  template void UpSolver<dim>::solve_static();                                                               \
  template void UpSolver<dim>::start(Mode);                                                                  \
  template StableStep UpSolver<dim>::suggested_step() const;                                                 \
  template double UpSolver<dim>::step(double);                                                               \
  template void UpSolver<dim>::dynamic_step(double);                                                         \
  template void UpSolver<dim>::damped_step(double);                                                          \
  template void UpSolver<dim>::generalised_alpha_step(double);                                               \
  template double UpSolver<dim>::runge_kutta_step(double);                                                   \
  template double UpSolver<dim>::try_stages(double);                                                         \
  template double UpSolver<dim>::find_stages(double);                                                        \
  template std::array<double, 2> UpSolver<dim>::mean_at_points(const BlockVector &);                         \
  template void UpSolver<dim>::book_work(const TimeLevel &, double,                                          \
                                         const dealii::TrilinosWrappers::MPI::Vector &);                     \
  template double UpSolver<dim>::estimated_error(const BlockVector &);                                       \
  template dealii::TrilinosWrappers::MPI::Vector UpSolver<dim>::mean_velocity() const;                       \
  template TimeLevel UpSolver<dim>::stage_level(double, bool) const;                                         \
  template void UpSolver<dim>::move_tracers();                                                               \
  template bool UpSolver<dim>::surfaces_change();
PEAT_INSTANTIATE(2)
PEAT_INSTANTIATE(3)
#undef PEAT_INSTANTIATE
} // namespace peat
