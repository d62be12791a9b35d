#include <peat/material/tensor.h>

namespace peat {
namespace {
/// Compressible neo-Hookean elasticity: energy per volume at the start
///   W = mu/2 (tr b - 3) - mu ln J + lambda/2 (ln J)^2,   J sigma = mu (b - I) + lambda ln J I,   b = F F^T.
/// The stress is a function of F: a stress that does not belong to the remembered F does not survive an
/// update.
class NeoHookean : public Law
{
public:
  explicit NeoHookean(const Section &section) : moduli(section) {}

  std::vector<StateField> state() const override { return {deformation_gradient()}; }

  bool finite_strain() const override { return true; }

  void update(const GradientLanes &increment, StressLanes &stress, Lanes *state) const override
  {
    const GradientLanes h = deform(increment, state);
    const StressLanes e = left_strain(h);
    const Lanes J = determinant(state), inverse_J = nan_unless_positive(J, 1. / J);
    const Lanes volumetric = moduli.lambda * log_one_plus(volume_change(h));
    for (unsigned int c = 0; c < 6; ++c)
      stress[c] = (c < 3 ? moduli.mu * e[c] + volumetric : moduli.mu * e[c]) * inverse_J;
  }

  /// For a symmetric increment D: delta(J sigma) = mu (D b + b D) + lambda tr D I, delta J = J tr D.
  void tangent(const StressLanes &stress, const Lanes *state, std::array<Lanes, 36> &tangent) const override
  {
    const GradientLanes h = displacement_gradient(state);
    const Lanes J = determinant(state);
    StressLanes b = left_strain(h);
    for (unsigned int c = 0; c < 3; ++c)
      b[c] += 1.;
    tangent_from_columns(tangent, [&](const StressLanes &D) {
      StressLanes column = symmetric_product(D, b);
      for (unsigned int c = 0; c < 6; ++c)
        column[c] =
            (moduli.mu * column[c] + (c < 3 ? moduli.lambda : 0.) * trace(D)) / J - stress[c] * trace(D);
      return column;
    });
  }

  Lanes stored_energy(const StressLanes &, const Lanes *state) const override
  {
    const GradientLanes h = displacement_gradient(state);
    const Lanes logarithm = log_one_plus(volume_change(h));
    const Lanes W =
        moduli.mu * (0.5 * trace(left_strain(h)) - logarithm) + 0.5 * moduli.lambda * logarithm * logarithm;
    return W / determinant(state);
  }

  /// The acoustic tensor of direction n is (mu n.b n I + (lambda + mu - lambda ln J) n x n)/J. Its largest
  /// eigenvalue belongs to the direction of the largest stretch, (mu b_max + mu + lambda - lambda ln J)/J,
  /// and with the stress put in for b it is (lambda + 2 mu - 2 lambda ln J)/J + sigma_max. Never less than mu
  /// b_max/J, the shear wave's.
  Lanes wave_modulus(const StressLanes &stress, const Lanes *state) const override
  {
    const Lanes J = determinant(state), logarithm = log_one_plus(volume_change(displacement_gradient(state)));
    const Lanes shear = largest_eigenvalue(stress) + (moduli.mu - moduli.lambda * logarithm) / J;
    return shear + max((moduli.lambda + moduli.mu - moduli.lambda * logarithm) / J, broadcast(0.));
  }

private:
  const ElasticModuli moduli;
};

const Member<Law, NeoHookean> neo_hookean("neo-hookean",
                                          "Compressible neo-Hookean elasticity for finite strains.");
} // namespace
} // namespace peat
