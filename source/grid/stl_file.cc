#include "stl_file.h"

#include <peat/base/text.h>

#include <deal.II/base/tensor.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <numeric>
#include <sstream>
#include <stdexcept>

namespace peat {
namespace {
using Place = dealii::Point<3>;

[[noreturn]] void fail(const std::string &message)
{
  throw std::runtime_error(message);
}

std::string shown(const Place &x)
{
  return '(' + to_text(x[0]) + ", " + to_text(x[1]) + ", " + to_text(x[2]) + ')';
}

/// Collects triangles whose corners come one by one.
class Builder
{
public:
  void add_corner(const Place &x)
  {
    for (unsigned int d = 0; d < 3; ++d)
      if (!std::isfinite(x[d]))
        fail("triangle " + std::to_string(mesh.facets.size() + 1) + " has a corner that is not finite");
    // Zero with its two signs is one place.
    const std::array<double, 3> key = {x[0] + 0., x[1] + 0., x[2] + 0.};
    const auto [entry, is_new] = numbers.emplace(key, mesh.vertices.size());
    if (is_new)
      mesh.vertices.push_back(x);
    corners[n_corners++] = entry->second;
    if (n_corners == 3) {
      mesh.facets.push_back(corners);
      n_corners = 0;
    }
  }

  SurfaceMesh<3> mesh;
  unsigned int n_corners = 0; ///< of the triangle that is not complete yet

private:
  std::map<std::array<double, 3>, unsigned int> numbers;
  SurfaceMesh<3>::Facet corners;
};

constexpr std::size_t header = 80, bytes_of_triangle = 50;

std::uint32_t number_at(const std::string &bytes, const std::size_t at)
{
  std::uint32_t result = 0;
  for (unsigned int b = 0; b < 4; ++b)
    result |= std::uint32_t(static_cast<unsigned char>(bytes[at + b])) << (8 * b);
  return result;
}

float float_at(const std::string &bytes, const std::size_t at)
{
  const std::uint32_t bits = number_at(bytes, at);
  float result;
  std::memcpy(&result, &bits, sizeof(result));
  return result;
}

SurfaceMesh<3> from_binary(const std::string &bytes)
{
  Builder builder;
  // Each triangle: a normal, which the order of the corners repeats, three corners, two bytes of no meaning.
  for (std::size_t at = header + 4; at < bytes.size(); at += bytes_of_triangle)
    for (unsigned int corner = 1; corner <= 3; ++corner) {
      const std::size_t first = at + 12 * corner;
      builder.add_corner(
          Place(float_at(bytes, first), float_at(bytes, first + 4), float_at(bytes, first + 8)));
    }
  return builder.mesh;
}

SurfaceMesh<3> from_text(const std::string &text)
{
  Builder builder;
  std::istringstream lines(text);
  std::string line;
  std::size_t n_loops = 0;
  for (unsigned int number = 1; std::getline(lines, line); ++number) {
    std::istringstream words(line);
    std::string word, rest;
    words >> word;
    n_loops += word == "endloop";
    if (word == "endloop" && (builder.n_corners != 0 || builder.mesh.facets.size() != n_loops))
      fail("line " + std::to_string(number) + ": a facet with more or less than three corners");
    if (word != "vertex")
      continue;
    Place x;
    if (!(words >> x[0] >> x[1] >> x[2]) || words >> rest)
      fail("line " + std::to_string(number) + ": " + in_quotes(trim(line)) + " are not three coordinates");
    builder.add_corner(x);
  }
  if (builder.n_corners != 0)
    fail("it ends within a facet");
  return builder.mesh;
}
} // namespace

SurfaceMesh<3> read_stl(const std::string &file_name)
{
  std::ifstream file(file_name, std::ios::binary);
  std::stringstream content;
  if (!file || !(content << file.rdbuf()))
    fail("cannot be read");
  const std::string bytes = content.str();
  const bool is_binary =
      bytes.size() >= header + 4 &&
      bytes.size() == header + 4 + bytes_of_triangle * std::size_t(number_at(bytes, header));
  if (!is_binary && bytes.compare(0, 5, "solid") != 0)
    fail("is no STL file: it neither begins with 'solid' nor has the length that a binary one tells");
  SurfaceMesh<3> mesh = is_binary ? from_binary(bytes) : from_text(bytes);
  if (mesh.facets.empty())
    fail("has no triangles");
  return mesh;
}

namespace {
dealii::Tensor<1, 3> area_vector(const SurfaceMesh<3> &mesh, const SurfaceMesh<3>::Facet &t)
{
  return 0.5 * cross_product_3d(mesh.vertices[t[1]] - mesh.vertices[t[0]],
                                mesh.vertices[t[2]] - mesh.vertices[t[0]]);
}

void check_areas(const SurfaceMesh<3> &mesh)
{
  for (std::size_t i = 0; i < mesh.facets.size(); ++i) {
    const auto &t = mesh.facets[i];
    double longest_square = 0.;
    for (unsigned int e = 0; e < 3; ++e)
      longest_square =
          std::max(longest_square, (mesh.vertices[t[(e + 1) % 3]] - mesh.vertices[t[e]]).norm_square());
    if (area_vector(mesh, t).norm() <= 1e-10 * longest_square)
      fail("triangle " + std::to_string(i + 1) + " at " + shown(mesh.vertices[t[0]]) + " has no area");
  }
}

/// Each edge belongs to two triangles, which run through it in opposite senses. Returns the neighbours of
/// each triangle.
std::vector<std::array<std::size_t, 3>> check_edges(const SurfaceMesh<3> &mesh)
{
  std::map<std::pair<unsigned int, unsigned int>, std::size_t> triangle_of;
  for (std::size_t i = 0; i < mesh.facets.size(); ++i)
    for (unsigned int e = 0; e < 3; ++e) {
      const unsigned int from = mesh.facets[i][e], to = mesh.facets[i][(e + 1) % 3];
      const auto [other, is_new] = triangle_of.emplace(std::make_pair(from, to), i);
      if (!is_new)
        fail("triangles " + std::to_string(other->second + 1) + " and " + std::to_string(i + 1) +
             " run in the same sense along the edge from " + shown(mesh.vertices[from]) + " to " +
             shown(mesh.vertices[to]) + "; all must be counter-clockwise as seen from outside");
    }
  std::vector<std::array<std::size_t, 3>> neighbours(mesh.facets.size());
  for (const auto &[edge, i] : triangle_of) {
    const auto opposite = triangle_of.find({edge.second, edge.first});
    if (opposite == triangle_of.end())
      fail("is not closed: the edge from " + shown(mesh.vertices[edge.first]) + " to " +
           shown(mesh.vertices[edge.second]) + " belongs only to triangle " + std::to_string(i + 1));
    for (unsigned int e = 0; e < 3; ++e)
      if (mesh.facets[i][e] == edge.first)
        neighbours[i][e] = opposite->second;
  }
  return neighbours;
}

/// The number of the connected part to which each triangle belongs.
std::vector<unsigned int> connected_parts(const std::vector<std::array<std::size_t, 3>> &neighbours)
{
  constexpr unsigned int none = -1;
  std::vector<unsigned int> part(neighbours.size(), none);
  unsigned int n_parts = 0;
  for (std::size_t first = 0; first < part.size(); ++first)
    if (part[first] == none) {
      std::vector<std::size_t> front = {first};
      part[first] = n_parts;
      while (!front.empty()) {
        const std::size_t i = front.back();
        front.pop_back();
        for (const std::size_t j : neighbours[i])
          if (part[j] == none) {
            part[j] = n_parts;
            front.push_back(j);
          }
      }
      ++n_parts;
    }
  return part;
}

/// Of a triangle as seen from x, positive if counter-clockwise from outside: A. van Oosterom and J. Strackee,
/// IEEE Trans. Biomed. Eng. 30 (1983), 125-126.
double solid_angle(const SurfaceMesh<3> &mesh, const SurfaceMesh<3>::Facet &t, const Place &x)
{
  const auto a = mesh.vertices[t[0]] - x, b = mesh.vertices[t[1]] - x, c = mesh.vertices[t[2]] - x;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return 2. *
         std::atan2(a * cross_product_3d(b, c), la * lb * lc + (a * b) * lc + (b * c) * la + (c * a) * lb);
}

/// A connected part that is turned outward has nothing around it or is in a cavity, one that is turned inward
/// is a cavity in another.
void check_sense(const SurfaceMesh<3> &mesh, const std::vector<unsigned int> &part)
{
  const unsigned int n_parts = 1 + *std::max_element(part.begin(), part.end());
  std::vector<double> volume(n_parts, 0.);
  std::vector<std::size_t> example(n_parts);
  const Place origin = mesh.vertices[0];
  for (std::size_t i = 0; i < mesh.facets.size(); ++i) {
    const auto &t = mesh.facets[i];
    volume[part[i]] += (mesh.vertices[t[0]] - origin) * area_vector(mesh, t) / 3.;
    example[part[i]] = i;
  }
  const double total = std::accumulate(volume.begin(), volume.end(), 0.);
  if (total <= 0.)
    fail("is turned inside out: its triangles must be counter-clockwise as seen from outside");
  const double full = 16. * std::atan(1.);
  for (unsigned int p = 0; p < n_parts && n_parts > 1; ++p) {
    const Place x = mesh.vertices[mesh.facets[example[p]][0]];
    double angle = 0.;
    for (std::size_t i = 0; i < mesh.facets.size(); ++i)
      if (part[i] != p)
        angle += solid_angle(mesh, mesh.facets[i], x);
    const long times_inside = std::lround(angle / full);
    if (times_inside != (volume[p] > 0. ? 0 : 1))
      fail("the part of the surface with the corner " + shown(x) +
           (volume[p] > 0. ? " lies inside another part"
                           : " is turned inside out and is no cavity of another part"));
  }
}
} // namespace

void check_closed(const SurfaceMesh<3> &mesh)
{
  check_areas(mesh);
  check_sense(mesh, connected_parts(check_edges(mesh)));
}
} // namespace peat
