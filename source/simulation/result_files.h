#pragma once

#include <nlohmann/json.hpp>

#include <fstream>
#include <string>
#include <vector>

namespace peat {
/// A number as JSON has it, which knows no NaN: null stands for it.
nlohmann::ordered_json json_number(double x);

/// A number as an entry of a CSV file; empty if it is not finite.
std::string csv_number(double x, const char *pattern = "%.10g");

/// Entries of a line of a CSV file, in quotes where they need it.
std::string join_csv(const std::vector<std::string> &entries);

/// A file that is complete once it has its name.
class ReplacedFile
{
public:
  explicit ReplacedFile(const std::string &name);
  std::ofstream &operator*() { return stream; }
  /// Throws a NumericalError if the file cannot be written.
  void close();

private:
  const std::string name;
  std::ofstream stream;
};
} // namespace peat
