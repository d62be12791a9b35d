// What is written and compared: fields by name, means, projections, probes, pictures, references.
// Also to be run on several ranks.

#define BOOST_TEST_MODULE output
#include <boost/test/unit_test.hpp>

#include "output_scene.h"
#include "picture_file.h"

#include <peat/simulation/comparison.h>
#include <peat/simulation/pictures.h>
#include <peat/simulation/probes.h>
#include <peat/simulation/projection.h>
#include <peat/simulation/table.h>

#include <deal.II/base/mpi.h>

#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>

#include <cmath>
#include <filesystem>
#include <sstream>

namespace {
/// Largest error of the projection of one body's field over the nodes.
template <int dim>
double projection_error(const World<dim> &world, const Body<dim> &body, const std::string &field,
                        const std::function<double(const dealii::Point<dim> &)> &f)
{
  const NodalProjection<dim> projection(world.nodes, cell_means<dim>({&body}, {field}));
  double error = 0.;
  for (unsigned int i = 0; i < world.nodes.size(); ++i)
    if (!std::isnan(projection.value(i, 0)))
      error = std::max(error, std::abs(projection.value(i, 0) - f(world.nodes.position(i))));
  return dealii::Utilities::MPI::max(error, comm);
}
} // namespace

BOOST_TEST_GLOBAL_FIXTURE(Mpi);

BOOST_AUTO_TEST_CASE(fields_by_name)
{
  const Directory directory;
  World<2> world(2, "", "hencky");
  const Body<2> &ground = *world.scene.bodies[0], &block = *world.scene.bodies[1];
  std::vector<double> row(ground.layout().n_columns);
  for (std::size_t c = 0; c < row.size(); ++c)
    row[c] = 1. + c;
  const auto get = [&](const Body<2> &body, const std::string &name) {
    const FieldAccess access(name, body.layout(), body.material());
    return access.available() ? access(row.data()) : std::nan("");
  };
  const Layout &layout = ground.layout();
  BOOST_TEST(get(ground, "pressure") == row[layout.pressure]);
  BOOST_TEST(get(ground, "displacement y") == row[layout.displacement + 1]);
  BOOST_TEST(get(ground, "effective stress zz") == row[layout.stress + 2]);
  BOOST_TEST(get(ground, "effective stress xy") == row[layout.stress + 3]);
  BOOST_TEST(get(ground, "total stress xx") == row[layout.stress] - row[layout.pressure]);
  BOOST_TEST(get(ground, "total stress xy") == row[layout.stress + 3]);
  BOOST_TEST(get(ground, "mean effective stress") == row[layout.stress + 1]);
  BOOST_TEST(get(ground, "density") == row[layout.mass] / row[layout.volume]);
  BOOST_TEST(get(ground, "speed") == std::hypot(row[layout.velocity], row[layout.velocity + 1]));
  BOOST_TEST(get(ground, "porosity") == row[layout.porosity]);
  BOOST_TEST(get(block, "total stress xx") == row[block.layout().stress]);
  BOOST_TEST(std::isnan(get(block, "pressure")));
  BOOST_TEST(std::isnan(get(block, "porosity")));
  BOOST_TEST(std::isnan(get(ground, "displacement z")));
  for (const Layout::Field &field : layout.fields)
    if (field.kind == Layout::Kind::other && field.n_components == 9) {
      BOOST_TEST(get(ground, field.name + " 11") == row[field.first_column]);
      BOOST_TEST(get(ground, field.name + " 32") == row[field.first_column + 7]);
    }

  const World<2> small(2);
  const Body<2> &sand = *small.scene.bodies[0];
  BOOST_TEST(FieldAccess("porosity", sand.layout(), sand.material())(row.data()) == 0.4);
  BOOST_TEST(FieldAccess("effective stress xx", sand.layout(), sand.material()).unit() == "Pa");
}

BOOST_AUTO_TEST_CASE(unknown_fields)
{
  const Directory directory;
  const auto reference = [](const std::string &lines) {
    return message_of([&] {
      World<2> world(2,
                     "subsection References\n  subsection check\nset Value = 0\n" + lines + "\n  end\nend\n");
      Comparison<2> comparison(*world.parameters, ".");
    });
  };
  BOOST_TEST(contains(reference("set Field = presure"), "did you mean 'pressure'"));
  BOOST_TEST(contains(reference("set Field = presure"), "case.prm:"));
  BOOST_TEST(
      contains(reference("set Field = pressure\nset Body = block"), "body 'block' has no field 'pressure'"));
  BOOST_TEST(contains(reference("set Field = pressure\nset Body = grund"), "did you mean 'ground'"));
  BOOST_TEST(contains(reference("set Field = pressure\nset Times = 2"), "the run ends at 1 s"));
  BOOST_TEST(reference("set Field = pressure\nset Body = ground") == "");
}

