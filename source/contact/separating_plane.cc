#include <peat/contact/separating_plane.h>

#include <Eigen/Dense>

namespace peat {
template <int dim>
void SeparatingPlanes<dim>::reinit(const std::size_t n_sites)
{
  sums.assign(n_sites * n_sums, 0.);
  for (auto &of_stage : planes)
    of_stage.assign(n_sites * n_unknowns, 0.);
  shifts.resize(n_sites);
  settled.resize(n_sites);
}

template <int dim>
void SeparatingPlanes<dim>::find_shifts()
{
  std::fill(settled.begin(), settled.end(), 0);
  for (std::size_t site = 0; site < shifts.size(); ++site)
    shifts[site] = stage == 0 ? dealii::Tensor<1, dim>() : normal(site, stage - 1);
}

template <int dim>
void SeparatingPlanes<dim>::add(const NearPoints<dim> &points, const double side,
                                const std::vector<dealii::Point<dim>> &center, const double length)
{
  for (const auto &entry : points.neighbours()) {
    if (settled[entry.site])
      continue;
    const double *plane = &planes[stage][std::size_t(entry.site) * n_unknowns];
    double X[n_unknowns];
    const auto &point = points.points()[entry.point];
    auto x = point.x;
    if (stage > 0)
      x -= side * share_to_surface * point.reach(shifts[entry.site]) * shifts[entry.site];
    double s = plane[dim];
    X[dim] = 1.;
    for (unsigned int d = 0; d < dim; ++d) {
      X[d] = (x[d] - center[entry.site][d]) / length;
      s += plane[d] * X[d];
    }
    // The derivatives of log(1 + exp(-side s)), a convex function of the plane.
    const double L = std::tanh(0.5 * s), curvature = 0.25 * (1. - L * L);
    double *sum = &sums[std::size_t(entry.site) * n_sums];
    for (unsigned int i = 0; i < n_unknowns; ++i)
      for (unsigned int j = i; j < n_unknowns; ++j)
        *sum++ += curvature * X[i] * X[j];
    for (unsigned int i = 0; i < n_unknowns; ++i)
      *sum++ += 0.5 * (side - L) * X[i];
  }
}

template <int dim>
bool SeparatingPlanes<dim>::improve()
{
  // Keeps the planes of separable points finite: the smaller, the steeper they are and the fewer points
  // decide.
  constexpr double penalty = 1e-4;
  // Newton's method squares what is left after a change of this size. The first stage only says which way
  // points are moved.
  const double still = stage + 1 < n_stages ? 1e-3 : 1e-5;
  using Matrix = Eigen::Matrix<double, n_unknowns, n_unknowns>;
  using Vector = Eigen::Matrix<double, n_unknowns, 1>;
  bool converged = true;
  for (std::size_t site = 0; site < shifts.size(); ++site) {
    const double *sum = &sums[site * n_sums];
    Eigen::Map<Vector> plane(&planes[stage][site * n_unknowns]);
    Matrix A;
    for (unsigned int i = 0; i < n_unknowns; ++i)
      for (unsigned int j = i; j < n_unknowns; ++j)
        A(i, j) = A(j, i) = *sum++;
    Vector b(sum);
    // No points, or those of one body alone.
    if (settled[site] || A(dim, dim) == 0.)
      continue;
    for (unsigned int d = 0; d < dim; ++d) {
      A(d, d) += penalty;
      b(d) -= penalty * plane(d);
    }
    A(dim, dim) += 1e-2 * penalty;
    const Vector before = plane.template head<dim>().normalized().homogeneous();
    Vector change = A.ldlt().solve(b);
    // Newton's method for a function with a flat tail: no step that leaves the region where it is known.
    const double limit = 1. + plane.norm();
    if (change.norm() > limit)
      change *= limit / change.norm();
    plane += change;
    // Each for itself: what a site gets must not depend on which others its rank knows.
    settled[site] = (plane.template head<dim>().normalized() - before.template head<dim>()).norm() < still;
    converged = converged && settled[site];
  }
  return converged;
}

template <int dim>
dealii::Tensor<1, dim> SeparatingPlanes<dim>::normal(const std::size_t site,
                                                     const unsigned int of_stage) const
{
  dealii::Tensor<1, dim> n;
  for (unsigned int d = 0; d < dim; ++d)
    n[d] = planes[of_stage][site * n_unknowns + d];
  return n.norm() > 0. ? n / n.norm() : n;
}

template class SeparatingPlanes<2>;
template class SeparatingPlanes<3>;
} // namespace peat
