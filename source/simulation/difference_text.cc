#include <peat/simulation/difference.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace peat {
namespace {
std::string format(const char *pattern, const double number)
{
  char text[40];
  std::snprintf(text, sizeof(text), pattern, number);
  return text;
}

std::string percent(const double share)
{
  return format(share < 0.001 ? "%.1g %%" : "%.2g %%", 100. * share);
}

std::string capitalized(std::string text)
{
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z')
    text[0] += 'A' - 'a';
  return text;
}

std::string place(const Difference &difference, const unsigned int dimension)
{
  std::string text;
  for (unsigned int d = 0; d < dimension; ++d)
    text += (d > 0 ? ", " : "(") + format("%.4g", difference.place[d]);
  return text + ") m";
}

/// Who was compared where: "Pressure in body 'ground'".
std::string subject(const Difference &difference)
{
  const std::string field = capitalized(difference.field);
  if (difference.kind == "cells")
    return field + (difference.name.empty() ? "" : " in body '" + difference.name + "'");
  if (difference.kind == "probe")
    return field + " at probe '" + difference.name + "'";
  return field + " against the reference '" + difference.name + "'";
}

std::string where(const Difference &difference, const unsigned int dimension)
{
  if (difference.kind == "probe")
    return "";
  if (difference.kind == "history")
    return " at its probe, which starts at " + place(difference, dimension);
  if (difference.kind != "cells")
    return " at " + place(difference, dimension);
  const std::string body = difference.name.empty() ? " of body '" + difference.worst_body + "'" : "";
  const std::string words =
      difference.place_in_words.empty() ? "" : " (" + difference.place_in_words + body + ")";
  return " in the cell around " + place(difference, dimension) + (words.empty() ? body : words);
}

std::string when(const double time, const double end_time)
{
  const double share = time / end_time;
  const std::string text = "at t = " + format("%.4g", time) + " s";
  return text + (share > 1. - 1e-9 ? " (the end)" : " (" + percent(share) + " of the run)");
}
} // namespace

std::string readable_value(const double value, const std::string &unit, const double size)
{
  struct Prefix
  {
    const char *base;
    double at_least;
    double factor;
    const char *unit;
  };
  // In the order in which they are tried.
  static const Prefix prefixes[] = {
      {"Pa", 1e6, 1e-6, "MPa"}, {"Pa", 1e3, 1e-3, "kPa"}, {"Pa", 0.1, 1., "Pa"},     {"m", 0.1, 1., "m"},
      {"m", 1e-5, 1e3, "mm"},   {"m/s", 0.1, 1., "m/s"},  {"m/s", 1e-5, 1e3, "mm/s"}};
  for (const Prefix &prefix : prefixes)
    if (unit == prefix.base && size >= prefix.at_least)
      return format("%.4g ", prefix.factor * value) + prefix.unit;
  return format("%.4g", value) + (unit.empty() || unit == "-" ? "" : " " + unit);
}

std::string sentence(const Difference &difference, const std::array<std::string, 2> &labels,
                     const double tolerance, const unsigned int dimension, const double end_time)
{
  const bool reference =
      difference.kind == "profile" || difference.kind == "history" || difference.kind == "formula";
  std::string text = subject(difference) + ": ";
  if (difference.relative_L2 > tolerance)
    text += (reference ? labels[1] + " is off by " : "the runs differ by ") +
            percent(difference.relative_L2) + " over all (L2)";
  else
    text += (reference ? labels[1] + " is within the tolerance over all (" : "the runs agree over all (") +
            percent(difference.relative_L2) + ") but not everywhere";
  const double size = std::max(std::abs(difference.value[0]), std::abs(difference.value[1]));
  text += "; the difference is largest, " + percent(difference.relative_Linf) + ", " +
          when(difference.time, end_time) + where(difference, dimension) + ": " + labels[1] + " " +
          readable_value(difference.value[1], difference.unit, size) + ", " + labels[0] + " " +
          readable_value(difference.value[0], difference.unit, size);
  if (!std::isnan(difference.share_above))
    text +=
        "; " + percent(difference.share_above) + " of the values differ by more than " + percent(tolerance);
  return text + ".";
}
} // namespace peat
