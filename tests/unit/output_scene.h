#pragma once

// A small scene with known fields, for the tests of what is written. Include after Boost.Test.

#include <peat/simulation/simulation.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <unistd.h>

#include "mpi_fixture.h"

using namespace peat;

const MPI_Comm comm = MPI_COMM_WORLD;

inline unsigned int rank()
{
  return dealii::Utilities::MPI::this_mpi_process(comm);
}

/// The current directory of all ranks while it lives.
class Directory
{
public:
  Directory() : before(std::filesystem::current_path())
  {
    const int id = dealii::Utilities::MPI::broadcast(comm, int(getpid()));
    path = std::filesystem::temp_directory_path() / ("peat_output_" + std::to_string(id));
    std::filesystem::create_directories(path);
    std::filesystem::current_path(path);
  }
  ~Directory()
  {
    MPI_Barrier(comm);
    std::filesystem::current_path(before);
    if (rank() == 0)
      std::filesystem::remove_all(path);
    MPI_Barrier(comm);
  }

private:
  std::filesystem::path before, path;
};

inline void write_file(const std::string &name, const std::string &text)
{
  if (rank() == 0) {
    std::filesystem::remove(name);
    std::ofstream(name) << text;
  }
  MPI_Barrier(comm);
}

inline std::string read_file(const std::string &name)
{
  std::ifstream file(name, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

inline std::string message_of(const std::function<void()> &action)
{
  try {
    action();
  } catch (const InputError &error) {
    return error.what();
  }
  return "";
}

inline bool contains(const std::string &text, const std::string &part)
{
  return text.find(part) != std::string::npos;
}

/// A saturated ground (finite strain if so asked) and, beside it, a dry block; all sizes in cells of 1/n.
template <int dim>
std::string scene_text(const unsigned int n, const std::string &law, const std::string &more)
{
  std::ostringstream text;
  text << "set Dimension = " << dim << "\nsubsection Constants\n  set n = " << n << "\nend\n"
       << "subsection Grid\n  set Lower corner = " << (dim == 2 ? "0, 0" : "0, 0, 0")
       << "\n  set Upper corner = " << (dim == 2 ? "2, 2" : "2, 2, 2")
       << "\n  set Cells = " << (dim == 2 ? "2*n, 2*n" : "2*n, 2*n, 2*n") << "\nend\n"
       << "subsection Materials\n  subsection sand\n    set Law = " << law << "\n    set Porosity = 0.4\n"
       << "    set Hydraulic conductivity = 1e-4\n  end\n  subsection steel\n    set Density = 7850\n  "
          "end\nend\n"
       << "subsection Bodies\n  subsection ground\n    set Material = sand\n    set Shape = "
       << (dim == 2 ? "box(0, 0, 1, 1)" : "box(0, 0, 0, 1, 1, 1)")
       << "\n  end\n  subsection block\n    set Material = steel\n    set Shape = "
       << (dim == 2 ? "ball(1.5, 1.5, 0.4)" : "ball(1.5, 1.5, 1.5, 0.4)") << "\n  end\nend\n"
       << "subsection Stages\n  subsection run\n    set Duration = 1\n  end\nend\n"
       << more;
  return text.str();
}

template <int dim>
struct World
{
  World(const unsigned int n, const std::string &more = "", const std::string &law = "linear elastic")
      : World(make_case(scene_text<dim>(n, law, more)))
  {}

  explicit World(std::unique_ptr<Case<dim>> given)
      : parameters(std::move(given)), grid(parameters->grid, comm), scene(make_scene(*parameters, grid)),
        nodes(grid, static_cast<unsigned int>(parameters->scheme.basis))
  {
    std::vector<CellId> cells;
    for (const auto &body : scene.bodies)
      for (const Slice &slice : body->slices())
        cells.push_back(slice.cell);
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    nodes.rebuild(cells);
    fields.flux.assign(std::size_t(nodes.size()) * dim, 0.25);
  }

  static std::unique_ptr<Case<dim>> make_case(const std::string &text)
  {
    write_file("case.prm", text);
    file() = std::make_unique<ParameterFile>("case.prm", std::vector<std::string>());
    BOOST_REQUIRE(read_dimension(*file()) == dim);
    return std::make_unique<Case<dim>>(*file());
  }
  static std::unique_ptr<ParameterFile> &file()
  {
    static std::unique_ptr<ParameterFile> one;
    return one;
  }

  std::vector<const Body<dim> *> bodies() const
  {
    std::vector<const Body<dim> *> list;
    for (const auto &body : scene.bodies)
      list.push_back(body.get());
    return list;
  }

  /// Give all points of all bodies a pressure (if they have one) and the same value as effective stress yy
  /// and velocity x; `at_cell_centre`: constant in each cell, as u-p schemes leave the pressure.
  void set(const std::function<double(const dealii::Point<dim> &)> &f, const bool at_cell_centre = false)
  {
    for (const auto &body : scene.bodies)
      for (const std::uint32_t handle : body->handles()) {
        const dealii::Point<dim> &x = body->position(handle);
        dealii::Point<dim> centre;
        for (unsigned int d = 0; d < dim; ++d)
          centre[d] = grid.lower(body->cell(handle), d) + 0.5 * grid.size(body->cell(handle), d);
        const double value = f(at_cell_centre ? centre : x);
        double *row = body->row(handle);
        row[body->layout().stress + 1] = value;
        row[body->layout().velocity] = value;
        if (body->layout().pressure >= 0)
          row[body->layout().pressure] = value;
      }
  }

  std::unique_ptr<Case<dim>> parameters;
  Grid<dim> grid;
  Scene<dim> scene;
  ActiveNodes<dim> nodes;
  NodalFields<dim> fields;
};

template <int dim>
double linear(const dealii::Point<dim> &x)
{
  return 3. + 2. * x[0] - 5. * x[1] + (dim == 3 ? 4. * x[dim - 1] : 0.);
}

template <int dim>
double wave(const dealii::Point<dim> &x)
{
  return std::sin(2. * x[0] + 0.3) * std::cos(1.5 * x[1]) * (dim == 3 ? std::exp(0.5 * x[dim - 1]) : 1.);
}
