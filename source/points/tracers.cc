#include <peat/grid/cut_box.h>
#include <peat/points/tracers.h>

#include <deal.II/base/mpi.h>
#include <deal.II/base/quadrature_lib.h>

namespace peat {
namespace {
/// Where a tracer belongs: a piece of surface to the cell of the material just behind it.
template <int dim>
typename Grid<dim>::Lattice home(const typename Tracers<dim>::Tracer &tracer, const Grid<dim> &grid)
{
  dealii::Point<dim> x = tracer.position;
  if (const double area = tracer.area.norm(); area > 0.)
    x -= 1e-7 * grid.smallest_cell_size() / area * tracer.area;
  return grid.locate(x);
}
} // namespace

template <int dim>
CellId Tracers<dim>::own_cell(const Tracer &tracer) const
{
  return grid.cell_at(home<dim>(tracer, grid));
}

template <int dim>
void Tracers<dim>::add(const std::uint32_t id, const dealii::Point<dim> &position,
                       const dealii::Tensor<1, dim> &area, const int body)
{
  const Tracer tracer{id, position, position, area, false, body};
  const CellId cell = own_cell(tracer);
  if (cell != no_index && grid.is_owned(cell))
    list.push_back(tracer);
}

namespace {
template <int dim>
Bounds<dim> neighbour_box(const Bounds<dim> &box, const unsigned int face)
{
  Bounds<dim> result = box;
  const double h = box.upper[face / 2] - box.lower[face / 2];
  result.lower[face / 2] += face % 2 ? h : -h;
  result.upper[face / 2] += face % 2 ? h : -h;
  return result;
}

/// One of n^dim equal parts of a box.
template <int dim>
Bounds<dim> part_of_box(const Bounds<dim> &box, const unsigned int n, const unsigned int part)
{
  Bounds<dim> result;
  for (unsigned int d = 0, rest = part; d < dim; ++d, rest /= n) {
    const double length = box.upper[d] - box.lower[d];
    result.lower[d] = box.lower[d] + length * (rest % n) / n;
    result.upper[d] = box.lower[d] + length * (rest % n + 1) / n;
  }
  return result;
}

/// A plane piece of a shape's surface.
template <int dim>
struct Piece
{
  dealii::Point<dim> position;
  dealii::Tensor<1, dim> area;
};

/// The pieces of a shape's surface in a box and on those of its faces beyond which there is nothing of the
/// shape. Where the surface has an edge or a corner in the box, its parts are taken one by one.
template <int dim>
class PieceCollector
{
public:
  PieceCollector(const Shape<dim> &shape, const Grid<dim> &grid) : shape(shape), grid(grid) {}

  std::vector<Piece<dim>> collect(const Bounds<dim> &box, const unsigned int depth = 0) const
  {
    const CutBox<dim> part = cut(shape, box.lower, box.upper);
    if (part.volume == 0.)
      return {};
    std::vector<Piece<dim>> pieces = on_faces(box, part);
    const double smallest = 1e-9 * std::pow(box.upper[0] - box.lower[0], dim - 1);
    if (part.interface.norm() <= smallest)
      return pieces;

    if (add_faces_along_axes(box, part, pieces))
      return pieces;
    constexpr unsigned int deepest = 3, n_parts = 1 << dim;
    if (depth < deepest) {
      std::vector<Piece<dim>> finer;
      double area = 0., coarse_area = part.interface.norm();
      for (const auto &piece : pieces)
        coarse_area += piece.area.norm();
      for (unsigned int i = 0; i < n_parts; ++i)
        for (const auto &piece : collect(part_of_box(box, 2, i), depth + 1)) {
          finer.push_back(piece);
          area += piece.area.norm();
        }
      // A curved surface gains a little area by being resolved, an edge much more.
      if (area > 1.02 * coarse_area)
        return finer;
    }
    pieces.push_back({part.interface_centroid, part.interface});
    return pieces;
  }

