#include <peat/base/error.h>

namespace peat {
std::string Origin::prefix() const
{
  if (file.empty())
    return "";
  // Line 0 stands for the file as a whole, and for an override of the command line.
  if (line == 0)
    return file + ": ";
  return file + ":" + std::to_string(line) + ": ";
}
} // namespace peat
