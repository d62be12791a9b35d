#include <peat/material/tensor.h>

namespace peat {
namespace {
/// Hypoelasticity with the Jaumann rate of the Cauchy stress, sigma_t = C : d + w sigma - sigma w.
///
/// A step moves points by I + G (G the increment), so its gradient at the middle of the step is A = G (I +
/// G/2)^-1. With e = sym A, w = skw A and Cayley's rotation Q = (I - w/2)^-1 (I + w/2) (Hughes & Winget 1980)
///   sigma <- Q (sigma + C : e / 2) Q^T + C : e / 2,
/// which is of second order. The step is a rotation, I + G = R, exactly if e = 0; then Q = R, and the stress
/// turns with the body to round-off, however large the step. In one direction A is g/(1 + g/2) = ln(1 + g) +
/// O(g^3), which makes M ln(stretch) of uniaxial stretch. Half the stress increment on either side of the
/// rotation is what makes the step second order where a body shears and turns at once.
class Jaumann : public Law
{
public:
  explicit Jaumann(const Section &section) : moduli(section) {}

  bool finite_strain() const override { return true; }

  void update(const GradientLanes &increment, StressLanes &stress, Lanes *) const override
  {
    const GradientLanes middle = at_middle(increment);
    const StressLanes change = isotropic_stress(moduli, symmetric_part(middle));
    const Lanes volume = 1. + volume_change(increment);
    for (unsigned int c = 0; c < 6; ++c)
      stress[c] += 0.5 * change[c];
    stress = rotate(rotation(middle), stress);
    for (unsigned int c = 0; c < 6; ++c)
      stress[c] = nan_unless_positive(volume, stress[c] + 0.5 * change[c]);
  }

  void tangent(const StressLanes &, const Lanes *, std::array<Lanes, 36> &tangent) const override
  {
    tangent_from_columns(tangent, [&](const StressLanes &e) { return isotropic_stress(moduli, e); });
  }

  /// A hypoelastic law has no potential: this is the energy that linear elasticity sees in the stress.
  Lanes stored_energy(const StressLanes &stress, const Lanes *) const override
  {
    return isotropic_energy(moduli, stress);
  }

  /// The nominal stress rate for a gradient n x n is M n x n in every direction n and at any stress: the
  /// terms sigma tr(d) and sigma l^T cancel.
  Lanes wave_modulus(const StressLanes &, const Lanes *) const override
  {
    return broadcast(moduli.wave_modulus());
  }

private:
  /// G (I + G/2)^-1
  static GradientLanes at_middle(const GradientLanes &G)
  {
    GradientLanes h;
    for (unsigned int c = 0; c < 9; ++c)
      h[c] = 0.5 * G[c];
    for (unsigned int c = 0; c < 9; c += 4)
      h[c] += 1.;
    GradientLanes inverse = {h[4] * h[8] - h[5] * h[7], h[2] * h[7] - h[1] * h[8], h[1] * h[5] - h[2] * h[4],
                             h[5] * h[6] - h[3] * h[8], h[0] * h[8] - h[2] * h[6], h[2] * h[3] - h[0] * h[5],
                             h[3] * h[7] - h[4] * h[6], h[1] * h[6] - h[0] * h[7], h[0] * h[4] - h[1] * h[3]};
    const Lanes factor = 1. / (h[0] * inverse[0] + h[1] * inverse[3] + h[2] * inverse[6]);
    for (Lanes &component : inverse)
      component *= factor;
    return product(G, inverse);
  }

  /// Cayley's rotation of the skew part of A: ((1 - a.a) I + 2 a x a + 2 [a]) / (1 + a.a), where [a] is half
  /// of it.
  static GradientLanes rotation(const GradientLanes &A)
  {
    const Lanes x = 0.25 * (A[7] - A[5]), y = 0.25 * (A[2] - A[6]), z = 0.25 * (A[3] - A[1]);
    const Lanes f = 2. / (1. + x * x + y * y + z * z);
    return {1. - f * (y * y + z * z), f * (x * y - z),          f * (z * x + y),
            f * (x * y + z),          1. - f * (z * z + x * x), f * (y * z - x),
            f * (z * x - y),          f * (y * z + x),          1. - f * (x * x + y * y)};
  }

  const ElasticModuli moduli;
};

const Member<Law, Jaumann> jaumann("jaumann",
                                   "Hypoelasticity for finite strains with the Jaumann rate of the Cauchy "
                                   "stress.");
} // namespace
} // namespace peat
