#include <peat/solver/rest_pressure.h>

#include <deal.II/base/mpi.h>

#include <sstream>

#include "form_cell.h"

namespace peat {
namespace {
/// The seepage of the explicit step, as a function of one pressure per cell and body.
template <int dim, unsigned int reach>
class RestingSeepage
{
public:
  RestingSeepage(Scene<dim> &scene, const ActiveNodes<dim> &active, const double time);

  using Pressures = std::vector<double>;
  Pressures pressures() const;
  void set(const Pressures &p);

  /// Volume-weighted divergence of the flux of each cell; without loads: the linear part of it.
  Pressures divergence(const Pressures &p, bool with_loads);
  /// What the terms would be if none cancelled another.
  double gross() const { return largest; }
  const Pressures &diagonal() const { return jacobi; }
  double dot(const Pressures &a, const Pressures &b) const;

private:
  static constexpr unsigned int n_nodes = FormPoints<dim, reach>::n_nodes;
  struct Cell
  {
    Body<dim> *body;
    const Slice *slice;
    std::array<double, n_nodes * dim> slope; ///< sum V grad N
  };
  void add_cells(Body<dim> &body);
  void find_closed_rows();
  void find_diagonal();
  const Surface<dim> &surface(const Condition<dim> &condition) const;

  Scene<dim> &scene;
  const ActiveNodes<dim> &active;
  std::vector<Cell> cells;
  NodalFields<dim> nodal;
  std::vector<double> resistance, inertia;
  std::vector<std::size_t> closed_rows;
  Pressures jacobi;
  double largest = 0.;
};

template <int dim, unsigned int reach>
RestingSeepage<dim, reach>::RestingSeepage(Scene<dim> &scene, const ActiveNodes<dim> &active,
                                           const double time)
    : scene(scene), active(active), resistance(active.size(), 0.), inertia(active.size(), 0.)
{
  nodal.time = time;
  nodal.n_sums = 1;
  nodal.sums.assign(active.size(), 0.);
  for (auto *field : {&nodal.force, &nodal.pressure_load, &nodal.flux})
    field->assign(active.size() * dim, 0.);
  for (const auto &body : scene.bodies)
    if (body->material().mixture())
      add_cells(*body);
  active.sum_over_ranks(resistance.data(), 1);
  active.sum_over_ranks(inertia.data(), 1);
  find_closed_rows();
  find_diagonal();
  for (const auto &condition : scene.conditions)
    condition->add_loads(active, surface(*condition), nodal);
  active.sum_over_ranks(nodal.pressure_load.data(), dim);
}

template <int dim, unsigned int reach>
const Surface<dim> &RestingSeepage<dim, reach>::surface(const Condition<dim> &condition) const
{
  static const Surface<dim> none;
  return condition.surface_of().empty() ? none : scene.surfaces.at(condition.surface_of()).surface();
}

template <int dim, unsigned int reach>
void RestingSeepage<dim, reach>::add_cells(Body<dim> &body)
{
  const Mixture &mixture = *body.material().mixture();
  for (const Slice &slice : body.slices()) {
    Cell cell{&body, &slice, {}};
    const std::uint32_t *nodes = active.cell_nodes(slice.cell);
    for (std::uint32_t begin = slice.begin; begin < slice.end; begin += n_lanes) {
      const FormPoints<dim, reach> points(active.grid(), body, slice, begin);
      const Lanes kappa = mixture.mobility(points.porosity(body.layout(), mixture));
      for (unsigned int i = 0; i < n_nodes; ++i) {
        resistance[nodes[i]] += sum(points.volume * points.N[i] / kappa);
        inertia[nodes[i]] += mixture.fluid_density() * sum(points.volume * points.N[i]);
        for (unsigned int d = 0; d < dim; ++d)
          cell.slope[i * dim + d] += sum(points.volume * points.dN[i][d]);
      }
    }
    cells.push_back(cell);
  }
}

template <int dim, unsigned int reach>
void RestingSeepage<dim, reach>::find_closed_rows()
{
  std::vector<bool> open(2 * dim, false);
  for (const auto &condition : scene.conditions) {
    condition->select(active);
    for (const unsigned int boundary : condition->opened_boundaries())
      open[boundary] = true;
  }
  for (unsigned int b = 0; b < 2 * dim; ++b)
    for (const std::uint32_t i : active.on_boundary(b))
      if (!open[b])
        closed_rows.push_back(std::size_t(i) * dim + b / 2);
}

template <int dim, unsigned int reach>
void RestingSeepage<dim, reach>::find_diagonal()
{
  std::vector<char> closed(active.size() * dim, 0);
  for (const std::size_t row : closed_rows)
    closed[row] = 1;
  for (const Cell &cell : cells) {
    const std::uint32_t *nodes = active.cell_nodes(cell.slice->cell);
    double entry = 0.;
    for (unsigned int i = 0; i < n_nodes; ++i)
      for (unsigned int d = 0; d < dim; ++d)
        if (resistance[nodes[i]] > 0. && !closed[std::size_t(nodes[i]) * dim + d])
          entry += cell.slope[i * dim + d] * cell.slope[i * dim + d] / resistance[nodes[i]];
    jacobi.push_back(entry > 0. ? entry : 1.);
  }
}

template <int dim, unsigned int reach>
typename RestingSeepage<dim, reach>::Pressures RestingSeepage<dim, reach>::pressures() const
{
  Pressures p;
  for (const Cell &cell : cells)
    p.push_back(mean_pressure(*cell.body, *cell.slice));
  return p;
}

template <int dim, unsigned int reach>
void RestingSeepage<dim, reach>::set(const Pressures &p)
{
  const Pressures before = pressures();
  for (std::size_t k = 0; k < cells.size(); ++k)
    for (std::uint32_t i = cells[k].slice->begin; i < cells[k].slice->end; ++i)
      cells[k].body->row(cells[k].body->handles()[i])[cells[k].body->layout().pressure] += p[k] - before[k];
}

template <int dim, unsigned int reach>
typename RestingSeepage<dim, reach>::Pressures RestingSeepage<dim, reach>::divergence(const Pressures &p,
                                                                                      const bool with_loads)
{
  std::vector<double> &w = nodal.flux;
  std::fill(w.begin(), w.end(), 0.);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const std::uint32_t *nodes = active.cell_nodes(cells[k].slice->cell);
    for (unsigned int i = 0; i < n_nodes; ++i)
      for (unsigned int d = 0; d < dim; ++d)
        w[std::size_t(nodes[i]) * dim + d] += p[k] * cells[k].slope[i * dim + d];
  }
  active.sum_over_ranks(w.data(), dim);
  const double origin[3] = {0., 0., 0.};
  for (std::size_t i = 0; i < active.size(); ++i)
    for (unsigned int d = 0; d < dim; ++d) {
      const std::size_t row = i * dim + d;
      if (with_loads)
        w[row] += nodal.pressure_load[row] + inertia[i] * scene.gravity.value(origin, nodal.time, d);
      w[row] *= resistance[i] > 0. ? 1. / resistance[i] : 0.;
    }
  for (const std::size_t row : closed_rows)
    w[row] = 0.;
  // Given fluxes are loads; walls on surfaces act on every flux.
  for (const auto &condition : scene.conditions)
    if (with_loads || condition->fluid() == Condition<dim>::Fluid::impermeable)
      condition->constrain_flux(active, surface(*condition), nodal);

