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
  double fill = 1.;
};

/// How much smaller than in a full cell the pieces of material are that a node may have to move alone: with
/// GIMP the smallest domain of a point over half a cell, with Q1 the part of the cell that is filled.
template <int dim>
double fill_of(const Body<dim> &body, const Slice &slice, const Grid<dim> &grid)
{
  const Layout &layout = body.layout();
  double volume = 0., smallest = 1.;
  for (std::uint32_t i = slice.begin; i < slice.end; ++i) {
    const double *row = body.row(body.handles()[i]);
    volume += row[layout.volume];
    for (unsigned int d = 0; d < dim && layout.extent >= 0; ++d)
      smallest = std::min(smallest, 4. * row[layout.extent + d] / grid.size(slice.cell, d));
  }
  return layout.extent >= 0 ? smallest : std::min(1., volume / grid.volume(slice.cell));
}

/// Stiffness and density at the fastest of a cell's points.
struct Speeds
{
  double wave;      ///< c + |v|, with c undrained in a saturated body
  double diffusion; ///< D = Q kappa (1 - r); 0 in a dry body
};

template <int dim>
Speeds speeds(const Body<dim> &body, const Slice &slice, const bool seepage_inertia)
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
    if (mixture) {
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

template <int dim>
Limits limits(const Body<dim> &body, const Grid<dim> &grid, const bool seepage_inertia)
{
  Limits result;
  for (const Slice &slice : body.slices()) {
    double h = std::numeric_limits<double>::max();
    for (unsigned int d = 0; d < dim; ++d)
      h = std::min(h, grid.size(slice.cell, d));
    const double fill = fill_of(body, slice, grid);
    const Speeds fastest = speeds(body, slice, seepage_inertia);
    const double c = fastest.wave / std::min(1., fill > 0.99 ? 1. : 1.39 * std::sqrt(fill));
    const double D = fastest.diffusion / std::min(1., fill > 0.99 ? 1. : 1.95 * fill);
    const double dt = h * h / (D + std::sqrt(D * D + c * c * h * h));
    if (dt < result.combined)
      result = {h / c, D > 0. ? h * h / (2. * D) : std::numeric_limits<double>::max(), dt, fill};
  }
  return result;
}
} // namespace

template <int dim>
StableStep stable_step(const std::vector<std::unique_ptr<Body<dim>>> &bodies, const Grid<dim> &grid,
                       const bool seepage_inertia)
{
  StableStep result{std::numeric_limits<double>::max(), ""};
  for (const auto &body : bodies) {
    const Limits mine = limits(*body, grid, seepage_inertia);
    const double dt = dealii::Utilities::MPI::min(mine.combined, grid.communicator());
    if (!(dt < result.dt))
      continue;
    // The rank that has the smallest step says what limits it.
    const unsigned int code = (mine.diffusion < mine.wave ? 2 : 1) + (mine.fill < 0.99 ? 2 : 0);
    const unsigned int winner =
        dealii::Utilities::MPI::max(mine.combined == dt ? code : 0u, grid.communicator());
    result.dt = dt;
    result.limit = std::string(winner % 2 == 0 ? "pressure diffusion" : "wave") + " in '" + body->name() +
                   "'" + (winner > 2 ? " (partly filled cell)" : "");
  }
  return result;
}

template StableStep stable_step<2>(const std::vector<std::unique_ptr<Body<2>>> &, const Grid<2> &, bool);
template StableStep stable_step<3>(const std::vector<std::unique_ptr<Body<3>>> &, const Grid<3> &, bool);
} // namespace peat
