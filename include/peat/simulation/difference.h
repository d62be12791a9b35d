#pragma once

#include <peat/simulation/recorder.h>

#include <array>
#include <string>
#include <vector>

namespace peat {
/// How far two runs, or a run and a reference, are from each other in one field.
///
/// Over cells: with d the difference of the means in a cell, V the mean of the two volumes in it and w the
/// share of time of a sample (half the way to its neighbours; the first one reaches back to the start of the
/// run),
///   L2 = sqrt(sum w V d^2 / sum w V),   Linf = max |d|.
/// Over a probe: the same with V = 1. Relative are L2 / scale_L2 and Linf / scale_Linf, where the scales are
/// those norms of the whole quantity (all components of a vector or stress), of the run in which they are
/// larger. So a component that is nearly zero is not measured against itself.
struct Difference
{
  std::string kind;  ///< "cells", "probe", "profile", "history", "formula"
  std::string runs;  ///< "fem-mpm", "mpm-reference", ...: of which the other is subtracted
  std::string name;  ///< of the body ("" for all), the probe or the reference
  std::string field; ///< as a user knows it
  std::string unit;  ///< of the field
  double L2 = 0., Linf = 0.;
  double scale_L2 = 0., scale_Linf = 0.;
  double relative_L2 = 0., relative_Linf = 0.; ///< NaN if nothing was compared or the field is negligible
  double share_above = 0.; ///< of the values compared, with |d| > tolerance * scale_Linf; NaN if not known
  unsigned long n = 0;     ///< values compared
  unsigned long n_left_out = 0; ///< not in both runs, or under half of the cell in either
  bool negligible = false;      ///< the quantity is round-off in both runs
  double time = 0.;             ///< where |d| is largest [s]
  std::array<double, 3> place = {0., 0., 0.};
  std::array<double, 2> value = {0., 0.}; ///< there; of the run (or reference) subtracted, of the other
  std::string worst_body;                 ///< the body there; of cells
  std::string place_in_words;             ///< "in the uppermost cells, at the left edge"; of cells
};

/// The component's quantity: "displacement" of "displacement x"; "pressure" of itself.
std::string quantity_of(const std::string &field);

/// Cells that hold less of a body than this share of the cell are left out.
constexpr double least_fill = 0.5;

/// Each field over the cells of all bodies together and, if there are several, of each body; `tolerance` is
/// that of share_above. The recordings must be of the same mesh and bodies.
std::vector<Difference> compare_cells(const Recording &first, const Recording &second, double tolerance);

/// Columns over time of one run: what probes.csv holds.
struct Histories
{
  std::vector<double> time;
  std::vector<std::string> names;           ///< "PROBE/FIELD [UNIT]"
  std::vector<std::vector<double>> columns; ///< as names; NaN where there is no value
};

/// Reads probes.csv; empty if there is no such file.
Histories read_histories(const std::string &file_name);

/// Each column of displacement, velocity, pressure and stress that both have, at the times of the first as
/// far as the second reaches; the second is interpolated linearly.
std::vector<Difference> compare_histories(const Histories &first, const Histories &second, double tolerance);

/// Marks quantities that are round-off: relative to the mesh and the run for displacement and velocity,
/// relative to each other and to the largest stiffness of a skeleton for pressure and stress. [m], [s], [Pa].
void mark_negligible(std::vector<Difference> &differences, double mesh_size, double end_time,
                     double stiffness);

/// One sentence about a difference above the tolerance: how large, where and when it is largest, both values.
/// `labels` are what the runs are called, in the order of Difference::value.
std::string sentence(const Difference &difference, const std::array<std::string, 2> &labels, double tolerance,
                     unsigned int dimension, double end_time);

/// A number with its unit for people, in the prefix that suits a number of that size: "12.3 kPa", "-0.45 mm".
std::string readable_value(double value, const std::string &unit, double size);
} // namespace peat
