#pragma once

#include <stdexcept>
#include <string>

namespace peat {
/// Where a word of the input stands. An empty file name means "nowhere in particular".
struct Origin
{
  std::string file;
  unsigned int line = 0;

  /// "file:line: ", or "" when the place is unknown.
  std::string prefix() const;
};

/// The user's input is wrong. what() is one line that names the place, the user's word and what would be
/// right. The program ends with exit code 1.
class InputError : public std::runtime_error
{
public:
  explicit InputError(const std::string &message) : std::runtime_error(message) {}
  InputError(const Origin &origin, const std::string &message) : std::runtime_error(origin.prefix() + message)
  {}
};

/// The computation went wrong (NaN, a lost point, an unstable step). what() says where, when and what to
/// change. The program writes what is needed to look at it and ends with exit code 2.
class NumericalError : public std::runtime_error
{
public:
  explicit NumericalError(const std::string &message) : std::runtime_error(message) {}
};
} // namespace peat
