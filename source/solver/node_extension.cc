#include <peat/solver/node_extension.h>

#include <deal.II/base/mpi.h>

#include <algorithm>

namespace peat {
namespace {
/// A node is small with less than this share of the mass of the one behind it. Edges and corners of a body
/// that fills its cells have a half. With this the fastest motion of a body whose surface lies anywhere in a
/// cell is that of full cells.
constexpr double small_share = 0.35;
/// Of its mass, that a node farther behind gives to the straight line of one small node at most.
constexpr double given_share = 0.125;
/// Nodes that weigh the same but for round-off.
constexpr double slack = 1e-6;
} // namespace

template <int dim>
void NodeExtension<dim>::reinit(const ActiveNodes<dim> &nodes, const std::vector<char> &given)
{
  active = &nodes;
  const Grid<dim> &grid = nodes.grid();
  const MPI_Comm communicator = grid.communicator();
  parallel = dealii::Utilities::MPI::n_mpi_processes(communicator) > 1;
  const int rank = dealii::Utilities::MPI::this_mpi_process(communicator);

  // By node and direction: less the lowest rank with an occupied cell on that way.
  constexpr double none = -1e9;
  std::vector<double> first_rank(nodes.size() * std::size_t(2 * dim), none);
  std::vector<char> touched(nodes.size(), 0);
  for (const CellId cell : nodes.occupied_cells()) {
    const std::uint32_t *cell_nodes = nodes.cell_nodes(cell);
    for (unsigned int v = 0; v < (1u << dim); ++v) {
      const std::uint32_t i = cell_nodes[nodes.own_node(v)];
      touched[i] = 1;
      for (unsigned int d = 0; d < dim; ++d)
        first_rank[i * std::size_t(2 * dim) + 2 * d + (v >> d & 1 ? 0 : 1)] = -rank;
    }
  }
  nodes.max_over_ranks(first_rank.data(), 2 * dim);

  const auto follows = [&](const std::uint32_t i, const std::uint32_t other) {
    for (unsigned int d = 0; d < dim; ++d)
      if (given[i * std::size_t(dim) + d] && !given[other * std::size_t(dim) + d])
        return false;
    return true;
  };
  candidates.clear();
  for (std::uint32_t i = 0; i < nodes.size(); ++i) {
    if (!touched[i])
      continue;
    Candidate candidate;
    candidate.node = i;
    bool any = false;
    for (unsigned int way = 0; way < 2 * dim; ++way) {
      candidate.behind[way] = candidate.beyond[way] = no_index;
      candidate.ratio[way] = 1.;
      const double holder = first_rank[i * std::size_t(2 * dim) + way];
      candidate.mine[way] = holder == -rank;
      if (holder == none)
        continue;
      auto lattice = grid.node_lattice(nodes.grid_node(i));
      std::uint32_t *const places[2] = {&candidate.behind[way], &candidate.beyond[way]};
      for (std::uint32_t *place : places) {
        lattice[way / 2] += way % 2 ? 1 : -1;
        if (lattice[way / 2] < 0 || lattice[way / 2] > grid.n_cells(way / 2))
          break;
        const NodeId grid_node = grid.node_at(lattice);
        const std::uint32_t j = grid_node == no_index ? no_index : nodes.index_of(grid_node);
        if (j == no_index || !follows(i, j))
          break;
        *place = j;
      }
      if (candidate.beyond[way] != no_index)
        candidate.ratio[way] =
            nodes.position(i).distance(nodes.position(candidate.behind[way])) /
            nodes.position(candidate.behind[way]).distance(nodes.position(candidate.beyond[way]));
      any = any || candidate.behind[way] != no_index;
    }
    if (any)
      candidates.push_back(candidate);
  }
  for (auto &level : levels)
    level.clear();
  n_levels = 0;
}

template <int dim>
void NodeExtension<dim>::find(const double *sums, const unsigned int stride, const int resistance)
{
  found.clear();
  const auto value = [&](const std::uint32_t i, const int column) {
    return sums[i * std::size_t(stride) + column];
  };
  double heaviest_of_all = 0.;
  for (std::uint32_t i = 0; i < active->size(); ++i)
    heaviest_of_all = std::max(heaviest_of_all, value(i, 0));
  for (const Candidate &candidate : candidates) {
    const std::uint32_t i = candidate.node;
    const double own = value(i, 0);
    if (own >= small_share * heaviest_of_all)
      continue;
    double heaviest = 0.;
    for (const std::uint32_t j : candidate.behind)
      if (j != no_index)
        heaviest = std::max(heaviest, value(j, 0));
    if (!(own > 0.) || own >= small_share * heaviest)
      continue;
    unsigned int n_lines = 0;
    for (const std::uint32_t j : candidate.behind)
      n_lines += j != no_index && value(j, 0) >= (1. - slack) * heaviest;
    for (unsigned int way = 0; way < 2 * dim; ++way) {
      const std::uint32_t behind = candidate.behind[way], beyond = candidate.beyond[way];
      if (behind == no_index || !candidate.mine[way] || value(behind, 0) < (1. - slack) * heaviest)
        continue;
      Line line;
      line.node = {i, behind, beyond};
      line.share = (1. - own / (small_share * heaviest)) / n_lines;
      // Heavier than this node, so that none follows itself, and by so much that it stays positive.
      line.slope = 0.;
      if (beyond != no_index)
        line.slope = std::max(0., std::min({candidate.ratio[way], given_share * (value(beyond, 0) / own - 1.),
                                            2. * value(beyond, 0) / heaviest}));
      if (line.slope > 0. && resistance >= 0 && value(i, resistance) > 0.)
        line.slope = std::min(line.slope, given_share * value(beyond, resistance) / value(i, resistance));
      if (!(line.slope > 0.)) {
        line.slope = 0.;
        line.node[2] = no_index;
      }
      found.push_back(line);
    }
  }

  sort_into_levels(found);
  if (is_empty())
    return;
  mass.resize(active->size());
  for (std::size_t i = 0; i < mass.size(); ++i)
    mass[i] = sums[i * stride];
  for (unsigned int l = n_levels; l-- > 0;) {
    for (Line &line : levels[l])
      for (unsigned int k = 0; k < 3; ++k)
        line.mass[k] = line.node[k] == no_index ? 0. : mass[line.node[k]];
    at_level(l, mass.data(), 1, 0, 1, [&](const Line &line, double *delta) {
      const double moved = line.share * mass[line.node[0]];
      delta[0] -= moved;
      delta[1] += (1. + line.slope) * moved;
      delta[2] -= line.slope * moved;
    });
  }
}

template <int dim>
void NodeExtension<dim>::sort_into_levels(const std::vector<Line> &lines)
{
  for (auto &lines_of_level : levels)
    lines_of_level.clear();
  n_levels = !lines.empty();
  if (parallel)
    n_levels = dealii::Utilities::MPI::max(n_levels, active->grid().communicator());
  if (n_levels == 0)
    return;
  level_of.assign(active->size(), 0.);
  for (const Line &line : lines)
    level_of[line.node[0]] = 1.;
  active->max_over_ranks(level_of.data(), 1);
  for (unsigned int turn = 1; turn <= dim; ++turn) {
    bool changed = false;
    next_level = level_of;
    for (const Line &line : lines)
      for (const std::uint32_t j : {line.node[1], line.node[2]})
        if (j != no_index && level_of[j] + 1. > next_level[line.node[0]]) {
          next_level[line.node[0]] = level_of[j] + 1.;
          changed = true;
        }
    level_of.swap(next_level);
    active->max_over_ranks(level_of.data(), 1);
    if (!parallel && !changed)
      break;
  }
  // What would follow more nodes in a row than there are directions goes its own way.
  for (const Line &line : lines)
    if (const auto l = static_cast<unsigned int>(level_of[line.node[0]]); l <= dim) {
      levels[l - 1].push_back(line);
      n_levels = std::max(n_levels, l);
    }
  if (parallel)
    n_levels = dealii::Utilities::MPI::max(n_levels, active->grid().communicator());
}

template <int dim>
template <typename Action>
void NodeExtension<dim>::at_level(const unsigned int level, double *data, const unsigned int stride,
                                  const unsigned int first, const unsigned int n, const Action &action) const
{
  const std::vector<Line> &lines = levels[level];
  deltas.assign(lines.size() * 3 * n, 0.);
  for (std::size_t l = 0; l < lines.size(); ++l)
    action(lines[l], &deltas[l * 3 * n]);
  if (parallel) {
    nodal.assign(active->size() * std::size_t(n), 0.);
    for (std::size_t l = 0; l < lines.size(); ++l)
      for (unsigned int k = 0; k < 3; ++k)
        for (unsigned int c = 0; c < n && lines[l].node[k] != no_index; ++c)
          nodal[lines[l].node[k] * std::size_t(n) + c] += deltas[(l * 3 + k) * n + c];
    active->sum_over_ranks(nodal.data(), n);
    for (std::size_t i = 0; i < active->size(); ++i)
      for (unsigned int c = 0; c < n; ++c)
        data[i * stride + first + c] += nodal[i * n + c];
    return;
  }
  for (std::size_t l = 0; l < lines.size(); ++l)
    for (unsigned int k = 0; k < 3; ++k)
      for (unsigned int c = 0; c < n && lines[l].node[k] != no_index; ++c)
        data[lines[l].node[k] * std::size_t(stride) + first + c] += deltas[(l * 3 + k) * n + c];
}

template <int dim>
void NodeExtension<dim>::fold(double *data, const unsigned int stride, const unsigned int first,
                              const unsigned int n) const
{
  for (unsigned int l = n_levels; l-- > 0;)
    at_level(l, data, stride, first, n, [&](const Line &line, double *delta) {
      const double *own = data + line.node[0] * std::size_t(stride) + first;
      for (unsigned int c = 0; c < n; ++c) {
        const double moved = line.share * own[c];
        delta[c] -= moved;
        delta[n + c] += (1. + line.slope) * moved;
        delta[2 * n + c] -= line.slope * moved;
      }
    });
}

template <int dim>
void NodeExtension<dim>::fold_momentum(double *data, const unsigned int stride,
                                       const unsigned int first) const
{
  for (unsigned int l = n_levels; l-- > 0;)
    at_level(l, data, stride, first, dim, [&](const Line &line, double *delta) {
      for (unsigned int d = 0; d < dim; ++d) {
        double v[3];
        for (unsigned int k = 0; k < 3; ++k)
          v[k] = line.mass[k] > 0. ? data[line.node[k] * std::size_t(stride) + first + d] / line.mass[k] : 0.;
        const double moved = line.share * line.mass[0];
        const double rest = v[0] - (1. + line.slope) * v[1] + line.slope * v[2];
        delta[d] -= moved * v[0];
        delta[dim + d] += (1. + line.slope) * moved * (v[1] + rest);
        delta[2 * dim + d] -= line.slope * moved * (v[2] + rest);
      }
    });
}

template <int dim>
void NodeExtension<dim>::fold_areas(double *data) const
{
  for (unsigned int l = n_levels; l-- > 0;)
    at_level(l, data, 1, 0, 1, [&](const Line &line, double *delta) {
      delta[0] -= line.share * data[line.node[0]];
      delta[1] += line.share * data[line.node[0]];
    });
}

template <int dim>
void NodeExtension<dim>::unfold(double *data, const unsigned int n) const
{
  for (unsigned int l = 0; l < n_levels; ++l)
    at_level(l, data, n, 0, n, [&](const Line &line, double *delta) {
      for (unsigned int c = 0; c < n; ++c) {
        const double beyond = line.node[2] == no_index ? 0. : data[line.node[2] * std::size_t(n) + c];
        delta[c] = line.share * ((1. + line.slope) * data[line.node[1] * std::size_t(n) + c] -
                                 line.slope * beyond - data[line.node[0] * std::size_t(n) + c]);
      }
    });
}

template <int dim>
void NodeExtension<dim>::unfold_compliance(double *data, const unsigned int n) const
{
  for (unsigned int l = 0; l < n_levels; ++l)
    at_level(l, data, n, 0, n, [&](const Line &line, double *delta) {
      for (unsigned int c = 0; c < n; ++c) {
        const double own = data[line.node[0] * std::size_t(n) + c];
        const double beyond = line.node[2] == no_index ? 0. : data[line.node[2] * std::size_t(n) + c];
        const double behind = std::pow(1. + line.slope, 2) * data[line.node[1] * std::size_t(n) + c] +
                              std::pow(line.slope, 2) * beyond;
        delta[c] = std::pow(1. - line.share, 2) * own + std::pow(line.share, 2) * behind - own;
      }
    });
}

template class NodeExtension<2>;
template class NodeExtension<3>;
} // namespace peat
