#include <peat/material/tensor.h>

namespace peat {
namespace {
/// ln(I + X) of a symmetric X without trace and with I + X positive definite, by m-point Gauss quadrature of
///   ln(I + X) = integral over t from 0 to 1 of X (I + t X)^-1 dt.
/// By Cayley and Hamilton X (I + t X)^-1 = (X - t X^2 + t^2 I3 I)/(1 + t^2 I2 + t^3 I3), so that a quadrature
/// point costs one division, and neither eigenvalues nor logarithms are needed. The relative error at an
/// eigenvalue s^2 of I + X is about ((s - 1)/(s + 1))^(2m).
class LogarithmRule
{
public:
  explicit LogarithmRule(const unsigned int m) : points(m)
  {
    constexpr double error = 1e-15;
    const double q = std::pow(error, 0.5 / m);
    // The smallest eigenvalue of I + X that the rule can treat, and det(I + X) below which there may be a
    // smaller one: with the trace 3 the other two are (3 - smallest)/2 at most on average.
    const double smallest = std::pow((1. - q) / (1. + q), 2);
    least_determinant = smallest * std::pow(0.5 * (3. - smallest), 2);

    for (unsigned int i = 0; i < m; ++i) {
      // Newton's iteration for the root i of Legendre's polynomial P_m.
      double x = std::cos(std::acos(-1.) * (i + 0.75) / (m + 0.5)), slope = 0.;
      for (unsigned int newton = 0; newton < 8; ++newton) {
        double previous = 1., current = x;
        for (unsigned int k = 2; k <= m; ++k) {
          const double next = ((2. * k - 1.) * x * current - (k - 1.) * previous) / k;
          previous = current;
          current = next;
        }
        slope = m * (x * current - previous) / (x * x - 1.);
        x -= current / slope;
      }
      points[i] = {0.5 * (1. + x), 1. / ((1. - x * x) * slope * slope)};
    }
  }

  /// ln(I + X) = a X - b X^2 + c I3 I, with the second and third invariant of X.
  void coefficients(const Lanes I2, const Lanes I3, Lanes &a, Lanes &b, Lanes &c) const
  {
    a = b = c = broadcast(0.);
    for (const Point &point : points) {
      Lanes term = point.weight / (1. + point.t * point.t * (I2 + point.t * I3));
      a += term;
      term *= point.t;
      b += term;
      term *= point.t;
      c += term;
    }
  }

  double least_determinant;

private:
  struct Point
  {
    double t, weight;
  };
  std::vector<Point> points;
};

/// Hencky elasticity: linear between the Kirchhoff stress and the logarithmic strain,
///   J sigma = lambda tr(eps) I + 2 mu eps,   eps = 1/2 ln b,   b = F F^T,
/// with the energy 1/2 (J sigma) : eps per volume at the start.
/// The stress is a function of F: a stress that does not belong to the remembered F does not survive an
/// update.
class Hencky : public Law
{
public:
  explicit Hencky(const Section &section)
      : moduli(section), rules{LogarithmRule(4), LogarithmRule(8), LogarithmRule(16), LogarithmRule(32),
                               LogarithmRule(64)}
  {}

  std::vector<StateField> state() const override { return {deformation_gradient()}; }

  bool finite_strain() const override { return true; }

  void update(const GradientLanes &increment, StressLanes &stress, Lanes *state) const override
  {
    const GradientLanes h = deform(increment, state);
    const Lanes J = determinant(state);
    const StressLanes tau = isotropic_stress(moduli, logarithmic_strain(left_strain(h), J));
    const Lanes inverse_J = nan_unless_positive(J, 1. / J);
    for (unsigned int c = 0; c < 6; ++c)
      stress[c] = tau[c] * inverse_J;
  }

