#include <peat/solver/continuum.h>

#include <algorithm>

// The nodes of a continuum: their numbers, what conditions leave them, and those with little mass.

namespace peat {
template <int dim>
void Continuum<dim>::number_nodes(const std::vector<NodeId> &more_nodes)
{
  const std::vector<CellId> occupied = occupied_cells();
  if (extension && dealii::Utilities::MPI::n_mpi_processes(grid.communicator()) > 1) {
    // A node behind a small one may be reached by points of another rank only.
    ActiveNodes<dim> reached(grid, active.nodes_per_direction());
    reached.rebuild(occupied, more_nodes);
    auto nodes = with_neighbours(grid, reached.exchanged_nodes());
    nodes.insert(nodes.end(), more_nodes.begin(), more_nodes.end());
    active.rebuild(occupied, nodes);
  } else
    active.rebuild(occupied, more_nodes);
  resize_fields();
  steps_to_small_nodes = 0;

  std::vector<bool> open(2 * dim, false);
  for (const auto &condition : conditions) {
    condition->select(active);
    for (const unsigned int boundary : condition->opened_boundaries())
      open[boundary] = true;
  }
  closed_rows.clear();
  if (saturated)
    for (unsigned int b = 0; b < 2 * dim; ++b)
      if (!open[b])
        for (const std::uint32_t i : active.on_boundary(b))
          closed_rows.push_back(std::size_t(i) * dim + b / 2);
  if (extension || pressure)
    find_prescribed_rows();
  if (extension)
    extension->reinit(active, prescribed);
  if (!pressure)
    return;
  if (has_ties)
    couple_nodes();
  std::vector<CellId> cells;
  for (std::size_t b = 0; b < members.size(); ++b)
    if (body(b).material().mixture())
      for (const Slice &slice : body(b).slices())
        cells.push_back(slice.cell);
  pressure->renumber(cells);
  freedom.moves.assign(prescribed.size(), 1);
  for (std::size_t row = 0; row < prescribed.size(); ++row)
    freedom.moves[row] = !prescribed[row];
  freedom.flows.assign(prescribed.size(), 1);
  for (const std::size_t row : closed_rows)
    freedom.flows[row] = 0;
}

template <int dim>
void Continuum<dim>::find_prescribed_rows()
{
  // What a condition overwrites is prescribed, whatever the value.
  const double untouched = std::numeric_limits<double>::max();
  std::vector<double> velocity(active.size() * dim, untouched);
  for (const auto &condition : conditions)
    condition->constrain_velocity(active, 0., 1., velocity);
  prescribed.resize(velocity.size());
  for (std::size_t row = 0; row < velocity.size(); ++row)
    prescribed[row] = velocity[row] != untouched;
  flux_is_given.assign(saturated ? prescribed.size() : 0, 0);
  if (!saturated)
    return;
  for (const std::size_t row : closed_rows)
    flux_is_given[row] = 1;
  NodalFields<dim> fields;
  fields.flux.assign(prescribed.size(), untouched);
  for (const auto &condition : conditions)
    condition->constrain_flux(active, {}, fields);
  for (std::size_t row = 0; row < prescribed.size(); ++row)
    flux_is_given[row] = flux_is_given[row] || fields.flux[row] != untouched;
}

template <int dim>
void Continuum<dim>::resize_fields()
{
  const std::size_t n = active.size();
  nodal.sums.resize(n * nodal.n_sums);
  for (auto *field : {&nodal.velocity, &nodal.acceleration, &nodal.new_velocity})
    field->assign(n * dim, 0.);
  if (remapped)
    mapped_velocity.assign(n * dim, 0.);
  if (has_loads)
    nodal.force.assign(n * dim, 0.);
  if (saturated) {
    // Steps find the flux anew; this is for pictures between the steps.
    renumber(nodal.flux);
    renumber(unfelt_velocity);
    late_contact_force.assign(n * dim, 0.);
    nodal.pressure_load.assign(n * dim, 0.);
  }
}

template <int dim>
void Continuum<dim>::renumber(std::vector<double> &field) const
{
  // Another rank may know a node that is new here: its value comes with a count.
  constexpr unsigned int n = dim + 1;
  std::vector<double> known(active.size() * n, 0.);
  for (std::size_t i = 0; i < active.size(); ++i)
    if (const std::uint32_t old = active.previous_index(i); old != no_index && !field.empty()) {
      std::copy_n(&field[std::size_t(old) * dim], dim, &known[i * n]);
      known[i * n + dim] = 1.;
    }
  active.sum_over_ranks(known.data(), n);
  field.assign(active.size() * dim, 0.);
  for (std::size_t i = 0; i < active.size(); ++i)
    for (unsigned int d = 0; d < dim; ++d)
      field[i * dim + d] = known[i * n + d] / std::max(1., known[i * n + dim]);
}

template <int dim>
double Continuum<dim>::node_volume(const std::size_t node) const
{
  const auto lattice = grid.node_lattice(active.grid_node(node));
  double volume = 1.;
  for (unsigned int d = 0; d < dim; ++d) {
    const auto &planes = grid.planes(d);
    const int i = lattice[d], last = planes.size() - 1;
    volume *= 0.5 * (planes[std::min(i + 1, last)] - planes[std::max(i - 1, 0)]);
  }
  return volume;
}

template <int dim>
void Continuum<dim>::find_small_nodes()
{
  if (steps_to_small_nodes-- > 0)
    return;
  steps_to_small_nodes = 100;
  // Mass that a node would have if it were as densely filled as the fullest node of its cells.
  std::vector<double> full_mass(active.size(), 0.);
  for (const CellId cell : active.occupied_cells()) {
    const std::uint32_t *cell_nodes = active.cell_nodes(cell);
    // By mass per volume of the mesh around a node, so that nodes on the mesh's faces are as heavy as others.
    double densest = 0.;
    for (unsigned int v = 0; v < (1u << dim); ++v) {
      const std::uint32_t i = cell_nodes[active.own_node(v)];
      densest = std::max(densest, nodal.sums[std::size_t(i) * nodal.n_sums] / node_volume(i));
    }
    for (unsigned int i = 0; i < active.nodes_per_cell(); ++i)
      full_mass[cell_nodes[i]] = std::max(full_mass[cell_nodes[i]], densest * node_volume(cell_nodes[i]));
  }
  active.max_over_ranks(full_mass.data(), 1);

  // Of a body that fills its cells a node on a face has half of it, one on an edge or corner an eighth at
  // least.
  constexpr double small_share = 0.1;
  std::vector<char> small(active.size(), 0);
  for (std::size_t i = 0; i < active.size(); ++i)
    small[i] = nodal.sums[i * nodal.n_sums + Sums<dim>::mass] < small_share * full_mass[i];
  near_small_node.assign(active.occupied_cells().size(), 0);
  for (std::size_t c = 0; c < near_small_node.size(); ++c) {
    const std::uint32_t *cell_nodes = active.cell_nodes(active.occupied_cells()[c]);
    for (unsigned int v = 0; v < (1u << dim); ++v)
      near_small_node[c] |= small[cell_nodes[active.own_node(v)]];
  }
}

template <int dim>
void Continuum<dim>::extend_nodes()
{
  using S = Sums<dim>;
  double *sums = nodal.sums.data();
  extension->find(sums, nodal.n_sums, saturated ? int(S::resistance) : -1);
  if (extension->is_empty())
    return;
  extension->fold_momentum(sums, nodal.n_sums, S::momentum);
  extension->fold(sums, nodal.n_sums, S::mass, 1);
  extension->fold(sums, nodal.n_sums, S::force, nodal.n_sums - S::force);
}

template <int dim>
const std::vector<double> &Continuum<dim>::seen_by_points(const std::vector<double> &field,
                                                          std::vector<double> &seen) const
{
  if (!extension || extension->is_empty() || field.empty())
    return field;
  seen = field;
  extension->unfold(seen.data(), dim);
  return seen;
}

#define PEAT_INSTANTIATE(dim)                                                                                \
  template void Continuum<dim>::number_nodes(const std::vector<NodeId> &);                                   \
  template void Continuum<dim>::find_prescribed_rows();                                                      \
  template void Continuum<dim>::find_small_nodes();                                                          \
  template void Continuum<dim>::extend_nodes();                                                              \
  template const std::vector<double> &Continuum<dim>::seen_by_points(const std::vector<double> &,            \
                                                                     std::vector<double> &) const;
PEAT_INSTANTIATE(2)
PEAT_INSTANTIATE(3)
#undef PEAT_INSTANTIATE
} // namespace peat
