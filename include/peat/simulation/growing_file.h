#pragma once

#include <peat/base/archive.h>

#include <cstdint>
#include <fstream>
#include <string>

namespace peat {
/// A text file to which a run adds lines. A new run begins it anew with its first line; one that goes on from
/// a checkpoint cuts off what was written after that.
class GrowingFile
{
public:
  /// Nothing is written.
  GrowingFile() = default;
  /// Makes the file if there is none, and leaves what is in it for now. Throws an InputError if it cannot be
  /// written.
  explicit GrowingFile(const std::string &name);

  bool is_open() const { return !name.empty(); }
  /// Whether no line has been written.
  bool is_new() const { return is_open() && !begun; }
  /// To write the next lines to.
  std::ostream &lines();

  /// How long the file is. Throws an InputError if it has become shorter since.
  void persist(Archive &archive);

private:
  void open_at(std::uintmax_t length);

  std::string name;
  std::ofstream file;
  bool begun = false;
};
} // namespace peat
