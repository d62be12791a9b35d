#pragma once

#include <peat/contact/near_points.h>
#include <peat/contact/rigid_body.h>
#include <peat/solver/contact_site.h>

#include <functional>

namespace peat {
/// Where a rigid body may touch some bodies: their nodes near its surface, with the gaps of the points there,
/// its normals, and the areas of the interface (theory.md, contact). One geometry for explicit and implicit
/// steps.
template <int dim>
class RigidSites
{
public:
  /// @param bodies those that the rigid body may touch
  /// @param sites are found here; `second` is their node
  RigidSites(const Grid<dim> &grid, Basis basis, const RigidBody<dim> &rigid,
             std::vector<const Body<dim> *> bodies, std::vector<ContactSite<dim>> &sites);

  /// Choose the nodes near the rigid body: they have new numbers, or the choice is outdated.
  void choose(const ActiveNodes<dim> &nodes);
  /// Whether the rigid body has moved so far that other nodes may matter.
  bool is_outdated() const;
  /// The last choice.
  void persist(Archive &archive, const ActiveNodes<dim> &nodes);
  /// Find normals, gaps and areas, and which sites act. Collective.
  /// @param has_mass whether a node has any
  void find(const ActiveNodes<dim> &nodes, const std::function<bool(std::uint32_t)> &has_mass);

private:
  using Vector = dealii::Tensor<1, dim>;
  using Corners = std::array<dealii::Point<dim>, (1u << dim)>;

  /// Where a point's box comes nearest to the rigid body.
  struct Approach
  {
    double gap = ContactSite<dim>::far; ///< [m]
    Vector normal;                      ///< of the rigid body, there
    dealii::Point<dim> place;           ///< on its surface
  };

  void take(const ActiveNodes<dim> &nodes, const std::vector<std::uint32_t> &chosen);
  Corners corners() const;
  Approach approach(const typename NearPoints<dim>::PointData &point) const;
  /// Of a point alone.
  Approach at(const dealii::Point<dim> &x) const;
  void find_gaps(const ActiveNodes<dim> &nodes, const std::function<bool(std::uint32_t)> &has_mass);
  void find_surfaces(const ActiveNodes<dim> &nodes);
  double *values_of(const ContactSite<dim> &site) { return &sums[std::size_t(index_of(site)) * n_columns]; }
  /// Where the site's sums over ranks stand.
  std::size_t index_of(const ContactSite<dim> &site) const
  {
    return parallel ? site.second : site_of_node[site.second];
  }

  const Grid<dim> &grid;
  const Basis basis;
  const RigidBody<dim> &rigid;
  const std::vector<const Body<dim> *> bodies;
  const bool parallel;
  std::vector<ContactSite<dim>> &sites;

  std::vector<std::uint32_t> site_of_node;
  NearPoints<dim> near;
  SiteLines<dim> lines;
  /// Where the corners of the rigid body's box were when the nodes were chosen.
  Corners corners_of_choice;

  // Of a step, here to keep their memory.
  std::vector<Approach> approaches; ///< of the points near the rigid body
  std::vector<double> areas;        ///< of the interface, by site
  /// By index_of(): least distance of the bodies' points, negative; sums over them (see find_gaps()).
  std::vector<double> nearest, sums;
  static constexpr unsigned int touch_column = 2 + 2 * dim, gradient_column = 3 + 4 * dim;
  static constexpr unsigned int n_columns = 3 + 5 * dim;
};
} // namespace peat
