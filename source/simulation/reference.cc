#include <peat/simulation/reference.h>

#include <peat/base/text.h>

#include <algorithm>

namespace peat {
namespace {
/// An entry that the kind does not read would mislead.
void refuse_unused(const Section &section, const std::string &kind)
{
  static const std::vector<std::pair<std::string, std::vector<std::string>>> used_by = {
      {"Body", {"profile", "formula"}},
      {"Times", {"profile", "formula"}},
      {"Probe", {"history"}},
      {"File", {"profile", "history"}},
      {"Columns", {"profile", "history"}},
      {"Coordinate", {"profile", "history"}},
      {"Axis", {"profile"}},
      {"Start", {"history"}},
      {"Single points", {"formula"}},
      {"Value", {"formula"}}};
  for (const auto &[key, kinds] : used_by)
    if (section.has(key) && std::find(kinds.begin(), kinds.end(), kind) == kinds.end())
      section.fail(key, "'" + key + "' means nothing to a " + kind + "; it belongs to " + in_quotes(kinds));
}
} // namespace

template <int dim>
ReferenceParameters<dim>::ReferenceParameters(Section section, const std::vector<std::string> &probe_names)
    : section(section), name(section.name()), formula("0", {}, {})
{
  std::string kind_name = "formula", axis_name = dim == 2 ? "y" : "z";
  const std::vector<std::string> axes =
      dim == 2 ? std::vector<std::string>{"x", "y"} : std::vector<std::string>{"x", "y", "z"};
  section.add(
      "Kind", kind_name, {"profile", "history", "formula"},
      "'profile': a table along an axis at some times, compared with means over cells. 'history': a table "
      "over "
      "time, compared with a probe. 'formula': a function of x, y, z, t, compared with means over cells.");
  section.add("Field", field,
              "The field, with its component: 'pressure', 'displacement y', 'effective stress xx', ...");
  section.add("Body", body, "Compare only this body; empty: all.");
  section.add("Scale", scale, nonnegative(""),
              "Relative errors refer to it; 0: the reference's largest absolute value.");
  section.add("Times", times, 0, positive("s"),
              "Times of comparison; empty: the end. Profiles and formulas.");
  section.add("Probe", probe, "The probe that a history is compared with.");
  section.add("File", file, "Table in CSV with a line of names; lines that begin with # are skipped.");
  section.add("Coordinate", coordinate,
              "Name of the column with the coordinate or the time; empty: the first.");
  section.add("Columns", columns, "Names of the columns with the values, one per time; separated by commas.");
  section.add("Axis", axis_name, axes, "The axis of a profile.");
  section.add("Start", start, nonnegative("s"), "A history is compared from this time on.");
  section.add("Single points", single_points,
              "Compare a formula with single points instead of means over cells.");
  section.add("Value", formula, 1, "", "The formula.");
  kind = kind_name == "profile" ? Kind::profile : kind_name == "history" ? Kind::history : Kind::formula;
  axis = axis_name == "x" ? 0 : axis_name == "y" ? 1 : 2;
  if (section.describing())
    return;
  const std::string owner = "reference '" + name + "'";
  section.require("Field", owner);
  refuse_unused(section, kind_name);
  if (kind == Kind::formula)
    section.require("Value", owner);
  if (kind != Kind::formula && (file.empty() || columns.empty()))
    section.fail(file.empty() ? "File" : "Columns", owner + " needs a 'File' and 'Columns'");
  if (kind == Kind::profile && columns.size() != times.size())
    section.fail("Columns", "'Columns' and 'Times' must have as many entries");
  for (const double time : times)
    if (std::count(times.begin(), times.end(), time) > 1)
      section.fail("Times", "t = " + to_text(time) + " s stands twice");
  if (kind == Kind::history && std::find(probe_names.begin(), probe_names.end(), probe) == probe_names.end())
    section.fail("Probe", "there is no probe '" + probe + "'" + suggestion(probe, probe_names));
}

template struct ReferenceParameters<2>;
template struct ReferenceParameters<3>;
} // namespace peat
