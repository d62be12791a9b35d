#pragma once

#include <peat/base/lanes.h>
#include <peat/base/parameters.h>
#include <peat/base/registry.h>

#include <memory>
#include <string>
#include <vector>

namespace peat {
/// How the hydraulic conductivity follows the porosity n. A member gives the dependence up to a constant
/// factor; the mixture scales it to the conductivity that the user measured (Mixture::conductivity()).
class Conductivity
{
public:
  virtual ~Conductivity() = default;

  /// Proportional to the conductivity, positive for n in (0, 1).
  virtual Lanes shape(Lanes porosity) const = 0;

  /// The porosity does not enter: one evaluation serves all points.
  virtual bool is_constant() const = 0;
};

/// The fluid in the pores of a saturated material, and what the two have in common. p > 0 is compression of
/// the fluid.
///
/// Functions with a porosity are for the present one, those without for the porosity at the start. M is the
/// stiffness of the drained skeleton to a plane compression wave (Law::wave_modulus()) [Pa].
class Mixture
{
public:
  /// Reads the material's section. Throws InputError.
  explicit Mixture(Section section);

  /// The entries that only a saturated material has, apart from "Porosity" itself.
  static const std::vector<std::string> &entries();

  /// At the start; n_t = (1 - n) div u_t afterwards.
  double porosity() const { return n; }
  double grain_density() const { return rho_s; }
  double fluid_density() const { return rho_f; }
  /// Biot's alpha.
  double biot_coefficient() const { return alpha; }

  /// rho = n rho_f + (1 - n) rho_s [kg/m^3]
  double density() const { return density_of(n); }
  Lanes density(const Lanes porosity) const { return density_of(porosity); }

  /// 1/Q = (alpha - n)/K_s + n/K_f [1/Pa]; the first term is missing with incompressible grains.
  double storage() const { return storage_of(n); }
  Lanes storage(const Lanes porosity) const { return storage_of(porosity); }
  double Q() const { return 1. / storage(); }

  /// The hydraulic conductivity k [m/s].
  double conductivity() const { return conductivity(broadcast(n))[0]; }
  Lanes conductivity(const Lanes porosity) const { return k_factor * law->shape(porosity); }
  /// kappa = k / (rho_f g_r) [m^2/(Pa s)]
  double mobility() const { return conductivity() / unit_weight; }
  Lanes mobility(const Lanes porosity) const { return conductivity(porosity) / unit_weight; }
  bool constant_conductivity() const { return law->is_constant(); }

  /// r = alpha rho_f / rho
  double r() const { return alpha * rho_f / density(); }

  /// c_d = sqrt(M/rho): no pore pressure [m/s].
  double drained_speed(double M) const;
  /// c_u = sqrt((M + alpha^2 Q)/rho): no seepage [m/s].
  double undrained_speed(double M) const;
  /// c_hf = sqrt(M/(rho - alpha rho_f)): the skeleton's wave at frequencies above the crossover, where the
  /// term rho_f a of Darcy's law is on; needs r < 1 [m/s].
  double permeable_speed(double M) const;
  /// w_c = (M/Q + alpha^2)/((rho - alpha rho_f) kappa): below it waves are undrained and slow diffusion c_v
  /// goes on beside them, above it the pressure is diffusive with Q kappa (1 - r) [rad/s].
  double crossover(double M) const;

  /// alpha^2 Q (1 - r) - r M [Pa]. With the term rho_f a in Darcy's law the u-p equations are well posed only
  /// if this is positive (Routh and Hurwitz on their characteristic polynomial); otherwise every mode grows
  /// whatever the scheme and the step. Without the term they always are well posed.
  double well_posedness(double M) const;

  /// Largest stable step [s] of the explicit scheme in full cells of size h [m] with points at `speed` |v|
  /// [m/s]:
  ///   dt = h^2/(D + sqrt(D^2 + (c_u + |v|)^2 h^2)),   D = Q kappa (1 - r) with the term rho_f a, Q kappa
  ///   without.
  /// The limits are h/(c_u + |v|) and h^2/(2 D). For the numbers at the start,
  double stable_step(double M, double h, double speed, bool seepage_inertia) const;
  /// and for the present ones.
  Lanes stable_step(Lanes porosity, Lanes M, Lanes h, Lanes speed, bool seepage_inertia) const;

  /// The speed that limits the step of the explicit skeleton beside implicit pressures to h/c [m/s]:
  ///   c = sqrt(M/(rho - alpha rho_f) / (1 - r M/(alpha^2 Q (1 - r)))) with the term rho_f a: c_hf, and more
  ///   where the fluid is hardly stiff enough for the form to be well posed;  c_d without.
  Lanes semi_implicit_speed(Lanes porosity, Lanes M, Lanes density, bool seepage_inertia) const;

private:
  template <typename Number>
  Number density_of(const Number porosity) const
  {
    return porosity * rho_f + (1. - porosity) * rho_s;
  }

  template <typename Number>
  Number storage_of(const Number porosity) const
  {
    return (alpha - porosity) * grain_compressibility + porosity / K_f;
  }

  double n = 0.4;
  double rho_s = 2650.;
  double rho_f = 1000.;
  double K_f = 2.2e9;
  double grain_compressibility = 0.;
  double alpha = 1.;
  double unit_weight;
  std::unique_ptr<Conductivity> law;
  double k_factor;
};
} // namespace peat
