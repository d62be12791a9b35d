#define BOOST_TEST_MODULE shape
#include <boost/test/unit_test.hpp>

#include <peat/grid/cut_box.h>
#include <peat/grid/shape.h>
#include <peat/grid/surface_mesh.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace peat;

namespace {
const double pi = std::acos(-1.);
const Origin somewhere{"case.prm", 7};

template <int dim>
std::shared_ptr<const Shape<dim>> shape(const std::string &text, const Constants &constants = {})
{
  return parse_shape<dim>(text, constants, somewhere);
}

/// The message with which a shape is refused; "" if it is not.
template <int dim>
std::string refusal(const std::string &text)
{
  try {
    shape<dim>(text);
  } catch (const InputError &error) {
    return error.what();
  }
  return "";
}

template <int dim>
void check_refused(const std::string &text, const std::vector<std::string> &parts_of_message)
{
  const std::string message = refusal<dim>(text);
  BOOST_TEST_INFO(text << " -> " << message);
  BOOST_TEST(message.rfind("case.prm:7: ", 0) == 0u);
  BOOST_TEST(message.find('\n') == std::string::npos);
  for (const std::string &part : parts_of_message) {
    BOOST_TEST_INFO("'" << message << "' lacks '" << part << "'");
    BOOST_TEST((message.find(part) != std::string::npos));
  }
}

/// A regular grid of n^dim boxes that covers a box, each cut with a shape.
template <int dim>
struct CutGrid
{
  double h;
  double volume = 0.;
  double surface = 0.;
  double largest_jump = 0.;
  double farthest_interface_centroid = 0.;
  unsigned int n_cut = 0;
  unsigned int n_centroids_outside = 0;
  dealii::Tensor<1, dim> interface;
  /// Face areas on the outside of the grid: what the shape's surface lacks to be closed.
  dealii::Tensor<1, dim> border;
  /// The area vector of the surface, found as the jump of face areas between neighbours, in absolute values.
  double surface_on_faces = 0.;
  std::vector<CutBox<dim>> boxes;

  CutGrid(const Shape<dim> &shape, const dealii::Point<dim> &lower, const double length, const unsigned int n)
      : h(length / n)
  {
    const unsigned int n_boxes = std::lround(std::pow(n, dim));
    for (unsigned int i = 0; i < n_boxes; ++i) {
      dealii::Point<dim> a, b;
      for (unsigned int d = 0, rest = i; d < dim; ++d, rest /= n) {
        a[d] = lower[d] + (rest % n) * h;
        b[d] = lower[d] + (rest % n + 1) * h;
      }
      boxes.push_back(cut(shape, a, b));
      add(shape, boxes.back());
    }
    for (unsigned int i = 0, stride = 1, d = 0; d < dim; ++d, stride *= n)
      for (i = 0; i < n_boxes; ++i)
        if ((i / stride) % n + 1 < n) {
          const double jump = boxes[i].face_area[2 * d + 1] - boxes[i + stride].face_area[2 * d];
          largest_jump = std::max(largest_jump, std::abs(jump));
          surface_on_faces += std::abs(jump);
        }
  }

private:
  void add(const Shape<dim> &shape, const CutBox<dim> &box)
  {
    volume += box.volume;
    interface += box.interface;
    surface += box.interface.norm();
    if (box.volume > 0. && shape.distance(box.centroid) > 0.)
      ++n_centroids_outside;
    if (box.volume > 0. && box.volume < (1. - 1e-12) * std::pow(h, dim))
      ++n_cut;
    if (box.interface.norm() > 0. && shape.is_distance())
      farthest_interface_centroid =
          std::max(farthest_interface_centroid, std::abs(shape.distance(box.interface_centroid)) / h);
  }
};

template <int dim>
dealii::Point<dim> diagonal(const double x)
{
  dealii::Point<dim> result;
  for (unsigned int d = 0; d < dim; ++d)
    result[d] = x;
  return result;
}

/// Volume up to `error` boxes per cut box, surface up to round-off (planes) or of second order, closed
/// surface.
template <int dim>
void check_covered(const std::string &text, const double volume, const double error, const double jump)
{
  const auto s = shape<dim>(text, {{"pi", pi}});
  for (const unsigned int n : {1u, 2u, 5u, dim == 2 ? 32u : 9u}) {
    const CutGrid<dim> grid(*s, diagonal<dim>(-0.5), 1.03, n);
    BOOST_TEST_INFO(text << " on " << n << " boxes per side, volume " << grid.volume << " instead of "
                         << volume);
    BOOST_TEST(std::abs(grid.volume - volume) <= error * grid.n_cut * std::pow(grid.h, dim) + 1e-14);
    BOOST_TEST_INFO(text << " on " << n << ": jump of face areas");
    BOOST_TEST(grid.largest_jump <= jump * std::pow(grid.h, dim - 1));
    BOOST_TEST_INFO(text << " on " << n << ": closed surface");
    BOOST_TEST(grid.interface.norm() <= 10. * jump * std::pow(grid.h, dim - 1) + 1e-14);
    BOOST_TEST(grid.n_centroids_outside == 0u);
    BOOST_TEST(grid.farthest_interface_centroid <= 1e-9);
  }
}

/// Signs and lower bounds of distances, at random places in [-1,1]^dim. The distance does not change faster
/// than the place does, therefore it cannot overestimate.
template <int dim, class Inside>
void check_distance(const std::string &text, const Inside &inside)
{
  const auto s = shape<dim>(text);
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> coordinate(-1., 1.);
  unsigned int n_wrong = 0, n_steep = 0, n_out_of_bounds = 0;
  dealii::Point<dim> last;
  for (unsigned int i = 0; i < 2000; ++i) {
    dealii::Point<dim> x;
    for (unsigned int d = 0; d < dim; ++d)
      x[d] = coordinate(generator);
    n_wrong += (s->distance(x) < 0.) != inside(x);
    n_steep += std::abs(s->distance(x) - s->distance(last)) > x.distance(last) * (1. + 1e-12);
    if (inside(x))
      for (unsigned int d = 0; d < dim; ++d)
        n_out_of_bounds += x[d] < s->bounds().lower[d] || x[d] > s->bounds().upper[d];
    last = x;
  }
  BOOST_TEST_INFO(text);
  BOOST_TEST(n_wrong + n_steep + n_out_of_bounds == 0u);
}
} // namespace