  /// If the shape fills the box and none of its neighbours in part only: Gauss points on its faces beyond
  /// which there is nothing of the shape.
  bool add_whole_faces(const Bounds<dim> &box, const unsigned int n,
                       std::vector<typename Tracers<dim>::Tracer> &list) const
  {
    const auto fill = [&](const Bounds<dim> &bounds) {
      double volume = 1.;
      for (unsigned int d = 0; d < dim; ++d)
        volume *= bounds.upper[d] - bounds.lower[d];
      return cut(shape, bounds.lower, bounds.upper).volume / volume;
    };
    if (fill(box) < 1. - 1e-10)
      return false;
    std::vector<unsigned int> faces;
    for (unsigned int face = 0; face < 2 * dim; ++face) {
      const Bounds<dim> beyond = neighbour_box(box, face);
      if (!grid.contains(beyond.center()))
        continue;
      const double filled = fill(beyond);
      if (filled > 0. && filled < 1. - 1e-10)
        return false;
      if (filled == 0.)
        faces.push_back(face);
    }
    const dealii::QGauss<dim - 1> rule(n);
    for (const unsigned int face : faces)
      for (unsigned int q = 0; q < rule.size(); ++q) {
        const unsigned int axis = face / 2;
        typename Tracers<dim>::Tracer tracer{std::uint32_t(list.size()), {}, {}, {}};
        double area = rule.weight(q);
        for (unsigned int d = 0, tangent = 0; d < dim; ++d) {
          const double h = box.upper[d] - box.lower[d];
          if (d == axis) {
            tracer.position[d] = face % 2 ? box.upper[d] : box.lower[d];
            continue;
          }
          tracer.position[d] = box.lower[d] + rule.point(q)[tangent++] * h;
          area *= h;
        }
        tracer.initial_position = tracer.position;
        tracer.area[axis] = face % 2 ? area : -area;
        list.push_back(tracer);
      }
    return true;
  }

private:
  /// If what is left of the box is a box itself: its faces inside the box, exactly.
  static bool add_faces_along_axes(const Bounds<dim> &box, const CutBox<dim> &part,
                                   std::vector<Piece<dim>> &pieces)
  {
    dealii::Tensor<1, dim> length;
    double volume = 1.;
    for (unsigned int d = 0; d < dim; ++d) {
      length[d] = 2. * (part.interface[d] > 0.   ? part.centroid[d] - box.lower[d]
                        : part.interface[d] < 0. ? box.upper[d] - part.centroid[d]
                                                 : 0.5 * (box.upper[d] - box.lower[d]));
      volume *= length[d];
    }
    if (std::abs(volume - part.volume) > 1e-10 * part.volume)
      return false;
    for (unsigned int d = 0; d < dim; ++d)
      if (part.interface[d] != 0.) {
        Piece<dim> piece{part.centroid, {}};
        piece.position[d] = part.interface[d] > 0. ? box.lower[d] + length[d] : box.upper[d] - length[d];
        piece.area[d] = std::copysign(volume / length[d], part.interface[d]);
        pieces.push_back(piece);
      }
    return true;
  }

  std::vector<Piece<dim>> on_faces(const Bounds<dim> &box, const CutBox<dim> &part) const
  {
    std::vector<Piece<dim>> pieces;
    const double smallest = 1e-9 * std::pow(box.upper[0] - box.lower[0], dim - 1);
    for (unsigned int face = 0; face < 2 * dim; ++face) {
      const Bounds<dim> beyond = neighbour_box(box, face);
      if (part.face_area[face] <= smallest || !grid.contains(beyond.center()) ||
          cut(shape, beyond.lower, beyond.upper).volume > 0.)
        continue;
      Piece<dim> piece{part.centroid, {}};
      piece.position[face / 2] = face % 2 ? box.upper[face / 2] : box.lower[face / 2];
      piece.area[face / 2] = (face % 2 ? 1. : -1.) * part.face_area[face];
      pieces.push_back(piece);
    }
    return pieces;
  }

