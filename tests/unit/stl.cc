#define BOOST_TEST_MODULE stl
#include <boost/test/unit_test.hpp>

#include <peat/contact/shape_moments.h>
#include <peat/grid/cut_box.h>
#include <peat/grid/shape.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <random>

#include <unistd.h>

using namespace peat;
using Place = dealii::Point<3>;

namespace {
const double pi = std::acos(-1.);
const std::string file_name = "peat_test_" + std::to_string(getpid()) + ".stl";

void write_text(const SurfaceMesh<3> &mesh)
{
  std::ofstream file(file_name);
  file.precision(17);
  file << "solid thing\n";
  for (const auto &t : mesh.facets) {
    file << "  facet normal 0 0 0\n    outer loop\n";
    for (const unsigned int v : t)
      file << "      vertex " << mesh.vertices[v][0] << ' ' << mesh.vertices[v][1] << ' '
           << mesh.vertices[v][2] << '\n';
    file << "    endloop\n  endfacet\n";
  }
  file << "endsolid thing\n";
}

void write_binary(const SurfaceMesh<3> &mesh)
{
  std::ofstream file(file_name, std::ios::binary);
  // Some programs begin binary files as if they were text.
  char header[80] = "solid but binary";
  file.write(header, sizeof(header));
  const std::uint32_t n = mesh.facets.size();
  file.write(reinterpret_cast<const char *>(&n), sizeof(n));
  for (const auto &t : mesh.facets) {
    float numbers[12] = {};
    for (unsigned int i = 0; i < 3; ++i)
      for (unsigned int d = 0; d < 3; ++d)
        numbers[3 + 3 * i + d] = mesh.vertices[t[i]][d];
    file.write(reinterpret_cast<const char *>(numbers), sizeof(numbers));
    file.write("\0\0", 2);
  }
}

std::shared_ptr<const Shape<3>> read(const std::string &text = "stl(" + file_name + ")")
{
  return parse_shape<3>(text, {}, Origin{"case.prm", 7});
}

/// The message with which the file is refused; "" if it is not.
std::string refusal()
{
  std::string message;
  try {
    read();
  } catch (const InputError &error) {
    message = error.what();
  }
  std::remove(file_name.c_str());
  return message;
}

void check_refused(const std::vector<std::string> &parts_of_message)
{
  const std::string message = refusal();
  BOOST_TEST_INFO(message);
  BOOST_TEST(message.rfind("case.prm:7: shape 'stl': the file '" + file_name + "': ", 0) == 0u);
  BOOST_TEST(message.find('\n') == std::string::npos);
  for (const std::string &part : parts_of_message) {
    BOOST_TEST_INFO("'" << message << "' lacks '" << part << "'");
    BOOST_TEST((message.find(part) != std::string::npos));
  }
}

std::shared_ptr<const Shape<3>> as_shape(const SurfaceMesh<3> &mesh, const bool binary = false)
{
  binary ? write_binary(mesh) : write_text(mesh);
  auto result = read();
  std::remove(file_name.c_str());
  return result;
}

SurfaceMesh<3> box_mesh(const Place &lower, const Place &upper)
{
  SurfaceMesh<3> mesh;
  for (unsigned int c = 0; c < 8; ++c)
    mesh.vertices.push_back(
        Place(c & 1 ? upper[0] : lower[0], c & 2 ? upper[1] : lower[1], c & 4 ? upper[2] : lower[2]));
  mesh.facets = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                 {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

void append(SurfaceMesh<3> &mesh, const SurfaceMesh<3> &other, const bool reversed = false)
{
  const unsigned int first = mesh.vertices.size();
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (auto t : other.facets) {
    if (reversed)
      std::swap(t[1], t[2]);
    mesh.facets.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
}

/// An icosahedron on the unit sphere whose triangles are divided into four again and again.
SurfaceMesh<3> icosphere(const unsigned int n_refinements)
{
  SurfaceMesh<3> mesh;
  const double g = (1. + std::sqrt(5.)) / 2.;
  for (const Place &x : {Place(-1, g, 0), Place(1, g, 0), Place(-1, -g, 0), Place(1, -g, 0), Place(0, -1, g),
                         Place(0, 1, g), Place(0, -1, -g), Place(0, 1, -g), Place(g, 0, -1), Place(g, 0, 1),
                         Place(-g, 0, -1), Place(-g, 0, 1)})
    mesh.vertices.push_back(Place(x / x.norm()));
  mesh.facets = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                 {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                 {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (unsigned int r = 0; r < n_refinements; ++r) {
    std::map<std::pair<unsigned int, unsigned int>, unsigned int> middles;
    const auto middle = [&](unsigned int a, unsigned int b) {
      const auto [entry, is_new] = middles.emplace(std::minmax(a, b), mesh.vertices.size());
      if (is_new) {
        const auto x = mesh.vertices[a] + dealii::Tensor<1, 3>(mesh.vertices[b]);
        mesh.vertices.push_back(Place(x / dealii::Tensor<1, 3>(x).norm()));
      }
      return entry->second;
    };
    std::vector<SurfaceMesh<3>::Facet> finer;
    for (const auto &t : mesh.facets) {
      const unsigned int a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], a, c}, {t[1], b, a}, {t[2], c, b}, {a, b, c}});
    }
    mesh.facets = finer;
  }
  return mesh;
}

std::vector<Place> random_places(const unsigned int n, const double reach)
{
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> coordinate(-reach, reach);
  std::vector<Place> places;
  for (unsigned int i = 0; i < n; ++i)
    places.push_back(Place(coordinate(generator), coordinate(generator), coordinate(generator)));
  return places;
}
} // namespace

BOOST_AUTO_TEST_CASE(a_box_of_triangles_is_a_box)
{
  const Place lower(-0.5, -0.25, -0.75), upper(0.5, 0.5, 0.25);
  const auto box = parse_shape<3>("box(-0.5, -0.25, -0.75, 0.5, 0.5, 0.25)", {}, {});
  for (const bool binary : {false, true}) {
    const auto triangles = as_shape(box_mesh(lower, upper), binary);
    BOOST_TEST(triangles->is_distance());
    BOOST_TEST(triangles->bounds().lower.distance(lower) == 0.);
    BOOST_TEST(triangles->bounds().upper.distance(upper) == 0.);
    auto places = random_places(5000, 1.);
    // On planes of faces, on lines of edges, diagonals, corners and the middle.
    for (const double x : {-0.5, -0.25, 0., 0.25, 0.5, 0.75})
      for (const double y : {-0.25, 0., 0.125, 0.5, 0.75})
        for (const double z : {-1., -0.75, -0.25, 0.25, 0.5})
          places.push_back(Place(x, y, z));
    for (const Place &x : places) {
      BOOST_TEST_INFO(x);
      BOOST_TEST(std::abs(triangles->distance(x) - box->distance(x)) <= 1e-14);
      const auto n = triangles->normal(x);
      BOOST_TEST(std::abs(n.norm() - 1.) <= 1e-14);
      BOOST_TEST_INFO(x);
      BOOST_TEST(std::abs(triangles->distance(x - box->distance(x) * n)) <= 1e-14);
    }
    const CutBox<3> part = cut(*triangles, Place(0., 0., 0.), Place(1., 1., 1.));
    BOOST_TEST(std::abs(part.volume - 0.5 * 0.5 * 0.25) <= 1e-4);
  }
}

BOOST_AUTO_TEST_CASE(a_ball_of_triangles_is_nearly_a_ball)
{
  double last_error = 1.;
  for (const unsigned int n : {2u, 3u, 4u}) {
    const auto ball = as_shape(icosphere(n));
    double error = 0., error_of_normals = 0.;
    for (const Place &x : random_places(5000, 1.5)) {
      error = std::max(error, std::abs(ball->distance(x) - (x.norm() - 1.)));
      if (x.norm() > 1.1)
        error_of_normals = std::max(error_of_normals, (ball->normal(x) - x / x.norm()).norm());
    }
    BOOST_TEST_MESSAGE(20 * std::pow(4, n)
                       << " triangles: distance " << error << ", normals " << error_of_normals);
    BOOST_TEST(error < 0.3 * last_error);
    last_error = error;
  }
  BOOST_TEST(last_error < 2e-3);
}

BOOST_AUTO_TEST_CASE(sign_is_right_near_sharp_corners)
{
  // A thin spike: the nearest feature of most places is an edge or a corner.
  SurfaceMesh<3> spike;
  spike.vertices = {Place(0, 0, 0), Place(0.1, 0, 0), Place(0, 0.1, 0), Place(1, 1, 3)};
  spike.facets = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  const auto shape = as_shape(spike);
  unsigned int n_inside = 0, n_wrong = 0;
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> coordinate(-0.05, 0.15), height(-0.5, 3.5);
  for (unsigned int i = 0; i < 20000; ++i) {
    const double z = height(generator);
    const Place x(coordinate(generator) + z / 3., coordinate(generator) + z / 3., z);
    // In barycentric coordinates.
    const double d = z / 3., b = (x[0] - d) / 0.1, c = (x[1] - d) / 0.1, a = 1. - b - c - d;
    const bool inside = std::min({a, b, c, d}) > 0.;
    n_inside += inside;
    n_wrong += inside != (shape->distance(x) < 0.);
  }
  BOOST_TEST(n_inside > 500u);
  BOOST_TEST(n_wrong == 0u);
}

BOOST_AUTO_TEST_CASE(moments_of_triangulated_bodies)
{
  write_text(box_mesh(Place(1., 0., 0.), Place(2., 2., 3.)));
  // Turned by 90 degrees about z through (1, 0, 0): x from -1 to 1, y from 0 to 1.
  const auto box = moments(*read("rotate(stl(" + file_name + "), 90, 1, 0, 0, 0, 0, 1)"));
  std::remove(file_name.c_str());
  BOOST_TEST(std::abs(box.volume - 6.) <= 1e-12);
  BOOST_TEST(box.centroid.distance(Place(0., 0.5, 1.5)) <= 1e-12);
  for (unsigned int i = 0; i < 3; ++i)
    for (unsigned int j = 0; j < 3; ++j) {
      const double edges[3] = {2., 1., 3.};
      BOOST_TEST(std::abs(box.second[i][j] - (i == j ? 6. * edges[i] * edges[i] / 12. : 0.)) <= 1e-12);
    }

  SurfaceMesh<3> shell = icosphere(4), inner = icosphere(4);
  for (auto &x : inner.vertices)
    x *= 0.5;
  append(shell, inner, true);
  const auto hollow = moments(*as_shape(shell));
  const double full = 4. / 3. * pi;
  BOOST_TEST(std::abs(hollow.volume - full * (1. - 0.125)) <= 0.005 * full);
  BOOST_TEST(std::abs(hollow.second[1][1] - full / 5. * (1. - 1. / 32.)) <= 0.01 * full / 5.);
  BOOST_TEST(as_shape(shell)->distance(Place(0.1, 0., 0.)) > 0.39);
}

BOOST_AUTO_TEST_CASE(wrong_files_are_refused)
{
  const SurfaceMesh<3> box = box_mesh(Place(0., 0., 0.), Place(1., 1., 1.));
  SurfaceMesh<3> wrong = box;
  wrong.facets.pop_back();
  write_text(wrong);
  check_refused({"not closed", "belongs only to triangle"});

  wrong = box;
  std::swap(wrong.facets[4][0], wrong.facets[4][1]);
  write_text(wrong);
  check_refused({"in the same sense along the edge", "triangles"});

  wrong = {};
  append(wrong, box, true);
  write_text(wrong);
  check_refused({"inside out"});

  wrong = box;
  append(wrong, box_mesh(Place(2., 0., 0.), Place(2.5, 1., 1.)), true);
  write_text(wrong);
  check_refused({"is turned inside out and is no cavity"});

  wrong = box;
  append(wrong, box_mesh(Place(0.25, 0.25, 0.25), Place(0.5, 0.5, 0.5)));
  write_text(wrong);
  check_refused({"lies inside another part"});

  wrong = box;
  wrong.facets.push_back({0, 1, 1});
  write_text(wrong);
  check_refused({"triangle 13", "has no area"});

  wrong = box;
  wrong.facets.push_back({0, 2, 1});
  write_binary(wrong);
  check_refused({"in the same sense"});

  wrong = box;
  wrong.vertices[3][1] = std::numeric_limits<double>::quiet_NaN();
  write_binary(wrong);
  check_refused({"triangle 2", "not finite"});

  write_binary(box);
  std::ofstream(file_name, std::ios::app) << "x";
  check_refused({"has no triangles"});

  std::ofstream(file_name) << "solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 zero\n";
  check_refused({"line 4", "'vertex 0 0 zero'", "not three coordinates"});
  std::ofstream(file_name)
      << "solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nendloop\n";
  check_refused({"line 6", "three corners"});
  std::ofstream(file_name)
      << "solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nvertex 0 1 1\n"
         "vertex 0 0 0\nvertex 0 0 1\nvertex 0 1 1\nendloop\n";
  check_refused({"line 10", "three corners"});
  std::ofstream(file_name) << "solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\n";
  check_refused({"ends within a facet"});
  std::ofstream(file_name) << "solid a\nendsolid a\n";
  check_refused({"has no triangles"});
  std::ofstream(file_name) << "PK";
  check_refused({"no STL file"});
  check_refused({"cannot be read"});
}
