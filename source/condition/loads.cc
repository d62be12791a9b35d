#include <peat/condition/condition.h>

// Conditions on tractions and on the pore fluid. The pressure is prescribed naturally, through the closed
// integral of pbar N n in Darcy's law; a flux is prescribed on the nodal flux itself.

namespace peat {
namespace {
template <int dim>
void coordinates(const dealii::Point<dim> &x, double (&result)[3])
{
  for (unsigned int d = 0; d < 3; ++d)
    result[d] = d < dim ? x[d] : 0.;
}

template <int dim>
class Traction : public Condition<dim>
{
public:
  Traction(Section section, const Place<dim> &place)
      : Condition<dim>(section, place), value(dim == 2 ? "0, 0" : "0, 0, 0", {}, {})
  {
    section.add("Value", value, dim, "Pa", "Force per present area, as a vector.");
    section.require_start("Value", value);
    if (place.on_mesh() && !section.describing())
      section.fail("Where", "a traction acts on the surface of a body: 'surface of BODY' or 'top of BODY'");
  }

  void add_loads(const ActiveNodes<dim> &, const Surface<dim> &surface,
                 NodalFields<dim> &fields) const override
  {
    double uniform[dim], x[3];
    coordinates(dealii::Point<dim>(), x);
    if (value.is_uniform())
      for (unsigned int d = 0; d < dim; ++d)
        uniform[d] = value.value(x, fields.time, d);
    for (const SurfacePoint<dim> &point : surface) {
      if (!this->place.contains(point))
        continue;
      const double area = point.area.norm();
      coordinates(point.position, x);
      for (unsigned int d = 0; d < dim; ++d) {
        const double force = area * (value.is_uniform() ? uniform[d] : value.value(x, fields.time, d));
        for (unsigned int i = 0; i < point.n_nodes; ++i)
          fields.force[std::size_t(point.node[i]) * dim + d] += force * point.N[i];
      }
    }
  }

  dealii::Tensor<1, dim> force(const SurfacePoint<dim> &point, const double t) const override
  {
    dealii::Tensor<1, dim> result;
    if (!this->place.contains(point))
      return result;
    double x[3];
    coordinates(point.position, x);
    for (unsigned int d = 0; d < dim; ++d)
      result[d] = point.area.norm() * value.value(x, t, d);
    return result;
  }

private:
  Function value;
};
const ConditionMember<Traction> traction("traction", "a given force per area on a body's surface.");

template <int dim>
class Pressure : public Condition<dim>
{
public:
  Pressure(Section section, const Place<dim> &place) : Condition<dim>(section, place), value("0", {}, {})
  {
    section.add("Value", value, 1, "Pa", "The pore pressure.");
    section.require_start("Value", value);
    if (place.on_mesh() && place.boundaries.empty() && !section.describing())
      section.fail("Where", "a pressure acts on faces of the mesh or on the surface of a body");
    if (!place.boundaries.empty() && place.region)
      section.fail(
          "Region",
          "a pressure acts on whole faces of the mesh; 'Region' can restrict it on a body's surface");
  }
  bool concerns_fluid() const override { return true; }
  typename Condition<dim>::Fluid fluid() const override { return Condition<dim>::Fluid::pressure; }
  double fluid_value(const double *x, const double t) const override { return value.value(x, t); }
  std::vector<unsigned int> opened_boundaries() const override { return this->place.boundaries; }

  void add_loads(const ActiveNodes<dim> &nodes, const Surface<dim> &surface,
                 NodalFields<dim> &fields) const override
  {
    double x[3];
    coordinates(dealii::Point<dim>(), x);
    if (value.is_uniform() && value.value(x, fields.time) == 0.)
      return;
    for (const SurfacePoint<dim> &point : surface) {
      if (!this->place.contains(point))
        continue;
      coordinates(point.position, x);
      const double p = value.value(x, fields.time);
      for (unsigned int i = 0; i < point.n_nodes; ++i)
        for (unsigned int d = 0; d < dim; ++d)
          fields.pressure_load[std::size_t(point.node[i]) * dim + d] -= p * point.area[d] * point.N[i];
    }
    add_mesh_faces(nodes, fields);
  }

private:
  /// Faces of the mesh belong to the cells that hold points; each node of such a face has an equal share of
  /// it.
  void add_mesh_faces(const ActiveNodes<dim> &nodes, NodalFields<dim> &fields) const
  {
    const Grid<dim> &grid = nodes.grid();
    const unsigned int reach = nodes.nodes_per_direction();
    for (const unsigned int boundary : this->place.boundaries) {
      const unsigned int axis = boundary / 2;
      const bool at_upper_end = boundary % 2;
      for (const CellId cell : nodes.occupied_cells()) {
        if (grid.lattice(cell)[axis] != (at_upper_end ? grid.n_cells(axis) - 1 : 0))
          continue;
        const double share = grid.volume(cell) / grid.size(cell, axis) / (1 << (dim - 1));
        for (unsigned int v = 0; v < (1u << dim); ++v) {
          if (((v >> axis) & 1) != at_upper_end)
            continue;
          unsigned int local = 0;
          for (int d = dim - 1; d >= 0; --d)
            local = local * reach + ((v >> d) & 1) + (reach == 4 ? 1 : 0);
          const std::uint32_t i = nodes.cell_nodes(cell)[local];
          double x[3];
          coordinates(nodes.position(i), x);
          fields.pressure_load[std::size_t(i) * dim + axis] -=
              value.value(x, fields.time) * share * (at_upper_end ? 1. : -1.);
        }
      }
    }
  }
  Function value;
};
const ConditionMember<Pressure> pressure("pressure", "a given pore pressure; fluid may pass.");

/// Free water: what stands above a surface presses on it and fixes the pore pressure there.
template <int dim>
class WaterTable : public Condition<dim>
{
public:
  WaterTable(Section section, const Place<dim> &place) : Condition<dim>(section, place), level("0", {}, {})
  {
    section.add("Level", level, 1, "m",
                "Height of the water table (the last coordinate), above or below the surface.");
    section.add("Unit weight", unit_weight, positive("N/m^3"), "Of the water: rho_f g.");
    section.add(
        "Suction", suction,
        "Pressures above the water table are negative as if the water stood there at rest; otherwise zero.");
    section.require("Level", "condition '" + section.name() + "'");
    section.require_start("Level", level);
    if (place.on_mesh() && !section.describing())
      section.fail("Where",
                   "a water table acts on the surface of a body: 'surface of BODY' or 'top of BODY'");
  }
  bool concerns_fluid() const override { return true; }
  typename Condition<dim>::Fluid fluid() const override { return Condition<dim>::Fluid::pressure; }
  double fluid_value(const double *x, const double t) const override
  {
    const double p = unit_weight * (level.value(x, t) - x[dim - 1]);
    return suction ? p : std::max(0., p);
  }
  dealii::Tensor<1, dim> force(const SurfacePoint<dim> &point, const double t) const override
  {
    double x[3];
    coordinates(point.position, x);
    return this->place.contains(point) ? -std::max(0., fluid_value(x, t)) * point.area
                                       : dealii::Tensor<1, dim>();
  }

