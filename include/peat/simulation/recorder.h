#pragma once

#include <peat/base/parameters.h>
#include <peat/grid/grid.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace peat {
template <int dim>
struct Case;
template <int dim>
struct Scene;

/// The section `Compare`: what `peat compare` does with the case.
struct CompareParameters
{
  explicit CompareParameters(Section section);

  Section section;
  unsigned int n_samples = 20; ///< number of times
  bool logarithmic = false;    ///< times are spaced by equal factors, else equally
  double first_sample = 0.;    ///< [s] of times spaced by factors; 0: a ten-thousandth of the run
  double tolerance = 0.02;     ///< of relative differences; those above get a sentence
  /// What the two runs set, as `--set` would: "Section/Key=value", several separated by ';'.
  std::string first = "Method=mpm";
  std::string second = "Method=fem";
};

/// Means over the cells of one body at one time.
struct CellSamples
{
  std::vector<std::uint64_t> cell; ///< ascending; i + n_x (j + n_y k), see Recording::planes
  std::vector<double> volume;      ///< of the body in the cell [m^dim]
  std::vector<double> values;      ///< [cell][field]; NaN where the body has no such field
};

/// What one run was like: means over cells of fields, by time and body. Independent of the mesh of the run
/// and of the number of ranks, so that runs can be compared cell by cell.
struct Recording
{
  unsigned int dimension = 0;
  std::array<std::vector<double>, 3> planes; ///< of the mesh [m]; in 2-D planes[2] is empty
  std::vector<std::string> fields;           ///< "pressure", "displacement x", ...
  std::vector<std::string> units;            ///< of the fields
  std::vector<std::string> bodies;
  std::vector<double> times;                     ///< recorded so far, ascending [s]
  std::vector<std::vector<CellSamples>> samples; ///< [time][body]

  /// Number of cells of the mesh in a direction; 1 in the third one of 2-D.
  std::size_t n_cells(const unsigned int d) const { return planes[d].empty() ? 1 : planes[d].size() - 1; }
  /// Lattice coordinates of a cell.
  std::array<std::size_t, 3> lattice(std::uint64_t cell) const;
  /// Its middle [m]; 0 in the third direction of 2-D.
  std::array<double, 3> middle(std::uint64_t cell) const;
  /// Its size [m^dim].
  double volume(std::uint64_t cell) const;
};

/// Records a run at given times. Simulation calls record() when its schedule comes to one of them.
template <int dim>
class Recorder
{
public:
  /// Fields: pressure (if any body is saturated), displacement, velocity, effective stress, by components.
  /// `times` are to be ascending and after the start of the run [s].
  Recorder(const Case<dim> &parameters, std::vector<double> times);

  const std::vector<double> &times() const { return all_times; }

  /// Collective. Time must be one of times().
  void record(double time, const Scene<dim> &scene, const Grid<dim> &grid);

  /// On rank 0 all that was recorded; on other ranks the same without samples.
  const Recording &recording() const { return data; }

private:
  std::vector<double> all_times;
  Recording data;
};

/// Times in (0, end] as the parameters space them, and the `others`; ascending, each once (up to 1e-9 of the
/// end). Throws an InputError if the first one is after the end.
std::vector<double> sample_times(const CompareParameters &compare, double end,
                                 const std::vector<double> &others);
} // namespace peat