BOOST_AUTO_TEST_CASE(distances_in_two_dimensions)
{
  using P = dealii::Point<2>;
  const auto in_box = [](const P &x) { return x[0] > -.3 && x[0] < .4 && x[1] > -.1 && x[1] < .5; };
  const auto in_disc = [](const P &x) { return x.distance(P(.2, .1)) < .5; };
  check_distance<2>("box(-.3, -.1, .4, .5)", in_box);
  check_distance<2>("ball(.2, .1, .5)", in_disc);
  check_distance<2>("disc(.2, .1, .5)", in_disc);
  check_distance<2>("halfspace(.1, .2, 3, 4)",
                    [](const P &x) { return (x[0] - .1) * 3 + (x[1] - .2) * 4 < 0; });
  check_distance<2>("union(box(-.3, -.1, .4, .5), disc(.2, .1, .5))",
                    [&](const P &x) { return in_box(x) || in_disc(x); });
  check_distance<2>("intersection(box(-.3, -.1, .4, .5), disc(.2, .1, .5))",
                    [&](const P &x) { return in_box(x) && in_disc(x); });
  check_distance<2>("difference(box(-.3, -.1, .4, .5), disc(.2, .1, .5), box(-1, -1, -.2, 0))",
                    [&](const P &x) { return in_box(x) && !in_disc(x) && !(x[0] < -.2 && x[1] < 0.); });
  check_distance<2>("translate(disc(0, 0.2, .5), .2, -.1)", in_disc);
  check_distance<2>("rotate(box(-.1, -.4, .5, .3), 90, 0, 0)", in_box);
  check_distance<2>("polygon(-.3, -.1, .4, -.1, .4, .5, -.3, .5)", in_box);
  check_distance<2>("polygon(-.3, -.1, -.3, .5, .4, .5, .4, -.1, -.3, -.1)", in_box);
  check_distance<2>("polygon(-.5,-.5, .5,-.5, .5,0, 0,0, 0,.5, -.5,.5)", [](const P &x) {
    return std::max(std::abs(x[0]), std::abs(x[1])) < .5 && !(x[0] > 0. && x[1] > 0.);
  });

  BOOST_TEST(shape<2>("box(0, 0, 2, 1)")->distance(P(5, 5)) == 5.);
  BOOST_TEST(shape<2>("box(0, 0, 2, 1)")->distance(P(1, .75)) == -.25);
  BOOST_TEST(shape<2>("polygon(0,0, 4,0, 0,3)")->distance(P(4, 3)) == 2.4,
             boost::test_tools::tolerance(1e-14));
  BOOST_TEST(shape<2>("rotate(box(0, 0, 2, 1), -90, 0, 0)")->distance(P(.25, -1)) == -.25);
  BOOST_TEST(shape<2>("rotate(disc(1, 0, .5), 30, 0, 0)")->distance(P(std::sqrt(.75), .5)) == -.5,
             boost::test_tools::tolerance(1e-14));
}

