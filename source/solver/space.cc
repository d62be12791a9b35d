#include <peat/solver/space.h>

#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_nothing.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_system.h>
#include <deal.II/fe/fe_tools.h>
#include <deal.II/grid/grid_tools.h>

#include "cell_shapes.h"

namespace peat {
namespace {
constexpr unsigned int power(const unsigned int base, const unsigned int exponent)
{
  return exponent == 0 ? 1 : base * power(base, exponent - 1);
}

template <int dim>
unsigned int degree(const Nodes kind)
{
  return kind == Nodes::q2 ? 2 : 1;
}
} // namespace

template <int dim>
Space<dim>::Space(const Grid<dim> &grid, const Nodes displacement)
    : background(grid), kind(displacement), n_nodes(power(static_cast<unsigned int>(displacement), dim)),
      displacement_elements(dealii::FESystem<dim>(dealii::FE_Nothing<dim>(), dim),
                            dealii::FESystem<dim>(dealii::FE_Q<dim>(degree<dim>(displacement)), dim)),
      pressure_elements(dealii::FE_Nothing<dim>(), dealii::FE_Q<dim>(1)),
      displacement_handler(grid.triangulation()), pressure_handler(grid.triangulation())
{}

template <int dim>
std::vector<char> Space<dim>::with_ghosts(const std::vector<CellId> &cells) const
{
  std::vector<char> marked(background.n_local_cells(), 0);
  for (const CellId cell : cells)
    marked[cell] = 1;
  using Cell = typename dealii::Triangulation<dim>::active_cell_iterator;
  dealii::GridTools::exchange_cell_data_to_ghosts<char, dealii::Triangulation<dim>>(
      background.triangulation(), [&](const Cell &cell) { return marked[cell->active_cell_index()]; },
      [&](const Cell &cell, const char value) { marked[cell->active_cell_index()] = value; });
  return marked;
}

template <int dim>
std::vector<char> Space<dim>::dilate(const std::vector<char> &marked) const
{
  std::vector<char> result = marked;
  for (CellId cell = 0; cell < background.n_local_cells(); ++cell) {
    if (!background.is_owned(cell))
      continue;
    for (unsigned int k = 0; k < power(3, dim); ++k) {
      auto lattice = background.lattice(cell);
      for (unsigned int d = 0, rest = k; d < dim; ++d, rest /= 3)
        lattice[d] += int(rest % 3) - 1;
      const CellId neighbour = background.cell_at(lattice);
      if (neighbour != no_index && marked[neighbour])
        result[cell] = 1;
    }
  }
  return result;
}

template <int dim>
void Space<dim>::number(dealii::DoFHandler<dim> &handler, const dealii::hp::FECollection<dim> &elements,
                        const std::vector<char> &active, const unsigned int block)
{
  for (const auto &cell : handler.active_cell_iterators())
    if (cell->is_locally_owned())
      cell->set_active_fe_index(active[cell->active_cell_index()] ? 1 : 0);
  handler.distribute_dofs(elements);
  n_global[block] = handler.n_dofs();
  owned_sets.push_back(handler.locally_owned_dofs());
  dealii::IndexSet relevant;
  dealii::DoFTools::extract_locally_relevant_dofs(handler, relevant);
  relevant_sets.push_back(relevant);
}

template <int dim>
void Space<dim>::distribute(const std::vector<CellId> &solid, const std::vector<CellId> &saturated)
{
  owned_sets.clear();
  relevant_sets.clear();
  const auto solid_cell = with_ghosts(solid);
  saturated_cell = with_ghosts(saturated);
  number(displacement_handler, displacement_elements, kind == Nodes::gimp ? dilate(solid_cell) : solid_cell,
         0);
  number(pressure_handler, pressure_elements, saturated_cell, 1);
  if (!has_pressure()) {
    owned_sets.pop_back();
    relevant_sets.pop_back();
  }
  make_displacement_tables(solid, solid_cell);
  make_pressure_tables(saturated);
}

template <int dim>
unsigned int Space<dim>::boundaries_at(const dealii::Point<dim> &x) const
{
  const double tolerance = 1e-9 * background.smallest_cell_size();
  unsigned int bits = 0;
  for (unsigned int d = 0; d < dim; ++d) {
    if (x[d] < background.planes(d).front() + tolerance)
      bits |= 1u << (2 * d);
    if (x[d] > background.planes(d).back() - tolerance)
      bits |= 1u << (2 * d + 1);
  }
  return bits;
}

template <int dim>
void Space<dim>::make_displacement_tables(std::vector<CellId> solid, const std::vector<char> &solid_cell)
{
  for (CellId cell = 0; cell < background.n_local_cells() && kind != Nodes::gimp; ++cell)
    if (solid_cell[cell] && !background.is_owned(cell))
      solid.push_back(cell);

  const auto &element = displacement_elements[1];
  const unsigned int k = degree<dim>(kind), n = power(k + 1, dim);
  const auto lexicographic = dealii::FETools::hierarchic_to_lexicographic_numbering<dim>(k);
  std::vector<unsigned int> place(element.dofs_per_cell);
  for (unsigned int i = 0; i < element.dofs_per_cell; ++i) {
    const auto [component, base] = element.system_to_component_index(i);
    place[i] = lexicographic[base] * dim + component;
  }

  slot.assign(background.n_local_cells(), no_index);
  for (std::size_t s = 0; s < solid.size(); ++s)
    slot[solid[s]] = s;
  displacement_table.assign(solid.size() * n_nodes * dim, 0);
  node_list.clear();
  std::vector<std::uint32_t> node_of_unknown(relevant_sets[0].n_elements(), no_index);
  std::vector<Index> unknowns(element.dofs_per_cell), sorted(element.dofs_per_cell);
  for (const auto &cell : displacement_handler.active_cell_iterators()) {
    if (cell->is_artificial() || cell->active_fe_index() == 0)
      continue;
    const CellId id = cell->active_cell_index();
    cell->get_dof_indices(unknowns);
    for (unsigned int i = 0; i < unknowns.size(); ++i)
      sorted[place[i]] = unknowns[i];
    if (kind != Nodes::gimp && slot[id] != no_index)
      std::copy(sorted.begin(), sorted.end(), &displacement_table[std::size_t(slot[id]) * n_nodes * dim]);
    for (unsigned int i = 0; i < n; ++i) {
      std::uint32_t &known = node_of_unknown[relevant_sets[0].index_within_set(sorted[i * dim])];
      if (known != no_index)
        continue;
      known = node_list.size();
      Node node;
      for (unsigned int d = 0, rest = i; d < dim; ++d, rest /= k + 1) {
        // Exactly on the mesh's planes where the node is.
        const double fraction = double(rest % (k + 1)) / k;
        const double lower = background.lower(id, d),
                     upper = background.planes(d)[background.lattice(id)[d] + 1];
        node.position[d] = fraction == 1. ? upper : lower + fraction * (upper - lower);
        node.displacement[d] = sorted[i * dim + d];
      }
      node_list.push_back(node);
    }
  }
  find_vertices();
  if (kind == Nodes::gimp)
    make_patches(solid);
}

template <int dim>
void Space<dim>::find_vertices()
{
  vertex_node.assign(background.locally_relevant_nodes().n_elements(), no_index);
  for (std::size_t i = 0; i < node_list.size(); ++i) {
    auto lattice = background.locate(node_list[i].position);
    bool is_vertex = true;
    for (unsigned int d = 0; d < dim; ++d) {
      if (node_list[i].position[d] >= background.planes(d).back())
        lattice[d] = background.n_cells(d);
      is_vertex = is_vertex && node_list[i].position[d] == background.planes(d)[lattice[d]];
    }
    if (is_vertex)
      vertex_node[background.node_at(lattice)] = i;
  }
}

template <int dim>
void Space<dim>::make_patches(const std::vector<CellId> &solid)
{
  for (std::size_t s = 0; s < solid.size(); ++s)
    for (unsigned int i = 0; i < n_nodes; ++i) {
      auto lattice = background.lattice(solid[s]);
      for (unsigned int d = 0, rest = i; d < dim; ++d, rest /= 4)
        lattice[d] = std::max(0, std::min(lattice[d] - 1 + int(rest % 4), background.n_cells(d)));
      const Node &node = *node_at(background.node_at(lattice));
      std::copy(node.displacement.begin(), node.displacement.end(),
                &displacement_table[(s * n_nodes + i) * dim]);
    }
}

template <int dim>
void Space<dim>::make_pressure_tables(const std::vector<CellId> &saturated)
{
  pressure_slot.assign(background.n_local_cells(), no_index);
  for (std::size_t s = 0; s < saturated.size(); ++s)
    pressure_slot[saturated[s]] = s;
  pressure_table.assign(saturated.size() * n_pressures, 0);
  pressure_node_list.clear();
  if (!has_pressure())
    return;
  const auto lexicographic = dealii::FETools::hierarchic_to_lexicographic_numbering<dim>(1);
  std::vector<char> known(relevant_sets[1].n_elements(), 0);
  std::vector<Index> unknowns(n_pressures);
  for (const auto &cell : pressure_handler.active_cell_iterators()) {
    if (cell->is_artificial() || cell->active_fe_index() == 0)
      continue;
    const CellId id = cell->active_cell_index();
    cell->get_dof_indices(unknowns);
    for (unsigned int i = 0; i < n_pressures; ++i) {
      const unsigned int v = lexicographic[i];
      if (pressure_slot[id] != no_index)
        pressure_table[std::size_t(pressure_slot[id]) * n_pressures + v] = first_pressure() + unknowns[i];
      char &listed = known[relevant_sets[1].index_within_set(unknowns[i])];
      if (listed)
        continue;
      listed = 1;
      PressureNode node;
      for (unsigned int d = 0; d < dim; ++d)
        node.position[d] = background.planes(d)[background.lattice(id)[d] + ((v >> d) & 1)];
      node.pressure = first_pressure() + unknowns[i];
      pressure_node_list.push_back(node);
    }
  }
}

template <int dim>
CellId Space<dim>::solid_cell_at(const dealii::Point<dim> &x) const
{
  const double tolerance = 1e-9 * background.smallest_cell_size();
  for (unsigned int k = 0; k < power(3, dim); ++k) {
    dealii::Point<dim> near = x;
    for (unsigned int d = 0, rest = k; d < dim; ++d, rest /= 3)
      near[d] += rest % 3 == 1 ? -tolerance : rest % 3 == 2 ? tolerance : 0.;
    const CellId cell = background.cell_at(background.locate(near));
    if (cell != no_index && is_solid(cell))
      return cell;
  }
  return no_index;
}

template <int dim>
dealii::Tensor<1, dim> Space<dim>::value(const dealii::TrilinosWrappers::MPI::Vector &displacement,
                                         const dealii::Point<dim> &x) const
{
  const CellId cell = solid_cell_at(x);
  if (cell == no_index)
    return {};
  double N[64];
  if (kind == Nodes::q2)
    shape_functions<dim, 3>(background, cell, x, N);
  else if (kind == Nodes::q1)
    shape_functions<dim, 2>(background, cell, x, N);
  else
    Assert(false, dealii::ExcMessage("the domain of a point is needed"));
  dealii::Tensor<1, dim> result;
  const Index *unknowns = displacements(cell);
  for (unsigned int i = 0; i < n_nodes; ++i)
    for (unsigned int d = 0; d < dim; ++d)
      result[d] += N[i] * displacement(unknowns[i * dim + d]);
  return result;
}

template class Space<2>;
template class Space<3>;
} // namespace peat
