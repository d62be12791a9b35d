#include <peat/simulation/projection.h>

#include <deal.II/base/symmetric_tensor.h>
#include <deal.II/grid/grid_tools.h>

#include <limits>

namespace peat {
namespace {
/// Spread of the data [cell sizes^2] below which a slope is not taken from them: it would amplify their
/// errors.
constexpr double smallest_spread = 0.02;
/// Fill of the cells next to a node from which on no others are asked.
constexpr double inner_fill = 0.75;
} // namespace

template <int dim>
double LinearFit<dim>::weight(const dealii::Tensor<1, dim> &d)
{
  double product = 1.;
  for (unsigned int k = 0; k < dim; ++k)
    product *= std::max(0., 1. - std::abs(d[k]) / reach);
  return product;
}

template <int dim>
void LinearFit<dim>::add(const double w, const dealii::Tensor<1, dim> &d, double *moments)
{
  *moments++ += w;
  for (unsigned int k = 0; k < dim; ++k)
    *moments++ += w * d[k];
  for (unsigned int k = 0; k < dim; ++k)
    for (unsigned int l = k; l < dim; ++l)
      *moments++ += w * d[k] * d[l];
}

template <int dim>
std::array<double, 1 + dim> LinearFit<dim>::coefficients(const double *moments)
{
  std::array<double, 1 + dim> c;
  c.fill(0.);
  const double w = *moments++;
  if (!(w > 0.))
    return c;
  dealii::Tensor<1, dim> middle;
  dealii::SymmetricTensor<2, dim> spread;
  for (unsigned int k = 0; k < dim; ++k)
    middle[k] = *moments++ / w;
  for (unsigned int k = 0; k < dim; ++k)
    for (unsigned int l = k; l < dim; ++l)
      spread[k][l] = *moments++ / w - middle[k] * middle[l];

  // value = mean - slope . middle with slope = spread^-1 (sum w d f / w - middle mean), in those principal
  // directions in which the data allow it.
  dealii::Tensor<1, dim> step;
  for (const auto &[variance, direction] :
       dealii::eigenvectors(spread, dealii::SymmetricTensorEigenvectorMethod::jacobi))
    if (variance > smallest_spread)
      step += (direction * middle) / variance * direction;
  c[0] = (1. + middle * step) / w;
  for (unsigned int k = 0; k < dim; ++k)
    c[1 + k] = -step[k] / w;
  return c;
}

template <int dim>
NodalProjection<dim>::NodalProjection(const ActiveNodes<dim> &nodes, const CellMeans<dim> &means)
    : nodes(nodes), grid(nodes.grid()), n_fields(means.n_fields)
{
  gather_ghosts(means);
  find_inner_nodes();

  using Fit = LinearFit<dim>;
  constexpr unsigned int n_moments = Fit::n_moments;
  std::vector<double> moments(std::size_t(nodes.size()) * n_moments, 0.);
  for_each_pair([&](const std::size_t i, const std::size_t, const double w, const dealii::Tensor<1, dim> &d) {
    Fit::add(w, d, &moments[i * n_moments]);
  });
  nodes.sum_over_ranks(moments.data(), n_moments);

  std::vector<std::array<double, 1 + dim>> coefficients(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i)
    coefficients[i] = Fit::coefficients(&moments[i * n_moments]);

  values.assign(std::size_t(nodes.size()) * n_fields, 0.);
  for_each_pair(
      [&](const std::size_t i, const std::size_t entry, const double w, const dealii::Tensor<1, dim> &d) {
        double c = coefficients[i][0];
        for (unsigned int k = 0; k < dim; ++k)
          c += coefficients[i][1 + k] * d[k];
        for (unsigned int f = 0; f < n_fields; ++f)
          values[i * n_fields + f] += w * c * mean[entry * n_fields + f];
      });
  nodes.sum_over_ranks(values.data(), n_fields);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (moments[i * n_moments] == 0.)
      std::fill_n(values.begin() + i * n_fields, n_fields, std::numeric_limits<double>::quiet_NaN());
}

template <int dim>
void NodalProjection<dim>::gather_ghosts(const CellMeans<dim> &means)
{
  entry_of_cell.assign(grid.n_local_cells(), no_index);
  const auto append = [&](const CellId id, const double V, const dealii::Point<dim> &x, const double *data) {
    entry_of_cell[id] = cell.size();
    cell.push_back(id);
    volume.push_back(V);
    centroid.push_back(x);
    mean.insert(mean.end(), data, data + n_fields);
  };
  for (std::size_t e = 0; e < means.size(); ++e)
    if (nodes.is_occupied(means.cell[e]))
      append(means.cell[e], means.volume[e], means.centroid[e], means.values.data() + e * n_fields);
  n_owned = cell.size();
  if (dealii::Utilities::MPI::n_mpi_processes(grid.communicator()) == 1)
    return;

  using Cell = typename dealii::Triangulation<dim>::active_cell_iterator;
  using Data = std::vector<double>;
  // A cell without a mean sends nothing but an empty vector.
  const auto pack = [&](const Cell &iterator) {
    const std::uint32_t e = entry_of_cell[iterator->active_cell_index()];
    if (e == no_index)
      return Data();
    Data data = {volume[e]};
    for (unsigned int d = 0; d < dim; ++d)
      data.push_back(centroid[e][d]);
    data.insert(data.end(), mean.begin() + e * n_fields, mean.begin() + (e + 1) * n_fields);
    return data;
  };
  const auto unpack = [&](const Cell &iterator, const Data &data) {
    if (data.empty())
      return;
    dealii::Point<dim> x;
    for (unsigned int d = 0; d < dim; ++d)
      x[d] = data[1 + d];
    append(iterator->active_cell_index(), data[0], x, data.data() + 1 + dim);
  };
  dealii::GridTools::exchange_cell_data_to_ghosts<Data, dealii::Triangulation<dim>>(grid.triangulation(),
                                                                                    pack, unpack);
}

template <int dim>
void NodalProjection<dim>::find_inner_nodes()
{
  std::vector<double> fill(nodes.size(), 0.);
  for (std::size_t e = 0; e < n_owned; ++e)
    for (unsigned int v = 0; v < (1u << dim); ++v)
      fill[corner_node(nodes, cell[e], v)] += volume[e];
  nodes.sum_over_ranks(fill.data(), 1);

  is_inner.resize(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto lattice = grid.node_lattice(nodes.grid_node(i));
    double full = 1.;
    for (unsigned int d = 0; d < dim; ++d) {
      const auto &planes = grid.planes(d);
      const int k = lattice[d], last = grid.n_cells(d);
      full *= k == 0 ? 2. * (planes[1] - planes[0])
                     : (k == last ? 2. * (planes[last] - planes[last - 1]) : planes[k + 1] - planes[k - 1]);
    }
    is_inner[i] = fill[i] > inner_fill * full;
  }
}

/// Visits (node, entry, weight, distance). A cell of this rank brings its own mean to its corners and, where
/// these are not inner nodes, the means of its neighbours, so that a node on an edge sees two layers; all
/// that takes part is known to the rank that owns the cell.
template <int dim>
template <typename Visit>
void NodalProjection<dim>::for_each_pair(const Visit &visit) const
{
  const auto bring = [&](const std::size_t carrier, const std::size_t entry, const unsigned int v) {
    const std::uint32_t i = corner_node(nodes, cell[carrier], v);
    dealii::Tensor<1, dim> d = centroid[entry] - nodes.position(i);
    for (unsigned int k = 0; k < dim; ++k)
      d[k] /= grid.size(cell[carrier], k);
    const double w = volume[entry] * LinearFit<dim>::weight(d);
    if (w > 0.)
      visit(i, entry, w, d);
  };
  constexpr unsigned int n_ring = dim == 2 ? 9 : 27;
  for (std::size_t e = 0; e < n_owned; ++e) {
    std::array<std::uint32_t, n_ring> ring;
    for (unsigned int r = 0; r < n_ring; ++r) {
      auto lattice = grid.lattice(cell[e]);
      for (unsigned int d = 0, rest = r; d < dim; ++d, rest /= 3)
        lattice[d] += int(rest % 3) - 1;
      const CellId neighbour = grid.cell_at(lattice);
      ring[r] = neighbour == no_index ? no_index : entry_of_cell[neighbour];
    }
    for (unsigned int v = 0; v < (1u << dim); ++v) {
      if (is_inner[corner_node(nodes, cell[e], v)])
        bring(e, e, v);
      else
        for (const std::uint32_t neighbour : ring)
          if (neighbour != no_index)
            bring(e, neighbour, v);
    }
  }
}

template struct LinearFit<2>;
template struct LinearFit<3>;
template class NodalProjection<2>;
template class NodalProjection<3>;
} // namespace peat
