#include <peat/base/text.h>
#include <peat/grid/shape.h>
#include <peat/grid/surface_mesh.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "stl_file.h"
#include "triangle_tree.h"

// Bodies whose surface comes from a file of triangles.

namespace peat {
namespace {
/// What a closed surface of triangles encloses. Which side a place is on, the normal at the nearest point of
/// the surface says: of a face, the mean of two on an edge, the mean by angles at a corner; with these the
/// answer is right for every place: J. A. Baerentzen and H. Aanaes, IEEE Trans. Vis. Comput. Graph. 11
/// (2005), 243-253.
class Triangulated : public Shape<3>
{
public:
  explicit Triangulated(SurfaceMesh<3> surface)
      : mesh(std::move(surface)), tree(mesh.vertices, mesh.facets), corner_normals(mesh.vertices.size()),
        edge_normals(mesh.facets.size()), box{mesh.vertices[0], mesh.vertices[0]}
  {
    std::map<std::pair<unsigned int, unsigned int>, dealii::Tensor<1, 3>> face_of_edge;
    for (const auto &t : mesh.facets) {
      face_normals.push_back(normal_of(t));
      for (unsigned int e = 0; e < 3; ++e) {
        const auto along = direction(t[e], t[(e + 1) % 3]), back = direction(t[e], t[(e + 2) % 3]);
        corner_normals[t[e]] += std::acos(std::min(1., std::max(-1., along * back))) * face_normals.back();
        face_of_edge[{t[e], t[(e + 1) % 3]}] = face_normals.back();
      }
    }
    for (std::size_t i = 0; i < mesh.facets.size(); ++i)
      for (unsigned int e = 0; e < 3; ++e)
        edge_normals[i][e] =
            face_normals[i] + face_of_edge.at({mesh.facets[i][(e + 1) % 3], mesh.facets[i][e]});
    for (const auto &x : mesh.vertices)
      for (unsigned int d = 0; d < 3; ++d) {
        box.lower[d] = std::min(box.lower[d], x[d]);
        box.upper[d] = std::max(box.upper[d], x[d]);
      }
  }

  double distance(const dealii::Point<3> &x) const override
  {
    const auto nearest = tree.nearest(x);
    const double length = std::sqrt(nearest.distance_square);
    return (x - nearest.point) * normal_at(nearest) < 0. ? -length : length;
  }

  dealii::Tensor<1, 3> normal(const dealii::Point<3> &x) const override
  {
    const auto nearest = tree.nearest(x);
    const dealii::Tensor<1, 3> at_surface = normal_at(nearest), way = x - nearest.point;
    const double length = way.norm();
    // Nearer than this the direction is round-off.
    if (length <= 1e-9 * box.radius())
      return at_surface / at_surface.norm();
    return way * at_surface < 0. ? -way / length : way / length;
  }

  Bounds<3> bounds() const override { return box; }

  bool append_facets(SurfaceMesh<3> &surface) const override
  {
    const unsigned int first = surface.vertices.size();
    surface.vertices.insert(surface.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (const auto &t : mesh.facets)
      surface.facets.push_back({t[0] + first, t[1] + first, t[2] + first});
    return true;
  }

private:
  const SurfaceMesh<3> mesh;
  const TriangleTree tree;
  std::vector<dealii::Tensor<1, 3>> face_normals;
  std::vector<dealii::Tensor<1, 3>> corner_normals;              ///< not of length 1
  std::vector<std::array<dealii::Tensor<1, 3>, 3>> edge_normals; ///< of each triangle; not of length 1
  Bounds<3> box;

  dealii::Tensor<1, 3> direction(const unsigned int from, const unsigned int to) const
  {
    const auto edge = mesh.vertices[to] - mesh.vertices[from];
    return edge / edge.norm();
  }
  dealii::Tensor<1, 3> normal_of(const SurfaceMesh<3>::Facet &t) const
  {
    const auto area = cross_product_3d(mesh.vertices[t[1]] - mesh.vertices[t[0]],
                                       mesh.vertices[t[2]] - mesh.vertices[t[0]]);
    return area / area.norm();
  }
  const dealii::Tensor<1, 3> &normal_at(const TriangleTree::Nearest &nearest) const
  {
    return nearest.part == 6   ? face_normals[nearest.triangle]
           : nearest.part >= 3 ? edge_normals[nearest.triangle][nearest.part - 3]
                               : corner_normals[mesh.facets[nearest.triangle][nearest.part]];
  }
};

std::shared_ptr<const Shape<3>> make_solid(const ShapeCall<3> &call)
{
  // Line 0: the command line, whose files are relative to the working directory.
  const std::filesystem::path file = call.arguments[0],
                              beside = call.origin.line == 0
                                           ? std::filesystem::path()
                                           : std::filesystem::path(call.origin.file).parent_path();
  const std::string path = (file.is_absolute() ? file : beside / file).string();
  try {
    SurfaceMesh<3> mesh = read_stl(path);
    check_closed(mesh);
    return std::make_shared<const Triangulated>(std::move(mesh));
  } catch (const std::runtime_error &error) {
    call.fail("the file '" + path + "': " + error.what());
  }
}

const ShapeMember<3> stl("stl", "file",
                         "What the closed surface of triangles in an STL file encloses; the file's place is "
                         "relative to the parameter file.",
                         make_solid);
} // namespace
} // namespace peat
