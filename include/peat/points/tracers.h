#pragma once

#include <peat/base/archive.h>
#include <peat/grid/active_nodes.h>
#include <peat/grid/shape.h>
#include <peat/grid/surface.h>
#include <peat/points/body.h>

#include <functional>
#include <vector>

namespace peat {
/// Massless points that move with the material: pieces of a body's surface, on which tractions act, and
/// probes. Each is handled by one rank.
template <int dim>
class Tracers
{
public:
  struct Tracer
  {
    std::uint32_t id;
    dealii::Point<dim> initial_position;
    dealii::Point<dim> position;
    dealii::Tensor<1, dim> area; ///< outward normal times area; zero for a probe
    bool adjoins = false;        ///< see SurfacePoint
    int body = -1;               ///< of a probe: the body it started in; -1: none
  };

  explicit Tracers(const Grid<dim> &grid) : grid(grid) {}

  /// Put a tracer here if this rank owns the cell it lies in. All ranks call it for all tracers.
  void add(std::uint32_t id, const dealii::Point<dim> &position, const dealii::Tensor<1, dim> &area,
           int body = -1);
  /// Put tracers on the surface of a shape where this rank's cells are, with the given number of pieces per
  /// cell and direction. Faces that lie on the edge of the mesh are left out.
  /// With `gauss_points` > 0: so many Gauss points per direction on whole faces of cells.
  void cover(const Shape<dim> &shape, unsigned int pieces_per_direction, unsigned int gauss_points = 0);

  /// Mark the pieces behind which another body lies.
  void find_adjoining(const std::function<bool(const dealii::Point<dim> &)> &is_in_other_body);

  /// Put pieces of surface that are normal to an axis where the body's points see its surface: at the edge of
  /// the points' domains (GIMP), or as high in their cell as the volume of the points below fills it (Q1). A
  /// uniform traction is then in balance with the same stress in every cell, also where material has just
  /// entered a cell.
  void settle(const Body<dim> &body, const ActiveNodes<dim> &nodes);

  /// Find for each tracer the nodes that carry it. A tracer whose own cell holds no material (the surface has
  /// risen a little above the grid line) is carried by the cell below it.
  /// With a list, tracers of other bodies are not carried; those of no body go with body 0.
  void locate(const ActiveNodes<dim> &nodes, const std::vector<std::size_t> &bodies = {});
  /// As located.
  const Surface<dim> &surface() const { return carried; }
  const std::vector<Tracer> &tracers() const { return list; }

  /// Move with the nodal velocity for dt; with `stretch`, areas follow the motion too.
  void move(const std::vector<double> &velocity, double dt, bool stretch, const ActiveNodes<dim> &nodes);

  /// Put each tracer where it was at the start, moved by the displacement of that place.
  void place(const std::function<dealii::Tensor<1, dim>(const dealii::Point<dim> &)> &displacement);
  /// From now on they count as having started where they are.
  void restart();

  /// Whether a tracer of this rank has gone where another rank must carry it.
  bool leaves_rank() const;
  /// Hand such tracers over. Collective.
  void migrate();

  void persist(Archive &archive)
  {
    archive.begin("tracers");
    archive(list);
  }

private:
  /// Shape functions at the position; if not `beyond_cell`, at the point of this cell that is nearest to it.
  void set_weights(CellId cell, bool beyond_cell, const ActiveNodes<dim> &nodes,
                   SurfacePoint<dim> &point) const;
  CellId own_cell(const Tracer &tracer) const;
  CellId carrier(const Tracer &tracer, const ActiveNodes<dim> &nodes) const;

  const Grid<dim> &grid;
  std::vector<Tracer> list;
  Surface<dim> carried;
  std::vector<CellId> carrier_cell;
};
} // namespace peat
