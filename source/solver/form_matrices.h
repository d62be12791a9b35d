#pragma once

#include <Eigen/Core>

#include "form_cell.h"

// The products of shape functions of all points of a cell that make the cell's matrix.

namespace peat {
/// What the derivatives of the residual at eight points are made of.
struct PointCoefficients
{
  bool finite_strain;
  std::array<Lanes, 36> tangent; ///< of the law
  StressLanes law_stress;        ///< effective, as the law has it
  StressLanes total_stress;      ///< that acts: with the projected mean and the pore pressure
  Lanes volume_at_start;         ///< of the step
  Lanes volume_ratio;            ///< J that the law sees, over the start of the step; 1 for small strain

  double alpha, fluid_density;
  Lanes storage, mobility;
  // Under finite strain:
  Lanes storage_rate;           ///< p_t/Q + alpha div v - source, and what it gains per volumetric strain
  Lanes mobility_slope;         ///< what kappa gains per volumetric strain
  std::array<Lanes, 3> drive;   ///< R
  std::array<Lanes, 3> p_slope; ///< grad p
  GradientLanes velocity_gradient;
};

/// The shape functions of all points of a cell as tall matrices, whose products make the cell's matrix. With
/// the projection Pi of a cell the law sees its volumetric strains, and of its mean stress what Pi leaves
/// acts (theory.md, section 10); the stiffness then is
///
///     B^T D B + a W^-1 g + g^T W^-1 (b + C W^-1 g),   g = int psi div N,  W = int psi psi,
///
/// where D is the tangent without its volumetric part, C = int K psi psi with the bulk modulus K, and a, b
/// are what mean and deviator of anisotropic tangents have to do with each other.
template <int dim, unsigned int reach>
class CellMatrices
{
public:
  using Points = FormPoints<dim, reach>;
  using Projection = CellProjection<dim, reach>;
  static constexpr unsigned int n_nodes = Points::n_nodes, n_u = n_nodes * dim, n_p = Space<dim>::n_pressures,
                                n_psi = Projection::n_functions;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// Make room for a cell with so many points.
  void clear(unsigned int n_points, bool finite_strain);
  /// `functions`: psi at the points, or null without projection.
  void add(const Points &points, const PointCoefficients &c, const std::array<Lanes, n_psi> *functions,
           bool has_pressure);

  /// The cell's matrix: minus the derivative of the residual.
  void multiply(const TimeLevel &level, const std::array<double, n_psi> *norms, bool has_pressure,
                dealii::FullMatrix<double> &result);
  /// sum V alpha^2 / K N_p N_p with the drained bulk modulus K of dim dimensions; with projection 2 G stands
  /// for K in what Pi leaves out of N_p.
  Matrix pressure_mass(const std::array<double, n_psi> *norms) const;
  /// Compliance for the stabilisation [1/Pa]: the larger of 1/M (one-dimensional optimum) and 1/(4 G).
  double compliance() const { return largest_compliance; }

  /// Of the last multiply(): the stiffness is shear() + g^T diag(modulus / W) g.
  struct Volumetric
  {
    Matrix gradient;                   ///< g [n_psi][n_u]
    std::array<double, n_psi> modulus; ///< lambda [Pa]
    double shear_modulus;              ///< [Pa]
    Matrix projection;                 ///< sum V alpha psi N_p / W [n_psi][n_p]
  };
  Volumetric volumetric(const std::array<double, n_psi> &norms, bool has_pressure) const;

private:
  static constexpr unsigned int n_strain = dim == 2 ? 3 : 6;
  static constexpr unsigned int component[6] = {0, 1, dim == 2 ? 3u : 2u, 3, 4, 5};
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, dim * dim, dim * dim>;
  using Column = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, dim * dim, 1>;

  /// Row of the strain (or gradient) for the stress component, or d u_i/d x_j.
  static unsigned int stress_row(unsigned int row, bool finite_strain);
  void small_strain(const PointCoefficients &c, unsigned int l, Square &D) const;
  void finite_strain(const PointCoefficients &c, unsigned int l, Square &D) const;
  void split_volume(const PointCoefficients &c, unsigned int l, double V,
                    const std::array<Lanes, n_psi> &functions, Square &D);
  void add_strain(const Points &points, unsigned int l);
  void add_fluid(const Points &points, const PointCoefficients &c, unsigned int l);
  void add_fluid_geometry(const Points &points, const PointCoefficients &c, unsigned int l);
  void add_volumetric_stiffness(const std::array<double, n_psi> &norms);
  void multiply_fluid(const TimeLevel &level, dealii::FullMatrix<double> &result);

