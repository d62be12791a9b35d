#include <peat/solver/explicit_mpm.h>

#include <deal.II/base/mpi.h>

#include <cmath>
#include <sstream>

namespace peat {
namespace {
/// What is not finite at the first such point of this rank, and where that is; empty if there is none.
template <int dim>
std::string first_not_finite(const Scene<dim> &scene, const Grid<dim> &grid)
{
  const auto finite = [](const double *row, const int first, const unsigned int n) {
    return first < 0 || std::all_of(row + first, row + first + n, [](double v) { return std::isfinite(v); });
  };
  for (const auto &body : scene.bodies)
    for (const Slice &slice : body->slices())
      for (std::uint32_t i = slice.begin; i < slice.end; ++i) {
        const std::uint32_t handle = body->handles()[i];
        const double *row = body->row(handle);
        const Layout &layout = body->layout();
        const std::string what = !finite(row, layout.stress, dim == 2 ? 4 : 6) ? "stress"
                                 : !finite(row, layout.pressure, 1)            ? "pressure"
                                 : !finite(row, layout.velocity, dim)          ? "velocity"
                                                                               : "";
        if (what.empty())
          continue;
        // Its place may not be finite either; its cell is that of the step's start.
        dealii::Point<dim> middle;
        for (unsigned int d = 0; d < dim; ++d)
          middle[d] = grid.lower(slice.cell, d) + 0.5 * grid.size(slice.cell, d);
        std::ostringstream text;
        text << "the " << what << " of point " << body->id(handle) << " of body '" << body->name()
             << "', in the cell around (" << middle << "), is not finite";
        return text.str();
      }
  return "";
}
} // namespace

template <int dim>
ExplicitMPM<dim>::ExplicitMPM(const SchemeParameters &scheme, const Grid<dim> &grid, Scene<dim> &scene,
                              const double start_time, const Ledger<dim> &carried)
    : scheme(scheme), grid(grid), scene(scene), now(start_time), book(carried)
{
  for (const auto &bodies : scene.continua)
    continua.push_back(std::make_unique<Continuum<dim>>(scheme, grid, scene, bodies));
  if (!scene.contacts.empty())
    all_nodes = std::make_unique<ActiveNodes<dim>>(grid, static_cast<unsigned int>(scheme.basis));
  contact.reinit(scheme, grid, scene, continua);
  std::vector<ImplicitPressure<dim> *> implicit;
  for (const auto &continuum : continua)
    if (ImplicitPressure<dim> *pressure = continuum->implicit_pressure())
      implicit.push_back(pressure);
  // Without contacts there is one continuum.
  NodalCoupling *coupling = nullptr;
  if (!contact.is_empty())
    coupling = &contact;
  else if (continua.front()->ties_nodes())
    coupling = continua.front().get();
  pressures.reinit(std::move(implicit), coupling, scheme.pressure_tolerance, grid.communicator());
}

template <int dim>
void ExplicitMPM<dim>::prepare()
{
  std::vector<NodeId> common;
  if (all_nodes) {
    std::vector<CellId> occupied;
    for (const auto &continuum : continua) {
      const auto cells = continuum->occupied_cells();
      occupied.insert(occupied.end(), cells.begin(), cells.end());
    }
    std::sort(occupied.begin(), occupied.end());
    occupied.erase(std::unique(occupied.begin(), occupied.end()), occupied.end());
    all_nodes->rebuild(occupied);
    // Two continua may meet at a node of the partition's border with their points on different ranks: there
    // each rank knows the node for all of them, and those next to it, between which the interface may lie.
    common = with_neighbours(grid, all_nodes->exchanged_nodes());
  }
  for (const auto &continuum : continua)
    continuum->number_nodes(common);
  for (const auto &body : scene.bodies)
    body->accept_cells();
  contact.match_nodes();
}

template <int dim>
void ExplicitMPM<dim>::find_flux()
{
  contact.note_late_forces();
  for (const auto &continuum : continua)
    continuum->solve_darcy();
  contact.constrain_flux();
}

template <int dim>
void ExplicitMPM<dim>::solve_pressure()
{
  // Pressures change what bodies in contact do to each other; mostly they stay as they are, some part or
  // begin to slide.
  constexpr unsigned int most_passes = 6;
  const auto each = [&](const auto &stage) {
    for (const auto &continuum : continua)
      stage(*continuum);
  };
  each([](auto &continuum) { continuum.begin_pressure(); });
  for (unsigned int pass = 1;; ++pass) {
    contact.hold();
    each([](auto &continuum) { continuum.prepare_pressure(); });
    pressures.solve();
    each([](auto &continuum) { continuum.take_pressure(); });
    contact.take_reactions();
    if (pass == most_passes || !contact.is_outdated())
      break;
    contact.solve();
    find_flux();
  }
  each([](auto &continuum) { continuum.finish_pressure(); });
}

template <int dim>
void ExplicitMPM<dim>::step(const double dt)
{
  const auto each = [&](const auto &stage) {
    for (const auto &continuum : continua)
      stage(*continuum);
  };
  each([&](auto &continuum) { continuum.points_to_nodes(now, dt); });
  each([&](auto &continuum) { continuum.add_loads(); });
  each([&](auto &continuum) { continuum.find_velocities(); });
  each([&](auto &continuum) { continuum.solve_momentum(); });
  each([&](auto &continuum) { continuum.constrain_motion(book); });
  contact.begin(now, dt);
  contact.solve();
  find_flux();
  if (!pressures.is_empty())
    solve_pressure();
  contact.finish(book);
  each([&](auto &continuum) { continuum.advance_points(); });
  contact.constrain_carrying_velocity();
  each([&](auto &continuum) { continuum.deform_points(); });
  each([&](auto &continuum) { continuum.book_balances(book); });
  each([&](auto &continuum) { continuum.move_tracers(); });
  now += dt;
  relocate_points();
}

template <int dim>
const ActiveNodes<dim> &ExplicitMPM<dim>::nodes() const
{
  return all_nodes ? *all_nodes : continua.front()->nodes();
}

template <int dim>
const NodalFields<dim> &ExplicitMPM<dim>::fields() const
{
  if (!all_nodes)
    return continua.front()->fields();
  gather_flux();
  return all_fields;
}

template <int dim>
void ExplicitMPM<dim>::gather_flux() const
{
  all_fields.time = continua.front()->fields().time;
  all_fields.dt = continua.front()->fields().dt;
  all_fields.flux.clear();
  if (!scene.is_saturated())
    return;
  all_fields.flux.assign(all_nodes->size() * dim, 0.);
  std::vector<double> weight(all_nodes->size(), 0.);
  for (const auto &continuum : continua)
    if (continuum->is_saturated()) {
      const ActiveNodes<dim> &nodes = continuum->nodes();
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        const std::uint32_t j = all_nodes->index_of(nodes.grid_node(i));
        const double m = continuum->mass(i);
        if (j == no_index)
          continue;
        weight[j] += m;
        for (unsigned int d = 0; d < dim; ++d)
          all_fields.flux[std::size_t(j) * dim + d] += m * continuum->fields().flux[i * dim + d];
      }
    }
  for (std::size_t j = 0; j < weight.size(); ++j)
    for (unsigned int d = 0; d < dim; ++d)
      all_fields.flux[j * dim + d] *= weight[j] > 0. ? 1. / weight[j] : 0.;
}

