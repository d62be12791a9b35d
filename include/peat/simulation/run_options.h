#pragma once

#include <string>
#include <vector>

namespace peat {
/// The words of the command line that concern a run.
struct RunOptions
{
  std::string file;
  std::vector<std::string> overrides; ///< "Section/Key=value"
  std::string output;                 ///< directory; "" for output/NAME-OF-FILE
  bool quiet = false;
  bool resume = false; ///< go on from the checkpoint in the directory
};

/// The words that concern a sweep.
struct SweepOptions
{
  RunOptions run;
  std::vector<std::string> vary; ///< "Section/Key=value, value, ..."
  double target = 0.;            ///< relative error; 0: that of the case
  unsigned int n_jobs = 0;       ///< 0: that of the case
};
} // namespace peat
