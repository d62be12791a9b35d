#pragma once

#include <peat/simulation/case.h>
#include <peat/simulation/difference.h>
#include <peat/simulation/recorder.h>

#include <array>
#include <string>
#include <vector>

namespace peat {
/// One of the two runs of a comparison.
struct ComparedRun
{
  std::string settings; ///< "Section/Key=value; ..."
  std::string name;     ///< of its directory and in files: "mpm"
  std::string label;    ///< for people: "CMPM"
  std::string directory;
  std::string problem; ///< why it ended early; "": it did not
  Recording recording; ///< on rank 0
};

/// All that a comparison has found; on rank 0.
struct ComparisonData
{
  std::string title;
  std::string directory;
  std::array<ComparedRun, 2> runs;
  std::vector<Difference> differences; ///< cells, probes, references
  double tolerance = 0.;
  double end_time = 0.;
  unsigned int dimension = 0;
};

/// Where the page looks: the cell and time in which the first run's main field (pressure, or the vertical
/// stress of a dry case) is largest, and vertical lines of cells through it and through probes.
struct Sights
{
  std::size_t field = 0;
  double time = 0.;
  std::array<std::size_t, 3> cell = {0, 0, 0};
  std::vector<std::array<std::size_t, 3>> lines; ///< lattice of any cell in each
  std::vector<std::string> line_names;

  /// Whether the cell is in the plane through the largest value (3-D; always in 2-D) or in a line.
  bool see(const std::array<std::size_t, 3> &lattice, unsigned int dimension) const;
};

template <int dim>
Sights find_sights(const Case<dim> &parameters, const Recording &recording);

/// Whether a difference is above the tolerance in L2 or Linf.
bool is_above(const Difference &difference, double tolerance);

/// The sentences about all differences above the tolerance, the largest ones first, those of all bodies,
/// references and probes each in turn.
std::vector<std::string> findings(const ComparisonData &data);

/// compare.csv: a line for each difference.
void write_differences(const ComparisonData &data);

/// samples.csv: a line for each time, body and cell with the fields of both runs; empty where a run has none.
/// Large recordings are restricted to what the page shows (Sights::see()). Returns whether all is there.
bool write_samples(const ComparisonData &data, const Sights &sights);

/// references.csv: the values of the references at places and times, for the page; relative file names of
/// tables start from `case_directory`. Nothing without references.
template <int dim>
void write_references(const Case<dim> &parameters, const std::string &case_directory,
                      const ComparisonData &data, const Sights &sights);

/// summary.json of the comparison; reads those of the two runs.
void write_compare_summary(const ComparisonData &data, const Sights &sights, bool samples_are_complete);
} // namespace peat
