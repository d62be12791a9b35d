// What is written about rigid bodies, and how they are refused. Also to be run on several ranks.

#define BOOST_TEST_MODULE rigid_output
#include <boost/test/unit_test.hpp>

#include "output_scene.h"
#include "picture_file.h"

#include <peat/simulation/pictures.h>
#include <peat/simulation/statistics.h>
#include <peat/simulation/table.h>

#include <boost/property_tree/ptree.hpp>

#include <cmath>

BOOST_TEST_GLOBAL_FIXTURE(Mpi);

namespace {
template <int dim>
std::string rigid(const std::string &lines)
{
  return "subsection Rigid bodies\n  subsection tamper\n" + lines + "\n  end\nend\n";
}

template <int dim>
std::string floating_box()
{
  return std::string("set Shape = ") +
         (dim == 2 ? "box(0.2, 1.1, 0.6, 1.3)" : "box(0.2, 0.2, 1.1, 0.6, 0.5, 1.3)");
}

/// Every place on the surface in a picture is on the body's surface, edges as far as the mesh of the surface
/// is wide, and has the velocity of its place.
template <int dim>
void check_surface(const RigidBody<dim> &body, const std::string &file, const double tolerance)
{
  std::size_t n = 0;
  const std::vector<float> positions = array(file, "", n, "Points");
  const std::vector<float> velocities = array(file, "velocity", n);
  BOOST_REQUIRE(positions.size() == 3 * n);
  BOOST_REQUIRE(velocities.size() == 3 * n);
  BOOST_REQUIRE(n >= 12u);
  dealii::Point<dim> sum;
  for (std::size_t i = 0; i < n; ++i) {
    dealii::Point<dim> x;
    dealii::Tensor<1, dim> v;
    for (unsigned int d = 0; d < dim; ++d) {
      x[d] = positions[3 * i + d];
      v[d] = velocities[3 * i + d];
    }
    BOOST_TEST_INFO(x);
    BOOST_TEST(std::abs(body.distance(x)) <= tolerance);
    BOOST_TEST_INFO(x);
    BOOST_TEST((body.velocity_at(x) - v).norm() <= 1e-5);
  }
}

template <int dim>
void check_pictures()
{
  World<dim> world(2, rigid<dim>(floating_box<dim>() + "\nset Motion = prescribed\nset Velocity = " +
                                 (dim == 2 ? "3, -4\nset Spin = 2" : "3, -4, 5\nset Spin = 2, -1, 0.5")));
  RigidBody<dim> &body = *world.scene.rigid_bodies.at(0);
  Pictures<dim> pictures(".", world.scene, comm);
  pictures.write(0., world.nodes, world.fields);
  body.begin_step(0., 0.5, {});
  body.end_step();
  pictures.write(0.5, world.nodes, world.fields);
  if (rank() == 0) {
    check_surface(body, "pictures/tamper-0001.vtu", 0.4 / (dim == 2 ? 128. : 40.));
    boost::property_tree::ptree list;
    boost::property_tree::read_xml("solution.pvd", list);
    BOOST_TEST(list.get_child("VTKFile.Collection").size() == 8u);
  }
}
} // namespace

BOOST_AUTO_TEST_CASE(pictures_2d)
{
  const Directory directory;
  check_pictures<2>();
}

BOOST_AUTO_TEST_CASE(pictures_3d)
{
  const Directory directory;
  check_pictures<3>();
}

