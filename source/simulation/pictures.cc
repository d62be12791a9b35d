#include <peat/simulation/pictures.h>

#include <peat/simulation/projection.h>

#include <deal.II/base/data_out_base.h>
#include <deal.II/base/mpi.h>

#include <cctype>
#include <cstdio>
#include <filesystem>
#include <fstream>

namespace peat {
namespace {
/// A scalar (1), vector (dim) or tensor (9) of a picture: which numbers of a row of data its components are;
/// -1 stands for zero.
struct Quantity
{
  std::string name;
  std::string unit;
  std::vector<int> source;
};

template <int dim>
std::vector<int> stress_source(const int first)
{
  std::vector<int> source = dim == 2 ? std::vector<int>{0, 3, -1, 3, 1, -1, -1, -1, 2}
                                     : std::vector<int>{0, 3, 5, 3, 1, 4, 5, 4, 2};
  for (int &component : source)
    if (component >= 0)
      component += first;
  return source;
}

std::vector<int> consecutive(const int first, const unsigned int n)
{
  std::vector<int> source;
  for (unsigned int c = 0; c < n; ++c)
    source.push_back(first + c);
  return source;
}

/// A picture file: patches (cells or points) with data.
template <int patch_dim, int dim>
class PatchFile : public dealii::DataOutInterface<patch_dim, dim>
{
public:
  using Patch = dealii::DataOutBase::Patch<patch_dim, dim>;

  PatchFile(std::vector<Quantity> quantities, const std::size_t n_patches) : quantities(std::move(quantities))
  {
    for (const Quantity &quantity : this->quantities)
      n_components += quantity.source.size();
    patches.reserve(n_patches);
  }

  Patch &add_patch()
  {
    patches.emplace_back();
    Patch &patch = patches.back();
    patch.patch_index = patches.size() - 1;
    patch.data.reinit(n_components, 1 << patch_dim);
    return patch;
  }

  /// A line or a triangle.
  Patch &add_facet()
  {
    Patch &patch = add_patch();
    if (patch_dim == 2) {
      patch.reference_cell = dealii::ReferenceCells::get_simplex<patch_dim>();
      patch.data.reinit(n_components, patch_dim + 1);
    }
    return patch;
  }

  /// Fill in the data of one vertex from a row of numbers.
  void set(Patch &patch, const unsigned int vertex, const double *row) const
  {
    unsigned int c = 0;
    for (const Quantity &quantity : quantities)
      for (const int source : quantity.source)
        patch.data(c++, vertex) = source < 0 ? 0. : row[source];
  }

  /// All ranks write into one file.
  void write(const std::string &file_name, const double time, const unsigned int cycle, MPI_Comm communicator)
  {
    dealii::DataOutBase::VtkFlags flags(time, cycle);
    flags.compression_level = decltype(flags.compression_level)::best_speed;
    for (const Quantity &quantity : quantities)
      if (!quantity.unit.empty())
        flags.physical_units[quantity.name] = quantity.unit;
    this->set_flags(flags);
    this->write_vtu_in_parallel(file_name, communicator);
  }

protected:
  const std::vector<Patch> &get_patches() const override { return patches; }

  std::vector<std::string> get_dataset_names() const override
  {
    std::vector<std::string> names;
    for (const Quantity &quantity : quantities)
      names.insert(names.end(), quantity.source.size(), quantity.name);
    return names;
  }

