#pragma once

#include <peat/grid/surface_mesh.h>
#include <peat/solver/explicit_mpm.h>

#include <map>
#include <string>
#include <vector>

namespace peat {
/// Pictures for ParaView: `solution.pvd`, which lists for each time `pictures/grid-0003.vtu` (the cells that
/// hold material) and `pictures/BODY-0003.vtu` for each body (its points; of a rigid body its surface). Each
/// file is written by all ranks together, compressed, in single precision.
///
/// The grid shows velocity, displacement and effective stress of all bodies together, and pressure and flux
/// (as the last step left it; zero if the nodes were numbered anew since) where there is pore fluid; all but
/// the flux are projections of the points (NodalProjection). Points show every stored field and their ids.
/// Stresses and deformation gradients are full tensors.
template <int dim>
class Pictures
{
public:
  /// `scene` must live as long as this. Collective: makes the directory.
  Pictures(const std::string &directory, const Scene<dim> &scene, MPI_Comm communicator);

  /// Collective.
  void write(double time, const ActiveNodes<dim> &nodes, const NodalFields<dim> &fields);
  unsigned int n_written() const { return n_times; }
  /// Reading writes the list of the pictures so far.
  void persist(Archive &archive);

private:
  struct Entry
  {
    double time;
    unsigned int part;
    std::string name;
    std::string file;
    void persist(Archive &archive) { archive(time, part, name, file); }
  };

  void write_grid(double time, const ActiveNodes<dim> &nodes, const NodalFields<dim> &fields);
  void write_points(double time, const Body<dim> &body);
  void write_surface(double time, const RigidBody<dim> &body, const SurfaceMesh<dim> &surface);
  /// "pictures/NAME-0003.vtu", noted for solution.pvd.
  std::string add_entry(double time, const std::string &name);
  bool write_list() const;

  const std::string directory;
  const Scene<dim> &scene;
  MPI_Comm communicator;
  unsigned int n_times = 0;
  /// Of the rigid bodies, where they were at the start.
  std::vector<SurfaceMesh<dim>> surfaces;
  /// What the name of a part (the grid or a body) is in file names, and its number.
  struct Part
  {
    std::string file_name;
    unsigned int number;
    void persist(Archive &archive) { archive(file_name, number); }
  };
  std::map<std::string, Part> parts;
  std::vector<Entry> entries;
};
} // namespace peat