BOOST_AUTO_TEST_CASE(distances_in_three_dimensions)
{
  using P = dealii::Point<3>;
  const auto in_box = [](const P &x) {
    return x[0] > -.3 && x[0] < .4 && x[1] > -.1 && x[1] < .5 && x[2] > -.7 && x[2] < .2;
  };
  const auto in_cylinder = [](const P &x) { return std::hypot(x[0], x[1] - .1) < .4 && std::abs(x[2]) < .5; };
  check_distance<3>("box(-.3, -.1, -.7, .4, .5, .2)", in_box);
  check_distance<3>("sphere(0, .1, 0, .4)", [](const P &x) { return x.distance(P(0, .1, 0)) < .4; });
  check_distance<3>("cylinder(0, .1, .5, 0, .1, -.5, .4)", in_cylinder);
  check_distance<3>("rotate(cylinder(-.5, .1, 0, .5, .1, 0, .4), 90, 0, 0, 0, 0, 2, 0)", in_cylinder);
  check_distance<3>(
      "rotate(rotate(cylinder(-.5, .1, 0, .5, .1, 0, .4), 37, 0, 0, 0, 0, 2, 0), 53, 0, 0, 0, 0, .1, 0)",
      in_cylinder);
  check_distance<3>("prism(-.7, .2, -.3, -.1, .4, -.1, .4, .5, -.3, .5)", in_box);
  check_distance<3>(
      "difference(box(-.3, -.1, -.7, .4, .5, .2), translate(cylinder(0, 0, .5, 0, 0, -.5, .4), 0, .1, 0))",
      [&](const P &x) { return in_box(x) && !in_cylinder(x); });

  const auto s = shape<3>("cylinder(0, 0, 0, 1, 1, 1, .5)");
  BOOST_TEST(s->bounds().upper[0] == 1. + .5 * std::sqrt(2. / 3.), boost::test_tools::tolerance(1e-14));
  // By the right-hand rule x goes to y around z.
  BOOST_TEST(shape<3>("rotate(ball(1, 0, 0, .1), 90, 0, 0, 0, 0, 0, 1)")->distance(P(0, 1, 0)) == -.1);
}

BOOST_AUTO_TEST_CASE(numbers_are_expressions_and_inside_takes_functions)
{
  const auto s =
      shape<2>("union( box(0, 0, 2*L, max(L, 1)) ,disc(3*L, 0, sqrt(R)) )", {{"L", 2.}, {"R", 4.}});
  BOOST_TEST(s->bounds().upper[0] == 8.);
  BOOST_TEST(s->bounds().upper[1] == 2.);
  BOOST_TEST(s->is_distance());

  const auto f = shape<2>("intersection(box(0, 0, 1, 1), inside(a*x - y))", {{"a", .5}});
  BOOST_TEST(!f->is_distance());
  BOOST_TEST(f->distance(dealii::Point<2>(.5, .2)) < 0.);
  BOOST_TEST(f->distance(dealii::Point<2>(.5, .3)) > 0.);
  BOOST_TEST(f->bounds().upper[0] == 1.);
}

