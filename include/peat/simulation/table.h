#pragma once

#include <string>
#include <vector>

namespace peat {
/// Numbers under named columns, from a CSV file: lines that begin with # are skipped, the first other line
/// holds the names. Entries may be empty.
class Table
{
public:
  /// Throws InputError, with the line where there is one.
  explicit Table(const std::string &file_name);

  const std::vector<std::string> &names() const { return column_names; }
  bool has(const std::string &name) const;
  /// NaN where the entry is empty.
  const std::vector<double> &column(const std::string &name) const;

private:
  std::vector<std::string> column_names;
  std::vector<std::vector<double>> columns;
};

/// A name as an entry of a CSV file: in quotes if it holds a comma or a quote.
std::string csv_entry(const std::string &text);

/// A function through given points: in each interval the cubic polynomial through the four nearest points,
/// i.e. of fourth order where the function is smooth, and what is not smooth disturbs the two neighbour
/// intervals only. Linear in pieces of fewer than four points and in intervals much longer than a neighbour.
/// Between two points of the same coordinate the function jumps.
class Curve
{
public:
  /// Points in any order; those with NaN are left out.
  Curve(const std::vector<double> &x, const std::vector<double> &y);

  bool empty() const { return pieces.empty(); }
  /// Where the points lie.
  double lower() const { return pieces.front().x.front(); }
  double upper() const { return pieces.back().x.back(); }
  /// Between lower() and upper(); beyond them the value there. At a jump that of the left side.
  double value(double x) const;

private:
  struct Piece
  {
    std::vector<double> x, y;
    double value(double x) const;
  };
  std::vector<Piece> pieces;
};
} // namespace peat
