#pragma once

#include <peat/base/archive.h>
#include <peat/grid/active_nodes.h>
#include <peat/grid/grid.h>
#include <peat/grid/shape.h>
#include <peat/material/material.h>
#include <peat/points/layout.h>

#include <deal.II/particles/particle_handler.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace peat {
/// One subsection of `Bodies`.
template <int dim>
struct BodyParameters
{
  BodyParameters(Section section, const std::vector<std::string> &material_names);

  Section section;
  std::string name;
  std::string material;
  std::shared_ptr<const Shape<dim>> shape;
  unsigned int points_per_direction = 2;
  bool lattice_of_body = false; ///< see `Point lattice`
  Function initial_velocity;
  double fall_height = 0.; ///< [m]
  /// Velocity that a fall from there gives, to be set by who knows gravity; added to the initial velocity.
  dealii::Tensor<1, dim> fall_velocity;
  std::string from_stage; ///< "": from the start
  Function initial_stress;
  Function initial_pressure;
};

/// Points of one cell: `handles[begin ... end)` in the order of Body::handles().
struct Slice
{
  CellId cell;
  std::uint32_t begin;
  std::uint32_t end;
};

/// A body of one material: its points in a deal.II particle handler, and which points lie in which cell.
///
/// The particle handler stores positions and rows of properties in flat arrays, which kernels address by
/// handle. Which cell a point is in is kept here, so that a point which crosses a face costs a few
/// nanoseconds; the handler's own, dear sort runs when points leave for another rank and before output, see
/// synchronise().
template <int dim>
class Body
{
public:
  Body(const BodyParameters<dim> &parameters, const Material &material, const Grid<dim> &grid,
       const SchemeFields &scheme);

  const std::string &name() const { return parameters.name; }
  const Material &material() const { return body_material; }
  const Layout &layout() const { return columns; }
  const dealii::Particles::ParticleHandler<dim> &handler() const { return particles; }
  const std::shared_ptr<const Shape<dim>> &shape() const { return initial_shape; }

  unsigned int n_local_points() const { return cell_of_point.size(); }
  dealii::types::particle_index n_global_points() const { return particles.n_global_particles(); }

  /// Row of properties and coordinates of a point.
  double *row(const std::uint32_t handle) { return first_row + std::size_t(handle) * columns.n_columns; }
  const double *row(const std::uint32_t handle) const
  {
    return first_row + std::size_t(handle) * columns.n_columns;
  }
  dealii::Point<dim> &position(const std::uint32_t handle) { return first_position[handle]; }
  const dealii::Point<dim> &position(const std::uint32_t handle) const { return first_position[handle]; }
  dealii::types::particle_index id(const std::uint32_t handle) const;

  const std::vector<Slice> &slices() const { return cell_slices; }
  const std::vector<std::uint32_t> &handles() const { return handles_by_cell; }
  CellId cell(const std::uint32_t handle) const { return cell_of_point[handle]; }

  /// Kernels note here the points that have left their cell; relocate() finds their new ones.
  std::vector<std::uint32_t> &movers() { return moved_points; }

  /// Note all points that are outside their cell.
  void note_movers();

  struct Relocation
  {
    bool cells_changed = false; ///< cells_changed() after it
    bool leaves_rank =
        false; ///< a point has entered a cell of another rank: synchronise() before the next step
  };
  /// Assign the noted points to their new cells. Throws NumericalError for a point that left the mesh or
  /// moved further than one cell.
  Relocation relocate(double time);

  /// Whether a cell of this rank has got its first point or lost its last one since the cells were accepted.
  bool cells_changed() const;
  void accept_cells();

  /// Bring the particle handler up to date: points move to the rank that owns their cell, storage is in cell
  /// order again. Collective. Throws NumericalError if a point gets lost.
  void synchronise(double time);

  /// Take all points out, until enter() puts them where they were at the start. Collective.
  void withdraw();
  void enter();

  /// All points, in the order in which they are stored. Collective.
  void persist(Archive &archive);

  /// Check that the global number of points is what it was at the start.
  dealii::types::particle_index n_points_at_start() const { return initial_number; }

private:
  void seed();
  /// Make the points' ids, which so far count from 0 on each rank, unique over the ranks.
  void number_points(std::uint32_t n_local);
  void rebuild_slices();
  void attach_storage();

  const BodyParameters<dim> parameters;
  const unsigned int gauss_points; ///< see SchemeFields
  const Material &body_material;
  const Grid<dim> &grid;
  const Layout columns;
  const std::shared_ptr<const Shape<dim>> initial_shape;
  dealii::Particles::ParticleHandler<dim> particles;
  dealii::types::particle_index initial_number = 0;

  double *first_row = nullptr;
  dealii::Point<dim> *first_position = nullptr;
  std::vector<CellId> cell_of_point;
  std::vector<Slice> cell_slices;
  std::vector<CellId> accepted_cells;
  std::vector<std::uint32_t> handles_by_cell;
  std::vector<std::uint32_t> count_in_cell;
  std::vector<std::uint32_t> moved_points;
};
} // namespace peat