  /// For a symmetric increment D, in the principal frame of b: delta eps_ij = theta_ij D_ij with
  /// theta_ij = u coth u, u = eps_i - eps_j (one where the strains are equal), and delta J = J tr D.
  void tangent(const StressLanes &stress, const Lanes *state, std::array<Lanes, 36> &tangent) const override
  {
    const GradientLanes h = displacement_gradient(state);
    const Lanes J = determinant(state);
    const Spectrum b(left_strain(h));
    GradientLanes back;
    std::array<Lanes, 3> eps;
    StressLanes theta;
    for (unsigned int i = 0; i < 3; ++i) {
      eps[i] = 0.5 * log_one_plus(b.values[i]);
      for (unsigned int j = 0; j < 3; ++j)
        back[3 * i + j] = b.vectors[3 * j + i];
    }
    for (unsigned int i = 0; i < 3; ++i)
      for (unsigned int j = i; j < 3; ++j)
        theta[symmetric_index[i][j]] =
            map(eps[i] - eps[j], [](double u) { return u == 0. ? 1. : u / std::tanh(u); });
    tangent_from_columns(tangent, [&](const StressLanes &D) {
      StressLanes strain = rotate(back, D);
      for (unsigned int c = 0; c < 6; ++c)
        strain[c] *= theta[c];
      StressLanes column = isotropic_stress(moduli, rotate(b.vectors, strain));
      for (unsigned int c = 0; c < 6; ++c)
        column[c] = column[c] / J - stress[c] * trace(D);
      return column;
    });
  }

  Lanes stored_energy(const StressLanes &stress, const Lanes *state) const override
  {
    return determinant(state) * isotropic_energy(moduli, stress);
  }

  /// In the principal direction i the nominal stress is J sigma_i / s_i, s_i the stretch; its derivative,
  /// referred to the present state, is (lambda + 2 mu)/J - sigma_i. Largest where the compression is; at
  /// least the shear wave's mu/J.
  Lanes wave_modulus(const StressLanes &stress, const Lanes *state) const override
  {
    const Lanes J = determinant(state);
    StressLanes pressure;
    for (unsigned int c = 0; c < 6; ++c)
      pressure[c] = -stress[c];
    return max(moduli.wave_modulus() / J + largest_eigenvalue(pressure), moduli.mu / J);
  }

private:
  /// 1/2 ln(I + e). Isotropic part apart, I + e = c (I + X) with c = 1 + tr(e)/3 and a trace-free X; the
  /// shortest rule that serves all lanes treats ln(I + X). Where the shape has changed beyond all rules,
  /// eigenvalues do.
  StressLanes logarithmic_strain(const StressLanes &e, const Lanes J) const
  {
    const Lanes mean = trace(e) / 3., inverse_c = 1. / (1. + mean);
    const Lanes det = J * J * inverse_c * inverse_c * inverse_c; // of I + X; one for a change of volume alone
    double least = det[0];
    for (unsigned int l = 1; l < n_lanes; ++l)
      least = std::min(least, det[l]);
    for (const LogarithmRule &rule : rules)
      if (least >= rule.least_determinant) {
        StressLanes X;
        for (unsigned int c = 0; c < 6; ++c)
          X[c] = (c < 3 ? e[c] - mean : e[c]) * inverse_c;
        const StressLanes X2 = square(X);
        const Lanes I3 = determinant(X);
        Lanes a, b, c;
        rule.coefficients(-0.5 * trace(X2), I3, a, b, c);
        const Lanes isotropic = log_one_plus(mean) + c * I3;
        StressLanes eps;
        for (unsigned int i = 0; i < 6; ++i)
          eps[i] = 0.5 * (a * X[i] - b * X2[i] + (i < 3 ? isotropic : broadcast(0.)));
        return eps;
      }

    const Spectrum spectrum(e);
    StressLanes eps = {};
    for (unsigned int i = 0; i < 3; ++i)
      eps[i] = 0.5 * log_one_plus(spectrum.values[i]);
    return rotate(spectrum.vectors, eps);
  }

  const ElasticModuli moduli;
  const std::array<LogarithmRule, 5> rules;
};

const Member<Law, Hencky> hencky("hencky",
                                 "Hencky elasticity for finite strains: linear between Kirchhoff stress and "
                                 "logarithmic strain.");
} // namespace
} // namespace peat