  unsigned int rows = 0;  ///< points so far
  unsigned int width = 0; ///< rows of a point in B: symmetric strain or, under finite strain, gradient
  bool is_finite = false;
  double largest_compliance = 0.;
  double shear_sum = 0., volume_sum = 0.;
  Matrix B, DB, N, mN, divergence, M, storage, coupling, volume_p, dM, mobility, drag, geometry;
  Eigen::Matrix<double, Eigen::Dynamic, 1> bulk, shear;
  Matrix psi, psi_now, psi_start; ///< psi, and times the present volume and that at the start of the step
  Matrix deviator, mean;          ///< left factor of a, right factor of b
  Matrix stiffness_of_mean;       ///< C
  Matrix K, mass, Qc, S, H, G, g;
};

template <int dim, unsigned int reach>
void CellMatrices<dim, reach>::clear(const unsigned int n_points, const bool finite)
{
  rows = 0;
  largest_compliance = shear_sum = volume_sum = 0.;
  stiffness_of_mean.setZero(n_psi, n_psi);
  const unsigned int needed = finite ? dim * dim : n_strain;
  if (N.rows() >= n_points && width == needed)
    return;
  width = needed;
  is_finite = finite;
  B.setZero(n_points * width, n_u);
  DB.setZero(n_points * width, n_u);
  N.resize(n_points, n_nodes);
  mN.resize(n_points, n_nodes);
  divergence.resize(n_points, n_u);
  M.resize(n_points, n_p);
  storage.resize(n_points, n_p);
  coupling.resize(n_points, n_p);
  volume_p.resize(n_points, n_p);
  bulk.resize(n_points);
  shear.resize(n_points);
  dM.resize(n_points * dim, n_p);
  mobility.resize(n_points * dim, n_p);
  drag.resize(n_points * dim, n_p);
  geometry.resize(finite ? n_points * width : 0, n_p);
  for (Matrix *matrix : {&psi, &psi_now, &psi_start})
    matrix->resize(n_points, n_psi);
  deviator.resize(n_points * width, n_psi);
  mean.resize(n_points * width, n_psi);
}

template <int dim, unsigned int reach>
unsigned int CellMatrices<dim, reach>::stress_row(const unsigned int row, const bool finite)
{
  return finite ? symmetric_index[row / dim][row % dim] : component[row];
}

template <int dim, unsigned int reach>
void CellMatrices<dim, reach>::small_strain(const PointCoefficients &c, const unsigned int l, Square &D) const
{
  for (unsigned int a = 0; a < width; ++a)
    for (unsigned int b = 0; b < width; ++b)
      D(a, b) = c.tangent[6 * component[a] + component[b]][l];
}

/// Of the nominal stress J sigma F^-T for the gradient l of a displacement in the present configuration:
/// C : sym l + w sigma - sigma w with the spin w, and, since J and F change, tr(l) sigma - sigma l^T.
template <int dim, unsigned int reach>
void CellMatrices<dim, reach>::finite_strain(const PointCoefficients &c, const unsigned int l,
                                             Square &D) const
{
  const auto law = [&](const unsigned int i, const unsigned int j) {
    return c.law_stress[symmetric_index[i][j]][l];
  };
  const auto total = [&](const unsigned int i, const unsigned int j) {
    return c.total_stress[symmetric_index[i][j]][l];
  };
  for (unsigned int i = 0; i < dim; ++i)
    for (unsigned int j = 0; j < dim; ++j) {
      const unsigned int row = i * dim + j;
      for (unsigned int k = 0; k < dim; ++k)
        for (unsigned int m = 0; m < dim; ++m)
          D(row, k * dim + m) =
              c.tangent[6 * symmetric_index[i][j] + symmetric_index[k][m]][l] + (k == m ? total(i, j) : 0.);
      for (unsigned int k = 0; k < dim; ++k) {
        D(row, i * dim + k) += 0.5 * law(k, j);
        D(row, k * dim + i) -= 0.5 * law(k, j);
        D(row, k * dim + j) -= 0.5 * law(i, k);
        D(row, j * dim + k) += 0.5 * law(i, k) - total(i, k);
      }
    }
}

/// Take the volumetric part out of D and add it to the factors of the products with g.
template <int dim, unsigned int reach>
void CellMatrices<dim, reach>::split_volume(const PointCoefficients &c, const unsigned int l, const double V,
                                            const std::array<Lanes, n_psi> &functions, Square &D)
{
  Column of_strain(width), of_stress(width), identity(width);
  double K_law = 0.;
  for (unsigned int i = 0; i < 3; ++i)
    for (unsigned int j = 0; j < 3; ++j)
      K_law += c.tangent[6 * i + j][l] / 9.;
  for (unsigned int a = 0; a < width; ++a) {
    const unsigned int s = stress_row(a, is_finite);
    identity(a) = s < 3 ? 1. : 0.;
    // Stress per volumetric strain, and mean stress per strain.
    of_strain(a) = (c.tangent[6 * s][l] + c.tangent[6 * s + 1][l] + c.tangent[6 * s + 2][l]) / 3.;
    of_stress(a) = (c.tangent[s][l] + c.tangent[6 + s][l] + c.tangent[12 + s][l]) / 3. - K_law * identity(a);
  }
  D.noalias() -= of_strain * identity.transpose();
  D.noalias() -= identity * of_stress.transpose();
  of_strain -= K_law * identity;
  const double V_start = c.volume_at_start[l], ratio = c.volume_ratio[l];
  for (unsigned int k = 0; k < n_psi; ++k) {
    const double f = functions[k][l];
    psi(rows, k) = f;
    psi_now(rows, k) = V * f;
    psi_start(rows, k) = V_start * f;
    deviator.block(rows * width, k, width, 1) = V * f / ratio * of_strain;
    mean.block(rows * width, k, width, 1) = V_start * f * of_stress;
    for (unsigned int m = 0; m < n_psi; ++m)
      stiffness_of_mean(k, m) += V_start * f * functions[m][l] * K_law / ratio;
  }
}

template <int dim, unsigned int reach>
void CellMatrices<dim, reach>::add_strain(const Points &points, const unsigned int l)
{
  constexpr unsigned int pairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};
  auto block = B.middleRows(rows * width, width);
  for (unsigned int i = 0; i < n_nodes; ++i) {
    N(rows, i) = points.N[i][l];
    mN(rows, i) = points.mass[l] * points.N[i][l];
    for (unsigned int d = 0; d < dim; ++d)
      divergence(rows, i * dim + d) = points.dN[i][d][l];
    if (is_finite) {
      for (unsigned int d = 0; d < dim; ++d)
        for (unsigned int e = 0; e < dim; ++e)
          block(d * dim + e, i * dim + d) = points.dN[i][e][l];
      continue;
    }
    for (unsigned int a = 0; a < n_strain; ++a) {
      const auto &pair = pairs[component[a]];
      if (pair[0] == pair[1])
        block(a, i * dim + pair[0]) = points.dN[i][pair[0]][l];
      else {
        block(a, i * dim + pair[0]) = points.dN[i][pair[1]][l];
        block(a, i * dim + pair[1]) = points.dN[i][pair[0]][l];
      }
    }
  }
}

