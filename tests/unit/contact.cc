#define BOOST_TEST_MODULE contact
#include <boost/test/unit_test.hpp>

#include "output_scene.h"
#include "section.h"

#include <peat/contact/contact_law.h>
#include <peat/contact/separating_plane.h>

BOOST_TEST_GLOBAL_FIXTURE(Mpi);

// What an interface bears, and where contact sees surfaces and their normals.

namespace {
std::unique_ptr<ContactLaw> law(const std::string &lines)
{
  return from_text(lines, [](const Section &section) { return make_contact_law(section); });
}

/// Two bodies in a mesh of cells of size 1/8, and what contact knows at the nodes that both reach.
template <int dim>
struct Meeting
{
  Meeting(const std::string &lower_shape, const std::string &upper_shape)
  {
    const std::string zeros = dim == 2 ? "0, 0" : "0, 0, 0", twos = dim == 2 ? "2, 2" : "2, 2, 2";
    std::ostringstream text;
    text << "set Dimension = " << dim << "\nsubsection Grid\n set Lower corner = " << zeros
         << "\n set Upper corner = " << twos << "\n set Cells = " << (dim == 2 ? "16, 16" : "16, 16, 16")
         << "\nend\nsubsection Materials\n subsection m\n set Density = 1000\n end\nend\nsubsection Bodies\n"
         << " subsection lower\n set Material = m\n set Shape = " << lower_shape << "\n end\n"
         << " subsection upper\n set Material = m\n set Shape = " << upper_shape << "\n end\nend\n"
         << "subsection Contacts\n subsection c\n set Bodies = lower, upper\n set Law = frictionless\n "
            "end\nend\n"
         << "subsection Stages\n subsection s\n set Duration = 1\n end\nend\n";
    write_file("meeting.prm", text.str());
    file = std::make_unique<ParameterFile>("meeting.prm", std::vector<std::string>());
    read_dimension(*file);
    parameters = std::make_unique<Case<dim>>(*file);
    grid = std::make_unique<Grid<dim>>(parameters->grid, comm);
    scene = make_scene(*parameters, *grid);

    for (unsigned int side = 0; side < 2; ++side) {
      nodes.push_back(std::make_unique<ActiveNodes<dim>>(*grid, 4));
      std::vector<CellId> cells;
      for (const Slice &slice : scene.bodies[side]->slices())
        cells.push_back(slice.cell);
      nodes[side]->rebuild(cells);
    }
    std::vector<std::uint32_t> site_of_node[2];
    for (unsigned int side = 0; side < 2; ++side)
      site_of_node[side].assign(nodes[side]->size(), no_index);
    for (std::uint32_t i = 0; i < nodes[0]->size(); ++i)
      if (const std::uint32_t j = nodes[1]->index_of(nodes[0]->grid_node(i)); j != no_index) {
        site_of_node[0][i] = site_of_node[1][j] = places.size();
        places.push_back(nodes[0]->position(i));
      }
    for (unsigned int side = 0; side < 2; ++side) {
      near[side].choose(*nodes[side], Basis::gimp, {scene.bodies[side].get()}, site_of_node[side]);
      near[side].collect(*nodes[side]);
    }
    planes.reinit(places.size());
    planes.fit(
        near[0], near[1], places, 0.125, [](std::vector<double> &) {}, [](const bool c) { return c; });
  }

  /// Equation (43) at a site with a normal.
  double gap(const std::uint32_t site, const dealii::Tensor<1, dim> &n) const
  {
    double edge[2] = {-1e10, -1e10};
    for (unsigned int side = 0; side < 2; ++side)
      for (const auto &entry : near[side].entries())
        if (const auto &point = near[side].points()[entry.point]; entry.site == site && point.depth > 0.)
          edge[side] = std::max(edge[side], (side == 0 ? 1. : -1.) * (dealii::Tensor<1, dim>(point.x) * n) +
                                                point.reach(n));
    return -edge[0] - edge[1];
  }
  bool both_reach(const std::uint32_t site) const
  {
    bool found[2] = {false, false};
    for (unsigned int side = 0; side < 2; ++side)
      for (const auto &entry : near[side].entries())
        found[side] = found[side] || entry.site == site;
    return found[0] && found[1];
  }

