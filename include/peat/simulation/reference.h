#pragma once

#include <peat/base/parameters.h>

#include <string>
#include <vector>

namespace peat {
/// One subsection of `References`: a solution that a field is compared with, as a table or as a formula.
template <int dim>
struct ReferenceParameters
{
  ReferenceParameters(Section section, const std::vector<std::string> &probe_names);

  enum class Kind {
    profile, ///< a table along an axis, at some times; against means over cells
    history, ///< a table over time, against a probe
    formula  ///< a function of x, y, z, t, at some times; against means over cells or single points
  };

  Section section;
  std::string name;
  Kind kind = Kind::formula;
  std::string field;         ///< "pressure", "displacement y", "effective stress xx", ...
  std::string body;          ///< restrict to one body; "" for all
  double scale = 0.;         ///< errors are divided by it; 0: the largest absolute value of the reference
  std::vector<double> times; ///< profile, formula [s]
  std::string probe;         ///< history
  std::string file;          ///< table
  std::string coordinate;    ///< column of the coordinate or the time
  std::vector<std::string> columns; ///< one per time, or one for a history
  unsigned int axis = 0;            ///< profile
  double start = 0.;                ///< history: times before are left out [s]
  bool single_points = false;       ///< formula: compare points instead of means over cells
  Function formula;
};
} // namespace peat