template <int dim, unsigned int reach>
void CellMatrices<dim, reach>::add(const Points &points, const PointCoefficients &c,
                                   const std::array<Lanes, n_psi> *functions, const bool has_pressure)
{
  Square D(width, width);
  for (unsigned int l = 0; l < points.n; ++l, ++rows) {
    const double V = points.volume[l];
    largest_compliance = std::max(
        {largest_compliance, 1. / c.tangent[0][l], c.tangent[21][l] > 0. ? 0.25 / c.tangent[21][l] : 0.});
    // Bulk modulus lambda + 2 mu / dim, and mu from the normal stresses.
    bulk(rows) = (c.tangent[0][l] + (dim - 1) * c.tangent[1][l]) / dim;
    shear(rows) = (c.tangent[0][l] + c.tangent[7][l] + c.tangent[14][l] - c.tangent[1][l] - c.tangent[8][l] -
                   c.tangent[12][l]) /
                  6.;
    shear_sum += V * shear(rows);
    volume_sum += V;
    if (is_finite)
      finite_strain(c, l, D);
    else
      small_strain(c, l, D);
    if (functions)
      split_volume(c, l, V, *functions, D);
    add_strain(points, l);
    DB.middleRows(rows * width, width).noalias() = V * D * B.middleRows(rows * width, width);
    if (has_pressure)
      add_fluid(points, c, l);
  }
}