  const Shape<dim> &shape;
  const Grid<dim> &grid;
};
} // namespace

template <int dim>
void Tracers<dim>::cover(const Shape<dim> &shape, const unsigned int pieces_per_direction,
                         const unsigned int gauss_points)
{
  const unsigned int n = pieces_per_direction;
  const unsigned int n_boxes = dim == 2 ? n * n : n * n * n;
  const PieceCollector<dim> collector(shape, grid);
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
    if (gauss_points > 0 && collector.add_whole_faces(cell_box, gauss_points, list))
      continue;
    for (unsigned int b = 0; b < n_boxes; ++b)
      for (const Piece<dim> &piece : collector.collect(part_of_box(cell_box, n, b)))
        list.push_back({std::uint32_t(list.size()), piece.position, piece.position, piece.area});
  }
}

template <int dim>
void Tracers<dim>::find_adjoining(const std::function<bool(const dealii::Point<dim> &)> &is_in_other_body)
{
  for (Tracer &tracer : list)
    tracer.adjoins = is_in_other_body(tracer.initial_position +
                                      1e-4 * grid.smallest_cell_size() / tracer.area.norm() * tracer.area);
}

template <int dim>
CellId Tracers<dim>::carrier(const Tracer &tracer, const ActiveNodes<dim> &nodes) const
{
  const CellId own = own_cell(tracer);
  if (own != no_index && nodes.is_occupied(own))
    return own;
  const auto lattice = home<dim>(tracer, grid);
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
void Tracers<dim>::set_weights(const CellId cell, const bool beyond_cell, const ActiveNodes<dim> &nodes,
                               SurfacePoint<dim> &point) const
{
  const unsigned int reach = nodes.nodes_per_direction();
  const auto base = grid.lattice(cell);
  std::array<int, dim> first;
  point.N.fill(1.);
  for (unsigned int d = 0; d < dim; ++d) {
    const auto &planes = grid.planes(d);
    int i = base[d];
    if (beyond_cell && point.position[d] > planes[i + 1] && i + 1 < grid.n_cells(d))
      ++i;
    else if (beyond_cell && point.position[d] < planes[i] && i > 0)
      --i;
    first[d] = i - base[d] + (reach == 4 ? 1 : 0);
    const double xi =
        std::min(1., std::max(0., (point.position[d] - planes[i]) / (planes[i + 1] - planes[i])));
    for (unsigned int v = 0; v < point.n_nodes; ++v)
      point.N[v] *= (v >> d) & 1 ? xi : 1. - xi;
  }
  for (unsigned int v = 0; v < point.n_nodes; ++v) {
    unsigned int local = 0;
    for (int d = dim - 1; d >= 0; --d)
      local = local * reach + first[d] + ((v >> d) & 1);
    point.node[v] = nodes.cell_nodes(cell)[local];
  }
}

template <int dim>
void Tracers<dim>::settle(const Body<dim> &body, const ActiveNodes<dim> &nodes)
{
  const Layout &layout = body.layout();
  const auto &slices = body.slices();
  for (Tracer &tracer : list) {
    unsigned int axis = 0;
    for (unsigned int d = 1; d < dim; ++d)
      if (std::abs(tracer.area[d]) > std::abs(tracer.area[axis]))
        axis = d;
    const double area = tracer.area.norm(), side = tracer.area[axis] > 0. ? 1. : -1.;
    const CellId cell = carrier(tracer, nodes);
    if (cell == no_index || std::abs(tracer.area[axis]) < 0.999 * area)
      continue;
    const auto slice = std::lower_bound(slices.begin(), slices.end(), cell,
                                        [](const Slice &a, const CellId c) { return a.cell < c; });
    if (slice == slices.end() || slice->cell != cell)
      continue;

    // The points below the piece: those nearest to it along the surface.
    const auto distance = [&](const std::uint32_t handle) {
      double largest = 0.;
      for (unsigned int d = 0; d < dim; ++d)
        if (d != axis)
          largest =
              std::max(largest, std::abs(body.position(handle)[d] - tracer.position[d]) / grid.size(cell, d));
      return largest;
    };
    double nearest = std::numeric_limits<double>::max();
    for (std::uint32_t i = slice->begin; i < slice->end; ++i)
      nearest = std::min(nearest, distance(body.handles()[i]));
    double edge = -std::numeric_limits<double>::max(), volume = 0.;
    for (std::uint32_t i = slice->begin; i < slice->end; ++i) {
      const std::uint32_t handle = body.handles()[i];
      if (distance(handle) > nearest + 0.05)
        continue;
      const double *row = body.row(handle);
      volume += row[layout.volume];
      if (layout.wide_domains)
        edge = std::max(edge, side * body.position(handle)[axis] + row[layout.extent + axis]);
    }
    if (layout.wide_domains)
      tracer.position[axis] = side * edge;
    else {
      const double depth = std::min(grid.size(cell, axis), volume / area);
      tracer.position[axis] = grid.lower(cell, axis) + (side > 0. ? depth : grid.size(cell, axis) - depth);
    }
  }
}

template <int dim>
void Tracers<dim>::locate(const ActiveNodes<dim> &nodes, const std::vector<std::size_t> &bodies)
{
  const auto is_meant = [&](const Tracer &tracer) {
    return bodies.empty() ||
           std::find(bodies.begin(), bodies.end(), std::size_t(std::max(0, tracer.body))) != bodies.end();
  };
  carried.resize(list.size());
  carrier_cell.resize(list.size());
  for (std::size_t t = 0; t < list.size(); ++t) {
    SurfacePoint<dim> &point = carried[t];
    point.initial_position = list[t].initial_position;
    point.position = list[t].position;
    point.area = list[t].area;
    point.adjoins = list[t].adjoins;
    const CellId cell = carrier_cell[t] = is_meant(list[t]) ? carrier(list[t], nodes) : no_index;
    if (cell == no_index) {
      point.node.fill(0);
      point.N.fill(0.);
      continue;
    }
    set_weights(cell, nodes.nodes_per_direction() == 4, nodes, point);
  }
}

template <int dim>
void Tracers<dim>::move(const std::vector<double> &velocity, const double dt, const bool stretch,
                        const ActiveNodes<dim> &nodes)
{
  for (std::size_t t = 0; t < list.size(); ++t) {
    const CellId cell = carrier_cell[t];
    if (cell == no_index)
      continue;
    // With the nodes of the carrying cell alone: those beyond may carry next to nothing.
    SurfacePoint<dim> point = carried[t];
    set_weights(cell, false, nodes, point);
    dealii::Tensor<2, dim> gradient;
    for (unsigned int i = 0; i < point.n_nodes; ++i) {
      const double *v = &velocity[std::size_t(point.node[i]) * dim];
      for (unsigned int d = 0; d < dim; ++d)
        list[t].position[d] += dt * point.N[i] * v[d];
      for (unsigned int e = 0; stretch && e < dim; ++e) {
        double slope = ((i >> e) & 1 ? 1. : -1.) / grid.size(cell, e);
        for (unsigned int d = 0; d < dim; ++d)
          if (d != e) {
            const double xi =
                std::min(1., std::max(0., (point.position[d] - grid.lower(cell, d)) / grid.size(cell, d)));
            slope *= (i >> d) & 1 ? xi : 1. - xi;
          }
        for (unsigned int d = 0; d < dim; ++d)
          gradient[d][e] += slope * v[d];
      }
    }
    // da_t = (div v I - (grad v)^T) da
    if (stretch)
      list[t].area += dt * (dealii::trace(gradient) * point.area - dealii::transpose(gradient) * point.area);
  }
}

template <int dim>
void Tracers<dim>::place(
    const std::function<dealii::Tensor<1, dim>(const dealii::Point<dim> &)> &displacement)
{
  for (Tracer &tracer : list)
    tracer.position = tracer.initial_position + displacement(tracer.initial_position);
}

template <int dim>
void Tracers<dim>::restart()
{
  for (Tracer &tracer : list)
    tracer.initial_position = tracer.position;
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
  constexpr unsigned int n_values = 3 + 3 * dim;
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
    values.push_back(tracer.adjoins);
    values.push_back(tracer.body);
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
      tracer.adjoins = values[i + 1 + 3 * dim] != 0.;
      tracer.body = values[i + 2 + 3 * dim];
      staying.push_back(tracer);
    }
  list.swap(staying);
}

template class Tracers<2>;
template class Tracers<3>;
} // namespace peat
