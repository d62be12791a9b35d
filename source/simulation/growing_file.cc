#include <peat/simulation/growing_file.h>

#include <peat/base/error.h>

#include <filesystem>

namespace peat {
GrowingFile::GrowingFile(const std::string &name) : name(name), file(name, std::ios::app)
{
  if (!file)
    throw InputError("cannot write '" + name + "'");
}

void GrowingFile::open_at(const std::uintmax_t length)
{
  file.close();
  std::error_code error;
  std::filesystem::resize_file(name, length, error);
  file.open(name, std::ios::app);
  if (error || !file)
    throw InputError("cannot write '" + name + "'");
  begun = true;
}

std::ostream &GrowingFile::lines()
{
  if (is_new())
    open_at(0);
  return file;
}

void GrowingFile::persist(Archive &archive)
{
  // Positions of streams that append count from where they were opened until something is written.
  std::uint64_t length = 0;
  std::error_code error;
  if (begun && !archive.is_loading()) {
    file.flush();
    length = std::filesystem::file_size(name, error);
  }
  archive(length);
  if (!archive.is_loading() || !is_open() || length == 0)
    return;
  const std::uintmax_t present = std::filesystem::file_size(name, error);
  if (error || present < length)
    throw InputError("'" + name +
                     "' is shorter than when the checkpoint was written; the run cannot go on with it");
  open_at(length);
}
} // namespace peat