template <int dim, unsigned int reach>
void CellMatrices<dim, reach>::add_fluid(const Points &points, const PointCoefficients &c,
                                         const unsigned int l)
{
  const double V = points.volume[l];
  for (unsigned int i = 0; i < n_p; ++i) {
    M(rows, i) = points.M[i][l];
    storage(rows, i) = V * c.storage[l] * points.M[i][l];
    coupling(rows, i) = V * c.alpha * points.M[i][l];
    volume_p(rows, i) = V * c.alpha * c.alpha * points.M[i][l];
    for (unsigned int d = 0; d < dim; ++d) {
      const double slope = points.dM[i][d][l];
      dM(d * M.rows() + rows, i) = slope;
      mobility(d * M.rows() + rows, i) = V * c.mobility[l] * slope;
      drag(d * M.rows() + rows, i) = V * c.mobility[l] * c.fluid_density * slope;
    }
  }
  if (is_finite)
    add_fluid_geometry(points, c, l);
}

/// Derivatives of the fluid's residual by the gradient l of a displacement: volumes and porosities change
/// with tr l, gradients with -l^T.
template <int dim, unsigned int reach>
void CellMatrices<dim, reach>::add_fluid_geometry(const Points &points, const PointCoefficients &c,
                                                  const unsigned int l)
{
  const double V = points.volume[l], kappa = c.mobility[l];
  for (unsigned int i = 0; i < n_p; ++i) {
    double along = 0.;
    for (unsigned int d = 0; d < dim; ++d)
      along += c.drive[d][l] * points.dM[i][d][l];
    const double of_volume = (kappa + c.mobility_slope[l]) * along - points.M[i][l] * c.storage_rate[l];
    for (unsigned int d = 0; d < dim; ++d)
      for (unsigned int e = 0; e < dim; ++e)
        geometry(rows * width + d * dim + e, i) =
            V * ((d == e ? of_volume : 0.) + points.M[i][l] * c.alpha * c.velocity_gradient[3 * e + d][l] +
                 kappa * (c.p_slope[d][l] * points.dM[i][e][l] - points.dM[i][d][l] * c.drive[e][l]));
  }
}

template <int dim, unsigned int reach>
typename CellMatrices<dim, reach>::Matrix
CellMatrices<dim, reach>::pressure_mass(const std::array<double, n_psi> *norms) const
{
  const auto shape = M.topRows(rows), weighted = volume_p.topRows(rows);
  if (!norms)
    return shape.transpose() * bulk.head(rows).cwiseInverse().asDiagonal() * weighted;
  Matrix moments = psi_start.topRows(rows).transpose() * shape;
  for (unsigned int k = 0; k < n_psi; ++k)
    moments.row(k) /= (*norms)[k];
  const Matrix seen = psi.topRows(rows) * moments, unseen = shape - seen;
  Eigen::Matrix<double, Eigen::Dynamic, 1> V(rows);
  for (unsigned int q = 0; q < rows; ++q)
    V(q) = weighted.row(q).sum(); // shape functions add up to 1
  return seen.transpose() * V.cwiseQuotient(bulk.head(rows)).asDiagonal() * seen +
         unseen.transpose() * V.cwiseQuotient(2. * shear.head(rows)).asDiagonal() * unseen;
}

template <int dim, unsigned int reach>
void CellMatrices<dim, reach>::add_volumetric_stiffness(const std::array<double, n_psi> &norms)
{
  const auto strains = B.topRows(rows * width);
  g.noalias() = psi_now.topRows(rows).transpose() * divergence.topRows(rows);
  Matrix scaled = g;
  for (unsigned int k = 0; k < n_psi; ++k)
    scaled.row(k) /= norms[k];
  Matrix right = mean.topRows(rows * width).transpose() * strains + stiffness_of_mean * scaled;
  for (unsigned int k = 0; k < n_psi; ++k)
    right.row(k) /= norms[k];
  K.noalias() += strains.transpose() * deviator.topRows(rows * width) * scaled;
  K.noalias() += g.transpose() * right;
}

