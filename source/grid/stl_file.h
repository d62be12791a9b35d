#pragma once

#include <peat/grid/surface_mesh.h>

#include <string>

namespace peat {
/// Reads the triangles of an STL file, text or binary; equal corners become one vertex. Throws a
/// std::runtime_error that says in one line what is wrong with the file.
SurfaceMesh<3> read_stl(const std::string &file_name);

/// Throws a std::runtime_error in one line unless the triangles are the surface of a body: closed, no edge
/// with more than two triangles, none without area, all counter-clockwise as seen from outside. Triangles are
/// numbered from 1 in messages. Not found is a surface that passes through itself.
void check_closed(const SurfaceMesh<3> &mesh);
} // namespace peat
