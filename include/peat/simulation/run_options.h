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
};
} // namespace peat
