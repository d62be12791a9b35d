#include "compare_output.h"

#include "result_files.h"

#include <peat/base/error.h>
#include <peat/simulation/table.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>

namespace peat {
namespace {
using json = nlohmann::ordered_json;

/// samples.csv is restricted when it would hold more numbers than this.
constexpr double most_samples = 2e6;
/// Vertical lines that the page shows.
constexpr std::size_t most_lines = 3;
} // namespace

bool Sights::see(const std::array<std::size_t, 3> &lattice, const unsigned int dimension) const
{
  if (dimension == 2 || lattice[1] == cell[1])
    return true;
  return std::any_of(lines.begin(), lines.end(),
                     [&](const auto &line) { return line[0] == lattice[0] && line[1] == lattice[1]; });
}

namespace {
/// The place of the largest main field, without lines yet.
Sights find_peak(const Recording &recording)
{
  Sights sights;
  const std::string main_field =
      recording.fields.front() == "pressure"
          ? "pressure"
          : (recording.dimension == 2 ? "effective stress yy" : "effective stress zz");
  sights.field =
      std::find(recording.fields.begin(), recording.fields.end(), main_field) - recording.fields.begin();
  double largest = -1.;
  for (std::size_t k = 0; k < recording.times.size(); ++k)
    for (const CellSamples &samples : recording.samples[k])
      for (std::size_t i = 0; i < samples.cell.size(); ++i) {
        const double value = std::abs(samples.values[i * recording.fields.size() + sights.field]);
        // A thin remainder of material in a cell is not what one wants to see.
        if (value > largest && samples.volume[i] >= least_fill * recording.volume(samples.cell[i])) {
          largest = value;
          sights.time = recording.times[k];
          sights.cell = recording.lattice(samples.cell[i]);
        }
      }
  return sights;
}

std::string line_name(const Recording &recording, const std::array<std::size_t, 3> &cell)
{
  const auto x =
      recording.middle(cell[0] + recording.n_cells(0) * (cell[1] + recording.n_cells(1) * cell[2]));
  char text[80];
  if (recording.dimension == 2)
    std::snprintf(text, sizeof(text), "x = %.4g m", x[0]);
  else
    std::snprintf(text, sizeof(text), "x = %.4g m, y = %.4g m", x[0], x[1]);
  return text;
}
} // namespace

template <int dim>
Sights find_sights(const Case<dim> &parameters, const Recording &recording)
{
  Sights sights = find_peak(recording);
  const auto add = [&](std::array<std::size_t, 3> cell) {
    cell[dim - 1] = 0; // lines are vertical
    if (dim == 2)
      cell[2] = 0;
    if (sights.lines.size() == most_lines ||
        std::find(sights.lines.begin(), sights.lines.end(), cell) != sights.lines.end())
      return;
    sights.lines.push_back(cell);
    sights.line_names.push_back(line_name(recording, cell));
  };
  add(sights.cell);
  for (const auto &probe : parameters.probes) {
    std::array<std::size_t, 3> cell = {0, 0, 0};
    for (unsigned int d = 0; d + 1 < dim; ++d) {
      const auto &planes = recording.planes[d];
      const std::size_t above =
          std::upper_bound(planes.begin(), planes.end(), probe.point[d]) - planes.begin();
      cell[d] = std::min(std::max<std::size_t>(above, 1), planes.size() - 1) - 1;
    }
    add(cell);
  }
  return sights;
}

bool is_above(const Difference &difference, const double tolerance)
{
  return difference.relative_L2 > tolerance || difference.relative_Linf > tolerance;
}

std::vector<std::string> findings(const ComparisonData &data)
{
  std::vector<const Difference *> list;
  const bool several_bodies = data.runs[0].recording.bodies.size() > 1;
  for (const Difference &difference : data.differences) {
    // With several bodies the sentence about each says more than the one about all.
    const bool repeated = difference.kind == "cells" && several_bodies && difference.name.empty();
    if (!repeated && is_above(difference, data.tolerance))
      list.push_back(&difference);
  }
  const auto rank = [](const Difference *d) { return d->kind == "cells" ? 0 : (d->kind == "probe" ? 2 : 1); };
  std::stable_sort(list.begin(), list.end(), [&](const Difference *a, const Difference *b) {
    return rank(a) != rank(b) ? rank(a) < rank(b) : a->relative_L2 > b->relative_L2;
  });
  std::vector<std::string> sentences;
  for (const Difference *difference : list) {
    std::array<std::string, 2> labels = {data.runs[0].label, data.runs[1].label};
    if (rank(difference) == 1)
      labels = {"the reference", difference->runs == data.runs[0].name + "-reference" ? data.runs[0].label
                                                                                      : data.runs[1].label};
    sentences.push_back(sentence(*difference, labels, data.tolerance, data.dimension, data.end_time));
  }
  return sentences;
}

void write_differences(const ComparisonData &data)
{
  ReplacedFile file(data.directory + "/compare.csv");
  *file << "runs,kind,name,field,unit,relative L2,relative Linf,L2,Linf,L2 scale,Linf scale,share above "
           "tolerance,compared,left out,above tolerance,worst time [s],worst x [m],worst y [m],worst z [m],"
           "worst body,worst place,value subtracted,value\n";
  for (const Difference &d : data.differences) {
    const bool has_place = d.kind != "probe" && d.n > 0;
    std::vector<std::string> row = {d.runs, d.kind, d.name, d.field, d.unit};
    for (const double x :
         {d.relative_L2, d.relative_Linf, d.L2, d.Linf, d.scale_L2, d.scale_Linf, d.share_above})
      row.push_back(csv_number(x));
    row.push_back(std::to_string(d.n));
    row.push_back(std::to_string(d.n_left_out));
    row.push_back(d.negligible
                      ? "negligible"
                      : (std::isnan(d.relative_L2) ? "" : (is_above(d, data.tolerance) ? "yes" : "no")));
    row.push_back(d.n > 0 ? csv_number(d.time) : "");
    for (unsigned int k = 0; k < 3; ++k)
      row.push_back(has_place && k < data.dimension ? csv_number(d.place[k]) : "");
    row.push_back(d.worst_body);
    row.push_back(d.place_in_words);
    for (const double x : d.value)
      row.push_back(d.n > 0 ? csv_number(x) : "");
    *file << join_csv(row) << '\n';
  }
  file.close();
}

namespace {
/// One body at one time; cells of both runs in ascending order.
void write_frame(std::ofstream &file, const ComparisonData &data, const Sights *only, const std::size_t k,
                 const std::size_t b)
{
  const Recording &first = data.runs[0].recording, &second = data.runs[1].recording;
  const std::size_t n_fields = first.fields.size();
  const CellSamples *samples[2] = {&first.samples[k][b], &second.samples[k][b]};
  std::size_t at[2] = {0, 0};
  while (at[0] < samples[0]->cell.size() || at[1] < samples[1]->cell.size()) {
    std::uint64_t next[2];
    for (unsigned int r = 0; r < 2; ++r)
      next[r] = at[r] < samples[r]->cell.size() ? samples[r]->cell[at[r]]
                                                : std::numeric_limits<std::uint64_t>::max();
    const std::uint64_t cell = std::min(next[0], next[1]);
    const auto lattice = first.lattice(cell);
    const bool wanted = !only || only->see(lattice, data.dimension);
    std::string line = csv_number(first.times[k]) + ',' + csv_entry(first.bodies[b]);
    for (unsigned int d = 0; d < data.dimension; ++d)
      line += ',' + std::to_string(lattice[d]);
    for (unsigned int r = 0; r < 2; ++r) {
      const bool here = next[r] == cell;
      line += ',' +
              csv_number(here ? samples[r]->volume[at[r]] : std::numeric_limits<double>::quiet_NaN(), "%.9g");
      for (std::size_t f = 0; f < n_fields; ++f)
        line += ',' + (here ? csv_number(samples[r]->values[at[r] * n_fields + f], "%.9g") : std::string());
      at[r] += here;
    }
    if (wanted)
      file << line << '\n';
  }
}
} // namespace

bool write_samples(const ComparisonData &data, const Sights &sights)
{
  const Recording &first = data.runs[0].recording, &second = data.runs[1].recording;
  double n_values = 0.;
  for (const auto &frame : first.samples)
    for (const CellSamples &samples : frame)
      n_values += 2. * samples.values.size();
  const bool complete = n_values <= most_samples;

  ReplacedFile file(data.directory + "/samples.csv");
  *file << "time [s],body";
  for (unsigned int d = 0; d < data.dimension; ++d)
    *file << ",cell "
          << "ijk"[d];
  for (const ComparedRun &run : data.runs) {
    *file << ',' << csv_entry(run.name + "/volume [m^" + std::to_string(data.dimension) + "]");
    for (std::size_t f = 0; f < first.fields.size(); ++f)
      *file << ',' << csv_entry(run.name + '/' + first.fields[f] + " [" + first.units[f] + ']');
  }
  *file << '\n';
  for (std::size_t k = 0; k < std::min(first.times.size(), second.times.size()); ++k)
    for (std::size_t b = 0; b < first.bodies.size(); ++b)
      write_frame(*file, data, complete ? nullptr : &sights, k, b);
  file.close();
  return complete;
}

namespace {
template <int dim>
void write_table(std::ofstream &file, const ReferenceParameters<dim> &reference, const std::string &directory)
{
  // The page needs no more points of a curve than this.
  constexpr std::size_t most_points = 400;
  const bool history = reference.kind == ReferenceParameters<dim>::Kind::history;
  const std::filesystem::path path(reference.file);
  const Table table(path.is_absolute() ? reference.file : (std::filesystem::path(directory) / path).string());
  const auto &at = table.column(reference.coordinate.empty() ? table.names().front() : reference.coordinate);
  const std::size_t stride = std::max<std::size_t>(1, at.size() / most_points);
  for (std::size_t c = 0; c < reference.columns.size(); ++c) {
    const auto &values = table.column(reference.columns[c]);
    for (std::size_t i = 0; i < at.size(); ++i) {
      if ((i % stride != 0 && i + 1 < at.size()) || !std::isfinite(at[i]) || !std::isfinite(values[i]))
        continue;
      std::vector<std::string> row = {reference.name, history ? "history" : "profile", reference.field,
                                      reference.body, reference.probe};
      row.push_back(csv_number(history ? at[i] : reference.times[c]));
      for (unsigned int d = 0; d < 3; ++d)
        row.push_back(!history && d == reference.axis ? csv_number(at[i]) : "");
      row.push_back(csv_number(values[i]));
      file << join_csv(row) << '\n';
    }
  }
}

/// A formula in the middles of the cells of the lines.
template <int dim>
void write_formula(std::ofstream &file, const ReferenceParameters<dim> &reference, const Recording &recording,
                   const Sights &sights, const double end_time)
{
  const std::vector<double> times = reference.times.empty() ? std::vector<double>{end_time} : reference.times;
  const std::size_t n_vertical = recording.n_cells(dim - 1);
  for (const double time : times)
    for (auto cell : sights.lines)
      for (std::size_t i = 0; i < n_vertical; ++i) {
        cell[dim - 1] = i;
        const auto x =
            recording.middle(cell[0] + recording.n_cells(0) * (cell[1] + recording.n_cells(1) * cell[2]));
        std::vector<std::string> row = {reference.name, "formula", reference.field,
                                        reference.body, "",        csv_number(time)};
        for (unsigned int d = 0; d < 3; ++d)
          row.push_back(d < dim ? csv_number(x[d]) : "");
        row.push_back(csv_number(reference.formula.value(x.data(), time)));
        file << join_csv(row) << '\n';
      }
}
} // namespace

template <int dim>
void write_references(const Case<dim> &parameters, const std::string &case_directory,
                      const ComparisonData &data, const Sights &sights)
{
  ReplacedFile file(data.directory + "/references.csv");
  *file << "reference,kind,field,body,probe,time [s],x [m],y [m],z [m],value\n";
  for (const auto &reference : parameters.references)
    if (reference.kind == ReferenceParameters<dim>::Kind::formula)
      write_formula(*file, reference, data.runs[0].recording, sights, data.end_time);
    else
      write_table(*file, reference, case_directory);
  file.close();
}

namespace {
json read_json(const std::string &path)
{
  std::ifstream file(path);
  const json content = json::parse(file, nullptr, false);
  if (content.is_discarded())
    throw NumericalError("cannot read '" + path + "'");
  return content;
}

json describe(const Difference &d, const double tolerance)
{
  return {{"relative_L2", json_number(d.relative_L2)},
          {"relative_Linf", json_number(d.relative_Linf)},
          {"L2", json_number(d.L2)},
          {"Linf", json_number(d.Linf)},
          {"unit", d.unit},
          {"compared", d.n},
          {"left_out", d.n_left_out},
          {"negligible", d.negligible},
          {"above_tolerance", is_above(d, tolerance)}};
}
} // namespace

void write_compare_summary(const ComparisonData &data, const Sights &sights, const bool samples_are_complete)
{
  const Recording &recording = data.runs[0].recording;
  json summary;
  summary["version"] = PEAT_VERSION;
  summary["case"] = data.title;
  summary["dimension"] = data.dimension;
  summary["methods"] = {data.runs[0].name, data.runs[1].name};
  summary["labels"] = {data.runs[0].label, data.runs[1].label};
  summary["settings"] = {data.runs[0].settings, data.runs[1].settings};
  summary["problems"] = {data.runs[0].problem, data.runs[1].problem};
  summary["tolerance"] = data.tolerance;
  summary["simulated_time"] = data.end_time;
  summary["sample_times"] = recording.times;
  summary["bodies"] = recording.bodies;
  summary["compare"] = json::object();
  for (const Difference &d : data.differences)
    if (d.kind == "cells" && d.name.empty())
      summary["compare"][d.field] = describe(d, data.tolerance);
  summary["findings"] = findings(data);
  json lines = json::array();
  for (std::size_t i = 0; i < sights.lines.size(); ++i)
    lines.push_back({{"name", sights.line_names[i]},
                     {"cell", std::vector<std::size_t>(sights.lines[i].begin(),
                                                       sights.lines[i].begin() + data.dimension - 1)}});
  std::vector<std::vector<double>> planes(recording.planes.begin(),
                                          recording.planes.begin() + data.dimension);
  summary["view"] = {
      {"field", recording.fields[sights.field]},
      {"unit", recording.units[sights.field]},
      {"time", sights.time},
      {"cell", std::vector<std::size_t>(sights.cell.begin(), sights.cell.begin() + data.dimension)},
      {"lines", lines},
      {"planes", planes},
      {"least_fill", least_fill},
      {"samples_are_complete", samples_are_complete}};
  for (const ComparedRun &run : data.runs)
    summary["runs"][run.name] = read_json(run.directory + "/summary.json");

  ReplacedFile file(data.directory + "/summary.json");
  *file << summary.dump(2) << std::endl;
  file.close();
}

#define PEAT_INSTANTIATE(dim)                                                                                \
  template Sights find_sights<dim>(const Case<dim> &, const Recording &);                                    \
  template void write_references<dim>(const Case<dim> &, const std::string &, const ComparisonData &,        \
                                      const Sights &);
PEAT_INSTANTIATE(2)
PEAT_INSTANTIATE(3)
#undef PEAT_INSTANTIATE
} // namespace peat
