#include <peat/simulation/recorder.h>

#include <peat/base/text.h>
#include <peat/simulation/case.h>
#include <peat/simulation/fields.h>
#include <peat/solver/explicit_mpm.h>

#include <deal.II/base/mpi.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace peat {
CompareParameters::CompareParameters(Section section) : section(section)
{
  section.add("Samples", n_samples, between(1, 10000),
              "Number of times at which 'peat compare' samples both runs; the times of the "
              "references come on top.");
  std::string spacing = "linear";
  section.add("Spacing", spacing, {"linear", "logarithmic"},
              "Of these times. 'logarithmic': each is later than the one before by the same factor, as for "
              "consolidation.");
  logarithmic = spacing == "logarithmic";
  section.add("First sample", first_sample, nonnegative("s"),
              "First of the times that are spaced logarithmically; 0: a ten-thousandth of the run.");
  if (!section.describing() && !logarithmic && section.has("First sample"))
    section.fail("First sample", "is for 'Spacing = logarithmic'");
  section.add("Tolerance", tolerance, strictly_between(0., 1.),
              "Relative differences above it are explained in the report of 'peat compare'.");
  section.add("First", first,
              "What the first run of 'peat compare' sets: Section/Key=value, several separated by ';'.");
  section.add("Second", second, "What the second run of 'peat compare' sets.");
}

std::array<std::size_t, 3> Recording::lattice(const std::uint64_t cell) const
{
  const std::size_t nx = n_cells(0), ny = n_cells(1);
  return {cell % nx, cell / nx % ny, cell / (nx * ny)};
}

std::array<double, 3> Recording::middle(const std::uint64_t cell) const
{
  const auto index = lattice(cell);
  std::array<double, 3> x = {0., 0., 0.};
  for (unsigned int d = 0; d < dimension; ++d)
    x[d] = 0.5 * (planes[d][index[d]] + planes[d][index[d] + 1]);
  return x;
}

double Recording::volume(const std::uint64_t cell) const
{
  const auto index = lattice(cell);
  double product = 1.;
  for (unsigned int d = 0; d < dimension; ++d)
    product *= planes[d][index[d] + 1] - planes[d][index[d]];
  return product;
}

std::vector<double> sample_times(const CompareParameters &compare, const double end,
                                 const std::vector<double> &others)
{
  const unsigned int n = compare.n_samples;
  const double first = compare.first_sample > 0. ? compare.first_sample : 1e-4 * end;
  if (compare.logarithmic && first >= end)
    compare.section.fail("First sample", "the run ends at " + to_text(end) + " s");
  std::vector<double> times = others;
  for (unsigned int k = 1; k < n; ++k)
    times.push_back(compare.logarithmic ? first * std::pow(end / first, double(k - 1) / (n - 1))
                                        : end * k / n);
  times.push_back(end);
  std::sort(times.begin(), times.end());
  const auto same = [&](const double a, const double b) { return b - a <= 1e-9 * end; };
  times.erase(std::unique(times.begin(), times.end(), same), times.end());
  return times;
}

template <int dim>
Recorder<dim>::Recorder(const Case<dim> &parameters, std::vector<double> times) : all_times(std::move(times))
{
  data.dimension = dim;
  if (parameters.is_saturated())
    data.fields.push_back("pressure");
  for (const std::string name : {"displacement ", "velocity "})
    for (unsigned int d = 0; d < dim; ++d)
      data.fields.push_back(name + "xyz"[d]);
  for (const std::string name : {"xx", "yy", "zz", "xy", "yz", "zx"})
    if (dim == 3 || (name != "yz" && name != "zx"))
      data.fields.push_back("effective stress " + name);
  data.units.assign(data.fields.size(), "");
  for (const auto &body : parameters.bodies)
    data.bodies.push_back(body.name);
}

namespace {
/// Sorts the rows "cell, volume, values" that the ranks have sent by cells.
CellSamples sort_rows(const std::vector<std::vector<double>> &ranks, const unsigned int n_fields)
{
  std::vector<const double *> rows;
  for (const std::vector<double> &sent : ranks)
    for (std::size_t i = 0; i < sent.size(); i += 2 + n_fields)
      rows.push_back(&sent[i]);
  std::sort(rows.begin(), rows.end(), [](const double *a, const double *b) { return *a < *b; });
  CellSamples samples;
  samples.values.reserve(rows.size() * n_fields);
  for (const double *row : rows) {
    samples.cell.push_back(row[0]);
    samples.volume.push_back(row[1]);
    samples.values.insert(samples.values.end(), row + 2, row + 2 + n_fields);
  }
  return samples;
}

/// This rank's rows of a body: index of the cell, volume, all fields (NaN: not available).
template <int dim>
std::vector<double> rows_of(const Body<dim> &body, const Grid<dim> &grid, const Recording &data,
                            std::vector<std::string> &units)
{
  std::vector<std::string> available;
  std::vector<std::size_t> column;
  for (std::size_t f = 0; f < data.fields.size(); ++f) {
    const FieldAccess access(data.fields[f], body.layout(), body.material());
    if (!access.available())
      continue;
    available.push_back(data.fields[f]);
    column.push_back(f);
    units[f] = access.unit();
  }
  const CellMeans<dim> means = cell_means<dim>({&body}, available);
  const std::size_t n = 2 + data.fields.size();
  std::vector<double> rows(means.size() * n, std::numeric_limits<double>::quiet_NaN());
  for (std::size_t e = 0; e < means.size(); ++e) {
    const auto &lattice = grid.lattice(means.cell[e]);
    double index = 0.; // exact up to 2^53 cells
    for (int d = dim - 1; d >= 0; --d)
      index = index * grid.n_cells(d) + lattice[d];
    rows[e * n] = index;
    rows[e * n + 1] = means.volume[e];
    for (std::size_t f = 0; f < column.size(); ++f)
      rows[e * n + 2 + column[f]] = means.value(e, f);
  }
  return rows;
}
} // namespace

template <int dim>
void Recorder<dim>::record(const double time, const Scene<dim> &scene, const Grid<dim> &grid)
{
  for (unsigned int d = 0; d < dim; ++d)
    data.planes[d] = grid.planes(d);
  data.times.push_back(time);
  std::vector<CellSamples> frame;
  for (const auto &body : scene.bodies) {
    const auto rows = rows_of(*body, grid, data, data.units);
    const auto all = dealii::Utilities::MPI::gather(grid.communicator(), rows, 0);
    frame.push_back(sort_rows(all, data.fields.size()));
  }
  data.samples.push_back(std::move(frame));
}

template class Recorder<2>;
template class Recorder<3>;
} // namespace peat
