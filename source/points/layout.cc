#include <peat/points/layout.h>

#include <deal.II/base/exceptions.h>

namespace peat {
Layout::Layout(const unsigned int dim, const Material &material, const SchemeFields &scheme)
{
  mass = add("mass", "kg", 1, Kind::scalar);
  volume = add("volume", dim == 2 ? "m^2" : "m^3", 1, Kind::scalar);
  velocity = add("velocity", "m/s", dim, Kind::vector);
  if (scheme.velocity_gradient)
    velocity_gradient = add("velocity gradient", "1/s", dim * dim, Kind::other);
  displacement = add("displacement", "m", dim, Kind::vector);
  stress = add("effective stress", "Pa", dim == 2 ? 4 : 6, Kind::stress);
  if (material.mixture()) {
    pressure = add("pressure", "Pa", 1, Kind::scalar);
    if (scheme.pressure_rate)
      pressure_rate = add("pressure rate", "Pa/s", 1, Kind::scalar);
    if (material.law().finite_strain())
      porosity = add("porosity", "", 1, Kind::scalar);
  }
  for (const StateField &field : material.law().state()) {
    const int column = add(field.name, field.unit, field.initial.size(), Kind::other);
    state = state < 0 ? column : state;
    n_state += field.initial.size();
  }
  Assert(n_state <= max_state_columns, dealii::ExcMessage("raise max_state_columns"));
  if (scheme.extent || scheme.surface_depth)
    extent = add("half extent", "m", dim, Kind::vector);
  wide_domains = scheme.extent;
  if (scheme.surface_depth)
    surface_depth = add("surface depth", "", 1, Kind::scalar);
}

int Layout::add(const std::string &name, const std::string &unit, const unsigned int n_components,
                const Kind kind)
{
  const int first = n_columns;
  fields.push_back({name, unit, first, n_components, n_components == 1 ? Kind::scalar : kind});
  n_columns += n_components;
  return first;
}

const Layout::Field *Layout::find(const std::string &name) const
{
  for (const Field &field : fields)
    if (field.name == name)
      return &field;
  return nullptr;
}
} // namespace peat
