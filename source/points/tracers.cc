#include <peat/grid/cut_box.h>
#include <peat/points/tracers.h>

#include <deal.II/base/mpi.h>

namespace peat {
template <int dim>
CellId Tracers<dim>::own_cell(const Tracer &tracer) const
{
  return grid.cell_at(grid.locate(tracer.position));
}

template <int dim>
void Tracers<dim>::add(const std::uint32_t id, const dealii::Point<dim> &position, const dealii::Tensor<1, dim> &area)
{
  const Tracer tracer{id, position, position, area};
  const CellId cell = own_cell(tracer);
  if (cell != no_index && grid.is_owned(cell))
    list.push_back(tracer);
}

namespace {
  /// How far inside the surface its tracers start, in cells: they belong to the cell of the material, not to the
  /// empty one beyond the face.
  constexpr double inset = 1e-7;

  template <int dim>
  Bounds<dim> neighbour_box(const Bounds<dim> &box, const unsigned int face)
  {
    Bounds<dim> result = box;
    const double h = box.upper[face / 2] - box.lower[face / 2];
    result.lower[face / 2] += face % 2 ? h : -h;
    result.upper[face / 2] += face % 2 ? h : -h;
    return result;
  }
} // namespace

template <int dim>
void Tracers<dim>::cover(const Shape<dim> &shape, const unsigned int pieces_per_direction)
{
  const unsigned int n = pieces_per_direction;
  const unsigned int n_boxes = dim == 2 ? n * n : n * n * n;
  const auto put = [&](dealii::Point<dim> x, const dealii::Tensor<1, dim> &area, const double h) {
    x -= inset * h * area / area.norm();
    list.push_back({std::uint32_t(list.size()), x, x, area});
  };
  for (CellId cell = 0; cell < grid.n_local_cells(); ++cell) {
    if (!grid.is_owned(cell))
      continue;
    Bounds<dim> cell_box;
    for (unsigned int d = 0; d < dim; ++d) {
      cell_box.lower[d] = grid.lower(cell, d);
      cell_box.upper[d] = grid.lower(cell, d) + grid.size(cell, d);
    }
    if (shape.is_distance() && std::abs(shape.distance(cell_box.center())) > 1.1 * cell_box.radius())
      continue;
    for (unsigned int b = 0; b < n_boxes; ++b) {
      Bounds<dim> box;
      for (unsigned int d = 0, rest = b; d < dim; ++d, rest /= n) {
        box.lower[d] = cell_box.lower[d] + grid.size(cell, d) * (rest % n) / n;
        box.upper[d] = cell_box.lower[d] + grid.size(cell, d) * (rest % n + 1) / n;
      }
      const CutBox<dim> part = cut(shape, box.lower, box.upper);
      if (part.volume == 0.)
        continue;
      const double h = box.upper[0] - box.lower[0];
      const double face_scale = std::pow(h, dim - 1);
      if (part.interface.norm() > 1e-9 * face_scale)
        put(part.interface_centroid, part.interface, h);
      for (unsigned int face = 0; face < 2 * dim; ++face) {
        const Bounds<dim> beyond = neighbour_box(box, face);
        if (part.face_area[face] <= 1e-9 * face_scale || !grid.contains(beyond.center()) ||
            cut(shape, beyond.lower, beyond.upper).volume > 0.)
          continue;
        dealii::Point<dim> x = part.centroid;
        x[face / 2] = face % 2 ? box.upper[face / 2] : box.lower[face / 2];
        dealii::Tensor<1, dim> area;
        area[face / 2] = (face % 2 ? 1. : -1.) * part.face_area[face];
        put(x, area, h);
      }
    }
  }
}

template <int dim>
CellId Tracers<dim>::carrier(const Tracer &tracer, const ActiveNodes<dim> &nodes) const
{
  const CellId own = own_cell(tracer);
  if (own != no_index && nodes.is_occupied(own))
    return own;
  const auto lattice = grid.locate(tracer.position);
  // First the cell behind the surface, then any other neighbour.
  if (tracer.area.norm_square() > 0.) {
    unsigned int axis = 0;
    for (unsigned int d = 1; d < dim; ++d)
      if (std::abs(tracer.area[d]) > std::abs(tracer.area[axis]))
        axis = d;
    auto behind = lattice;
    behind[axis] -= tracer.area[axis] > 0. ? 1 : -1;
    const CellId cell = grid.cell_at(behind);
    if (cell != no_index && nodes.is_occupied(cell))
      return cell;
  }
  for (unsigned int d = 0; d < dim; ++d)
    for (const int side : {-1, 1}) {
      auto beside = lattice;
      beside[d] += side;
      const CellId cell = grid.cell_at(beside);
      if (cell != no_index && nodes.is_occupied(cell))
        return cell;
    }
  return no_index;
}

template <int dim>
void Tracers<dim>::locate(const ActiveNodes<dim> &nodes)
{
  const unsigned int reach = nodes.nodes_per_direction();
  carried.resize(list.size());
  carrier_cell.resize(list.size());
  for (std::size_t t = 0; t < list.size(); ++t) {
    SurfacePoint<dim> &point = carried[t];
    point.initial_position = list[t].initial_position;
    point.position = list[t].position;
    point.area = list[t].area;
    const CellId cell = carrier_cell[t] = carrier(list[t], nodes);
    if (cell == no_index) {
      point.node.fill(0);
      point.N.fill(0.);
      continue;
    }
    double xi[dim];
    for (unsigned int d = 0; d < dim; ++d)
      xi[d] = std::min(1., std::max(0., (point.position[d] - grid.lower(cell, d)) / grid.size(cell, d)));
    for (unsigned int v = 0; v < point.n_nodes; ++v) {
      unsigned int local = 0;
      point.N[v] = 1.;
      for (int d = dim - 1; d >= 0; --d) {
        local = local * reach + ((v >> d) & 1) + (reach == 4 ? 1 : 0);
        point.N[v] *= (v >> d) & 1 ? xi[d] : 1. - xi[d];
      }
      point.node[v] = nodes.cell_nodes(cell)[local];
    }
  }
}

template <int dim>
void Tracers<dim>::move(const std::vector<double> &velocity, const double dt, const bool stretch,
                        const ActiveNodes<dim> &)
{
  for (std::size_t t = 0; t < list.size(); ++t) {
    const SurfacePoint<dim> &point = carried[t];
    for (unsigned int i = 0; i < point.n_nodes; ++i)
      for (unsigned int d = 0; d < dim; ++d)
        list[t].position[d] += dt * point.N[i] * velocity[std::size_t(point.node[i]) * dim + d];
    if (!stretch || carrier_cell[t] == no_index)
      continue;
    // da_t = (div v I - (grad v)^T) da, with the gradient of the carrying cell.
    dealii::Tensor<2, dim> gradient;
    for (unsigned int i = 0; i < point.n_nodes; ++i)
      for (unsigned int e = 0; e < dim; ++e) {
        double slope = (i >> e) & 1 ? 1. / grid.size(carrier_cell[t], e) : -1. / grid.size(carrier_cell[t], e);
        for (unsigned int d = 0; d < dim; ++d)
          if (d != e) {
            const double xi = std::min(1., std::max(0., (point.position[d] - grid.lower(carrier_cell[t], d)) /
                                                            grid.size(carrier_cell[t], d)));
            slope *= (i >> d) & 1 ? xi : 1. - xi;
          }
        for (unsigned int d = 0; d < dim; ++d)
          gradient[d][e] += slope * velocity[std::size_t(point.node[i]) * dim + d];
      }
    const dealii::Tensor<1, dim> area = list[t].area;
    list[t].area += dt * (dealii::trace(gradient) * area - dealii::transpose(gradient) * area);
  }
}

template <int dim>
bool Tracers<dim>::leaves_rank() const
{
  for (const Tracer &tracer : list) {
    const CellId cell = own_cell(tracer);
    if (cell == no_index || !grid.is_owned(cell))
      return true;
  }
  return false;
}

template <int dim>
void Tracers<dim>::migrate()
{
  constexpr unsigned int n_values = 1 + 3 * dim;
  std::map<unsigned int, std::vector<double>> outgoing;
  std::vector<Tracer> staying;
  for (const Tracer &tracer : list) {
    const CellId cell = own_cell(tracer);
    if (cell != no_index && grid.is_owned(cell)) {
      staying.push_back(tracer);
      continue;
    }
    if (cell == no_index)
      throw NumericalError("a piece of a body's surface or a probe moved further than one cell in one step");
    auto &values = outgoing[grid.cell_owner(cell)];
    values.push_back(tracer.id);
    for (unsigned int d = 0; d < dim; ++d) {
      values.push_back(tracer.initial_position[d]);
      values.push_back(tracer.position[d]);
      values.push_back(tracer.area[d]);
    }
  }
  const auto incoming = dealii::Utilities::MPI::some_to_some(grid.communicator(), outgoing);
  for (const auto &[rank, values] : incoming)
    for (std::size_t i = 0; i < values.size(); i += n_values) {
      Tracer tracer;
      tracer.id = values[i];
      for (unsigned int d = 0; d < dim; ++d) {
        tracer.initial_position[d] = values[i + 1 + 3 * d];
        tracer.position[d] = values[i + 2 + 3 * d];
        tracer.area[d] = values[i + 3 + 3 * d];
      }
      staying.push_back(tracer);
    }
  list.swap(staying);
}

template class Tracers<2>;
template class Tracers<3>;
} // namespace peat
