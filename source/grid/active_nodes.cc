#include <peat/grid/active_nodes.h>

#include <deal.II/base/mpi.h>

namespace peat {
template <int dim>
ActiveNodes<dim>::ActiveNodes(const Grid<dim> &grid, const unsigned int nodes_per_direction)
    : background(grid), reach(nodes_per_direction),
      n_cell_nodes(dim == 2 ? nodes_per_direction * nodes_per_direction
                            : nodes_per_direction * nodes_per_direction * nodes_per_direction),
      slot(grid.n_local_cells(), no_index),
      active_index(grid.locally_relevant_nodes().n_elements(), no_index), old_index(active_index)
{}

template <int dim>
void ActiveNodes<dim>::rebuild(const std::vector<CellId> &occupied_cells,
                               const std::vector<NodeId> &more_nodes)
{
  number_nodes(occupied_cells, more_nodes);
  make_exchange();
  for (auto &list : boundary_nodes)
    list.clear();
  for (unsigned int i = 0; i < node.size(); ++i) {
    const auto lattice = background.node_lattice(node[i]);
    for (unsigned int d = 0; d < dim; ++d) {
      if (lattice[d] == 0)
        boundary_nodes[2 * d].push_back(i);
      if (lattice[d] == background.n_cells(d))
        boundary_nodes[2 * d + 1].push_back(i);
    }
  }
  ++n_rebuilds;
}

template <int dim>
unsigned int ActiveNodes<dim>::add(const NodeId grid_node)
{
  std::uint32_t &index = active_index[grid_node];
  if (index == no_index) {
    index = node.size();
    node.push_back(grid_node);
    positions.push_back(background.node_position(grid_node));
    owned.push_back(background.owner(grid_node) ==
                    dealii::Utilities::MPI::this_mpi_process(background.communicator()));
  }
  return index;
}

template <int dim>
void ActiveNodes<dim>::number_nodes(const std::vector<CellId> &occupied_cells,
                                    const std::vector<NodeId> &more_nodes)
{
  for (const CellId cell : cells)
    slot[cell] = no_index;
  for (const NodeId n : old_nodes)
    old_index[n] = no_index;
  for (const NodeId n : node) {
    old_index[n] = active_index[n];
    active_index[n] = no_index;
  }
  old_nodes = node;
  node.clear();
  positions.clear();
  owned.clear();
  cells = occupied_cells;
  table.resize(cells.size() * n_cell_nodes);

  const int offset = reach == 2 ? 0 : -1;
  for (std::size_t s = 0; s < cells.size(); ++s) {
    slot[cells[s]] = s;
    const auto base = background.lattice(cells[s]);
    for (unsigned int i = 0; i < n_cell_nodes; ++i) {
      auto lattice = base;
      for (unsigned int d = 0, rest = i; d < dim; ++d, rest /= reach)
        lattice[d] = std::max(0, std::min(base[d] + offset + int(rest % reach), background.n_cells(d)));
      table[s * n_cell_nodes + i] = add(background.node_at(lattice));
    }
  }
  for (const NodeId n : more_nodes)
    add(n);
}

template <int dim>
unsigned int ActiveNodes<dim>::own_node(const unsigned int vertex) const
{
  unsigned int local = 0;
  for (int d = dim - 1; d >= 0; --d)
    local = local * reach + ((vertex >> d) & 1) + (reach == 4 ? 1 : 0);
  return local;
}

template <int dim>
void ActiveNodes<dim>::make_exchange()
{
  to_owners.clear();
  from_others.clear();
  const MPI_Comm communicator = background.communicator();
  if (dealii::Utilities::MPI::n_mpi_processes(communicator) == 1)
    return;

  using Index = dealii::types::global_dof_index;
  const auto &relevant = background.locally_relevant_nodes();
  std::map<unsigned int, std::vector<Index>> requests;
  std::map<unsigned int, std::vector<std::uint32_t>> mine;
  for (unsigned int i = 0; i < node.size(); ++i)
    if (!owned[i]) {
      const unsigned int rank = background.owner(node[i]);
      requests[rank].push_back(relevant.nth_index_in_set(node[i]));
      mine[rank].push_back(i);
    }
  const auto received = dealii::Utilities::MPI::some_to_some(communicator, requests);
  for (const auto &[rank, nodes] : mine)
    to_owners.push_back({rank, nodes});
  for (const auto &[rank, indices] : received) {
    Share share{rank, {}};
    // The owner keeps a node that only others reach, to add up what they contribute.
    for (const Index index : indices)
      share.nodes.push_back(add(relevant.index_within_set(index)));
    from_others.push_back(share);
  }
}

template <int dim>
std::vector<NodeId> ActiveNodes<dim>::exchanged_nodes() const
{
  std::vector<NodeId> result;
  for (const auto *shares : {&to_owners, &from_others})
    for (const Share &share : *shares)
      for (const std::uint32_t i : share.nodes)
        result.push_back(node[i]);
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

template <int dim>
void ActiveNodes<dim>::sum_over_ranks(double *data, const unsigned int n_components) const
{
  combine_over_ranks(data, n_components, [](const double a, const double b) { return a + b; });
}

template <int dim>
void ActiveNodes<dim>::max_over_ranks(double *data, const unsigned int n_components) const
{
  combine_over_ranks(data, n_components, [](const double a, const double b) { return std::max(a, b); });
}

template <int dim>
template <typename Combine>
void ActiveNodes<dim>::combine_over_ranks(double *data, const unsigned int n_components,
                                          const Combine &combine) const
{
  if (to_owners.empty() && from_others.empty())
    return;
  const MPI_Comm communicator = background.communicator();
  const int tag_to_owner = 4711, tag_to_all = 4712;
  buffers.resize(to_owners.size() + from_others.size());
  std::vector<MPI_Request> requests(buffers.size());

  const auto pack = [&](const Share &share, std::vector<double> &buffer) {
    buffer.resize(share.nodes.size() * n_components);
    double *out = buffer.data();
    for (const std::uint32_t i : share.nodes)
      for (unsigned int c = 0; c < n_components; ++c)
        *out++ = data[std::size_t(i) * n_components + c];
  };
  const auto post = [&](const std::vector<Share> &shares, const std::size_t first, const bool send,
                        const int tag) {
    for (std::size_t s = 0; s < shares.size(); ++s) {
      auto &buffer = buffers[first + s];
      if (send)
        pack(shares[s], buffer);
      buffer.resize(shares[s].nodes.size() * n_components);
      const auto call = send ? MPI_Isend(buffer.data(), buffer.size(), MPI_DOUBLE, shares[s].rank, tag,
                                         communicator, &requests[first + s])
                             : MPI_Irecv(buffer.data(), buffer.size(), MPI_DOUBLE, shares[s].rank, tag,
                                         communicator, &requests[first + s]);
      AssertThrowMPI(call);
    }
  };
  const auto unpack = [&](const Share &share, const std::vector<double> &buffer, const bool combined) {
    const double *in = buffer.data();
    for (const std::uint32_t i : share.nodes)
      for (unsigned int c = 0; c < n_components; ++c) {
        double &value = data[std::size_t(i) * n_components + c];
        value = combined ? combine(value, *in) : *in;
        ++in;
      }
  };

  const std::size_t n_own = to_owners.size();
  post(from_others, n_own, false, tag_to_owner);
  post(to_owners, 0, true, tag_to_owner);
  MPI_Waitall(requests.size(), requests.data(), MPI_STATUSES_IGNORE);
  for (std::size_t s = 0; s < from_others.size(); ++s)
    unpack(from_others[s], buffers[n_own + s], true);

  post(to_owners, 0, false, tag_to_all);
  post(from_others, n_own, true, tag_to_all);
  MPI_Waitall(requests.size(), requests.data(), MPI_STATUSES_IGNORE);
  for (std::size_t s = 0; s < to_owners.size(); ++s)
    unpack(to_owners[s], buffers[s], false);
}

template <int dim>
std::vector<NodeId> with_neighbours(const Grid<dim> &grid, const std::vector<NodeId> &nodes)
{
  std::vector<NodeId> result = nodes;
  for (const NodeId node : nodes)
    for (unsigned int d = 0; d < dim; ++d)
      for (const int step : {-1, 1}) {
        auto lattice = grid.node_lattice(node);
        lattice[d] += step;
        if (lattice[d] < 0 || lattice[d] > grid.n_cells(d))
          continue;
        if (const NodeId neighbour = grid.node_at(lattice); neighbour != no_index)
          result.push_back(neighbour);
      }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

template class ActiveNodes<2>;
template class ActiveNodes<3>;
template std::vector<NodeId> with_neighbours<2>(const Grid<2> &, const std::vector<NodeId> &);
template std::vector<NodeId> with_neighbours<3>(const Grid<3> &, const std::vector<NodeId> &);
} // namespace peat