template <int dim, unsigned int reach>
typename CellMatrices<dim, reach>::Volumetric
CellMatrices<dim, reach>::volumetric(const std::array<double, n_psi> &norms, const bool has_pressure) const
{
  // A share of K that leaves the shear part positive; lambda where that is one.
  constexpr double least_share = 0.1;
  Volumetric result;
  result.gradient = g;
  result.shear_modulus = shear_sum / volume_sum;
  for (unsigned int k = 0; k < n_psi; ++k) {
    const double bulk_modulus = stiffness_of_mean(k, k) / norms[k];
    result.modulus[k] = bulk_modulus > 0. ? bulk_modulus : stiffness_of_mean(0, 0) / norms[0];
    result.modulus[k] =
        std::max(result.modulus[k] - 2. / 3. * result.shear_modulus, least_share * result.modulus[k]);
  }
  if (has_pressure) {
    result.projection = psi.topRows(rows).transpose() * coupling.topRows(rows);
    for (unsigned int k = 0; k < n_psi; ++k)
      result.projection.row(k) /= norms[k];
  }
  return result;
}

template <int dim, unsigned int reach>
void CellMatrices<dim, reach>::multiply(const TimeLevel &level, const std::array<double, n_psi> *norms,
                                        const bool has_pressure, dealii::FullMatrix<double> &result)
{
  K.noalias() = B.topRows(rows * width).transpose() * DB.topRows(rows * width);
  if (norms)
    add_volumetric_stiffness(*norms);
  result = 0.;
  for (unsigned int i = 0; i < n_u; ++i)
    for (unsigned int j = 0; j < n_u; ++j)
      result(i, j) = level.share * K(i, j);
  if (level.acceleration > 0.) {
    mass.noalias() = level.acceleration * N.topRows(rows).transpose() * mN.topRows(rows);
    for (unsigned int i = 0; i < n_nodes; ++i)
      for (unsigned int j = 0; j < n_nodes; ++j)
        for (unsigned int d = 0; d < dim; ++d)
          result(i * dim + d, j * dim + d) += mass(i, j);
  }
  if (has_pressure)
    multiply_fluid(level, result);
}

template <int dim, unsigned int reach>
void CellMatrices<dim, reach>::multiply_fluid(const TimeLevel &level, dealii::FullMatrix<double> &result)
{
  const double scale = level.fluid_scale();
  Qc.noalias() = divergence.topRows(rows).transpose() * coupling.topRows(rows);
  S.noalias() = M.topRows(rows).transpose() * storage.topRows(rows);
  H.setZero(n_p, n_p);
  for (unsigned int d = 0; d < dim; ++d)
    H.noalias() += dM.middleRows(d * M.rows(), rows).transpose() * mobility.middleRows(d * M.rows(), rows);
  for (unsigned int j = 0; j < n_p; ++j) {
    for (unsigned int i = 0; i < n_u; ++i) {
      result(i, n_u + j) = -level.share * Qc(i, j);
      result(n_u + j, i) = scale * level.velocity * Qc(i, j);
    }
    for (unsigned int i = 0; i < n_p; ++i)
      result(n_u + i, n_u + j) = scale * (level.pressure_rate * S(i, j) + level.share * H(i, j));
  }
  if (is_finite) {
    G.noalias() = geometry.topRows(rows * width).transpose() * B.topRows(rows * width);
    for (unsigned int i = 0; i < n_p; ++i)
      for (unsigned int j = 0; j < n_u; ++j)
        result(n_u + i, j) -= scale * level.share * G(i, j);
  }
  if (!level.seepage_inertia || level.acceleration == 0.)
    return;
  for (unsigned int d = 0; d < dim; ++d) {
    G.noalias() = drag.middleRows(d * M.rows(), rows).transpose() * N.topRows(rows);
    for (unsigned int i = 0; i < n_p; ++i)
      for (unsigned int j = 0; j < n_nodes; ++j)
        result(n_u + i, j * dim + d) += scale * level.acceleration * G(i, j);
  }
}
} // namespace peat
