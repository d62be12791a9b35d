#include <peat/simulation/table.h>

#include <peat/base/error.h>
#include <peat/base/text.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numeric>

namespace peat {
namespace {
/// An interval this many times as long as its neighbour is not interpolated with it.
constexpr double long_interval = 5.;

std::vector<std::string> split_line(const std::string &line)
{
  std::vector<std::string> entries;
  std::size_t begin = 0;
  while (true) {
    const std::size_t end = line.find(',', begin);
    entries.push_back(trim(line.substr(begin, end - begin)));
    if (end == std::string::npos)
      return entries;
    begin = end + 1;
  }
}

double read_number(const std::string &text, const Origin &origin, const std::string &column)
{
  if (text.empty())
    return std::numeric_limits<double>::quiet_NaN();
  char *end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  if (*end != '\0')
    throw InputError(origin, in_quotes(text) + " in column " + in_quotes(column) + " is not a number");
  return number;
}
} // namespace

Table::Table(const std::string &file_name)
{
  std::ifstream file(file_name);
  if (!file || std::filesystem::is_directory(file_name))
    throw InputError("cannot open the table '" + file_name + "'");
  Origin origin{file_name, 0};
  std::string line;
  while (std::getline(file, line)) {
    ++origin.line;
    if (!line.empty() && line.back() == '\r')
      line.pop_back();
    if (trim(line).empty() || line[0] == '#')
      continue;
    const std::vector<std::string> entries = split_line(line);
    if (column_names.empty()) {
      column_names = entries;
      columns.resize(entries.size());
      continue;
    }
    if (entries.size() != column_names.size())
      throw InputError(origin, "the line has " + std::to_string(entries.size()) + " entries, but there are " +
                                   std::to_string(column_names.size()) + " columns");
    for (std::size_t c = 0; c < entries.size(); ++c)
      columns[c].push_back(read_number(entries[c], origin, column_names[c]));
  }
  if (column_names.empty() || columns.front().empty())
    throw InputError(origin,
                     "the table holds no numbers: a line of column names and lines of numbers are needed");
}

bool Table::has(const std::string &name) const
{
  return std::find(column_names.begin(), column_names.end(), name) != column_names.end();
}

const std::vector<double> &Table::column(const std::string &name) const
{
  const auto found = std::find(column_names.begin(), column_names.end(), name);
  if (found == column_names.end())
    throw InputError("the table has no column " + in_quotes(name) + suggestion(name, column_names));
  return columns[found - column_names.begin()];
}

std::string csv_entry(const std::string &text)
{
  if (text.find_first_of(",\"") == std::string::npos)
    return text;
  std::string quoted = "\"";
  for (const char c : text)
    quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

Curve::Curve(const std::vector<double> &x, const std::vector<double> &y)
{
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!std::isnan(x[i]) && !std::isnan(y[i]))
      order.push_back(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](const std::size_t a, const std::size_t b) { return x[a] < x[b]; });
  for (const std::size_t i : order) {
    const bool again = !pieces.empty() && pieces.back().x.back() == x[i];
    if (again && pieces.back().y.back() == y[i])
      continue;
    if (again || pieces.empty())
      pieces.emplace_back();
    pieces.back().x.push_back(x[i]);
    pieces.back().y.push_back(y[i]);
  }
}

double Curve::value(const double x) const
{
  const auto found =
      std::find_if(pieces.begin(), pieces.end(), [x](const Piece &p) { return x <= p.x.back(); });
  return found == pieces.end() ? pieces.back().y.back() : found->value(x);
}

double Curve::Piece::value(const double at) const
{
  if (at <= x.front())
    return y.front();
  const std::size_t right = std::lower_bound(x.begin(), x.end(), at) - x.begin(), left = right - 1;
  const double length = x[right] - x[left];
  const bool uneven = (left > 0 && length > long_interval * (x[left] - x[left - 1])) ||
                      (right + 1 < x.size() && length > long_interval * (x[right + 1] - x[right]));
  if (x.size() < 4 || uneven)
    return y[left] + (at - x[left]) / length * (y[right] - y[left]);

  const std::size_t first = std::min(left > 0 ? left - 1 : 0, x.size() - 4);
  double sum = 0.;
  for (std::size_t i = first; i < first + 4; ++i) {
    double factor = 1.;
    for (std::size_t j = first; j < first + 4; ++j)
      if (j != i)
        factor *= (at - x[j]) / (x[i] - x[j]);
    sum += factor * y[i];
  }
  return sum;
}
} // namespace peat
