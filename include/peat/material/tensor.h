#pragma once

#include <peat/material/law.h>

#include <limits>

// Algebra of 3 x 3 tensors on lanes, as much of it as the laws share. Everything is free of branches on
// single lanes: a lane that holds nonsense disturbs no other.

namespace peat {
/// Place of component (i, j) of a symmetric tensor in StressLanes.
constexpr unsigned int symmetric_index[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};

inline Lanes trace(const StressLanes &a)
{
  return a[0] + a[1] + a[2];
}

/// a : b
inline Lanes contract(const StressLanes &a, const StressLanes &b)
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + 2. * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5]);
}

inline Lanes determinant(const StressLanes &a)
{
  return a[0] * (a[1] * a[2] - a[4] * a[4]) - a[3] * (a[3] * a[2] - a[4] * a[5]) +
         a[5] * (a[3] * a[4] - a[1] * a[5]);
}

/// a . a
inline StressLanes square(const StressLanes &a)
{
  const Lanes xy = a[3] * a[3], yz = a[4] * a[4], zx = a[5] * a[5];
  return {a[0] * a[0] + xy + zx,
          xy + a[1] * a[1] + yz,
          zx + yz + a[2] * a[2],
          (a[0] + a[1]) * a[3] + a[4] * a[5],
          (a[1] + a[2]) * a[4] + a[3] * a[5],
          (a[2] + a[0]) * a[5] + a[3] * a[4]};
}

/// a . b + b . a
inline StressLanes symmetric_product(const StressLanes &a, const StressLanes &b)
{
  StressLanes result;
  for (unsigned int i = 0; i < 3; ++i)
    for (unsigned int j = i; j < 3; ++j) {
      Lanes s = {};
      for (unsigned int k = 0; k < 3; ++k)
        s += a[symmetric_index[i][k]] * b[symmetric_index[k][j]] +
             b[symmetric_index[i][k]] * a[symmetric_index[k][j]];
      result[symmetric_index[i][j]] = s;
    }
  return result;
}