  Directory directory;
  std::unique_ptr<ParameterFile> file;
  std::unique_ptr<Case<dim>> parameters;
  std::unique_ptr<Grid<dim>> grid;
  Scene<dim> scene;
  std::vector<std::unique_ptr<ActiveNodes<dim>>> nodes;
  NearPoints<dim> near[2];
  std::vector<dealii::Point<dim>> places;
  SeparatingPlanes<dim> planes;
};
} // namespace

BOOST_AUTO_TEST_CASE(laws)
{
  const auto coulomb = law("set Law = coulomb\nset Friction = 0.4\nset Static friction = 0.5");
  BOOST_TEST(coulomb->shear_limit(10., 2., true) == 4.);
  BOOST_TEST(coulomb->shear_limit(10., 2., false) == 5.);
  BOOST_TEST(coulomb->tension_limit(2.) == 0.);
  BOOST_TEST(coulomb->on_effective_stress());
  BOOST_TEST(
      !law("set Law = coulomb\nset Friction = 0.4\nset Friction on = total stress")->on_effective_stress());
  const auto adhesive = law("set Law = adhesive\nset Friction = 0.1\nset Adhesion = 100");
  BOOST_TEST(adhesive->shear_limit(10., 2., true) == 201.);
  BOOST_TEST(adhesive->tension_limit(2.) == 200.);
  BOOST_TEST(law("set Law = frictionless")->shear_limit(10., 2., true) == 0.);
  BOOST_TEST(law("set Law = stick")->shear_limit(1., 1., true) > 1e300);
  BOOST_TEST(law("set Law = tied")->ties());
  BOOST_CHECK_THROW(law("set Law = coulomb"), InputError);
  BOOST_CHECK_THROW(law("set Law = coulomb\nset Friction = 0.4\nset Static friction = 0.3"), InputError);
  BOOST_CHECK_THROW(law("set Law = frictionless\nset Friction = 0.4"), InputError);
}

BOOST_AUTO_TEST_CASE(flat_faces_and_corners)
{
  // A block whose corners are inside the lower face: a normal from volumes alone would lean there.
  const Meeting<2> meeting("box(0, 0, 2, 1)", "box(0.6, 1.01, 1.3, 1.6)");
  unsigned int n_sites = 0;
  for (std::uint32_t site = 0; site < meeting.places.size(); ++site)
    if (meeting.both_reach(site)) {
      ++n_sites;
      const auto n = meeting.planes.normal(site);
      // Two degrees: what the penalty leaves at a corner.
      BOOST_TEST(n[1] > std::cos(2. * 3.1416 / 180.), "normal " << n << " at " << meeting.places[site]);
      BOOST_TEST(std::abs(meeting.gap(site, dealii::Point<2>(0., 1.)) - 0.01) < 1e-12);
    }
  BOOST_TEST(n_sites > 4u);
}

BOOST_AUTO_TEST_CASE(tilted_faces)
{
  const double angle = 20. * 3.14159265358979 / 180.;
  const Meeting<2> meeting("intersection(box(0, 0, 2, 2), halfspace(1, 1, -sin(pi/9), cos(pi/9)))",
                           "rotate(box(0.6, 1.02, 1.4, 1.5), 20, 1, 1)");
  const dealii::Point<2> exact(-std::sin(angle), std::cos(angle));
  unsigned int n_sites = 0;
  for (std::uint32_t site = 0; site < meeting.places.size(); ++site)
    if (meeting.both_reach(site) && std::abs(meeting.places[site][0] - 1.) < 0.2) {
      ++n_sites;
      // Points of cut cells lie unevenly below the face.
      BOOST_TEST(meeting.planes.normal(site) * exact > std::cos(3. * 3.1416 / 180.));
      BOOST_TEST(std::abs(meeting.gap(site, exact) - 0.02) < 1e-6);
    }
  BOOST_TEST(n_sites > 3u);
}

BOOST_AUTO_TEST_CASE(flat_faces_in_space)
{
  const Meeting<3> meeting("box(0, 0, 0, 2, 2, 1)", "box(0.6, 0.6, 1.01, 1.3, 1.3, 1.6)");
  for (std::uint32_t site = 0; site < meeting.places.size(); ++site)
    if (meeting.both_reach(site)) {
      BOOST_TEST(meeting.planes.normal(site)[2] > std::cos(2. * 3.1416 / 180.));
      BOOST_TEST(std::abs(meeting.gap(site, dealii::Point<3>(0., 0., 1.)) - 0.01) < 1e-12);
    }
}
