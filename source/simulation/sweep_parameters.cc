#include <peat/simulation/sweep_parameters.h>

#include <peat/base/text.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

namespace peat {
namespace {
std::vector<std::string> split_values(const std::string &text)
{
  if (text.find(';') == std::string::npos)
    return split_outside_parentheses(text);
  std::vector<std::string> values;
  std::istringstream stream(text);
  for (std::string value; std::getline(stream, value, ';');)
    values.push_back(trim(value));
  return values;
}
} // namespace

SweepAxis::SweepAxis(std::string path, const std::string &text)
    : key(trim(path)), values(split_values(trim(text)))
{
  if (key.empty() || key.front() == '/' || key.back() == '/' || key.find('=') != std::string::npos)
    throw InputError(in_quotes(key) + " names no entry; write it as Section/Key");
  if (key.compare(0, 6, "Sweep/") == 0 || key.compare(0, 8, "Compare/") == 0)
    throw InputError(in_quotes(key) + " changes nothing in a run and cannot be varied");
  if (values.empty())
    throw InputError("no value to set " + in_quotes(key) + " to");
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i].empty())
      throw InputError("an empty value in " + in_quotes(text));
    if (std::find(values.begin(), values.begin() + i, values[i]) != values.begin() + i)
      throw InputError("the value " + in_quotes(values[i]) + " comes twice");
  }
}

std::string SweepAxis::name() const
{
  return key.substr(key.rfind('/') + 1);
}

bool SweepAxis::is_numeric() const
{
  return std::all_of(values.begin(), values.end(), [](const std::string &value) {
    char *end = nullptr;
    std::strtod(value.c_str(), &end);
    return end != value.c_str() && *end == '\0';
  });
}

SweepParameters::SweepParameters(Section section) : section(section)
{
  section.add("References", references,
              "Names of the references that make up the error of a run of 'peat sweep', which is the largest "
              "of their relative errors; empty: all.");
  section.add("Fields", fields, {"displacement", "velocity", "pressure", "effective stress"},
              "Where the case has no references: what is compared with the finest run, at the probes.");
  section.add("Norm", norm, {"L1", "L2", "Linf"}, "Norm of the errors.");
  section.add("Target", target, positive(""),
              "Relative error for which 'peat sweep' looks for the cheapest settings.");
  section.add("Skip margin", skip_margin, nonnegative(""),
              "A run is skipped if, by the runs before it, it would take longer than a finished one and have "
              "a larger error, both by this factor; below 1: never.");
  section.add("Jobs", n_jobs, between(1, 1000), "Runs at a time.");
  for (const std::string &name : section.user_sections("VARIED")) {
    Section one = section.subsection(name);
    std::string key, values;
    one.add("Key", key, "Entry that is varied, as Section/Sub/Key.");
    one.add("Values", values,
            "What it is set to in turn, separated by commas, or by ';' where values hold commas. All "
            "combinations with the values of the other subsections are run.");
    if (section.describing())
      continue;
    one.require("Key", "the varied entry '" + name + "'");
    one.require("Values", "the varied entry '" + name + "'");
    try {
      axes.emplace_back(key, values);
    } catch (const InputError &error) {
      one.fail("Values", error.what());
    }
    axes.back().place = one.origin("Values").prefix() + one.path() + "/Values: ";
    for (std::size_t a = 0; a + 1 < axes.size(); ++a)
      if (axes[a].key == axes.back().key)
        one.fail("Key", in_quotes(axes.back().key) + " is varied by another subsection already");
  }
}
} // namespace peat