BOOST_AUTO_TEST_CASE(means_over_cells)
{
  const Directory directory;
  World<2> world(4);
  world.set(linear<2>);
  const auto means = cell_means(world.bodies(), {"effective stress yy", "velocity x"});
  double volume = 0., error = 0.;
  for (std::size_t e = 0; e < means.size(); ++e) {
    volume += means.volume[e];
    error = std::max(error, std::abs(means.value(e, 0) - linear(means.centroid[e])));
    error = std::max(error, std::abs(means.value(e, 1) - linear(means.centroid[e])));
  }
  BOOST_TEST(dealii::Utilities::MPI::max(error, comm) < 1e-12);
  const double pi = std::acos(-1.);
  BOOST_TEST(dealii::Utilities::MPI::sum(volume, comm) == 1. + pi * 0.16, boost::test_tools::tolerance(1e-3));
  const auto pressures = cell_means(world.bodies(), {"pressure"});
  double wet = 0.;
  for (const double V : pressures.volume)
    wet += V;
  BOOST_TEST(dealii::Utilities::MPI::sum(wet, comm) == 1., boost::test_tools::tolerance(1e-12));
}

template <int dim>
void check_projection()
{
  const std::string q1 = "subsection Explicit MPM\n  set Basis = q1\nend\n";
  for (const std::string &more : {std::string(), q1}) {
    World<dim> world(4, more);
    world.set(linear<dim>);
    BOOST_TEST(projection_error<dim>(world, *world.scene.bodies[0], "pressure", linear<dim>) < 1e-11);
    BOOST_TEST(projection_error<dim>(world, *world.scene.bodies[1], "velocity x", linear<dim>) < 1e-11);
    world.set([](const dealii::Point<dim> &) { return 7.; }, true);
    BOOST_TEST(projection_error<dim>(world, *world.scene.bodies[1], "velocity x",
                                     [](const dealii::Point<dim> &) { return 7.; }) < 1e-12);
  }
  const auto error = [](const unsigned int n, const unsigned int body) {
    World<dim> world(n);
    world.set(wave<dim>, body == 0); // cut cells have no middle to speak of
    return projection_error<dim>(world, *world.scene.bodies[body], "effective stress yy", wave<dim>);
  };
  const unsigned int n = dim == 2 ? 10 : 5;
  const double coarse = error(n, 0), fine = error(2 * n, 0);
  BOOST_TEST_MESSAGE(dim << "-D projection, box: errors " << coarse << ' ' << fine << ", order "
                         << std::log2(coarse / fine));
  BOOST_TEST(std::log2(coarse / fine) > 1.8);
  const double ball = error(n, 1), finer_ball = error(2 * n, 1);
  BOOST_TEST_MESSAGE(dim << "-D projection, ball: errors " << ball << ' ' << finer_ball << ", order "
                         << std::log2(ball / finer_ball));
  BOOST_TEST(std::log2(ball / finer_ball) > 1.5);
}

BOOST_AUTO_TEST_CASE(projection_2d)
{
  const Directory directory;
  check_projection<2>();
}

BOOST_AUTO_TEST_CASE(projection_3d)
{
  const Directory directory;
  check_projection<3>();
}

BOOST_AUTO_TEST_CASE(tables)
{
  const Directory directory;
  write_file("good.csv", "# comment, with comma\nz [m],p(T=0.1) [Pa]\r\n1,10\n\n# more\n0, 0\n2,\n3,30\n");
  const Table table("good.csv");
  BOOST_TEST(table.names() == (std::vector<std::string>{"z [m]", "p(T=0.1) [Pa]"}),
             boost::test_tools::per_element());
  const Curve curve(table.column("z [m]"), table.column("p(T=0.1) [Pa]"));
  BOOST_TEST(curve.lower() == 0.);
  BOOST_TEST(curve.upper() == 3.);
  BOOST_TEST(curve.value(2.5) == 25., boost::test_tools::tolerance(1e-14));
  BOOST_TEST(contains(message_of([&] { table.column("p [Pa]"); }), "no column 'p [Pa]'; known are 'z [m]'"));
  BOOST_TEST(contains(message_of([] { Table("none.csv"); }), "cannot open the table 'none.csv'"));
  write_file("bad.csv", "a,b\n1,2\n3,x\n");
  BOOST_TEST(contains(message_of([] { Table("bad.csv"); }), "bad.csv:3: 'x' in column 'b' is not a number"));
  write_file("ragged.csv", "a,b\n1,2\n3\n");
  BOOST_TEST(contains(message_of([] { Table("ragged.csv"); }), "ragged.csv:3: the line has 1 entries"));
  write_file("empty.csv", "# nothing\n");
  BOOST_TEST(contains(message_of([] { Table("empty.csv"); }), "holds no numbers"));

  const Curve jump({0., 1., 1., 2.}, {0., 1., 5., 6.});
  BOOST_TEST(jump.value(0.5) == 0.5);
  BOOST_TEST(jump.value(1.) == 1.);
  BOOST_TEST(jump.value(1.5) == 5.5);
}