/// a . b
inline GradientLanes product(const GradientLanes &a, const GradientLanes &b)
{
  GradientLanes result;
  for (unsigned int i = 0; i < 3; ++i)
    for (unsigned int j = 0; j < 3; ++j)
      result[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
  return result;
}

/// q . a . q^T; with a rotation q this turns a.
inline StressLanes rotate(const GradientLanes &q, const StressLanes &a)
{
  GradientLanes qa;
  for (unsigned int i = 0; i < 3; ++i)
    for (unsigned int j = 0; j < 3; ++j)
      qa[3 * i + j] = q[3 * i] * a[symmetric_index[0][j]] + q[3 * i + 1] * a[symmetric_index[1][j]] +
                      q[3 * i + 2] * a[symmetric_index[2][j]];
  StressLanes result;
  for (unsigned int i = 0; i < 3; ++i)
    for (unsigned int j = i; j < 3; ++j)
      result[symmetric_index[i][j]] =
          qa[3 * i] * q[3 * j] + qa[3 * i + 1] * q[3 * j + 1] + qa[3 * i + 2] * q[3 * j + 2];
  return result;
}

inline StressLanes symmetric_part(const GradientLanes &g)
{
  return {g[0], g[4], g[8], 0.5 * (g[1] + g[3]), 0.5 * (g[5] + g[7]), 0.5 * (g[6] + g[2])};
}

/// det F, accurate relative to itself; F row by row.
inline Lanes determinant(const Lanes *F)
{
  return F[0] * (F[4] * F[8] - F[5] * F[7]) - F[1] * (F[3] * F[8] - F[5] * F[6]) +
         F[2] * (F[3] * F[7] - F[4] * F[6]);
}

/// det(I + h) - 1, accurate relative to h however small it is.
inline Lanes volume_change(const GradientLanes &h)
{
  const Lanes xy = h[0] * h[4] - h[1] * h[3], yz = h[4] * h[8] - h[5] * h[7], zx = h[8] * h[0] - h[6] * h[2];
  const Lanes cubic = h[0] * yz - h[1] * (h[3] * h[8] - h[5] * h[6]) + h[2] * (h[3] * h[7] - h[4] * h[6]);
  return (h[0] + h[4] + h[8]) + ((xy + yz + zx) + cubic);
}

/// (I + h)(I + h)^T - I = h + h^T + h h^T, accurate relative to h however small it is.
inline StressLanes left_strain(const GradientLanes &h)
{
  StressLanes e;
  for (unsigned int i = 0; i < 3; ++i)
    for (unsigned int j = i; j < 3; ++j)
      e[symmetric_index[i][j]] =
          (h[3 * i + j] + h[3 * j + i]) +
          (h[3 * i] * h[3 * j] + h[3 * i + 1] * h[3 * j + 1] + h[3 * i + 2] * h[3 * j + 2]);
  return e;
}

/// What the hyperelastic laws remember: F, row by row.
inline StateField deformation_gradient()
{
  return {"deformation gradient", "", {1., 0., 0., 0., 1., 0., 0., 0., 1.}};
}

/// F - I of a remembered F.
inline GradientLanes displacement_gradient(const Lanes *F)
{
  return {F[0] - 1., F[1], F[2], F[3], F[4] - 1., F[5], F[6], F[7], F[8] - 1.};
}

/// F <- (I + increment) F; returns F - I.
inline GradientLanes deform(const GradientLanes &increment, Lanes *F)
{
  GradientLanes old;
  for (unsigned int c = 0; c < 9; ++c)
    old[c] = F[c];
  const GradientLanes change = product(increment, old);
  for (unsigned int c = 0; c < 9; ++c)
    F[c] += change[c];
  return displacement_gradient(F);
}

/// NaN where `valid` (a volume, say) is not positive, else x.
inline Lanes nan_unless_positive(const Lanes valid, const Lanes x)
{
  return valid > 0. ? x : broadcast(std::numeric_limits<double>::quiet_NaN());
}

/// ln(1 + y) to about one unit in the last place, relative also for tiny y; NaN for y <= -1.
///
/// 1 + y = 2^k m with m between sqrt(1/2) and sqrt(2), and ln m = 2 artanh(z) with z = (m - 1)/(m + 1), |z| <
/// 0.172.
inline Lanes log_one_plus(const Lanes y)
{
  typedef long long Integers __attribute__((vector_size(sizeof(Lanes))));
  typedef unsigned long long Bits __attribute__((vector_size(sizeof(Lanes))));
  constexpr unsigned long long root_of_half = 0x3FE6A09E667F3BCD, exponent_unit = 1ull << 52;
  constexpr double ln2_high = 6.93147180369123816490e-01, ln2_low = 1.90821492927058770002e-10;

  const Lanes x = 1. + y;
  const Integers k = (Integers)((Bits)x - root_of_half) >> 52;
  const Lanes m = (Lanes)((Bits)x - (Bits)k * exponent_unit);
  const Lanes f = k == 0 ? y : m - 1.;
  const Lanes z = f / (2. + f), z2 = z * z;
  Lanes series = broadcast(2. / 23.);
  for (int n = 21; n >= 3; n -= 2)
    series = series * z2 + 2. / n;
  const Lanes factor = __builtin_convertvector(k, Lanes);
  // 2 z = f - z f keeps the leading term exact.
  return nan_unless_positive(x, factor * ln2_high + (f + (z * (z2 * series - f) + factor * ln2_low)));
}

/// Largest eigenvalue, to about 1e-7 of the deviator's size where two are equal and to round-off elsewhere.
///
/// With the mean m and p = sqrt(dev : dev / 6) it is m + p y, where y between 1 and 2 solves y^3 - 3 y =
/// det(dev / p).
inline Lanes largest_eigenvalue(const StressLanes &a)
{
  const Lanes mean = trace(a) / 3.;
  StressLanes dev = a;
  for (unsigned int c = 0; c < 3; ++c)
    dev[c] -= mean;
  const Lanes p = sqrt(contract(dev, dev) / 6.) + std::numeric_limits<double>::min();
  for (Lanes &component : dev)
    component /= p;
  const Lanes det = min(max(determinant(dev), broadcast(-2.)), broadcast(2.));
  Lanes y = 1. + 0.5 * sqrt(2. + det);
  for (unsigned int newton = 0; newton < 3; ++newton)
    y -= (y * (y * y - 3.) - det) / (3. * (y * y - 1.) + 1e-15);
  return mean + p * y;
}

/// Eigenvalues and, as the columns of a rotation, eigenvectors: a = vectors . diag(values) . vectors^T.
/// Accurate relative to the size of a; equal eigenvalues need no care. Cyclic Jacobi rotations until every
/// lane is done.
struct Spectrum
{
  explicit Spectrum(const StressLanes &a);
  std::array<Lanes, 3> values;
  GradientLanes vectors;
};

/// lambda tr(e) I + 2 mu e
inline StressLanes isotropic_stress(const ElasticModuli &moduli, const StressLanes &e)
{
  StressLanes s;
  for (unsigned int c = 0; c < 6; ++c)
    s[c] = 2. * moduli.mu * e[c];
  const Lanes mean = moduli.lambda * trace(e);
  for (unsigned int c = 0; c < 3; ++c)
    s[c] += mean;
  return s;
}

/// 1/2 s : e of the strain e that has the stress s = lambda tr(e) I + 2 mu e.
inline Lanes isotropic_energy(const ElasticModuli &moduli, const StressLanes &s)
{
  const Lanes t = trace(s);
  return (contract(s, s) - moduli.lambda / (3. * moduli.lambda + 2. * moduli.mu) * t * t) / (4. * moduli.mu);
}

/// The matrix of a linear map of symmetric tensors in the layout that Law::tangent() documents: column j is
/// `response(e_j)`, and e_j an engineering shear of one for j >= 3.
template <typename Response>
void tangent_from_columns(std::array<Lanes, 36> &tangent, const Response &response)
{
  for (unsigned int j = 0; j < 6; ++j) {
    StressLanes e = {};
    e[j] = broadcast(j < 3 ? 1. : 0.5);
    const StressLanes column = response(e);
    for (unsigned int i = 0; i < 6; ++i)
      tangent[6 * i + j] = column[i];
  }
}
} // namespace peat
