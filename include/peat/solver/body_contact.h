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
  void begin(double time, double dt) override;
  double solve() override;
  void finish(Ledger<dim> &book) override;
  void mark_nodes(const Continuum<dim> &continuum, std::vector<char> &count) const override;
  void constrain_flux() override;
  void constrain_carrying_velocity() override;

private:
  using Vector = typename ContactPair<dim>::Vector;

  void find_normals();
  void find_gaps();
  /// Replace values of sites by their sums (or largest values) over ranks; `side` says whose nodes know them.
  void add_over_ranks(std::vector<double> &values, unsigned int n_columns, const Continuum<dim> &side) const;
  void max_over_ranks(std::vector<double> &values, const Continuum<dim> &side) const;
  template <typename Combine>
  void over_ranks(std::vector<double> &values, unsigned int n_columns, const Continuum<dim> &side,
                  const Combine &combine) const;
  std::vector<const Body<dim> *> pointers(const std::vector<std::size_t> &bodies) const;
  const Continuum<dim> &continuum(const unsigned int side) const { return side == 0 ? first : second; }

  const SchemeParameters &scheme;
  const Grid<dim> &grid;
  const Scene<dim> &scene;
  Continuum<dim> &first, &second;
  const std::vector<std::size_t> first_bodies, second_bodies;
  const bool parallel;
  double step_length = 0.;

  std::vector<ContactSite<dim>> sites;
  std::vector<dealii::Point<dim>> places;
  std::array<NearPoints<dim>, 2> near;
  std::array<std::vector<double>, 2> volume_gradient; ///< dim columns a site [m^(dim-1)]
  SeparatingPlanes<dim> planes;
  mutable std::vector<double> all_nodes; ///< scratch for sums over ranks
};
} // namespace peat