template <int dim>
void ExplicitMPM<dim>::relocate_points()
{
  // What any rank finds concerns all: a change of cells or ranks is collective, and so is the end of a run.
  enum { not_finite, error, cells_changed, leaves_rank, n_flags };
  std::array<int, n_flags> flags = {0, 0, 0, 0};
  for (const auto &continuum : continua)
    flags[not_finite] |= !continuum->findings().finite;
  std::string message;
  try {
    for (const auto &body : scene.bodies) {
      const auto relocation = body->relocate(now);
      flags[cells_changed] |= relocation.cells_changed;
      flags[leaves_rank] |= relocation.leaves_rank;
    }
  } catch (const NumericalError &exception) {
    flags[error] = 1;
    message = exception.what();
  }
  const bool parallel = dealii::Utilities::MPI::n_mpi_processes(grid.communicator()) > 1;
  if (parallel) {
    for (const auto &[name, tracers] : scene.surfaces)
      flags[leaves_rank] |= tracers.leaves_rank();
    flags[leaves_rank] |= scene.probes && scene.probes->leaves_rank();
    const std::array<int, n_flags> mine = flags;
    const int ierr = MPI_Allreduce(mine.data(), flags.data(), n_flags, MPI_INT, MPI_MAX, grid.communicator());
    AssertThrowMPI(ierr);
  }

  if (flags[not_finite]) {
    const auto all =
        dealii::Utilities::MPI::all_gather(grid.communicator(), first_not_finite<dim>(scene, grid));
    const auto first = std::find_if(all.begin(), all.end(), [](const auto &one) { return !one.empty(); });
    std::ostringstream text;
    text << (first == all.end() ? "a stress, pressure or velocity is not finite" : *first) << ", t = " << now
         << " s, step " << continua.front()->fields().dt << " s; use a smaller 'Step factor'";
    throw NumericalError(text.str());
  }
  if (flags[error]) {
    const auto all = dealii::Utilities::MPI::all_gather(grid.communicator(), message);
    for (const std::string &one : all)
      if (!one.empty())
        throw NumericalError(one);
  }
  if (flags[leaves_rank] && parallel) {
    for (const auto &body : scene.bodies)
      body->synchronise(now);
    for (auto &[name, tracers] : scene.surfaces)
      tracers.migrate();
    if (scene.probes)
      scene.probes->migrate();
  }
  // On several ranks nodes are numbered anew when they would be on one, and not when a point of an occupied
  // cell changes its rank: some things are looked for when nodes change, and must not depend on the
  // partition.
  if (flags[leaves_rank] && parallel) {
    int changed = 0;
    for (const auto &body : scene.bodies)
      changed |= body->cells_changed();
    flags[cells_changed] = dealii::Utilities::MPI::max(changed, grid.communicator());
  }
  if (flags[cells_changed])
    prepare();
}

template <int dim>
StableStep ExplicitMPM<dim>::stable_step() const
{
  return peat::stable_step<dim>(scene.bodies, grid, scheme.seepage_inertia, scheme.implicit_pressure);
}

template <int dim>
void ExplicitMPM<dim>::persist(Archive &archive)
{
  if (archive.is_loading())
    prepare();
  archive.begin("explicit steps");
  archive(now, book);
  for (const auto &continuum : continua)
    archive(*continuum);
  archive(contact, pressures);
}

template class ExplicitMPM<2>;
template class ExplicitMPM<3>;
} // namespace peat
