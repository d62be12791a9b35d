#include <peat/contact/near_points.h>

#include <algorithm>

namespace peat {
template <int dim>
void NearPoints<dim>::choose(const ActiveNodes<dim> &nodes, const Basis chosen_basis,
                             const std::vector<const Body<dim> *> &bodies,
                             std::vector<std::uint32_t> site_of_node)
{
  basis = chosen_basis;
  sites = std::move(site_of_node);
  cells.clear();
  for (const Body<dim> *body : bodies)
    for (const Slice &slice : body->slices()) {
      const std::uint32_t *cell_nodes = nodes.cell_nodes(slice.cell);
      if (std::any_of(cell_nodes, cell_nodes + nodes.nodes_per_cell(),
                      [&](const std::uint32_t i) { return sites[i] != no_index; }))
        cells.push_back({body, slice.cell});
    }
}

template <int dim>
void NearPoints<dim>::collect(const ActiveNodes<dim> &nodes)
{
  data.clear();
  list.clear();
  around.clear();
  if (basis == Basis::q1)
    collect<2>(nodes);
  else
    collect<4>(nodes);
}

template <int dim>
template <unsigned int reach>
void NearPoints<dim>::collect(const ActiveNodes<dim> &nodes)
{
  constexpr unsigned int n_nodes = dim == 2 ? reach * reach : reach * reach * reach;
  for (const Cell &place : cells) {
    const Body<dim> &body = *place.body;
    const auto slice =
        std::lower_bound(body.slices().begin(), body.slices().end(), place.cell,
                         [](const Slice &slice, const CellId cell) { return slice.cell < cell; });
    if (slice == body.slices().end() || slice->cell != place.cell)
      continue;
    const Layout &layout = body.layout();
    const std::uint32_t *cell_nodes = nodes.cell_nodes(place.cell);
    for (std::uint32_t begin = slice->begin; begin < slice->end; begin += n_lanes) {
      const unsigned int n = std::min(n_lanes, slice->end - begin);
      const std::size_t first = data.size();
      for (unsigned int l = 0; l < n; ++l) {
        const std::uint32_t handle = body.handles()[begin + l];
        const double *row = body.row(handle);
        PointData point{body.position(handle), {}, row[layout.surface_depth], row[layout.volume]};
        for (unsigned int d = 0; d < dim; ++d)
          point.half_extent[d] = row[layout.extent + d];
        data.push_back(point);
      }
      Weights<dim, reach> w;
      for (unsigned int d = 0; d < dim; ++d) {
        Lanes x, half;
        for (unsigned int l = 0; l < n_lanes; ++l) {
          x[l] = data[first + std::min(l, n - 1)].x[d];
          half[l] = data[first + std::min(l, n - 1)].half_extent[d];
        }
        evaluate_direction(x, half, CellInterval::of(nodes.grid(), place.cell, d), w[d]);
      }
      for (unsigned int l = 0; l < n; ++l)
        for (unsigned int i = 0; i < n_nodes; ++i) {
          const std::uint32_t site = sites[cell_nodes[i]];
          if (site == no_index)
            continue;
          if (data[first + l].depth > 0.)
            around.push_back({site, std::uint32_t(first + l)});
          unsigned int k[dim];
          Entry entry{site, std::uint32_t(first + l), 1., {}};
          for (unsigned int d = 0, rest = i; d < dim; ++d, rest /= reach) {
            k[d] = rest % reach;
            entry.N *= w[d].value[k[d]][l];
          }
          if (!(entry.N > 0.))
            continue;
          for (unsigned int d = 0; d < dim; ++d) {
            entry.dN[d] = 1.;
            for (unsigned int e = 0; e < dim; ++e)
              entry.dN[d] *= e == d ? w[e].slope[k[e]][l] : w[e].value[k[e]][l];
          }
          list.push_back(entry);
        }
    }
  }
}

template class NearPoints<2>;
template class NearPoints<3>;
} // namespace peat
