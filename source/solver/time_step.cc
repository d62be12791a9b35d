#include <peat/solver/time_step.h>

#include <peat/material/mixture.h>

#include <deal.II/base/mpi.h>

namespace peat {
namespace {
struct Limits
{
  double wave = std::numeric_limits<double>::max();
  double diffusion = std::numeric_limits<double>::max();
  double combined = std::numeric_limits<double>::max();
  bool small_piece = false;
};

/// Steps until this limit is looked for again.
constexpr double steps_to_renewal = 100.;
/// How far from their even places the points of a cell count as on their way out [cell sizes, from end to
/// end].
constexpr double settled = 0.05;
/// What points that pass a face of cells add to the largest squared frequency, over that of full cells: from
/// the spectra of columns with one to five points in a cell, 0.25 to 0.56.
constexpr double passing = 0.56;

/// Factors by which slivers of material, which a node may have to move alone, reduce the limits of full
/// cells.
struct SliverFactors
{
  double wave;
  double diffusion;
  bool small_piece; ///< smaller than a point of a full cell
};

/// GIMP: a domain of half-length l that reaches over the surface's grid line adds up to c^2/(l h) to the
/// largest squared frequency 4 c^2/h^2, whatever the length that sticks out, and likewise D/(l h) to the
/// largest rate 4 D/h^2. The velocity of a node with hardly any mass does not outlive the step: its points do
/// not feel it. So its part of the motion is not a wave, stable to (omega dt)^2 = 4, but a relaxation, stable
/// to 2, and counts twice.
///
/// Q1: nodes with little mass follow others (NodeExtension). Points that pass a face, and edges and corners
/// that lie off the lines of the mesh, add up to `passing`/n to the largest squared frequency of full cells,
/// with n points in the length of a cell.
template <int dim>
SliverFactors sliver_factors(const Body<dim> &body, const Slice &slice, const Grid<dim> &grid,
                             const double mach_number)
{
  const Layout &layout = body.layout();
  double volume = 0., domain = 1., largest = 0.;
  dealii::Tensor<1, dim> first_moment; // of volume, about the lower corner of the cell, in its edges
  for (std::uint32_t i = slice.begin; i < slice.end; ++i) {
    const double *row = body.row(body.handles()[i]);
    volume += row[layout.volume];
    largest = std::max(largest, row[layout.volume]);
    const auto &x = body.position(body.handles()[i]);
    for (unsigned int d = 0; d < dim; ++d)
      first_moment[d] += row[layout.volume] * (x[d] - grid.lower(slice.cell, d)) / grid.size(slice.cell, d);
    for (unsigned int d = 0; d < dim && layout.wide_domains; ++d)
      domain = std::min(domain, 4. * row[layout.extent + d] / grid.size(slice.cell, d));
  }
  const auto reduced = [](const double part, const bool small) {
    return SliverFactors{1. / std::sqrt(1. + 2. * part), 1. / (1. + part), small};
  };
  if (layout.wide_domains)
    return reduced(1. / domain, domain < 0.99);
  // What is full and even, and stays so for a while.
  const double fill = volume / grid.volume(slice.cell);
  double part = 1.;
  for (unsigned int d = 0; d < dim; ++d)
    part = std::min({part, 2. * first_moment[d] / volume, 2. * (1. - first_moment[d] / volume)});
  if (part > (1. - settled) * fill && std::abs(fill - 1.) < settled &&
      steps_to_renewal * mach_number < 0.5 * settled)
    return {1., 1., false};
  return reduced(passing * std::pow(largest / grid.volume(slice.cell), 1. / dim), fill < 0.99);
}

/// Stiffness and density at the fastest of a cell's points.
struct Speeds
{
  double wave;      ///< c + |v|, with c undrained in a saturated body
  double diffusion; ///< D = Q kappa (1 - r); 0 in a dry body
};

template <int dim>
Speeds speeds(const Body<dim> &body, const Slice &slice, const bool seepage_inertia,
              const bool implicit_pressure)
{
  const Layout &layout = body.layout();
  const Law &law = body.material().law();
  const Mixture *mixture = body.material().mixture();
  Speeds fastest{0., 0.};
  constexpr unsigned int n_stress = dim == 2 ? 4 : 6;
  for (std::uint32_t begin = slice.begin; begin < slice.end; begin += n_lanes) {
    StressLanes stress = {};
    Lanes state[max_state_columns] = {}, density, porosity, speed;
    for (unsigned int l = 0; l < n_lanes; ++l) {
      const double *row = body.row(body.handles()[std::min(begin + l, slice.end - 1)]);
      for (unsigned int c = 0; c < n_stress; ++c)
        stress[c][l] = row[layout.stress + c];
      for (unsigned int c = 0; c < layout.n_state; ++c)
        state[c][l] = row[layout.state + c];
      density[l] = row[layout.mass] / row[layout.volume];
      porosity[l] = layout.porosity >= 0 ? row[layout.porosity] : (mixture ? mixture->porosity() : 0.);
      double v2 = 0.;
      for (unsigned int d = 0; d < dim; ++d)
        v2 += row[layout.velocity + d] * row[layout.velocity + d];
      speed[l] = std::sqrt(v2);
    }
    Lanes modulus = law.wave_modulus(stress, state);
    Lanes D = broadcast(0.);
    if (mixture && implicit_pressure) {
      const Lanes c = mixture->semi_implicit_speed(porosity, modulus, density, seepage_inertia);
      modulus = c * c * density;
    } else if (mixture) {
      const double alpha = mixture->biot_coefficient();
      const Lanes Q = 1. / mixture->storage(porosity);
      modulus += alpha * alpha * Q;
      D = Q * mixture->mobility(porosity);
      if (seepage_inertia)
        D *= 1. - alpha * mixture->fluid_density() / density;
    }
    const Lanes c = sqrt(modulus / density) + speed;
    for (unsigned int l = 0; l < n_lanes; ++l) {
      fastest.wave = std::max(fastest.wave, c[l]);
      fastest.diffusion = std::max(fastest.diffusion, D[l]);
    }
  }
  return fastest;
}

/// Of all points [m/s]: what is hit moves as fast at once.
template <int dim>
double largest_speed(const std::vector<std::unique_ptr<Body<dim>>> &bodies, const Grid<dim> &grid)
{
  double largest = 0.;
  for (const auto &body : bodies)
    for (std::uint32_t p = 0; p < body->n_local_points(); ++p) {
      double v2 = 0.;
      for (unsigned int d = 0; d < dim; ++d)
        v2 += std::pow(body->row(p)[body->layout().velocity + d], 2);
      largest = std::max(largest, v2);
    }
  return std::sqrt(dealii::Utilities::MPI::max(largest, grid.communicator()));
}

template <int dim>
Limits limits(const Body<dim> &body, const Grid<dim> &grid, const bool seepage_inertia,
              const bool implicit_pressure, const double motion)
{
  Limits result;
  for (const Slice &slice : body.slices()) {
    double h = std::numeric_limits<double>::max();
    for (unsigned int d = 0; d < dim; ++d)
      h = std::min(h, grid.size(slice.cell, d));
    const Speeds fastest = speeds(body, slice, seepage_inertia, implicit_pressure);
    const SliverFactors factors = sliver_factors(body, slice, grid, motion / fastest.wave);
    const double c = fastest.wave / factors.wave;
    const double D = fastest.diffusion / factors.diffusion;
    const double dt = h * h / (D + std::sqrt(D * D + c * c * h * h));
    if (dt < result.combined)
      result = {h / c, D > 0. ? h * h / (2. * D) : std::numeric_limits<double>::max(), dt,
                factors.small_piece};
  }
  return result;
}
} // namespace

template <int dim>
StableStep stable_step(const std::vector<std::unique_ptr<Body<dim>>> &bodies, const Grid<dim> &grid,
                       const bool seepage_inertia, const bool implicit_pressure)
{
  StableStep result{std::numeric_limits<double>::max(), ""};
  const double motion = largest_speed<dim>(bodies, grid);
  for (const auto &body : bodies) {
    const Limits mine = limits(*body, grid, seepage_inertia, implicit_pressure, motion);
    const double dt = dealii::Utilities::MPI::min(mine.combined, grid.communicator());
    if (!(dt < result.dt))
      continue;
    // The rank that has the smallest step says what limits it.
    const unsigned int code = (mine.diffusion < mine.wave ? 2 : 1) + (mine.small_piece ? 2 : 0);
    const unsigned int winner =
        dealii::Utilities::MPI::max(mine.combined == dt ? code : 0u, grid.communicator());
    result.dt = dt;
    result.limit = std::string(winner % 2 == 0                                   ? "pressure diffusion"
                               : implicit_pressure && body->material().mixture() ? "skeleton wave"
                                                                                 : "wave") +
                   " in '" + body->name() + "'" + (winner > 2 ? " (small piece of material)" : "");
  }
  return result;
}

template StableStep stable_step<2>(const std::vector<std::unique_ptr<Body<2>>> &, const Grid<2> &, bool,
                                   bool);
template StableStep stable_step<3>(const std::vector<std::unique_ptr<Body<3>>> &, const Grid<3> &, bool,
                                   bool);
} // namespace peat
