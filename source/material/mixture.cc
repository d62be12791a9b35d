#include <peat/material/mixture.h>

namespace peat {
namespace {
class ConstantConductivity : public Conductivity
{
public:
  explicit ConstantConductivity(const Section &) {}
  Lanes shape(const Lanes) const override { return broadcast(1.); }
  bool is_constant() const override { return true; }
};

/// n^3/(1 - n)^2 (Kozeny 1927, Carman 1937)
class KozenyCarman : public Conductivity
{
public:
  explicit KozenyCarman(const Section &) {}
  Lanes shape(const Lanes n) const override { return n * n * n / ((1. - n) * (1. - n)); }
  bool is_constant() const override { return false; }
};

const Member<Conductivity, ConstantConductivity> constant("constant", "Does not follow the porosity.");
const Member<Conductivity, KozenyCarman> kozeny_carman("kozeny-carman", "Follows n^3/(1-n)^2.");
} // namespace

const std::vector<std::string> &Mixture::entries()
{
  static const std::vector<std::string> names = {
      "Grain density",          "Fluid density",      "Fluid bulk modulus",
      "Grain bulk modulus",     "Biot coefficient",   "Conductivity law",
      "Hydraulic conductivity", "Reference porosity", "Reference gravity"};
  return names;
}

Mixture::Mixture(Section section)
{
  section.add("Porosity", n, strictly_between(0., 1.),
              "Volume of the pores per volume at the start. A material with this entry is saturated.");
  section.add("Grain density", rho_s, positive("kg/m^3"), "Density of the grains.");
  section.add("Fluid density", rho_f, positive("kg/m^3"), "Density of the fluid in the pores.");
  section.add("Fluid bulk modulus", K_f, positive("Pa"), "Bulk modulus of the fluid in the pores.");
  double K_s = 0.;
  section.add("Grain bulk modulus", K_s, nonnegative("Pa"),
              "Bulk modulus of the grains; 0 stands for incompressible grains.");
  if (K_s > 0.)
    grain_compressibility = 1. / K_s;
  section.add(
      "Biot coefficient", alpha, {"", 0., 1., false, true},
      "Biot's alpha, the share of the pore pressure in the total stress; not less than the porosity.");
  if (alpha < n)
    section.fail("Biot coefficient", "cannot be less than 'Porosity'");

  double k = 1e-5, n_reference = n, g = 9.81;
  section.add("Hydraulic conductivity", k, positive("m/s"),
              "Hydraulic conductivity k at 'Reference porosity'.");
  section.add("Reference porosity", n_reference, strictly_between(0., 1.),
              "Porosity at which the conductivity is 'Hydraulic conductivity'; 'Porosity' if not set.");
  section.add("Reference gravity", g, positive("m/s^2"),
              "Gravity in the unit weight of the fluid that turns the conductivity k [m/s] into the mobility "
              "k/(rho_f g); does not load anything.");
  law = choose<Conductivity>(section, "Conductivity law", "constant",
                             "How the conductivity follows the porosity.");
  k_factor = k / law->shape(broadcast(n_reference))[0];
  unit_weight = rho_f * g;
}

double Mixture::drained_speed(const double M) const
{
  return std::sqrt(M / density());
}

double Mixture::undrained_speed(const double M) const
{
  return std::sqrt((M + alpha * alpha * Q()) / density());
}

double Mixture::permeable_speed(const double M) const
{
  return std::sqrt(M / (density() - alpha * rho_f));
}

double Mixture::crossover(const double M) const
{
  return (M * storage() + alpha * alpha) / ((density() - alpha * rho_f) * mobility());
}

double Mixture::well_posedness(const double M) const
{
  return alpha * alpha * Q() * (1. - r()) - r() * M;
}

double Mixture::stable_step(const double M, const double h, const double speed,
                            const bool seepage_inertia) const
{
  return stable_step(broadcast(n), broadcast(M), broadcast(h), broadcast(speed), seepage_inertia)[0];
}

Lanes Mixture::stable_step(const Lanes porosity, const Lanes M, const Lanes h, const Lanes speed,
                           const bool seepage_inertia) const
{
  const Lanes Q = 1. / storage(porosity), rho = density(porosity);
  Lanes D = Q * mobility(porosity);
  if (seepage_inertia)
    D *= 1. - alpha * rho_f / rho;
  const Lanes c = sqrt((M + alpha * alpha * Q) / rho) + speed;
  return h * h / (D + sqrt(D * D + c * c * h * h));
}

Lanes Mixture::semi_implicit_speed(const Lanes porosity, const Lanes M, const Lanes density,
                                   const bool seepage_inertia) const
{
  if (!seepage_inertia)
    return sqrt(M / density);
  // What is well posed at the start may come near the limit as the skeleton stiffens.
  constexpr double least_margin = 0.01;
  const Lanes r = alpha * rho_f / density;
  const Lanes margin = 1. - r * M * storage(porosity) / (alpha * alpha * (1. - r));
  return sqrt(M / (density - alpha * rho_f) / max(margin, broadcast(least_margin)));
}
} // namespace peat
