#include <peat/material/material.h>

namespace peat {
Material::Material(Section section) : given_name(section.name())
{
  skeleton =
      choose<Law>(section, "Law", "linear elastic", "Constitutive law of the material, or of its skeleton.");

  const bool saturated = section.has("Porosity");
  if (saturated || section.describing())
    pores = std::make_unique<Mixture>(section);
  if (saturated && section.has("Density"))
    section.fail("Density", "'" + given_name +
                                "' has a 'Porosity', so its density follows from 'Grain density' and "
                                "'Fluid density'; 'Density' belongs to dry materials");
  if (!saturated) {
    section.add("Density", dry_density, positive("kg/m^3"),
                "Density at the start of a dry material, one without 'Porosity'.");
    for (const std::string &entry : Mixture::entries())
      if (section.has(entry))
        section.fail(entry,
                     "belongs to saturated materials; set 'Porosity' to make '" + given_name + "' one");
  }
}

namespace {
std::vector<Lanes> initial_state(const Law &law)
{
  std::vector<Lanes> state;
  for (const StateField &field : law.state())
    for (const double value : field.initial)
      state.push_back(broadcast(value));
  return state;
}
} // namespace

double Material::initial_modulus() const
{
  return skeleton->wave_modulus({}, initial_state(*skeleton).data())[0];
}

void Material::initial_tangent(std::array<Lanes, 36> &tangent) const
{
  skeleton->tangent({}, initial_state(*skeleton).data(), tangent);
}
} // namespace peat