BOOST_AUTO_TEST_CASE(pictures_show_the_triangles_of_a_file)
{
  const Directory directory;
  // A tetrahedron.
  const char *corner[4] = {"0.2 0.2 1.2", "0.6 0.2 1.2", "0.2 0.6 1.2", "0.2 0.2 1.6"};
  std::string text = "solid tetrahedron\n";
  for (const auto &t : {std::array<int, 3>{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const int c : t)
      text += std::string("vertex ") + corner[c] + '\n';
    text += "endloop\nendfacet\n";
  }
  write_file("part.stl", text + "endsolid tetrahedron\n");
  World<3> world(2, rigid<3>("set Shape = stl(part.stl)\nset Density = 1000"));
  RigidBody<3> &body = *world.scene.rigid_bodies.at(0);
  BOOST_TEST(std::abs(body.mass() - 1000. * 0.064 / 6.) <= 1e-9);
  Pictures<3> pictures(".", world.scene, comm);
  pictures.write(0., world.nodes, world.fields);
  if (rank() == 0) {
    check_surface(body, "pictures/tamper-0000.vtu", 1e-6);
    std::size_t n = 0;
    array("pictures/tamper-0000.vtu", "velocity", n);
    BOOST_TEST(n == 12u);
  }
}

BOOST_AUTO_TEST_CASE(statistics)
{
  const Directory directory;
  World<2> world(2, rigid<2>(floating_box<2>() + "\nset Density = 1000\nset Initial velocity = 3, -4\n"
                                                 "set Initial spin = 2"));
  RigidBody<2> &body = *world.scene.rigid_bodies.at(0);
  body.begin_step(0., 0.5, dealii::Tensor<1, 2>({0., -10.}));
  body.end_step();
  body.last_force = dealii::Tensor<1, 2>({5., 6.});
  body.last_moment[0] = 7.;
  const Totals<2> sums = totals(world.scene, comm);
  // m v^2/2 + m (a^2 + b^2)/12 w^2/2 with m = 80 kg/m.
  BOOST_TEST(sums.kinetic_energy == 0.5 * 80. * (9. + 81.) + 0.5 * 80. * 0.2 / 12. * 4.,
             boost::test_tools::tolerance(1e-7));
  BOOST_TEST(sums.momentum[0] == 240., boost::test_tools::tolerance(1e-7));
  if (rank() == 0) {
    Statistics<2> statistics(".", world.scene, true);
    statistics.write(0.5, 1, 0.5, "output", sums, Balances<2>(sums));
    const std::string text = read_file("statistics.csv");
    std::istringstream lines(text);
    std::string head, row;
    std::getline(lines, head);
    std::getline(lines, row);
    const auto value = [&](const std::string &name) {
      std::istringstream heads(head), values(row);
      std::string one, number;
      while (std::getline(heads, one, ',') && std::getline(values, number, ','))
        if (one == name)
          return std::stod(number);
      BOOST_FAIL("no column " + name);
      return 0.;
    };
    BOOST_TEST(value("tamper/position x [m]") == 0.4 + 1.5, boost::test_tools::tolerance(1e-9));
    BOOST_TEST(value("tamper/position y [m]") == 1.2 - 2. - 1.25, boost::test_tools::tolerance(1e-9));
    BOOST_TEST(value("tamper/velocity y [m/s]") == -9.);
    BOOST_TEST(value("tamper/rotation [rad]") == 1.);
    BOOST_TEST(value("tamper/spin [rad/s]") == 2.);
    BOOST_TEST(value("tamper/force y [N]") == 6.);
    BOOST_TEST(value("tamper/moment [N m]") == 7.);
  }
}

BOOST_AUTO_TEST_CASE(overlap_is_refused)
{
  const Directory directory;
  const auto message = [](const std::string &shape) {
    return message_of([&] { World<2> world(4, rigid<2>("set Mass = 1\nset Shape = " + shape)); });
  };
  // The ground reaches up to 1.
  BOOST_TEST(message("box(0.2, 1, 0.6, 1.3)") == "");
  BOOST_TEST(message("box(0.2, 0.999, 0.6, 1.3)") == "");
  BOOST_TEST(contains(message("box(0.2, 0.99, 0.6, 1.3)"), "rigid body 'tamper' and body 'ground' overlap"));
  // Between the points of a body, and around it.
  BOOST_TEST(contains(message("box(0.49, 0.97, 0.51, 1.3)"), "overlap"));
  BOOST_TEST(contains(message("polygon(0.5, 0.95, 0.7, 1.3, 0.3, 1.3)"), "overlap"));
  BOOST_TEST(contains(message("ball(1, 1, 3)"), "overlap"));
}
