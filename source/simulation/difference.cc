#include <peat/simulation/difference.h>

#include <peat/base/nan.h>
#include <peat/simulation/table.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace peat {
namespace {
/// Field numbers of a quantity's components, and how often each counts in the square of its magnitude.
struct ComparedQuantity
{
  std::vector<std::size_t> components;
  std::vector<double> multiplicity;
};

bool is_shear(const std::string &field)
{
  const std::string end = field.substr(std::max<std::size_t>(field.size(), 3) - 3);
  return end == " xy" || end == " yz" || end == " zx";
}

/// Of the field, among `fields`; `prefix` is what names have in common before the field ("PROBE/").
ComparedQuantity components_of(const std::string &field, const std::vector<std::string> &fields)
{
  ComparedQuantity quantity;
  for (std::size_t f = 0; f < fields.size(); ++f)
    if (quantity_of(fields[f]) == quantity_of(field)) {
      quantity.components.push_back(f);
      quantity.multiplicity.push_back(is_shear(fields[f]) ? 2. : 1.);
    }
  return quantity;
}

/// Shares of time of samples, see Difference. Without a start the first one reaches no further back.
std::vector<double> time_weights(const std::vector<double> &times, const bool from_start)
{
  std::vector<double> weights(times.size(), 1.);
  for (std::size_t k = 0; k < times.size() && times.size() > 1; ++k) {
    const double before = k > 0 ? times[k - 1] : (from_start ? 0. : times[k]);
    const double after = k + 1 < times.size() ? times[k + 1] : times[k];
    weights[k] = 0.5 * (after - before);
  }
  return weights;
}

struct DifferenceSums
{
  double weight = 0., square = 0.;
  std::array<double, 2> quantity = {0., 0.}; ///< integrals of the squares of the magnitudes
  Difference difference;

  /// `square_of` are the squares of the magnitude of the whole quantity. Returns whether this is the largest
  /// difference so far.
  bool add(const double w, const std::array<double, 2> &value, const std::array<double, 2> &square_of)
  {
    const double d = value[1] - value[0];
    weight += w;
    square += w * d * d;
    for (unsigned int r = 0; r < 2; ++r) {
      quantity[r] += w * square_of[r];
      difference.scale_Linf = std::max(difference.scale_Linf, std::sqrt(square_of[r]));
    }
    const bool largest = ++difference.n == 1 || std::abs(d) > difference.Linf;
    if (largest) {
      difference.Linf = std::abs(d);
      difference.value = value;
    }
    return largest;
  }

