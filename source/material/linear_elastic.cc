#include <peat/material/tensor.h>

namespace peat {
namespace {
/// Isotropic linear elasticity of small strains: sigma <- sigma + lambda tr(e) I + 2 mu e with the symmetric
/// part e of the increment. Rotations are taken for small, too: they leave the stress as it is.
class LinearElastic : public Law
{
public:
  explicit LinearElastic(const Section &section) : moduli(section) {}

  bool finite_strain() const override { return false; }
  bool is_linear() const override { return true; }

  void update(const GradientLanes &increment, StressLanes &stress, Lanes *) const override
  {
    const StressLanes change = isotropic_stress(moduli, symmetric_part(increment));
    for (unsigned int c = 0; c < 6; ++c)
      stress[c] += change[c];
  }

  void tangent(const StressLanes &, const Lanes *, std::array<Lanes, 36> &tangent) const override
  {
    tangent_from_columns(tangent, [&](const StressLanes &e) { return isotropic_stress(moduli, e); });
  }

  Lanes stored_energy(const StressLanes &stress, const Lanes *) const override
  {
    return isotropic_energy(moduli, stress);
  }

  Lanes wave_modulus(const StressLanes &, const Lanes *) const override
  {
    return broadcast(moduli.wave_modulus());
  }

private:
  const ElasticModuli moduli;
};

const Member<Law, LinearElastic> linear_elastic("linear elastic",
                                                "Isotropic linear elasticity for small strains and "
                                                "rotations; volumes are those at the start.");
} // namespace
} // namespace peat