  void add_loads(const ActiveNodes<dim> &, const Surface<dim> &surface,
                 NodalFields<dim> &fields) const override
  {
    double x[3];
    for (const SurfacePoint<dim> &point : surface) {
      if (!this->place.contains(point))
        continue;
      coordinates(point.position, x);
      const double p = fluid_value(x, fields.time);
      const auto weight = force(point, fields.time);
      for (unsigned int i = 0; i < point.n_nodes; ++i)
        for (unsigned int d = 0; d < dim; ++d) {
          const std::size_t row = std::size_t(point.node[i]) * dim + d;
          fields.pressure_load[row] -= p * point.area[d] * point.N[i];
          fields.force[row] += weight[d] * point.N[i];
        }
    }
  }

private:
  Function level;
  double unit_weight = 9810.;
  bool suction = true;
};
const ConditionMember<WaterTable>
    water_table("water table",
                "water at rest up to a level: its pressure on a body's surface, as a load and in the pores.");

template <int dim>
class Flux : public Condition<dim>
{
public:
  Flux(Section section, const Place<dim> &place) : Condition<dim>(section, place), value("0", {}, {})
  {
    section.add("Value", value, 1, "m/s",
                "Flux of pore fluid out through the face, relative to the skeleton.");
    section.require_start("Value", value);
    if (place.boundaries.empty() && !section.describing())
      section.fail("Where", "a flux acts on faces of the mesh");
  }
  bool concerns_fluid() const override { return true; }
  typename Condition<dim>::Fluid fluid() const override { return Condition<dim>::Fluid::flux; }
  double fluid_value(const double *x, const double t) const override { return value.value(x, t); }

  void constrain_flux(const ActiveNodes<dim> &nodes, const Surface<dim> &,
                      NodalFields<dim> &fields) const override
  {
    double x[3];
    for (const auto &selection : this->selections)
      for (const std::uint32_t i : selection.nodes) {
        coordinates(nodes.position(i), x);
        fields.flux[std::size_t(i) * dim + selection.boundary / 2] =
            value.value(x, fields.time) * (selection.boundary % 2 ? 1. : -1.);
      }
  }

private:
  Function value;
};
const ConditionMember<Flux> flux("flux", "a given flux of pore fluid through a face of the mesh.");

template <int dim>
class Impermeable : public Condition<dim>
{
public:
  Impermeable(const Section &section, const Place<dim> &place) : Condition<dim>(section, place)
  {
    if (place.on_mesh() && place.boundaries.empty() && !section.describing())
      section.fail("Where", "'impermeable' acts on faces of the mesh or on the surface of a body");
  }
  bool concerns_fluid() const override { return true; }
  typename Condition<dim>::Fluid fluid() const override { return Condition<dim>::Fluid::impermeable; }

  void constrain_flux(const ActiveNodes<dim> &, const Surface<dim> &surface,
                      NodalFields<dim> &fields) const override
  {
    for (const auto &selection : this->selections)
      for (const std::uint32_t i : selection.nodes)
        fields.flux[std::size_t(i) * dim + selection.boundary / 2] = 0.;
    // On a body's surface: the nodes nearest to it carry no flux along its normal.
    for (const SurfacePoint<dim> &point : surface) {
      if (!this->place.contains(point))
        continue;
      const dealii::Tensor<1, dim> normal = point.area / point.area.norm();
      for (unsigned int i = 0; i < point.n_nodes; ++i) {
        if (point.N[i] < 0.25 / (1 << (dim - 1)))
          continue;
        double *w = &fields.flux[std::size_t(point.node[i]) * dim];
        double outward = 0.;
        for (unsigned int d = 0; d < dim; ++d)
          outward += w[d] * normal[d];
        for (unsigned int d = 0; d < dim; ++d)
          w[d] -= outward * normal[d];
      }
    }
  }
};
const ConditionMember<Impermeable> impermeable("impermeable",
                                               "no fluid passes; the default on faces of the mesh.");
} // namespace
} // namespace peat