BOOST_AUTO_TEST_CASE(wrong_shapes_are_refused_in_plain_words)
{
  check_refused<2>("", {"a shape is missing"});
  check_refused<2>("ground", {"'ground' is not a shape"});
  check_refused<2>("(1, 2)", {"needs a name"});
  check_refused<2>("blal(0, 0, 1)", {"unknown shape 'blal'", "did you mean 'ball'?", "2-D", "polygon"});
  check_refused<2>("cylinder(0, 0, 0, 1, 1, 1, 2)", {"'cylinder' exists only in 3-D"});
  check_refused<3>("polygon(0, 0, 1, 0, 0, 1)", {"'polygon' exists only in 2-D"});
  check_refused<2>("box(0, 0, 1)", {"shape 'box'", "3 arguments", "box(x0, y0, x1, y1)"});
  check_refused<3>("box(0, 0, 1, 1)", {"shape 'box'", "box(x0, y0, z0, x1, y1, z1)"});
  check_refused<2>("union(disc(0, 0, 1))", {"shape 'union'", "1 argument is given", "union(a, b, ...)"});
  check_refused<2>("box()", {"shape 'box'", "0 arguments"});
  check_refused<2>("box(0, , 1, 1)", {"argument 2", "empty"});
  check_refused<2>("box(1, 0, 1, 1)", {"shape 'box'", "empty", "x1 = 1", "x0 = 1"});
  check_refused<2>("disc(0, 0, -1)", {"shape 'disc'", "empty", "radius is -1"});
  check_refused<2>("disc(0, 0, radius)", {"radius"});
  check_refused<2>("halfspace(0, 0, 0, 0)", {"normal must not be zero"});
  check_refused<3>("cylinder(0, 0, 1, 0, 0, 1, 1)", {"axis"});
  check_refused<3>("rotate(ball(0, 0, 0, 1), 30, 0, 0, 0, 0, 0, 0)", {"shape 'rotate'", "axis"});
  check_refused<2>("box(0, 0, 1, 1", {"1 ')' missing"});
  check_refused<2>("box(0, 0, 1, 1))", {"')' without '('"});
  check_refused<2>("box)0, 0, 1, 1(", {"')' without '('"});
  check_refused<2>("box(0, 0, 1, 1) disc(0, 0, 1)", {"unexpected 'disc(0, 0, 1)'"});
  check_refused<2>("union(box(0, 0, 1, 1), 3)", {"'3' is not a shape"});
  check_refused<2>("polygon(0, 0, 1, 1, 1)", {"5 arguments", "polygon(x1, y1, x2, y2, x3, y3, ...)"});
  check_refused<2>("polygon(0, 0, 1, 0, 1, 1, 2)", {"pairs"});
  check_refused<2>("polygon(0, 0, 1, 1, 2, 2)", {"turns back"});
  check_refused<2>("polygon(0, 0, .1, .3, .2, .6)", {"turns back"});
  check_refused<2>("polygon(0, 0, 1, 0, 1, 0, 0, 1)", {"corners 2 and 3 coincide"});
  check_refused<2>("polygon(0, 0, 1, 1, 1, 0, 0, 1)", {"meets itself", "1 and 2", "3 and 4"});
  check_refused<2>("polygon(0, 0, 2, 0, 2, 1, 1, 0, 0, 1)", {"meets itself"});
  check_refused<3>("prism(1, 0, 0, 0, 1, 0, 0, 1)", {"shape 'prism'", "z1 = 0"});
  check_refused<2>("intersection(box(0, 0, 1, 1), box(2, 0, 3, 1))",
                   {"empty", "do not overlap in direction x"});
  check_refused<2>("inside(x - t)", {"time"});
  check_refused<2>("inside(0)", {"empty"});
  check_refused<2>("inside(x - q)", {"'q'"});
}

BOOST_AUTO_TEST_CASE(boxes_are_cut_exactly)
{
  check_covered<2>("box(-0.31, -0.22, 0.17, 0.33)", .48 * .55, 1e-14, 1e-14);
  check_covered<3>("box(-0.31, -0.22, -.1, 0.17, 0.33, .44)", .48 * .55 * .54, 1e-14, 1e-14);
  check_covered<2>("rotate(box(-0.3, -0.2, 0.2, 0.3), 90, 0.02, 0)", .25, 1e-14, 1e-14);
  check_covered<2>("union(box(-0.3, -0.3, 0.01, 0.3), box(0.01, -0.3, 0.35, 0.2))", .31 * .6 + .34 * .5,
                   1e-14, 1e-14);
  check_covered<2>("difference(box(-.4, -.4, .4, .4), box(-.123, -.2, .1, .345))", .64 - .223 * .545, 1e-14,
                   1e-14);
  check_covered<3>("difference(box(-.4, -.4, -.4, .4, .4, .4), box(-.123, -.2, 0, .1, .345, 1))",
                   .512 - .223 * .545 * .4, 1e-14, 1e-14);

  // The measure of the surface: each direction separately, because boxes at edges see the sum of two vectors.
  const CutGrid<2> grid(*shape<2>("box(-0.31, -0.22, 0.17, 0.33)"), diagonal<2>(-.5), 1., 8);
  double vertical = 0., horizontal = 0.;
  for (const auto &box : grid.boxes) {
    vertical += std::abs(box.interface[0]);
    horizontal += std::abs(box.interface[1]);
  }
  BOOST_TEST(vertical == 2. * .55, boost::test_tools::tolerance(1e-14));
  BOOST_TEST(horizontal == 2. * .48, boost::test_tools::tolerance(1e-14));

  // One box with a corner of the shape in it.
  const auto box = cut(*shape<2>("box(0, 0, 1.25, 10.5)"), dealii::Point<2>(1, 10), dealii::Point<2>(2, 11));
  BOOST_TEST(box.volume == .125);
  BOOST_TEST(box.centroid.distance(dealii::Point<2>(1.125, 10.25)) < 1e-14);
  BOOST_TEST(box.face_area[0] == .5);
  BOOST_TEST(box.face_area[1] == 0.);
  BOOST_TEST(box.face_area[2] == .25);
  BOOST_TEST(box.face_area[3] == 0.);
}