  Pressures result(cells.size(), 0.);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const std::uint32_t *nodes = active.cell_nodes(cells[k].slice->cell);
    double gross = 0.;
    for (unsigned int i = 0; i < n_nodes; ++i)
      for (unsigned int d = 0; d < dim; ++d) {
        const double slope = cells[k].slope[i * dim + d];
        result[k] += slope * w[std::size_t(nodes[i]) * dim + d];
        if (with_loads && resistance[nodes[i]] > 0.)
          gross += std::abs(slope * inertia[nodes[i]] / resistance[nodes[i]]) *
                   std::abs(scene.gravity.value(origin, nodal.time, d));
      }
    largest = std::max(largest, gross);
  }
  largest = dealii::Utilities::MPI::max(largest, active.grid().communicator());
  return result;
}

template <int dim, unsigned int reach>
double RestingSeepage<dim, reach>::dot(const Pressures &a, const Pressures &b) const
{
  double sum = 0.;
  for (std::size_t k = 0; k < a.size(); ++k)
    sum += a[k] * b[k];
  return dealii::Utilities::MPI::sum(sum, active.grid().communicator());
}

template <int dim, unsigned int reach>
void balance(Scene<dim> &scene, const ActiveNodes<dim> &active, const double time)
{
  constexpr double tolerance = 1e-13, tolerable = 1e-10;
  const MPI_Comm communicator = active.grid().communicator();
  RestingSeepage<dim, reach> seepage(scene, active, time);
  auto p = seepage.pressures();
  auto r = seepage.divergence(p, true);
  const double n_cells = dealii::Utilities::MPI::sum(double(p.size()), communicator);
  const auto size = [&](const auto &x) { return std::sqrt(seepage.dot(x, x) / n_cells); };
  for (double &entry : r)
    entry = -entry;
  auto z = r, direction = r;
  double rho_before = 0., reached = size(r), best = reached;
  const double scale = std::max(seepage.gross(), 1e-300);
  auto best_p = p;
  for (unsigned int iteration = 0; iteration < 100 + 4. * n_cells && reached > tolerance * scale;
       ++iteration) {
    for (std::size_t k = 0; k < r.size(); ++k)
      z[k] = r[k] / seepage.diagonal()[k];
    const double rho = seepage.dot(r, z);
    for (std::size_t k = 0; k < r.size(); ++k)
      direction[k] = z[k] + (iteration > 0 ? rho / rho_before : 0.) * direction[k];
    rho_before = rho;
    const auto image = seepage.divergence(direction, false);
    const double curvature = seepage.dot(direction, image);
    if (!(curvature > 0.))
      break;
    const double length = rho / curvature;
    for (std::size_t k = 0; k < r.size(); ++k) {
      p[k] += length * direction[k];
      r[k] -= length * image[k];
    }
    reached = size(r);
    if (reached < best) {
      best = reached;
      best_p = p;
    }
  }
  if (!(best <= tolerable * scale)) {
    std::ostringstream text;
    text << "no pore pressures were found that stay at rest: seepage out of cells is still " << best / scale
         << " of that under gravity alone";
    throw NumericalError(text.str());
  }
  seepage.set(best_p);
}
} // namespace

template <int dim>
void balance_pressures(Scene<dim> &scene, const ActiveNodes<dim> &active, const double time)
{
  if (!scene.is_saturated())
    return;
  if (active.nodes_per_direction() == 2)
    balance<dim, 2>(scene, active, time);
  else
    balance<dim, 4>(scene, active, time);
}

template void balance_pressures<2>(Scene<2> &, const ActiveNodes<2> &, double);
template void balance_pressures<3>(Scene<3> &, const ActiveNodes<3> &, double);
} // namespace peat
