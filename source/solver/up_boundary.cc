#include <peat/solver/up_boundary.h>

#include <deal.II/base/mpi.h>
#include <peat/material/mixture.h>

#include <limits>
#include <set>

#include "cell_shapes.h"

namespace peat {
namespace {
/// Share of a cell within which a surface counts as running along the cell's face.
constexpr double on_plane = 1e-3;

template <int dim>
void coordinates(const dealii::Point<dim> &x, double (&result)[3])
{
  for (unsigned int d = 0; d < 3; ++d)
    result[d] = d < dim ? x[d] : 0.;
}

template <int dim>
int normal_axis(const dealii::Tensor<1, dim> &area)
{
  unsigned int axis = 0;
  for (unsigned int d = 1; d < dim; ++d)
    if (std::abs(area[d]) > std::abs(area[axis]))
      axis = d;
  return std::abs(area[axis]) > 0.999999 * area.norm() ? int(axis) : -1;
}

/// The cell of the material that a piece of surface bounds: the one just behind it or, where the surface has
/// risen over a grid line into a cell without points, the one below that.
template <int dim>
CellId cell_behind(const SurfacePoint<dim> &point, const Space<dim> &space)
{
  const Grid<dim> &grid = space.grid();
  dealii::Point<dim> behind = point.position;
  behind -= 1e-6 * grid.smallest_cell_size() / point.area.norm() * point.area;
  auto lattice = grid.locate(behind);
  const CellId own = grid.cell_at(lattice);
  if (own == no_index || space.is_solid(own))
    return own;
  unsigned int axis = 0;
  for (unsigned int d = 1; d < dim; ++d)
    if (std::abs(point.area[d]) > std::abs(point.area[axis]))
      axis = d;
  lattice[axis] -= point.area[axis] > 0. ? 1 : -1;
  const CellId below = grid.cell_at(lattice);
  return below != no_index && grid.is_owned(below) && space.is_solid(below) ? below : own;
}
} // namespace

template <int dim>
UpBoundary<dim>::UpBoundary(const Space<dim> &space, const Scene<dim> &scene,
                            const ImplicitContact<dim> &contact, const double penalty)
    : space(space), grid(space.grid()), scene(scene), contact(contact), penalty(penalty)
{}

template <int dim>
void UpBoundary<dim>::locate(const ActiveNodes<dim> &active, const std::vector<Index> &unused_unknowns)
{
  find_motions();
  for (const Index unknown : unused_unknowns)
    motions.push_back({unknown, 0, {}, nullptr});
  pressures.clear();
  if (space.has_pressure())
    find_mesh_pressures();
  find_pieces(active);
  share_pressures();
  any_pressure = dealii::Utilities::MPI::max(int(!pressures.empty()), grid.communicator()) > 0;
  for (const Piece &piece : pieces)
    any_pressure = any_pressure || piece.weak_pressure;
  any_pressure = dealii::Utilities::MPI::max(int(any_pressure), grid.communicator()) > 0;
  find_ties(unused_unknowns);
  make_constraints(unused_unknowns);
}

template <int dim>
void UpBoundary<dim>::make_constraints(const std::vector<Index> &unused_unknowns)
{
  rows = space.relevant();
  for (const Tie &tie : ties)
    rows[0].add_index(tie.common);
  dealii::IndexSet relevant(space.n_unknowns());
  relevant.add_indices(rows[0]);
  if (space.has_pressure())
    relevant.add_indices(rows[1], space.first_pressure());
  relevant.compress();
  homogeneous.clear();
  homogeneous.reinit(relevant);
  for (const Motion &motion : motions)
    homogeneous.add_line(motion.unknown);
  for (const GivenPressure &given : pressures)
    homogeneous.add_line(given.unknown);
  for (const Tie &tie : ties)
    for (const Index unknown : tie.members) {
      homogeneous.add_line(unknown);
      homogeneous.add_entry(unknown, tie.common, 1.);
    }
  homogeneous.close();
  unused_only.clear();
  unused_only.reinit(relevant);
  for (const Index unknown : unused_unknowns)
    unused_only.add_line(unknown);
  unused_only.close();
}

template <int dim>
void UpBoundary<dim>::find_motions()
{
  motions.clear();
  const double tolerance = Place<dim>::tolerance(grid);
  for (const auto &node : space.displacement_nodes()) {
    const unsigned int bits = space.boundaries_at(node.position);
    std::array<bool, dim> known{};
    for (const auto &condition : scene.conditions) {
      const Place<dim> &place = condition->place;
      if (!place.on_mesh() || !place.contains_node(node.position, tolerance))
        continue;
      const auto add = [&](const unsigned int boundary) {
        for (unsigned int d = 0; d < dim; ++d)
          if (!known[d] && condition->prescribes(boundary, d)) {
            known[d] = true;
            motions.push_back({node.displacement[d], d, node.position, condition.get()});
          }
      };
      for (const unsigned int boundary : place.boundaries)
        if ((bits >> boundary) & 1)
          add(boundary);
      if (place.boundaries.empty())
        add(-1);
    }
  }
}

template <int dim>
void UpBoundary<dim>::find_ties(const std::vector<Index> &unused_unknowns)
{
  ties.clear();
  const std::set<Index> unused(unused_unknowns.begin(), unused_unknowns.end());
  const double tolerance = Place<dim>::tolerance(grid);
  for (const auto &condition : scene.conditions)
    for (unsigned int d = 0; d < dim; ++d) {
      if (!condition->ties(d))
        continue;
      const Place<dim> &place = condition->place;
      unsigned int faces = 0;
      for (const unsigned int boundary : place.boundaries)
        faces |= 1u << boundary;
      // The first of all stands for them, on whatever rank it is.
      const Index none = std::numeric_limits<Index>::max();
      Tie tie{none, {}};
      for (const auto &node : space.displacement_nodes()) {
        const Index unknown = node.displacement[d];
        if (place.contains_node(node.position, tolerance) && unused.count(unknown) == 0 &&
            (faces == 0 || (space.boundaries_at(node.position) & faces))) {
          tie.members.push_back(unknown);
          tie.common = std::min(tie.common, unknown);
        }
      }
      tie.common = dealii::Utilities::MPI::min(tie.common, grid.communicator());
      if (tie.common == none)
        continue;
      tie.members.erase(std::remove(tie.members.begin(), tie.members.end(), tie.common), tie.members.end());
      ties.push_back(std::move(tie));
    }
}

namespace {
/// The value of an unknown that this rank may own.
double *owned_value(dealii::TrilinosWrappers::MPI::Vector &vector, const dealii::IndexSet &owned,
                    const dealii::types::global_dof_index unknown)
{
  return owned.is_element(unknown) ? &vector.trilinos_vector()[0][owned.index_within_set(unknown)] : nullptr;
}
} // namespace

template <int dim>
void UpBoundary<dim>::gather(dealii::TrilinosWrappers::MPI::Vector &displacement) const
{
  const dealii::IndexSet &owned = space.owned()[0];
  for (const Tie &tie : ties) {
    double sum = 0.;
    for (const Index unknown : tie.members)
      if (const double *value = owned_value(displacement, owned, unknown))
        sum += *value;
    sum = dealii::Utilities::MPI::sum(sum, grid.communicator());
    if (double *value = owned_value(displacement, owned, tie.common))
      *value += sum;
  }
}

template <int dim>
void UpBoundary<dim>::condense(BlockVector &forces) const
{
  gather(forces.block(0));
  homogeneous.set_zero(forces);
}

template <int dim>
void UpBoundary<dim>::distribute(dealii::TrilinosWrappers::MPI::Vector &displacement) const
{
  homogeneous.set_zero(displacement);
  const dealii::IndexSet &owned = space.owned()[0];
  for (const Tie &tie : ties) {
    const double *mine = owned_value(displacement, owned, tie.common);
    const double common = dealii::Utilities::MPI::sum(mine ? *mine : 0., grid.communicator());
    for (const Index unknown : tie.members)
      if (double *value = owned_value(displacement, owned, unknown))
        *value = common;
  }
}

template <int dim>
void UpBoundary<dim>::distribute(BlockVector &motion) const
{
  homogeneous.set_zero(motion);
  distribute(motion.block(0));
}

template <int dim>
void UpBoundary<dim>::find_mesh_pressures()
{
  for (const auto &node : space.pressure_nodes()) {
    const unsigned int bits = space.boundaries_at(node.position);
    for (const auto &condition : scene.conditions)
      if (condition->fluid() == Condition<dim>::Fluid::pressure)
        for (const unsigned int boundary : condition->place.boundaries)
          if ((bits >> boundary) & 1)
            pressures.push_back({node.pressure, node.position, condition.get(), 0.});
  }
}

template <int dim>
void UpBoundary<dim>::find_pieces(const ActiveNodes<dim> &active)
{
  pieces.clear();
  for (const auto &[name, tracers] : scene.surfaces)
    for (const SurfacePoint<dim> &point : tracers.surface()) {
      Piece piece;
      piece.point = point;
      piece.body = &scene.body(name);
      piece.cell = cell_behind(point, space);
      carry(active, piece);
      piece.cover = contact.cover(*piece.body, point.position);
      if (piece.body->material().mixture() && space.has_pressure() && piece.cell != no_index &&
          space.is_saturated(piece.cell))
        find_pressure(piece);
      pieces.push_back(piece);
    }
}

template <int dim>
void UpBoundary<dim>::carry(const ActiveNodes<dim> &active, Piece &piece) const
{
  if (space.nodes() == Nodes::q2) {
    constexpr unsigned int n = dim == 2 ? 9 : 27;
    if (piece.cell == no_index || !space.is_solid(piece.cell))
      return;
    piece.N.resize(n);
    shape_functions<dim, 3>(grid, piece.cell, piece.point.position, piece.N.data());
    const Index *unknowns = space.displacements(piece.cell);
    for (unsigned int i = 0; i < n; ++i)
      piece.displacement.push_back(unknowns[i * dim]);
    return;
  }
  for (unsigned int i = 0; i < piece.point.n_nodes; ++i)
    if (const auto *node = space.node_at(active.grid_node(piece.point.node[i]))) {
      piece.displacement.push_back(node->displacement[0]);
      piece.N.push_back(piece.point.N[i]);
    }
}

template <int dim>
bool UpBoundary<dim>::cover_changes() const
{
  if (contact.is_empty())
    return false;
  int changes = 0;
  auto piece = pieces.begin();
  for (const auto &[name, tracers] : scene.surfaces)
    for (const auto &tracer : tracers.tracers()) {
      changes |= contact.cover(*piece->body, tracer.position) != piece->cover;
      ++piece;
    }
  return dealii::Utilities::MPI::max(changes, grid.communicator()) > 0;
}

template <int dim>
bool UpBoundary<dim>::is_covered(Piece &piece) const
{
  using Interface = typename ContactParameters<dim>::Interface;
  if (piece.cover) {
    piece.otherwise = piece.cover->pressure;
    return piece.cover->interface == Interface::impermeable;
  }
  dealii::Point<dim> beyond = piece.point.initial_position;
  beyond += 1e-4 * grid.smallest_cell_size() / piece.point.area.norm() * piece.point.area;
  for (const auto &body : scene.bodies) {
    if (body.get() == piece.body || body->n_global_points() == 0 || !(body->shape()->distance(beyond) < 0.))
      continue;
    if (body->material().mixture())
      return true;
    for (const auto &contact : scene.contacts)
      if ((contact.first == body->name() && contact.second == piece.body->name()) ||
          (contact.second == body->name() && contact.first == piece.body->name())) {
        piece.otherwise = contact.pressure;
        return contact.interface == Interface::impermeable;
      }
  }
  return false;
}

template <int dim>
void UpBoundary<dim>::find_pressure(Piece &piece)
{
  for (const auto &condition : scene.conditions) {
    if (condition->surface_of() != piece.body->name() || !condition->place.contains(piece.point))
      continue;
    if (condition->fluid() == Condition<dim>::Fluid::impermeable)
      return;
    if (condition->fluid() == Condition<dim>::Fluid::pressure)
      piece.pressure = condition.get();
  }
  if (is_covered(piece))
    return;
  const int axis = normal_axis(piece.point.area);
  if (axis >= 0) {
    const double offset =
        (piece.point.position[axis] - grid.lower(piece.cell, axis)) / grid.size(piece.cell, axis);
    // On the face, or risen over it: there are no pressures beyond.
    if ((piece.point.area[axis] > 0. ? 1. - offset : offset) < on_plane) {
      prescribe_face(piece, axis);
      return;
    }
  }
  piece.weak_pressure = true;
  shape_functions<dim, 2>(grid, piece.cell, piece.point.position, piece.M.data());
}

template <int dim>
void UpBoundary<dim>::prescribe_face(const Piece &piece, const unsigned int axis)
{
  const Index *unknowns = space.pressures(piece.cell);
  const unsigned int side = piece.point.area[axis] > 0. ? 1 : 0;
  for (unsigned int v = 0; v < Space<dim>::n_pressures; ++v) {
    if (((v >> axis) & 1) != side)
      continue;
    dealii::Point<dim> x;
    for (unsigned int d = 0; d < dim; ++d)
      x[d] = grid.planes(d)[grid.lattice(piece.cell)[d] + ((v >> d) & 1)];
    pressures.push_back({unknowns[v], x, piece.pressure, piece.otherwise});
  }
}

template <int dim>
void UpBoundary<dim>::share_pressures()
{
  // A node on the border of two ranks may be prescribed by a piece that only one of them has.
  if (dealii::Utilities::MPI::n_mpi_processes(grid.communicator()) > 1 && space.has_pressure()) {
    std::vector<double> mine;
    for (const GivenPressure &given : pressures) {
      int number = -1;
      for (std::size_t c = 0; c < scene.conditions.size(); ++c)
        number = scene.conditions[c].get() == given.condition ? int(c) : number;
      mine.push_back(given.unknown);
      mine.push_back(number);
      mine.push_back(given.otherwise);
      for (unsigned int d = 0; d < dim; ++d)
        mine.push_back(given.position[d]);
    }
    pressures.clear();
    const dealii::IndexSet &relevant = space.relevant()[1];
    for (const auto &values : dealii::Utilities::MPI::all_gather(grid.communicator(), mine))
      for (std::size_t i = 0; i < values.size(); i += 3 + dim) {
        GivenPressure given{Index(values[i]), {}, nullptr, values[i + 2]};
        if (!relevant.is_element(given.unknown - space.first_pressure()))
          continue;
        if (values[i + 1] >= 0.)
          given.condition = scene.conditions[std::size_t(values[i + 1])].get();
        for (unsigned int d = 0; d < dim; ++d)
          given.position[d] = values[i + 3 + d];
        pressures.push_back(given);
      }
  }
  // What a condition says goes before the default.
  std::stable_sort(pressures.begin(), pressures.end(), [](const GivenPressure &a, const GivenPressure &b) {
    return a.unknown < b.unknown || (a.unknown == b.unknown && a.condition && !b.condition);
  });
  pressures.erase(
      std::unique(pressures.begin(), pressures.end(),
                  [](const GivenPressure &a, const GivenPressure &b) { return a.unknown == b.unknown; }),
      pressures.end());
}

template <int dim>
void UpBoundary<dim>::prescribe(const double start, const double end, BlockVector &unknown) const
{
  double x[3];
  const dealii::IndexSet &displacements = space.owned()[0];
  for (const Motion &motion : motions) {
    if (!displacements.is_element(motion.unknown))
      continue;
    coordinates(motion.position, x);
    unknown.block(0)(motion.unknown) =
        motion.condition && end > start
            ? motion.condition->displacement_increment(x, start, end - start, motion.component)
            : 0.;
  }
  for (const GivenPressure &given : pressures) {
    const Index local = given.unknown - space.first_pressure();
    if (!space.owned()[1].is_element(local))
      continue;
    coordinates(given.position, x);
    unknown.block(1)(local) = given.condition ? given.condition->fluid_value(x, end) : given.otherwise;
  }
  unknown.compress(dealii::VectorOperation::insert);
}

template <int dim>
void UpBoundary<dim>::prescribe_velocity(const double time, const double dt,
                                         dealii::TrilinosWrappers::MPI::Vector &velocity) const
{
  double x[3];
  for (const Motion &motion : motions) {
    if (!space.owned()[0].is_element(motion.unknown))
      continue;
    coordinates(motion.position, x);
    velocity(motion.unknown) =
        motion.condition ? motion.condition->displacement_increment(x, time, dt, motion.component) / dt : 0.;
  }
  velocity.compress(dealii::VectorOperation::insert);
}

template <int dim>
void UpBoundary<dim>::assemble(const TimeLevel &level, const StepState &state, BlockVector &residual,
                               BlockMatrix *matrix)
{
  acting = Reactions();
  add_surface_forces(level, residual);
  if (!space.has_pressure())
    return;
  add_fluxes(level, residual);
  add_penalties(level, state, residual, matrix);
}

template <int dim>
template <typename Action>
void UpBoundary<dim>::for_each_force(const double time, const Action &action) const
{
  for (const auto &condition : scene.conditions) {
    if (condition->surface_of().empty())
      continue;
    for (const Piece &piece : pieces) {
      if (piece.body->name() != condition->surface_of())
        continue;
      const auto force = condition->force(piece.point, time);
      if (force.norm_square() > 0.)
        action(piece, force);
    }
  }
}

template <int dim>
void UpBoundary<dim>::add_surface_forces(const TimeLevel &level, BlockVector &residual)
{
  for_each_force(level.time, [&](const Piece &piece, const dealii::Tensor<1, dim> &force) {
    for (std::size_t i = 0; i < piece.N.size(); ++i)
      for (unsigned int d = 0; d < dim; ++d)
        residual.block(0)(piece.displacement[i] + d) += piece.N[i] * force[d];
    acting.force += force;
    acting.gross_force += force.norm();
  });
}

template <int dim>
typename UpBoundary<dim>::Reactions
UpBoundary<dim>::loads(const TimeLevel &level, const dealii::TrilinosWrappers::MPI::Vector &motion) const
{
  Reactions sum = acting;
  for_each_force(level.time, [&](const Piece &piece, const dealii::Tensor<1, dim> &force) {
    for (std::size_t i = 0; i < piece.N.size(); ++i)
      for (unsigned int d = 0; d < dim; ++d)
        sum.work += piece.N[i] * force[d] * motion(piece.displacement[i] + d);
  });
  return sum;
}

template <int dim>
void UpBoundary<dim>::add_fluxes(const TimeLevel &level, BlockVector &residual)
{
  // Two Gauss points per direction along the face.
  const double gauss[2] = {0.5 - std::sqrt(1. / 12.), 0.5 + std::sqrt(1. / 12.)};
  double x[3];
  for (const auto &condition : scene.conditions) {
    if (condition->fluid() != Condition<dim>::Fluid::flux)
      continue;
    for (CellId cell = 0; cell < grid.n_local_cells(); ++cell) {
      if (!grid.is_owned(cell) || !space.is_saturated(cell))
        continue;
      for (const unsigned int boundary : condition->place.boundaries) {
        const unsigned int axis = boundary / 2;
        if (grid.lattice(cell)[axis] != (boundary % 2 ? grid.n_cells(axis) - 1 : 0))
          continue;
        const double area = grid.volume(cell) / grid.size(cell, axis) / (1 << (dim - 1));
        for (unsigned int g = 0; g < (1u << (dim - 1)); ++g) {
          dealii::Point<dim> place;
          for (unsigned int d = 0, rest = g; d < dim; ++d) {
            if (d == axis)
              place[d] = boundary % 2 ? grid.planes(d).back() : grid.planes(d).front();
            else {
              place[d] = grid.lower(cell, d) + gauss[rest % 2] * grid.size(cell, d);
              rest /= 2;
            }
          }
          if (!condition->place.contains_node(place, Place<dim>::tolerance(grid)))
            continue;
          coordinates(place, x);
          const double outflow = area * condition->fluid_value(x, level.time);
          double M[Space<dim>::n_pressures];
          shape_functions<dim, 2>(grid, cell, place, M);
          for (unsigned int i = 0; i < Space<dim>::n_pressures; ++i)
            residual(space.pressures(cell)[i]) -= level.fluid_scale() * outflow * M[i];
          acting.outflow += outflow;
        }
      }
    }
  }
}

template <int dim>
void UpBoundary<dim>::add_penalties(const TimeLevel &level, const StepState &state, BlockVector &residual,
                                    BlockMatrix *matrix)
{
  constexpr unsigned int n = Space<dim>::n_pressures;
  dealii::FullMatrix<double> local(n, n);
  dealii::Vector<double> right(n);
  std::vector<Index> unknowns(n);
  double x[3];
  for (const Piece &piece : pieces) {
    if (!piece.weak_pressure)
      continue;
    const double beta = penalty * piece.body->material().mixture()->mobility() / grid.smallest_cell_size() *
                        piece.point.area.norm();
    coordinates(piece.point.position, x);
    double p = -(piece.pressure ? piece.pressure->fluid_value(x, level.time) : piece.otherwise);
    std::copy_n(space.pressures(piece.cell), n, unknowns.begin());
    for (unsigned int i = 0; i < n; ++i) {
      const Index index = unknowns[i] - space.first_pressure();
      p += piece.M[i] * (level.share * state.unknown.block(1)(index) +
                         (1. - level.share) * state.second_history.block(1)(index));
    }
    acting.outflow += beta * p;
    for (unsigned int i = 0; i < n; ++i) {
      right(i) = -level.fluid_scale() * beta * p * piece.M[i];
      for (unsigned int j = 0; j < n; ++j)
        local(i, j) = level.fluid_scale() * beta * level.share * piece.M[i] * piece.M[j];
    }
    residual.add(unknowns, right);
    if (matrix)
      homogeneous.distribute_local_to_global(local, unknowns, *matrix);
  }
}

template <int dim>
typename UpBoundary<dim>::Reactions
UpBoundary<dim>::reactions(const TimeLevel &level, const BlockVector &residual,
                           const dealii::TrilinosWrappers::MPI::Vector &moved) const
{
  Reactions sum;
  for (const Motion &motion : motions)
    if (space.owned()[0].is_element(motion.unknown)) {
      const double force = -residual.block(0)(motion.unknown);
      sum.work += force * moved(motion.unknown);
      sum.force[motion.component] += force;
      sum.gross_force += std::abs(force);
    }
  for (const GivenPressure &given : pressures) {
    const Index index = given.unknown - space.first_pressure();
    if (space.owned()[1].is_element(index))
      sum.outflow += residual.block(1)(index) / level.fluid_scale();
  }
  return sum;
}

template class UpBoundary<2>;
template class UpBoundary<3>;
} // namespace peat