BOOST_AUTO_TEST_CASE(surfaces_on_faces_of_boxes_are_seen_from_their_side)
{
  using P = dealii::Point<2>;
  // Full box and empty neighbour: the surface shows in the face areas, not in the interface.
  for (const std::string text : {"box(0, 0, 1, 1)", "halfspace(1, 0, 1, 0)", "polygon(0,0, 1,0, 1,1, 0,1)",
                                 "inside(x < 1)", "inside(1 - x)", "rotate(box(0, 0, 1, 1), 180, .5, .5)",
                                 "union(box(0, 0, .5, 1), box(.5, 0, 1, 1))"}) {
    const auto s = shape<2>(text);
    const auto full = cut(*s, P(.5, 0), P(1, 1)), empty = cut(*s, P(1, 0), P(1.5, 1));
    BOOST_TEST_INFO(text);
    BOOST_TEST(full.volume == .5);
    BOOST_TEST(full.face_area[1] == 1.);
    BOOST_TEST(full.interface.norm() == 0.);
    BOOST_TEST(empty.volume == 0.);
    BOOST_TEST(empty.face_area[0] == 0.);
  }

  // Partly filled boxes on both sides of a hole's surface.
  const auto hole = shape<2>("difference(box(-1, -1, 3, 3), box(.5, -1, 1, .5), disc(1.5, 1, .2))");
  const auto left = cut(*hole, P(0, 0), P(1, 1)), right = cut(*hole, P(1, 0), P(2, 1));
  BOOST_TEST(left.volume == .75, boost::test_tools::tolerance(1e-14));
  BOOST_TEST(left.face_area[1] == .5, boost::test_tools::tolerance(1e-14));
  BOOST_TEST(right.volume == 1. - .02 * pi, boost::test_tools::tolerance(1e-5));
  BOOST_TEST(right.face_area[0] == 1.);

  // All of the surface of a body on the grid.
  const CutGrid<2> grid(*shape<2>("box(-.25, -.25, .5, .25)"), diagonal<2>(-1.), 2., 8);
  BOOST_TEST(grid.volume == .375);
  BOOST_TEST(grid.surface == 0.);
  BOOST_TEST(grid.surface_on_faces == 2.5);
  // What round-off puts on the other side of a face does not count.
  const CutGrid<2> inexact(*shape<2>("box(-.3, -.3, .1 + .2, .7 - .4)"), diagonal<2>(-.9), 1.8, 6);
  BOOST_TEST(inexact.n_cut == 0u);
}

