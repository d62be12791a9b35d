#pragma once

#include <peat/grid/active_nodes.h>

#include <deal.II/base/tensor.h>

#include <array>
#include <limits>
#include <vector>

namespace peat {
/// How a continuum's surface moves at a contact site: with the mean velocity of neighbours on a line of the
/// mesh, each weighted by the share of the surface that it carries. A pressure on the surface acts on them by
/// the same shares.
struct SurfaceNodes
{
  std::array<std::uint32_t, 3> node = {no_index, no_index, no_index};
  std::array<double, 3> weight = {0., 0., 0.};
  /// Of the interface that each node carries, by which fluid may leave the body [m^(dim-1)].
  std::array<double, 3> area = {0., 0., 0.};
};

/// What surfaces do at a site: they are free, keep their distance, or move as one.
enum class ContactMode { open, slides, sticks };

/// A place at which two bodies may touch.
template <int dim>
struct ContactSite
{
  static constexpr double far = std::numeric_limits<double>::max(); ///< gap where no point is near [m]
  /// Points that reach less far than the foremost one by this say with it where a surface is [cell sizes].
  static constexpr double surface_range = 0.25;
  /// By so much the gap of the nearest points may be less than the mean of those near them, and still count
  /// [cell sizes].
  static constexpr double gap_slack = 0.02;

  std::uint32_t first = no_index;  ///< the nearest node, of the first continuum; no_index of a rigid body
  std::uint32_t second = no_index; ///< the same node, of the second continuum
  bool counts = false;             ///< this rank handles it
  bool acts = false;               ///< the interface is here
  bool shares_line = false;        ///< a neighbour on its line carries as much
  /// Places of the sites whose nodes move with this one's surface; itself first, no_index where there is
  /// none.
  std::array<std::uint32_t, 3> line;
  SurfaceNodes first_surface, second_surface;
  dealii::Point<dim> x;                     ///< where forces act
  dealii::Tensor<1, dim> normal;            ///< from the first body to the second
  double gap = 0.;                          ///< between their surfaces [m]; negative if they overlap
  double area = 0.;                         ///< of the interface [m^(dim-1)]
  double height = 0.;                       ///< of the interface above the nearest node, along the normal [m]
  dealii::Tensor<1, dim> impulse;           ///< of this step, on the second body [N s]
  dealii::Tensor<1, dim> relative_velocity; ///< of the first body, at the start of the step [m/s]
  ContactMode mode = ContactMode::open;     ///< in which the impulse was found

  // While pore pressures are solved for.
  double normal_mass = 0.;         ///< force over relative acceleration along the normal [kg]
  dealii::Tensor<1, dim> mass;     ///< the same in each direction; where the bodies move as one
  bool closes_flux = false;        ///< no fluid passes
  dealii::Tensor<1, dim> reaction; ///< to what is tried, on the second body [N]
};

/// Which sites of an interface act, and which nodes carry it there (theory.md, eq. 41).
template <int dim>
class SiteLines
{
public:
  using Sites = std::vector<ContactSite<dim>>;

  /// Of all sites with a gap and a normal, find those that act: one for each line of the mesh that meets the
  /// interface, at the node that carries most of it; and the nodes of that line which carry the rest. Each
  /// node belongs to one site at most.
  /// @param nodes of one of the continua
  /// @param node its numbers in the sites
  /// @param areas of the interface, by site [m^(dim-1)]
  void find(const ActiveNodes<dim> &nodes, std::uint32_t ContactSite<dim>::*node,
            const std::vector<std::uint32_t> &site_of_node, const std::vector<double> &areas, Sites &sites);
  /// Weights by the areas that nodes carry. Returns their sum.
  static double weigh(const Sites &sites, const ContactSite<dim> &site, std::uint32_t ContactSite<dim>::*node,
                      const std::vector<double> &areas, SurfaceNodes &surface);

private:
  std::vector<std::uint32_t> owner_of_site; ///< the site whose line it is on
};
} // namespace peat
