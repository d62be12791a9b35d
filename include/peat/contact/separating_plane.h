#pragma once

#include <peat/contact/near_points.h>

namespace peat {
/// At each site, the normal of the plane that separates the points of two bodies, by logistic regression on
/// their places (Nairn, Hammerquist & Smith 2020). Swapping the bodies gives the opposite normals.
template <int dim>
class SeparatingPlanes
{
public:
  /// Forget what is known; n_sites from now on.
  void reinit(std::size_t n_sites);

  /// Sums of a site; they may be added over ranks.
  static constexpr unsigned int n_unknowns = dim + 1;
  static constexpr unsigned int n_sums = n_unknowns * (n_unknowns + 1) / 2 + n_unknowns;

  /// Improve all planes by Newton's method until they stand still. `add_over_ranks(sums)` is called once an
  /// iteration; `converged(bool)` says whether all ranks agree. Places are relative to `center` [m] in units
  /// of `length` [m].
  template <typename AddOverRanks, typename Agree>
  void fit(const NearPoints<dim> &first, const NearPoints<dim> &second,
           const std::vector<dealii::Point<dim>> &center, double length, const AddOverRanks &add_over_ranks,
           const Agree &agree)
  {
    for (unsigned int iteration = 0; iteration < most_iterations; ++iteration) {
      std::fill(sums.begin(), sums.end(), 0.);
      add(first, -1., center, length);
      add(second, 1., center, length);
      add_over_ranks(sums);
      if (agree(improve()))
        return;
    }
  }

  /// Unit vector from the first body to the second; zero where nothing separates them.
  dealii::Tensor<1, dim> normal(std::size_t site) const;

private:
  static constexpr unsigned int most_iterations = 12;

  void add(const NearPoints<dim> &points, double side, const std::vector<dealii::Point<dim>> &center,
           double length);
  /// One Newton step; true if no plane turned any more.
  bool improve();

  std::vector<double> sums;
  std::vector<double> planes; ///< n_unknowns a site
};
} // namespace peat
