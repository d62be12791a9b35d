#pragma once

#include <peat/base/parameters.h>

#include <string>
#include <vector>

namespace peat {
/// An entry of the case that takes several values in turn.
struct SweepAxis
{
  /// Splits the values: at ';' if there is one, otherwise at commas outside of parentheses.
  /// Throws an InputError if the key is no path, a value is empty or one comes twice.
  SweepAxis(std::string key, const std::string &values);

  /// The last part of the key, for tables: "Basis".
  std::string name() const;
  /// Whether all values are numbers, so that orders can be fitted over them.
  bool is_numeric() const;

  std::string key; ///< "Explicit MPM/Basis"
  std::vector<std::string> values;
  std::string place; ///< with which complaints begin: "case.prm:12: Sweep/mesh/Values: "
};

/// The section `Sweep`: what `peat sweep` does with the case.
struct SweepParameters
{
  explicit SweepParameters(Section section);

  Section section;
  std::vector<SweepAxis> axes;         ///< one for each subsection; all combinations of their values are run
  std::vector<std::string> references; ///< that make up the error of a run; none: all of the case
  std::vector<std::string> fields = {"displacement", "pressure"}; ///< compared if there are no references
  std::string norm = "L2";                                        ///< "L1", "L2" or "Linf"
  double target = 1e-2;                                           ///< relative error that one wants to buy
  double skip_margin = 3.; ///< factor in time and in error beyond which a run is not worth while; 0: run all
  unsigned int n_jobs = 1; ///< runs at a time
};
} // namespace peat
