#pragma once

#include <peat/contact/separating_plane.h>
#include <peat/solver/contact_pair.h>

namespace peat {
/// Contact of two deformable bodies (or of what is tied to them): at the nodes that both continua share.
template <int dim>
class BodyContact : public ContactPair<dim>
{
public:
  /// @param first_bodies places in scene.bodies of those of the first continuum that take part
  BodyContact(const ContactParameters<dim> &parameters, const SchemeParameters &scheme, const Grid<dim> &grid,
              const Scene<dim> &scene, Continuum<dim> &first, Continuum<dim> &second,
              std::vector<std::size_t> first_bodies, std::vector<std::size_t> second_bodies);

  void match_nodes() override;
  void begin(double dt) override;
  double solve() override;
  double outdated_change() override;
  void hold() override;
  void restrain_motion() override;
  void restrain_flux() override;
  void take_reactions() override;
  void finish(Ledger<dim> &book) override;
  void mark_nodes(const Continuum<dim> &continuum, std::vector<char> &count) const override;
  void note_late_forces() override;
  void constrain_flux() override;
  void constrain_carrying_velocity() override;
  void persist(Archive &archive) override;

private:
  using Vector = typename ContactPair<dim>::Vector;
  using Response = typename ContactPair<dim>::Response;
  using ContactPair<dim>::sites;
  using ContactPair<dim>::held_sites;

  void find_volume_gradients();
  /// Gradient of a body's volume at a site, out of the body [m^(dim-1)].
  Vector outward(unsigned int side, std::size_t s) const;
  void find_normals();
  void find_gaps();
  /// How far each body reaches from the sites towards the other along their normals, by `list` of the points
  /// that reach them.
  template <typename List>
  void find_edges(const std::array<const List *, 2> &lists);
  /// Sites where surfaces are near each other, and the points that reach them. False if there are none, on
  /// any rank.
  bool find_near_sites();
  /// At these sites, moments of the places where the bodies' surfaces are.
  void find_moments();
  void straighten_normals();
  /// Between the mean surfaces, where both bodies are [m].
  double mean_gap(std::size_t s, double h) const;
  void find_surfaces();
  /// Of both surfaces.
  Vector compliance_of(const ContactSite<dim> &site) const;
  /// The impulse that the law allows, given the velocities with that which has acted.
  Response respond_at(const ContactSite<dim> &site, const Vector &compliance) const;
  /// Of bodies that are tied.
  void take_all_nodes();
  /// Replace values of sites by their sums (or largest values) over ranks; `side` says whose nodes know them.
  template <typename Combine>
  void over_ranks(std::vector<double> &values, unsigned int n_columns, unsigned int side,
                  const Combine &combine);
  void add_over_ranks(std::vector<double> &values, unsigned int n_columns, unsigned int side);
  std::vector<const Body<dim> *> pointers(const std::vector<std::size_t> &bodies) const;
  const Continuum<dim> &continuum(const unsigned int side) const { return side == 0 ? first : second; }
  std::uint32_t node(const ContactSite<dim> &site, const unsigned int side) const
  {
    return side == 0 ? site.first : site.second;
  }
  bool has_mass(const ContactSite<dim> &site) const
  {
    return first.mass(site.first) > 0. && second.mass(site.second) > 0.;
  }

  Continuum<dim> &first, &second;
  const std::vector<std::size_t> first_bodies, second_bodies;

  std::vector<std::uint32_t> site_of_node; ///< by the first continuum's nodes
  std::vector<dealii::Point<dim>> places;
  std::array<NearPoints<dim>, 2> near;
  std::array<std::vector<double>, 2> volume_gradient; ///< dim columns a site [m^(dim-1)]
  std::array<std::vector<double>, 2> edge; ///< how far a body reaches from the site towards the other [m]
  std::vector<char> is_near;               ///< by site: surfaces may touch soon
  using Entries = std::vector<typename NearPoints<dim>::Entry>;
  std::array<Entries, 2> near_entries;       ///< at such sites, of points that know where the surface is
  std::vector<std::uint32_t> strip_of_entry; ///< the strip that its point is in, by near entry of one side
  std::vector<double> heights;               ///< of the surface over the site, by near entry of one side [m]
  /// Columns: weight; mean place of the surface, from the site; covariance, as a full matrix.
  static constexpr unsigned int n_moments = 1 + dim + dim * dim;
  std::array<std::vector<double>, 2> moments;
  /// How far one body reaches from the site towards the other within strips of half a cell beside it, in 3-D
  /// columns [m]; n_strips columns.
  static constexpr int strips_per_axis = 6;
  static constexpr unsigned int n_strips = dim == 2 ? strips_per_axis : strips_per_axis * strips_per_axis;
  std::vector<double> foremost;
  static unsigned int strip(const ContactSite<dim> &site, const dealii::Point<dim> &x, double width);
  std::array<std::vector<double>, 2> areas; ///< of the interface, by site
  std::vector<double> both_areas;
  SiteLines<dim> lines;
  std::array<NodalAdditions<dim>, 2> noted;
  SeparatingPlanes<dim> planes;
  std::vector<double> nodal_values; ///< scratch for sums over ranks
};
} // namespace peat