  std::vector<std::tuple<unsigned int, unsigned int, std::string,
                         dealii::DataComponentInterpretation::DataComponentInterpretation>>
  get_nonscalar_data_ranges() const override
  {
    namespace Interpretation = dealii::DataComponentInterpretation;
    std::vector<
        std::tuple<unsigned int, unsigned int, std::string, Interpretation::DataComponentInterpretation>>
        ranges;
    unsigned int first = 0;
    for (const Quantity &quantity : quantities) {
      const unsigned int n = quantity.source.size();
      if (n > 1)
        ranges.emplace_back(first, first + n - 1, quantity.name,
                            n == 9 ? Interpretation::component_is_part_of_tensor
                                   : Interpretation::component_is_part_of_vector);
      first += n;
    }
    return ranges;
  }

private:
  const std::vector<Quantity> quantities;
  unsigned int n_components = 0;
  std::vector<Patch> patches;
};

std::string in_file_name(const std::string &text)
{
  std::string result;
  for (const unsigned char c : text)
    result += std::isalnum(c) || c == '-' || c == '_' || c == '.' ? char(c) : '_';
  return result;
}

std::string in_xml(const std::string &text)
{
  std::string result;
  for (const char c : text)
    result += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '"' ? "&quot;" : std::string(1, c);
  return result;
}
} // namespace

template <int dim>
Pictures<dim>::Pictures(const std::string &directory, const Scene<dim> &scene, MPI_Comm communicator)
    : directory(directory), scene(scene), communicator(communicator)
{
  std::error_code error;
  if (dealii::Utilities::MPI::this_mpi_process(communicator) == 0)
    std::filesystem::create_directories(directory + "/pictures", error);
  if (dealii::Utilities::MPI::max(error.value(), communicator) != 0)
    throw InputError("cannot make the directory '" + directory + "/pictures'");
  for (const auto &rigid : scene.rigid_bodies)
    surfaces.push_back(surface_mesh(rigid->reference_shape()));
}

template <int dim>
void Pictures<dim>::write(const double time, const ActiveNodes<dim> &nodes, const NodalFields<dim> &fields)
{
  write_grid(time, nodes, fields);
  for (const auto &body : scene.bodies)
    write_points(time, *body);
  for (std::size_t r = 0; r < scene.rigid_bodies.size(); ++r)
    write_surface(time, *scene.rigid_bodies[r], surfaces[r]);
  ++n_times;
  const bool written = dealii::Utilities::MPI::this_mpi_process(communicator) != 0 || write_list();
  if (dealii::Utilities::MPI::min(int(written), communicator) == 0)
    throw NumericalError("cannot write '" + directory + "/solution.pvd'");
}

template <int dim>
std::string Pictures<dim>::add_entry(const double time, const std::string &name)
{
  if (parts.find(name) == parts.end()) {
    std::string file_name = name.empty() ? "grid" : in_file_name(name);
    const auto taken = [&] {
      return std::any_of(parts.begin(), parts.end(),
                         [&](const auto &p) { return p.second.file_name == file_name; });
    };
    while (taken())
      file_name += '_';
    const unsigned int number = parts.size();
    parts[name] = {file_name, number};
  }
  const Part &part = parts[name];
  char count[16];
  std::snprintf(count, sizeof(count), "-%04u.vtu", n_times);
  entries.push_back({time, part.number, name.empty() ? "grid" : name, "pictures/" + part.file_name + count});
  return directory + '/' + entries.back().file;
}

namespace {
/// Where the numbers of the grid's picture stand in its rows of data.
template <int dim>
std::vector<Quantity> grid_quantities(const bool saturated)
{
  constexpr unsigned int n_stress = dim == 2 ? 4 : 6;
  std::vector<Quantity> list = {{"velocity", "m/s", consecutive(0, dim)},
                                {"displacement", "m", consecutive(dim, dim)},
                                {"effective stress", "Pa", stress_source<dim>(2 * dim)}};
  if (saturated) {
    list.push_back({"pressure", "Pa", {2 * dim + n_stress}});
    list.push_back({"flux", "m/s", consecutive(2 * dim + n_stress + 1, dim)});
  }
  return list;
}

template <int dim>
std::vector<std::string> projected_fields()
{
  std::vector<std::string> names = {"velocity x", "velocity y", "displacement x", "displacement y"};
  if (dim == 3)
    names = {"velocity x", "velocity y", "velocity z", "displacement x", "displacement y", "displacement z"};
  for (const std::string component : {"xx", "yy", "zz", "xy", "yz", "zx"})
    if (dim == 3 || (component != "yz" && component != "zx"))
      names.push_back("effective stress " + component);
  return names;
}
} // namespace

template <int dim>
void Pictures<dim>::write_grid(const double time, const ActiveNodes<dim> &nodes,
                               const NodalFields<dim> &fields)
{
  const bool saturated = scene.is_saturated();
  std::vector<const Body<dim> *> bodies;
  for (const auto &body : scene.bodies)
    bodies.push_back(body.get());
  const std::vector<std::string> names = projected_fields<dim>();
  const NodalProjection<dim> skeleton(nodes, cell_means(bodies, names));
  const NodalProjection<dim> fluid(nodes, saturated ? cell_means(bodies, {"pressure"})
                                                    : CellMeans<dim>{1, {}, {}, {}, {}});

  PatchFile<dim, dim> file(grid_quantities<dim>(saturated), nodes.occupied_cells().size());
  std::vector<double> row(names.size() + 1 + dim, 0.);
  for (const CellId cell : nodes.occupied_cells()) {
    auto &patch = file.add_patch();
    patch.reference_cell = dealii::ReferenceCells::get_hypercube<dim>();
    for (unsigned int v = 0; v < (1u << dim); ++v) {
      const std::uint32_t i = corner_node(nodes, cell, v);
      patch.vertices[v] = nodes.position(i);
      for (std::size_t f = 0; f < names.size(); ++f)
        row[f] = skeleton.value(i, f);
      if (saturated) {
        row[names.size()] = fluid.value(i, 0);
        for (unsigned int d = 0; d < dim && !fields.flux.empty(); ++d)
          row[names.size() + 1 + d] = fields.flux[std::size_t(i) * dim + d];
      }
      file.set(patch, v, row.data());
    }
  }
  file.write(add_entry(time, ""), time, n_times, communicator);
}

template <int dim>
void Pictures<dim>::write_points(const double time, const Body<dim> &body)
{
  const Layout &layout = body.layout();
  std::vector<Quantity> quantities;
  for (const Layout::Field &field : layout.fields) {
    const bool tensor = field.kind == Layout::Kind::other && field.n_components == 9;
    if (field.kind == Layout::Kind::stress)
      quantities.push_back({field.name, field.unit, stress_source<dim>(field.first_column)});
    else if (field.n_components == 1 || field.kind == Layout::Kind::vector || tensor)
      quantities.push_back({field.name, field.unit, consecutive(field.first_column, field.n_components)});
    else
      for (unsigned int c = 0; c < field.n_components; ++c)
        quantities.push_back(
            {field.name + ' ' + std::to_string(c + 1), field.unit, {int(field.first_column + c)}});
  }
  quantities.push_back({"id", "", {int(layout.n_columns)}});

  PatchFile<0, dim> file(quantities, body.n_local_points());
  std::vector<double> row(layout.n_columns + 1);
  for (const std::uint32_t handle : body.handles()) {
    std::copy_n(body.row(handle), layout.n_columns, row.begin());
    row[layout.n_columns] = body.id(handle);
    auto &patch = file.add_patch();
    patch.vertices[0] = body.position(handle);
    file.set(patch, 0, row.data());
  }
  file.write(add_entry(time, body.name()), time, n_times, communicator);
}

template <int dim>
void Pictures<dim>::write_surface(const double time, const RigidBody<dim> &body,
                                  const SurfaceMesh<dim> &surface)
{
  PatchFile<dim - 1, dim> file({{"velocity", "m/s", consecutive(0, dim)}}, surface.facets.size());
  // All ranks know the surface, the first one writes it.
  if (dealii::Utilities::MPI::this_mpi_process(communicator) == 0)
    for (const auto &facet : surface.facets) {
      auto &patch = file.add_facet();
      for (unsigned int v = 0; v < dim; ++v) {
        patch.vertices[v] = body.to_present(surface.vertices[facet[v]]);
        const dealii::Tensor<1, dim> velocity = body.velocity_at(patch.vertices[v]);
        file.set(patch, v, velocity.begin_raw());
      }
    }
  file.write(add_entry(time, body.name()), time, n_times, communicator);
}

/// Under another name first, so that ParaView never finds half a file. Returns whether it worked.
template <int dim>
bool Pictures<dim>::write_list() const
{
  const std::string name = directory + "/solution.pvd";
  std::ofstream file(name + ".tmp");
  file.precision(12);
  file << "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" "
          "byte_order=\"LittleEndian\">\n"
       << "  <Collection>\n";
  for (const Entry &entry : entries)
    file << "    <DataSet timestep=\"" << entry.time << "\" group=\"\" part=\"" << entry.part << "\" name=\""
         << in_xml(entry.name) << "\" file=\"" << entry.file << "\"/>\n";
  file << "  </Collection>\n</VTKFile>\n";
  file.close();
  std::error_code error;
  if (file)
    std::filesystem::rename(name + ".tmp", name, error);
  return file && !error;
}

template <int dim>
void Pictures<dim>::persist(Archive &archive)
{
  archive.begin("pictures");
  archive(n_times, parts, entries);
  if (archive.is_loading() && dealii::Utilities::MPI::this_mpi_process(communicator) == 0)
    write_list();
}

template class Pictures<2>;
template class Pictures<3>;
} // namespace peat