BOOST_AUTO_TEST_CASE(interpolation)
{
  const auto error = [](const unsigned int n, const std::function<double(double)> &f) {
    std::vector<double> x, y;
    for (unsigned int i = 0; i <= n; ++i) {
      x.push_back(double(i) / n);
      y.push_back(f(x.back()));
    }
    const Curve curve(x, y);
    double largest = 0.;
    for (double t = 0.; t < 1.; t += 1e-3)
      largest = std::max(largest, std::abs(curve.value(t) - f(t)));
    return largest;
  };
  const auto smooth = [](const double x) { return std::cos(1.5 * x); };
  BOOST_TEST_MESSAGE("interpolation of cos(1.5 x), 20, 40, 80 intervals: "
                     << error(20, smooth) << ' ' << error(40, smooth) << ' ' << error(80, smooth));
  BOOST_TEST(error(40, smooth) < 2e-7);
  const auto front = [](const double x) { return std::min(1., std::max(0., 5. * (x - 0.5))); };
  BOOST_TEST_MESSAGE("interpolation of a ramp with kinks, 40 intervals: " << error(40, front));
  BOOST_TEST(error(40, front) < 0.01);
}

namespace {
const std::string probes_text = R"(
subsection Probes
  subsection inside
    set Point = 0.53, 0.41
  end
  subsection top, middle
    set Point = 0.5, 1
  end
  subsection corner
    set Point = 1, 1
  end
  subsection block
    set Point = 1.5, 1.5
  end
  subsection air
    set Point = 0.3, 1.8
    set Follow material = false
  end
  subsection place
    set Point = 0.3, 0.3
    set Follow material = false
  end
end
subsection References
  subsection history
    set Kind = history
    set Field = total stress yy
    set Probe = inside
    set File = history.csv
    set Columns = s [Pa]
    set Start = 0.25
  end
end
)";

std::size_t count(const std::string &text, const char c)
{
  return std::count(text.begin(), text.end(), c);
}
} // namespace

