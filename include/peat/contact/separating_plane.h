#pragma once

#include <peat/contact/near_points.h>

namespace peat {
/// At each site, the normal of the plane that separates the points of two bodies near their surfaces, by
/// logistic regression on their places (Nairn, Hammerquist & Smith 2020). Swapping the bodies gives the
/// opposite normals.
///
/// What decides is which points are nearest to the other body, so all points of the cells around a site
/// count, not those alone that have a weight at its node: at a node beyond the corner of a block, where one
/// column of the block's points is left, the ground's points must reach farther than that column for the
/// plane between them to lie along the ground.
template <int dim>
class SeparatingPlanes
{
public:
  /// Forget what is known; n_sites from now on.
  void reinit(std::size_t n_sites);

  /// Sums of a site; they may be added over ranks.
  static constexpr unsigned int n_unknowns = dim + 1;
  static constexpr unsigned int n_sums = n_unknowns * (n_unknowns + 1) / 2 + n_unknowns;

  /// Find the planes by Newton's method: first between the points, then between the points moved most of the
  /// way to the surfaces along the normals so far, which takes away that points of cut cells lie unevenly
  /// below a face. `add_over_ranks(sums)` is called once an iteration; `agree(bool)` says whether all ranks
  /// have converged. Places are relative to `center` [m] in units of `length` [m].
  template <typename AddOverRanks, typename Agree>
  void fit(const NearPoints<dim> &first, const NearPoints<dim> &second,
           const std::vector<dealii::Point<dim>> &center, double length, const AddOverRanks &add_over_ranks,
           const Agree &agree)
  {
    for (stage = 0; stage < n_stages; ++stage) {
      find_shifts();
      for (unsigned int iteration = 0; iteration < most_iterations; ++iteration) {
        std::fill(sums.begin(), sums.end(), 0.);
        add(first, -1., center, length);
        add(second, 1., center, length);
        add_over_ranks(sums);
        if (agree(improve()))
          break;
      }
    }
  }

  /// The planes of a step are where the next one begins.
  void persist(Archive &archive) { archive(planes); }

  /// Unit vector from the first body to the second; zero where nothing separates them.
  dealii::Tensor<1, dim> normal(std::size_t site) const { return normal(site, n_stages - 1); }

private:
  dealii::Tensor<1, dim> normal(std::size_t site, unsigned int of_stage) const;
  static constexpr unsigned int n_stages = 2;
  static constexpr unsigned int most_iterations = 40;
  static constexpr double share_to_surface = 0.75;

  /// How points are moved towards the surface in this stage.
  void find_shifts();
  void add(const NearPoints<dim> &points, double side, const std::vector<dealii::Point<dim>> &center,
           double length);
  /// One Newton step for the planes that have not been found; true if all have been.
  bool improve();

  std::vector<double> sums;
  unsigned int stage = 0;
  std::array<std::vector<double>, n_stages> planes; ///< n_unknowns a site
  /// Directions in which points of the first body are moved towards its surface, those of the second the
  /// other way.
  std::vector<dealii::Tensor<1, dim>> shifts;
  std::vector<char> settled; ///< by site: its plane has been found in this stage
};
} // namespace peat
