#include "result_files.h"

#include <peat/base/error.h>
#include <peat/simulation/table.h>

#include <cmath>
#include <cstdio>

namespace peat {
nlohmann::ordered_json json_number(const double x)
{
  return std::isfinite(x) ? nlohmann::ordered_json(x) : nlohmann::ordered_json(nullptr);
}

std::string csv_number(const double x, const char *pattern)
{
  if (!std::isfinite(x))
    return "";
  char text[40];
  std::snprintf(text, sizeof(text), pattern, x);
  return text;
}

std::string join_csv(const std::vector<std::string> &entries)
{
  std::string line;
  for (std::size_t i = 0; i < entries.size(); ++i)
    line += (i == 0 ? "" : ",") + csv_entry(entries[i]);
  return line;
}

ReplacedFile::ReplacedFile(const std::string &name) : name(name), stream(name + ".tmp") {}

void ReplacedFile::close()
{
  stream.close();
  if (!stream || std::rename((name + ".tmp").c_str(), name.c_str()) != 0)
    throw NumericalError("cannot write '" + name + "'");
}
} // namespace peat