BOOST_AUTO_TEST_CASE(probes)
{
  const Directory directory;
  World<2> world(4, probes_text);
  world.set(linear<2>);
  ProbeWriter<2> probes(*world.parameters, world.scene, world.grid, "probes.csv");
  probes.write(0.);
  const auto at = [](const double x, const double y) { return linear(dealii::Point<2>(x, y)); };
  BOOST_TEST(probes.value("inside", "pressure") == at(0.53, 0.41), boost::test_tools::tolerance(1e-12));
  BOOST_TEST(probes.value("top, middle", "pressure") == at(0.5, 1.), boost::test_tools::tolerance(1e-12));
  BOOST_TEST(probes.value("corner", "velocity x") == at(1., 1.), boost::test_tools::tolerance(1e-12));
  BOOST_TEST(probes.value("block", "effective stress yy") == at(1.5, 1.5),
             boost::test_tools::tolerance(1e-12));
  BOOST_TEST(probes.value("place", "velocity x") == at(0.3, 0.3), boost::test_tools::tolerance(1e-12));
  BOOST_TEST(std::abs(probes.value("inside", "total stress yy")) < 1e-12);
  BOOST_TEST(probes.value("corner", "x") == 1.);
  BOOST_TEST(std::isnan(probes.value("block", "pressure")));
  BOOST_TEST(std::isnan(probes.value("air", "velocity x")));
  BOOST_TEST(probes.value("air", "y") == 1.8);

  std::vector<double> velocity(std::size_t(world.nodes.size()) * 2, 0.);
  for (unsigned int i = 0; i < world.nodes.size(); ++i)
    velocity[2 * i + 1] = -1.;
  world.scene.probes->locate(world.nodes);
  world.scene.probes->move(velocity, 0.01, false, world.nodes);
  probes.write(0.5);
  BOOST_TEST(probes.value("inside", "displacement y") == -0.01, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(probes.value("inside", "pressure") == at(0.53, 0.40), boost::test_tools::tolerance(1e-12));
  BOOST_TEST(probes.value("place", "displacement y") == 0.);
  if (rank() == 0) {
    std::istringstream file(read_file("probes.csv"));
    std::string head, first, second;
    std::getline(file, head);
    std::getline(file, first);
    std::getline(file, second);
    BOOST_TEST(
        head.rfind("time [s],inside/x [m],inside/y [m],inside/displacement x [m],inside/displacement y [m],"
                   "inside/velocity x [m/s],inside/velocity y [m/s],inside/pressure [Pa],"
                   "inside/effective stress xx [Pa],",
                   0) == 0);
    BOOST_TEST(contains(head, ",\"top, middle/x [m]\","));
    BOOST_TEST(contains(head, "total stress yy [Pa]"));
    BOOST_TEST(count(first, ',') + 12 == count(head, ',')); // a comma in a name
    BOOST_TEST(contains(second, ",0.53,0.4,0,-0.01,"));
    BOOST_TEST(contains(first, ",,")); // no pressure in steel
  }
}

BOOST_AUTO_TEST_CASE(probes_3d)
{
  const Directory directory;
  World<3> world(4, "subsection Probes\n  subsection edge\n    set Point = 0.6, 1, 1\n  end\nend\n");
  world.set(linear<3>);
  ProbeWriter<3> probes(*world.parameters, world.scene, world.grid, "probes.csv");
  probes.write(0.);
  BOOST_TEST(probes.value("edge", "pressure") == linear(dealii::Point<3>(0.6, 1., 1.)),
             boost::test_tools::tolerance(1e-12));
}

BOOST_AUTO_TEST_CASE(histories)
{
  const Directory directory;
  write_file("history.csv", "t [s],s [Pa]\n0,0\n1,0\n");
  World<2> world(4, probes_text);
  ProbeWriter<2> probes(*world.parameters, world.scene, world.grid, "probes.csv");
  Comparison<2> comparison(*world.parameters, ".");
  BOOST_TEST(comparison.times().empty());
  BOOST_TEST(std::isnan(comparison.results()[0].relative_L2));
  for (const double t : {0., 0.25, 0.5, 1., 1.5}) {
    for (const std::uint32_t handle : world.scene.bodies[0]->handles())
      world.scene.bodies[0]->row(handle)[world.scene.bodies[0]->layout().stress + 1] = t < 0.5 ? 2. : -4.;
    probes.write(t);
    comparison.compare(probes);
  }
  // 2 at t = 0.25, -4 at 0.5 and 1; 0 is before the start, 1.5 beyond the table.
  const auto result = comparison.results()[0];
  BOOST_TEST(result.norms.n == 3u);
  BOOST_TEST(result.norms.n_outside == 1u);
  BOOST_TEST(result.norms.L1 == (0.125 * 2. + 0.625 * 4.) / 0.75, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(result.norms.L2 == std::sqrt((0.125 * 4. + 0.625 * 16.) / 0.75),
             boost::test_tools::tolerance(1e-12));
  BOOST_TEST(result.norms.Linf == 4., boost::test_tools::tolerance(1e-12));
  BOOST_TEST(result.unit == "Pa");
}

BOOST_AUTO_TEST_CASE(profiles_and_formulas)
{
  const Directory directory;
  std::ostringstream table;
  table << "y [m],p(T=0.1) [Pa],wrong [Pa]\n";
  for (int i = 0; i <= 20; ++i)
    table << 0.05 * i << ',' << 3. - 0.25 * i << ',' << 3.5 - 0.25 * i << '\n';
  write_file("profile.csv", table.str());
  World<2> world(4, R"(subsection References
  subsection profile
    set Kind = profile
    set Field = pressure
    set File = profile.csv
    set Columns = p(T=0.1) [Pa], wrong [Pa]
    set Times = 0.5, 1
    set Scale = 10
  end
  subsection formula
    set Field = effective stress yy
    set Value = 2 - 5*y + t
  end
  subsection points
    set Field = displacement x
    set Body = ground
    set Single points = true
    set Value = 0.1*x*x
  end
end
)");
  world.set([](const dealii::Point<2> &x) { return 3. - 5. * x[1]; });
  Body<2> &ground = *world.scene.bodies[0];
  for (const std::uint32_t handle : ground.handles()) {
    const double X = ground.position(handle)[0];
    ground.row(handle)[ground.layout().displacement] = 0.1 * X * X;
    ground.position(handle)[0] += 0.1 * X * X;
  }
  Comparison<2> comparison(*world.parameters, std::filesystem::current_path().string());
  BOOST_TEST(comparison.times() == (std::vector<double>{0.5, 1.}), boost::test_tools::per_element());
  comparison.compare(0.5, world.scene, comm);
  comparison.compare(1., world.scene, comm);
  const auto results = comparison.results();
  BOOST_TEST(results[0].norms.L1 == 0.25, boost::test_tools::tolerance(1e-10)); // 0 and 0.5
  BOOST_TEST(results[0].norms.L2 == std::sqrt(0.125), boost::test_tools::tolerance(1e-10));
  BOOST_TEST(results[0].relative_Linf == 0.05, boost::test_tools::tolerance(1e-10));
  BOOST_TEST(results[0].norms.n == 32u);
  BOOST_TEST(results[0].norms.worst_time == 1.);
  BOOST_TEST(results[1].norms.Linf < 1e-12);
  BOOST_TEST(results[1].norms.n ==
             16u + dealii::Utilities::MPI::sum(world.scene.bodies[1]->slices().size(), comm));
  BOOST_TEST(results[2].norms.Linf < 1e-14);
  BOOST_TEST(results[2].norms.n == ground.n_global_points());
  if (rank() == 0) {
    comparison.write_errors("errors.csv");
    const std::string text = read_file("errors.csv");
    BOOST_TEST(text.rfind("reference,time [s],L2,Linf,relative L2,relative Linf,n\nprofile,0.5,", 0) == 0);
    BOOST_TEST(contains(text, "\nprofile,1,0.5,0.5,0.05,0.05,16\n"));
  }

  const auto error = [](const std::string &lines) {
    return message_of([&] {
      World<2> other(
          2, "subsection References\n  subsection r\n    set Kind = profile\n    set Field = pressure\n"
             "    set Times = 1\n" +
                 lines + "\n  end\nend\n");
      Comparison<2> comparison(*other.parameters, ".");
    });
  };
  BOOST_TEST(contains(error("set File = none.csv\nset Columns = a"), "cannot open the table './none.csv'"));
  BOOST_TEST(contains(error("set File = profile.csv\nset Columns = wong [Pa]"), "did you mean 'wrong [Pa]'"));
  BOOST_TEST(contains(error("set File = profile.csv\nset Columns = wrong [Pa]\nset Coordinate = z"),
                      "no column 'z'"));
}

template <int dim>
void check_pictures()
{
  World<dim> world(4, "", "hencky");
  world.set([](const dealii::Point<dim> &) { return 7.; });
  Pictures<dim> pictures(".", world.scene, comm);
  pictures.write(0., world.nodes, world.fields);
  pictures.write(0.125, world.nodes, world.fields);
  BOOST_TEST(pictures.n_written() == 2u);
  const std::size_t n_cells = dealii::Utilities::MPI::sum(world.nodes.occupied_cells().size(), comm);
  if (rank() == 0) {
    std::size_t n = 0;
    const auto pressure = array("pictures/grid-0001.vtu", "pressure", n);
    BOOST_TEST(n == n_cells << dim);
    BOOST_TEST(pressure.size() == n);
    BOOST_TEST(std::count(pressure.begin(), pressure.end(), 7.f) >= 64);
    BOOST_TEST(array("pictures/grid-0001.vtu", "flux", n).front() == 0.25f);

    const auto stress = array("pictures/ground-0000.vtu", "effective stress", n);
    BOOST_TEST(n == world.scene.bodies[0]->n_global_points());
    BOOST_TEST(stress.size() == 9 * n);
    BOOST_TEST(stress[4] == 7.f);
    BOOST_TEST(stress[8] == 0.f);
    auto ids = array("pictures/block-0001.vtu", "id", n);
    std::sort(ids.begin(), ids.end());
    BOOST_TEST(ids.size() == world.scene.bodies[1]->n_global_points());
    BOOST_TEST(ids.back() == ids.size() - 1.f);

    boost::property_tree::ptree list;
    boost::property_tree::read_xml("solution.pvd", list);
    BOOST_TEST(list.get_child("VTKFile.Collection").size() == 6u);
    for (const auto &[tag, entry] : list.get_child("VTKFile.Collection"))
      BOOST_TEST(std::filesystem::exists(entry.template get<std::string>("<xmlattr>.file")));
    BOOST_TEST(!std::filesystem::exists("solution.pvd.tmp"));
  }
}

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