BOOST_AUTO_TEST_CASE(planes_are_cut_exactly)
{
  for (const std::string text :
       {"halfspace(.1, .2, 3, 4)", "halfspace(0, 0, 1, 1)", "halfspace(0, 0, -1e-3, 1)",
        "rotate(halfspace(.1, .2, 1, 0), 77, .3, 0)", "inside(.3 - x - 2*y)"}) {
    const auto s = shape<2>(text);
    const double whole = cut(*s, diagonal<2>(-1.), diagonal<2>(1.)).volume;
    const CutGrid<2> grid(*s, diagonal<2>(-1.), 2., 7);
    const double accuracy = s->is_distance() ? 1e-13 : 1e-7;
    BOOST_TEST_INFO(text);
    BOOST_TEST(std::abs(grid.volume - whole) <= accuracy);
    BOOST_TEST(grid.largest_jump <= accuracy);
    BOOST_TEST(grid.n_centroids_outside == 0u);
    for (const auto &box : grid.boxes)
      if (box.interface.norm() > 1e-6)
        BOOST_TEST(std::abs(s->distance(box.interface_centroid)) <= 1e-7);
  }

  // A corner cut off: volume, area vector and centroids are known.
  const auto box = cut(*shape<3>("halfspace(.6, 0, 0, 1, 1, 1)"), diagonal<3>(0.), diagonal<3>(1.));
  const dealii::Tensor<1, 3> area = box.interface - .18 * diagonal<3>(1.);
  BOOST_TEST(box.volume == .036, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(area.norm() < 1e-13);
  BOOST_TEST(box.centroid.distance(diagonal<3>(.15)) < 1e-12);
  BOOST_TEST(box.interface_centroid.distance(diagonal<3>(.2)) < 1e-12);

  const CutGrid<3> slope(*shape<3>("intersection(box(-.5,-.5,-.5,.5,.5,.5), halfspace(0,0,0,1,.4,.2))"),
                         diagonal<3>(-.5), 1., 5);
  BOOST_TEST(slope.volume == .5, boost::test_tools::tolerance(1e-13));
  BOOST_TEST(slope.surface == std::sqrt(1. + .16 + .04), boost::test_tools::tolerance(1e-13));
}

BOOST_AUTO_TEST_CASE(other_shapes_are_cut_accurately)
{
  const double lens = 2. * .09 * std::acos(.11 / .3) - .22 * std::sqrt(.09 - .0121);
  check_covered<2>("disc(0.03, 0.01, 0.4)", .16 * pi, 1e-5, 1e-4);
  check_covered<2>("rotate(box(-0.3, -0.2, 0.2, 0.3), 30, 0.02, 0)", .25, 1e-5, 1e-4);
  check_covered<2>("union(disc(-.1, 0, .3), disc(.12, 0, .3))", .18 * pi - lens, 1e-5, 1e-4);
  check_covered<2>("intersection(disc(-.1, 0, .3), disc(.12, 0, .3))", lens, 1e-5, 1e-4);
  check_covered<2>("difference(box(-.4, -.4, .4, .4), disc(0.01, 0, .3))", .64 - .09 * pi, 1e-5, 1e-4);
  check_covered<2>("polygon(-.4,-.4, .4,-.3, .1,.1, .3,.3, -.3,.3)", .385, 1e-4, 1e-3);
  check_covered<2>("inside(.16 - x^2 - y^2)", .16 * pi, 1e-4, 1e-3);
  check_covered<2>("inside(x^2 + y^2 < .16)", .16 * pi, 1e-3, 1e-3);

  check_covered<3>("ball(0.03, 0.01, 0.02, 0.4)", 4. / 3. * pi * .064, 1e-4, 1e-3);
  check_covered<3>("rotate(box(-.3, -.2, -.2, .2, .3, .2), 30, 0, 0, 0, 1, 1, .3)", .1, 1e-4, 1e-3);
  check_covered<3>("cylinder(-.2, -.2, -.1, .3, .2, .1, .2)", .04 * pi * std::sqrt(.25 + .16 + .04), 1e-4,
                   1e-3);
  check_covered<3>("difference(box(-.4, -.4, -.4, .4, .4, .4), ball(0.01, 0, 0, .3))", .512 - .036 * pi, 1e-4,
                   1e-3);
  check_covered<3>("prism(-.3, .31, -.4,-.4, .4,-.3, .1,.1, .3,.3, -.3,.3)", .61 * .385, 3e-4, 1e-3);
  check_covered<3>("inside(.16 - x^2 - y^2 - z^2)", 4. / 3. * pi * .064, 1e-3, 3e-3);
}

BOOST_AUTO_TEST_CASE(surface_converges_with_second_order)
{
  double last[2] = {0., 0.};
  for (const unsigned int n : {4u, 8u, 16u}) {
    const double error[2] = {
        std::abs(CutGrid<2>(*shape<2>("disc(0, 0, .4)"), diagonal<2>(-.5), 1., n).surface - .8 * pi),
        std::abs(CutGrid<3>(*shape<3>("ball(0, 0, 0, .4)"), diagonal<3>(-.5), 1., n).surface - .64 * pi)};
    for (unsigned int i = 0; i < 2; ++i) {
      BOOST_TEST_INFO("n = " << n << " in " << i + 2 << "-D: " << error[i] << " after " << last[i]);
      BOOST_TEST((n == 4 || error[i] < last[i] / 3.));
      last[i] = error[i];
    }
  }
}

BOOST_AUTO_TEST_CASE(small_and_thin_things_are_not_lost)
{
  using P = dealii::Point<2>;
  const P a(0, 0), b(1, 1);
  BOOST_TEST(cut(*shape<2>("disc(.41, .37, 1e-3)"), a, b).volume == 1e-6 * pi,
             boost::test_tools::tolerance(1e-4));
  BOOST_TEST(cut(*shape<2>("box(-1, .41, 2, .4101)"), a, b).volume == 1e-4,
             boost::test_tools::tolerance(1e-11));
  BOOST_TEST(cut(*shape<2>("difference(box(-1, -1, 2, 2), box(-1, .41, 2, .4101))"), a, b).volume ==
                 1. - 1e-4,
             boost::test_tools::tolerance(1e-12));
  BOOST_TEST(cut(*shape<3>("ball(.41, .37, .2, 1e-2)"), diagonal<3>(0.), diagonal<3>(1.)).volume ==
                 4. / 3. * pi * 1e-6,
             boost::test_tools::tolerance(1e-3));
  const auto sliver = cut(*shape<2>("box(-1, -1, 2, 1e-11)"), a, b);
  BOOST_TEST(sliver.volume == 0.);
  BOOST_TEST(sliver.face_area[0] == 0.);
  BOOST_TEST(cut(*shape<2>("box(-1, -1, 2, 1 - 1e-11)"), a, b).volume == 1.);

  // The centroid of a frame is in its hole.
  const auto frame = shape<2>("difference(box(0, 0, 1, 1), box(.1, .1, .9, .9))");
  const auto box = cut(*frame, P(-.5, -.5), P(1.5, 1.5));
  BOOST_TEST(box.volume == .36, boost::test_tools::tolerance(1e-14));
  BOOST_TEST(frame->distance(box.centroid) <= 0.);
}

namespace {
/// Length or area of a shape's surface as it is shown.
template <int dim>
double shown_area(const std::string &text)
{
  const auto s = shape<dim>(text);
  const SurfaceMesh<dim> mesh = surface_mesh(*s);
  double area = 0., farthest = 0.;
  for (const auto &facet : mesh.facets) {
    const auto &a = mesh.vertices[facet[0]], &b = mesh.vertices[facet[1]], &c = mesh.vertices[facet[dim - 1]];
    area += dim == 2 ? (b - a).norm()
                     : 0.5 * std::sqrt((b - a).norm_square() * (c - a).norm_square() -
                                       ((b - a) * (c - a)) * ((b - a) * (c - a)));
  }
  for (const auto &x : mesh.vertices)
    farthest = std::max(farthest, std::abs(s->distance(x)));
  BOOST_TEST_INFO(text);
  BOOST_TEST(farthest <= 0.5 * s->bounds().radius() * 2. / (dim == 2 ? 128. : 40.));
  return area;
}
} // namespace

BOOST_AUTO_TEST_CASE(surfaces_to_look_at)
{
  // Cut-off edges make surfaces smaller, by less than a cell's width beside each.
  BOOST_TEST(shown_area<2>("ball(1, 2, 3)") == 6. * pi, boost::test_tools::tolerance(1e-3));
  BOOST_TEST(shown_area<2>("box(0, 0, 2, 1)") == 6., boost::test_tools::tolerance(0.01));
  // The sides of the notch lie on lines of the grid.
  BOOST_TEST(shown_area<2>("difference(box(0, 0, 4, 4), box(1, 2, 3, 5))") == 20.,
             boost::test_tools::tolerance(0.01));
  BOOST_TEST(shown_area<3>("ball(1, 2, 3, 4)") == 64. * pi, boost::test_tools::tolerance(5e-3));
  BOOST_TEST(shown_area<3>("box(0, 0, 0, 1, 2, 3)") == 22., boost::test_tools::tolerance(0.03));
  BOOST_TEST(shown_area<3>("cylinder(0, 0, 0, 0, 0, 2, 1)") == 6. * pi, boost::test_tools::tolerance(0.03));
  BOOST_TEST(shown_area<3>("difference(box(0, 0, 0, 4, 4, 4), box(1, 1, 2, 3, 3, 5))") == 96. + 16.,
             boost::test_tools::tolerance(0.03));
}
