#include <peat/simulation/scheme_choice.h>

#include <peat/base/text.h>
#include <peat/material/mixture.h>
#include <peat/solver/time_step.h>

#include <deal.II/base/mpi.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>

namespace peat {
namespace {
// Measured (benchmarks.md): what a step costs in explicit ones.
constexpr double semi_implicit_cost = 2.;
constexpr double implicit_cost_2d = 250., implicit_cost_3d = 1000.;
// Steps for the period of a wave, for the rise of a load, and for what then fades away.
constexpr double steps_per_period = 100., steps_per_change = 25., steps_of_decay = 30.;
// Waves that no scheme keeps in phase any longer, and that implicit steps take out on the way.
constexpr double most_periods = 1000.;

/// A load, or a motion that is prescribed, as a function of time alone, and whether a value at the start is
/// something that is switched on.
struct Signal
{
  std::string name;
  std::function<double(double)> value;
  bool is_force;
};

template <int dim>
dealii::Point<dim> middle(const Scene<dim> &scene)
{
  for (const auto &body : scene.bodies)
    if (body->n_local_points() > 0)
      return body->position(0);
  return {};
}

template <int dim>
void add_surface_signals(const Condition<dim> &condition, const Tracers<dim> &surface,
                         std::vector<Signal> &signals)
{
  constexpr std::size_t most_pieces = 5;
  std::vector<SurfacePoint<dim>> pieces;
  for (const auto &tracer : surface.tracers()) {
    SurfacePoint<dim> piece;
    piece.initial_position = tracer.initial_position;
    piece.position = tracer.position;
    piece.area = tracer.area;
    if (condition.place.contains(piece))
      pieces.push_back(piece);
  }
  const std::size_t stride = std::max<std::size_t>(1, pieces.size() / most_pieces);
  for (std::size_t i = stride / 2; i < pieces.size(); i += stride)
    for (unsigned int d = 0; d < dim; ++d)
      signals.push_back(
          {condition.name,
           [&condition, piece = pieces[i], d](const double t) { return condition.force(piece, t)[d]; },
           true});
}

template <int dim>
std::vector<Signal> find_signals(const Scene<dim> &scene, const double moment)
{
  const dealii::Point<dim> x = middle(scene);
  std::array<double, 3> place{};
  for (unsigned int d = 0; d < dim; ++d)
    place[d] = x[d];
  std::vector<Signal> signals;
  for (unsigned int d = 0; d < dim; ++d)
    signals.push_back({"gravity",
                       [&scene, place, d](const double t) { return scene.gravity.value(place.data(), t, d); },
                       true});
  for (const auto &one : scene.conditions) {
    const Condition<dim> &condition = *one;
    if (!condition.surface_of().empty())
      add_surface_signals(condition, scene.surfaces.at(condition.surface_of()), signals);
    for (unsigned int d = 0; d < dim; ++d) {
      signals.push_back({condition.name,
                         [&condition, place, d, moment](const double t) {
                           return condition.displacement_increment(place.data(), t, moment, d) / moment;
                         },
                         true});
      if (condition.has_body_force())
        signals.push_back({condition.name,
                           [&condition, x, d](const double t) { return condition.body_force(x, t)[d]; },
                           true});
    }
    if (condition.has_fluid_source())
      signals.push_back(
          {condition.name, [&condition, x](const double t) { return condition.fluid_source(x, t); }, false});
    if (condition.fluid() == Condition<dim>::Fluid::pressure ||
        condition.fluid() == Condition<dim>::Fluid::flux)
      signals.push_back(
          {condition.name,
           [&condition, place](const double t) { return condition.fluid_value(place.data(), t); }, false});
  }
  return signals;
}

/// The largest change within `moment` that halving an interval leads to.
double sudden_change(const Signal &signal, double begin, double end, const double moment)
{
  double first = signal.value(begin), last = signal.value(end);
  while (end - begin > moment) {
    const double middle = 0.5 * (begin + end), value = signal.value(middle);
    if (std::abs(value - first) >= std::abs(last - value)) {
      end = middle;
      last = value;
    } else {
      begin = middle;
      first = value;
    }
  }
  return std::abs(last - first) * std::min(1., moment / std::max(end - begin, 1e-300));
}

/// Undrained, with the modulus at the start [m/s].
template <int dim>
double wave_speed(const Body<dim> &body)
{
  const double M = body.material().initial_modulus();
  const Mixture *mixture = body.material().mixture();
  return mixture ? mixture->undrained_speed(M) : std::sqrt(M / body.material().density());
}

/// Of a saturated body's undrained wave [s].
template <int dim>
double passage_of_cell(const Scene<dim> &scene, const Grid<dim> &grid)
{
  double fastest = 0.;
  for (const auto &body : scene.bodies)
    if (body->material().mixture())
      fastest = std::max(fastest, wave_speed(*body));
  return grid.smallest_cell_size() / fastest;
}

/// Steps end at the times of statistics and probes.
double count_steps(const double duration, const double dt, const OutputParameters &output)
{
  const double shortest =
      std::min({duration, output.statistics_interval_in(duration), output.probe_interval_in(duration)});
  constexpr double round_off = 1e-9;
  return std::ceil(duration / shortest * (1. - round_off)) * std::ceil(shortest / dt * (1. - round_off));
}

template <int dim>
double largest_extent(const Body<dim> &body, MPI_Comm communicator)
{
  double extent = 0.;
  for (unsigned int d = 0; d < dim; ++d) {
    double lower = std::numeric_limits<double>::max(), upper = -lower;
    for (const std::uint32_t handle : body.handles()) {
      lower = std::min(lower, body.position(handle)[d]);
      upper = std::max(upper, body.position(handle)[d]);
    }
    extent = std::max(extent, dealii::Utilities::MPI::max(upper, communicator) -
                                  dealii::Utilities::MPI::min(lower, communicator));
  }
  return extent;
}

template <int dim>
bool is_moving(const Body<dim> &body)
{
  const double least = 1e-6 * wave_speed(body);
  for (const std::uint32_t handle : body.handles())
    for (unsigned int d = 0; d < dim; ++d)
      if (std::abs(body.row(handle)[body.layout().velocity + d]) > least)
        return true;
  return false;
}

/// Whether the bodies are in equilibrium with the loads at the start of a stage as far as earlier ones go.
template <int dim>
bool starts_in_equilibrium(const Case<dim> &parameters, const StageParameters &stage)
{
  bool balanced = false;
  for (const auto &earlier : parameters.stages) {
    if (earlier.name == stage.name)
      break;
    // Waves that a dynamic stage leaves show in the velocities.
    balanced = true;
  }
  return balanced;
}
} // namespace

template <int dim>
Demand demand(const Case<dim> &parameters, const StageParameters &stage, const Scene<dim> &scene,
              const Grid<dim> &grid, const double start)
{
  Demand result;
  for (const auto &body : scene.bodies)
    if (body->n_global_points() > 0) {
      const double period = 4. * largest_extent(*body, grid.communicator()) / wave_speed(*body);
      result.crossing = std::max(result.crossing, period);
    }
  const auto waves = [&](const bool found, const std::string &why) {
    // Ranks may find different ones; the first of them is named.
    const auto all = dealii::Utilities::MPI::all_gather(grid.communicator(), found ? why : std::string());
    for (const std::string &one : all)
      if (!one.empty() && !result.waves) {
        result.waves = true;
        result.why = one;
      }
  };
  for (const auto &body : scene.bodies)
    waves(is_moving(*body), "body '" + body->name() + "' moves at the start");
  // What meets in a contact, and how fast, only the run can tell.
  for (const auto &contact : scene.contacts)
    waves(true, "'" + contact.first + "' and '" + contact.second + "' may hit each other");

  constexpr unsigned int n_samples = 400;
  constexpr double much = 0.2;
  const double moment = 0.25 * result.crossing, interval = stage.duration / n_samples;
  const unsigned int samples_in_moment = std::min<double>(n_samples, std::floor(moment / interval));
  const bool balanced = starts_in_equilibrium(parameters, stage);
  std::string fast;
  for (const Signal &signal : find_signals(scene, 1e-3 * moment)) {
    std::vector<double> values(n_samples + 1);
    for (unsigned int i = 0; i <= n_samples; ++i)
      values[i] = signal.value(start + i * interval);
    if (!balanced && signal.is_force && values[0] != 0. && fast.empty())
      fast = "'" + signal.name + "' acts from the start";
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const double range = *high - *low;
    if (range <= 1e-12 * std::max(std::abs(*low), std::abs(*high)))
      continue;
    double variation = 0., largest = 0.;
    for (unsigned int i = 0; i < n_samples; ++i) {
      const double change = std::abs(values[i + 1] - values[i]);
      variation += change;
      if (samples_in_moment > 0)
        largest = std::max(largest, std::abs(values[std::min(i + samples_in_moment, n_samples)] - values[i]));
      else if (change > much * range)
        largest = std::max(largest,
                           sudden_change(signal, start + i * interval, start + (i + 1) * interval, moment));
    }
    if (fast.empty() && largest > much * range)
      fast = "'" + signal.name + "' changes within the passage of a wave";
    result.changes = std::max(result.changes, variation / range);
  }
  waves(!fast.empty(), fast);
  if (const double periods = stage.duration / result.crossing; result.waves && periods > most_periods) {
    std::ostringstream text;
    text.precision(2);
    text << "; the stage lasts " << periods
         << " periods of the gravest one, more than any scheme keeps in phase: if they do not matter, "
            "'Solver = quasi-static' does without";
    result.why += text.str();
  }
  result.changes = dealii::Utilities::MPI::max(result.changes, grid.communicator());
  return result;
}

template <int dim>
std::vector<SchemeEstimate> estimate_schemes(const Case<dim> &parameters, const StageParameters &stage,
                                             const Scene<dim> &scene, const Grid<dim> &grid,
                                             const Demand &asked)
{
  const SchemeParameters &scheme = parameters.scheme;
  std::vector<SchemeEstimate> list;
  for (const Scheme one : {Scheme::explicit_steps, Scheme::semi_implicit, Scheme::implicit}) {
    SchemeEstimate estimate;
    estimate.scheme = one;
    estimate.why_not = parameters.why_not(one, stage);
    if (estimate.why_not.empty() && one == Scheme::implicit) {
      const double fixed = parameters.implicit.fixed_step;
      estimate.n_steps =
          fixed > 0.
              ? stage.duration / fixed
              : steps_of_decay + steps_per_change * asked.changes +
                    (asked.waves ? steps_per_period * std::min(stage.duration / asked.crossing, most_periods)
                                 : 0.);
      estimate.limit = fixed > 0. ? "'Time step'" : asked.waves ? "waves" : "changes of the loads";
      estimate.dt = stage.duration / estimate.n_steps;
      estimate.cost = estimate.n_steps * (dim == 2 ? implicit_cost_2d : implicit_cost_3d);
    } else if (estimate.why_not.empty()) {
      const bool semi = one == Scheme::semi_implicit;
      const StableStep stable = stable_step<dim>(scene.bodies, grid, scheme.seepage_inertia, semi);
      if (semi && asked.waves)
        estimate.largest_step = asked.crossing / steps_per_period;
      if (semi && !scene.contacts.empty())
        // With longer steps the front of an impact errs twice as much as with explicit ones (benchmarks.md).
        estimate.largest_step = std::min(estimate.largest_step, 0.5 * passage_of_cell(scene, grid));
      const double wanted = std::min(scheme.step_factor * stable.dt, estimate.largest_step);
      estimate.dt = scheme.fixed_step > 0. ? scheme.fixed_step : wanted;
      estimate.limit = scheme.fixed_step > 0.                    ? "'Time step'"
                       : wanted < scheme.step_factor * stable.dt ? "waves"
                                                                 : stable.limit;
      if (scheme.fixed_step > stable.dt)
        estimate.why_not =
            "'Explicit MPM/Time step' is above its stable step of " + to_text(stable.dt) + " s";
      estimate.n_steps = count_steps(stage.duration, estimate.dt, parameters.output);
      estimate.cost = estimate.n_steps * (semi ? semi_implicit_cost : 1.);
    }
    if (!estimate.why_not.empty())
      estimate.cost = std::numeric_limits<double>::infinity();
    list.push_back(estimate);
  }
  std::stable_sort(list.begin(), list.end(), [](const auto &a, const auto &b) { return a.cost < b.cost; });
  return list;
}

std::string describe(const SchemeEstimate &estimate)
{
  std::ostringstream text;
  text.precision(2);
  text << name_of(estimate.scheme) << ": ";
  if (!estimate.why_not.empty())
    text << "not possible, " << estimate.why_not;
  else
    text << "about " << estimate.n_steps << " steps of " << estimate.dt << " s (" << estimate.limit
         << "), cost " << estimate.cost;
  return text.str();
}

template Demand demand<2>(const Case<2> &, const StageParameters &, const Scene<2> &, const Grid<2> &,
                          double);
template Demand demand<3>(const Case<3> &, const StageParameters &, const Scene<3> &, const Grid<3> &,
                          double);
template std::vector<SchemeEstimate> estimate_schemes<2>(const Case<2> &, const StageParameters &,
                                                         const Scene<2> &, const Grid<2> &, const Demand &);
template std::vector<SchemeEstimate> estimate_schemes<3>(const Case<3> &, const StageParameters &,
                                                         const Scene<3> &, const Grid<3> &, const Demand &);
} // namespace peat