  Difference finish()
  {
    Difference &result = difference;
    if (result.n == 0) {
      result.L2 = result.Linf = result.scale_L2 = result.scale_Linf = nan;
      result.relative_L2 = result.relative_Linf = result.share_above = nan;
      return result;
    }
    result.L2 = std::sqrt(square / weight);
    result.scale_L2 = std::sqrt(std::max(quantity[0], quantity[1]) / weight);
    // Two runs in which nothing happens do not differ.
    result.relative_L2 = result.L2 > 0. ? result.L2 / result.scale_L2 : 0.;
    result.relative_Linf = result.Linf > 0. ? result.Linf / result.scale_Linf : 0.;
    return result;
  }
};

/// A cell of a body at a time, as far as it is compared.
struct Pair
{
  std::size_t frame, body;
  std::uint64_t cell;
  double weight; ///< w V
  const double *values[2];
};

/// All cells in which both runs hold enough of the bodies; counts the others.
std::vector<Pair> pair_cells(const Recording &first, const Recording &second,
                             const std::vector<std::size_t> &bodies, unsigned long &n_left_out)
{
  std::vector<Pair> pairs;
  const std::size_t n_frames = std::min(first.times.size(), second.times.size());
  const std::vector<double> weights =
      time_weights(std::vector<double>(first.times.begin(), first.times.begin() + n_frames), true);
  const std::size_t n_fields = first.fields.size();
  for (std::size_t k = 0; k < n_frames; ++k)
    for (const std::size_t b : bodies) {
      const CellSamples &one = first.samples[k][b], &two = second.samples[k][b];
      std::size_t i = 0, j = 0;
      while (i < one.cell.size() || j < two.cell.size()) {
        const bool in_one = i < one.cell.size() && (j == two.cell.size() || one.cell[i] <= two.cell[j]);
        const bool in_two = j < two.cell.size() && (i == one.cell.size() || two.cell[j] <= one.cell[i]);
        const std::uint64_t cell = in_one ? one.cell[i] : two.cell[j];
        const double least = least_fill * first.volume(cell);
        if (in_one && in_two && one.volume[i] >= least && two.volume[j] >= least)
          pairs.push_back({k,
                           b,
                           cell,
                           weights[k] * 0.5 * (one.volume[i] + two.volume[j]),
                           {&one.values[i * n_fields], &two.values[j * n_fields]}});
        else
          ++n_left_out;
        i += in_one;
        j += in_two;
      }
    }
  return pairs;
}

/// Where a place is between two ends: 0 at the first cell, 4 at the last one.
int part_of(const std::size_t index, const std::size_t low, const std::size_t high)
{
  if (index == low)
    return 0;
  if (index == high)
    return 4;
  const double share = double(index - low) / double(high - low);
  return share < 1. / 3. ? 1 : (share < 2. / 3. ? 2 : 3);
}

/// Where a cell is in a body at that time: "in the uppermost cells, at the left edge".
std::string describe_place(const Recording &recording, const Pair &pair)
{
  static const char *const words[3][5] = {
      {"at the left edge", "in the left third", "in the middle third of the width", "in the right third",
       "at the right edge"},
      {"at the front", "in the front third", "in the middle third of the depth", "in the rear third",
       "at the back"},
      {"in the lowest cells", "in the lower third", "in the middle third of the height", "in the upper third",
       "in the uppermost cells"}};
  std::array<std::size_t, 3> low, high;
  const CellSamples &samples = recording.samples[pair.frame][pair.body];
  low = high = recording.lattice(pair.cell);
  for (std::size_t i = 0; i < samples.cell.size(); ++i) {
    if (samples.volume[i] < least_fill * recording.volume(samples.cell[i]))
      continue;
    const auto index = recording.lattice(samples.cell[i]);
    for (unsigned int d = 0; d < recording.dimension; ++d) {
      low[d] = std::min(low[d], index[d]);
      high[d] = std::max(high[d], index[d]);
    }
  }
  const auto index = recording.lattice(pair.cell);
  const unsigned int vertical = recording.dimension - 1;
  std::string text;
  for (unsigned int n = 0; n < recording.dimension; ++n) {
    const unsigned int d = (vertical + n) % recording.dimension; // the vertical direction first
    if (low[d] == high[d])
      continue;
    text += (text.empty() ? "" : ", ");
    text += words[d == vertical ? 2 : d][part_of(index[d], low[d], high[d])];
  }
  return text;
}

Difference compare_field(const Recording &first, const std::vector<Pair> &pairs, const std::size_t field,
                         const double tolerance)
{
  const ComparedQuantity quantity = components_of(first.fields[field], first.fields);
  DifferenceSums sums;
  const Pair *worst = nullptr;
  for (const Pair &pair : pairs) {
    const std::array<double, 2> value = {pair.values[0][field], pair.values[1][field]};
    if (std::isnan(value[0]) || std::isnan(value[1]))
      continue;
    std::array<double, 2> square = {0., 0.};
    for (unsigned int r = 0; r < 2; ++r)
      for (std::size_t c = 0; c < quantity.components.size(); ++c)
        square[r] += quantity.multiplicity[c] * std::pow(pair.values[r][quantity.components[c]], 2);
    if (sums.add(pair.weight, value, square))
      worst = &pair;
  }
  Difference result = sums.finish();
  if (worst) {
    result.time = first.times[worst->frame];
    result.place = first.middle(worst->cell);
    result.worst_body = first.bodies[worst->body];
    result.place_in_words = describe_place(first, *worst);
    const double limit = tolerance * result.scale_Linf;
    const auto n_above = std::count_if(pairs.begin(), pairs.end(), [&](const Pair &pair) {
      return std::abs(pair.values[1][field] - pair.values[0][field]) > limit;
    });
    result.share_above = double(n_above) / result.n;
  }
  result.kind = "cells";
  result.field = first.fields[field];
  result.unit = first.units[field];
  return result;
}

double interpolate(const std::vector<double> &x, const std::vector<double> &y, const double at)
{
  const std::size_t right = std::lower_bound(x.begin(), x.end(), at) - x.begin();
  if (right == x.size())
    return nan;
  if (x[right] == at || right == 0)
    return x[right] == at ? y[right] : nan;
  const double share = (at - x[right - 1]) / (x[right] - x[right - 1]);
  return y[right - 1] + share * (y[right] - y[right - 1]);
}
} // namespace

std::string quantity_of(const std::string &field)
{
  const std::size_t blank = field.rfind(' ');
  if (blank == std::string::npos || field.find_first_not_of("xyz", blank + 1) != std::string::npos)
    return field;
  return field.substr(0, blank);
}

std::vector<Difference> compare_cells(const Recording &first, const Recording &second, const double tolerance)
{
  std::vector<std::vector<std::size_t>> groups(1);
  for (std::size_t b = 0; b < first.bodies.size(); ++b) {
    groups[0].push_back(b);
    if (first.bodies.size() > 1)
      groups.push_back({b});
  }
  std::vector<Difference> list;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    unsigned long n_left_out = 0;
    const std::vector<Pair> pairs = pair_cells(first, second, groups[g], n_left_out);
    for (std::size_t f = 0; f < first.fields.size(); ++f) {
      Difference difference = compare_field(first, pairs, f, tolerance);
      difference.name = g > 0 ? first.bodies[groups[g][0]] : "";
      difference.n_left_out = n_left_out;
      // A single body may lack a field that others have.
      if (difference.n > 0 || g == 0)
        list.push_back(difference);
    }
  }
  return list;
}

Histories read_histories(const std::string &file_name)
{
  Histories histories;
  if (!std::filesystem::exists(file_name))
    return histories;
  const Table table(file_name);
  histories.time = table.column(table.names().front());
  for (std::size_t c = 1; c < table.names().size(); ++c) {
    histories.names.push_back(table.names()[c]);
    histories.columns.push_back(table.column(table.names()[c]));
  }
  return histories;
}

std::vector<Difference> compare_histories(const Histories &first, const Histories &second,
                                          const double tolerance)
{
  // "PROBE/FIELD [UNIT]" without the unit; a field is compared with its probe in its name.
  std::vector<std::string> fields;
  for (const std::string &name : first.names)
    fields.push_back(name.substr(0, name.rfind(" [")));
  const std::vector<double> weights = time_weights(first.time, false);
  std::vector<Difference> list;
  for (std::size_t c = 0; c < fields.size(); ++c) {
    const std::size_t slash = fields[c].rfind('/');
    const std::string field = fields[c].substr(slash + 1);
    const bool is_place = field.size() == 1;
    if (is_place || first.names != second.names)
      continue;
    const ComparedQuantity quantity = components_of(fields[c], fields);
    DifferenceSums sums;
    std::vector<double> distances;
    for (std::size_t k = 0; k < first.time.size(); ++k) {
      std::array<double, 2> value, square = {0., 0.};
      const auto at = [&](const std::size_t column) -> std::array<double, 2> {
        return {first.columns[column][k], interpolate(second.time, second.columns[column], first.time[k])};
      };
      value = at(c);
      if (std::isnan(value[0]) || std::isnan(value[1])) {
        ++sums.difference.n_left_out;
        continue;
      }
      for (std::size_t q = 0; q < quantity.components.size(); ++q)
        for (unsigned int r = 0; r < 2; ++r)
          square[r] += quantity.multiplicity[q] * std::pow(at(quantity.components[q])[r], 2);
      if (sums.add(weights[k], value, square))
        sums.difference.time = first.time[k];
      distances.push_back(std::abs(value[1] - value[0]));
    }
    Difference result = sums.finish();
    result.kind = "probe";
    result.name = fields[c].substr(0, slash);
    result.field = field;
    const std::string &name = first.names[c];
    result.unit = name.substr(name.rfind('[') + 1, name.size() - name.rfind('[') - 2);
    const double limit = tolerance * result.scale_Linf;
    if (result.n > 0)
      result.share_above =
          std::count_if(distances.begin(), distances.end(), [&](double d) { return d > limit; }) /
          double(result.n);
    list.push_back(result);
  }
  return list;
}

void mark_negligible(std::vector<Difference> &differences, const double mesh_size, const double end_time,
                     const double stiffness)
{
  // Far above round-off, far below anything that can be measured.
  constexpr double least = 1e-10, least_strain = 1e-12;
  double least_stress = least_strain * stiffness;
  for (const Difference &difference : differences)
    if (difference.unit == "Pa" && difference.n > 0)
      least_stress = std::max(least_stress, least * difference.scale_Linf);
  for (Difference &difference : differences) {
    const std::string quantity = quantity_of(difference.field);
    double bound = 0.;
    if (quantity == "displacement")
      bound = least * mesh_size;
    else if (quantity == "velocity")
      bound = least * mesh_size / end_time;
    else if (difference.unit == "Pa")
      bound = least_stress;
    difference.negligible = difference.n > 0 && difference.scale_Linf <= bound;
    if (difference.negligible)
      difference.relative_L2 = difference.relative_Linf = nan;
  }
}
} // namespace peat
