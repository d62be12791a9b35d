#include <peat/base/text.h>
#include <peat/condition/condition.h>

#include <algorithm>

namespace peat {
namespace {
template <int dim>
int boundary_id(const std::string &name)
{
  const auto &names = boundary_names<dim>();
  for (unsigned int b = 0; b < names.size(); ++b)
    if (names[b] == name)
      return b;
  return -1;
}
} // namespace

template <int dim>
Place<dim>::Place(Section section, const std::vector<std::string> &body_names)
{
  std::vector<std::string> where;
  std::string region_text;
  section.add("Where", where,
              "Faces of the mesh (" + in_quotes(boundary_names<dim>()) +
                  "), 'surface of BODY', one side of a body ('top of BODY'), or 'region'.");
  section.add("Region", region_text,
              "A shape: only nodes (or parts of the surface, as they were at the start) inside "
              "it are meant. Empty: no restriction.");
  if (!region_text.empty())
    region = parse_shape<dim>(region_text, section.constants(), section.origin("Region"));
  if (section.describing())
    return;
  section.require("Where", "condition '" + section.name() + "'");
  if (where.empty())
    section.fail("Where", "name faces of the mesh, the surface of a body, or 'region'");

  for (const std::string &word : where) {
    if (std::count(where.begin(), where.end(), word) > 1)
      section.fail("Where", "'" + word + "' stands twice");
    const std::size_t of = word.find(" of ");
    if (of != std::string::npos) {
      if (where.size() > 1)
        section.fail("Where", "name one surface of a body, or faces of the mesh, not several surfaces");
      const std::string side = word.substr(0, of);
      body = word.substr(of + 4);
      direction = boundary_id<dim>(side);
      if (direction < 0 && side != "surface")
        section.fail("Where", "'" + side + "' is no side of a body; sides are 'surface', " +
                                  in_quotes(boundary_names<dim>()));
      if (!is_one_of(body_names, body))
        section.fail("Where", "there is no body '" + body + "'; the bodies are " + in_quotes(body_names));
    } else if (word == "region") {
      if (where.size() > 1)
        section.fail(
            "Where",
            "'region' stands alone; with faces of the mesh 'Region' says which part of them is meant");
      if (!region)
        section.fail("Where", "'Where = region' needs a 'Region'");
    } else {
      const int id = boundary_id<dim>(word);
      if (id < 0)
        section.fail("Where", "there is no boundary '" + word + "'; the mesh has " +
                                  in_quotes(boundary_names<dim>()) + ", bodies have 'surface of BODY'");
      boundaries.push_back(id);
    }
  }
}

template <int dim>
bool Place<dim>::contains(const SurfacePoint<dim> &point) const
{
  if (point.adjoins)
    return false;
  if (direction >= 0) {
    const int axis = direction / 2, sign = direction % 2 ? 1 : -1;
    for (int d = 0; d < dim; ++d)
      if (d != axis && std::abs(point.area[d]) > std::abs(point.area[axis]))
        return false;
    if (point.area[axis] * sign <= 0.)
      return false;
  }
  return !region || region->distance(point.initial_position) <= 0.;
}

template <int dim>
void Condition<dim>::select(const ActiveNodes<dim> &nodes)
{
  selections.clear();
  if (!place.on_mesh())
    return;
  const double tolerance = Place<dim>::tolerance(nodes.grid());
  const auto in_region = [&](const std::uint32_t i) {
    return place.contains_node(nodes.position(i), tolerance);
  };
  for (const unsigned int boundary : place.boundaries) {
    selections.push_back({int(boundary), {}});
    for (const std::uint32_t i : nodes.on_boundary(boundary))
      if (in_region(i))
        selections.back().nodes.push_back(i);
  }
  if (place.boundaries.empty()) {
    selections.push_back({-1, {}});
    for (std::uint32_t i = 0; i < nodes.size(); ++i)
      if (in_region(i))
        selections.back().nodes.push_back(i);
  }
}

template <int dim>
std::map<std::string, ConditionEntry<dim>> &condition_family()
{
  static std::map<std::string, ConditionEntry<dim>> entries;
  return entries;
}

template <int dim>
std::unique_ptr<Condition<dim>> make_condition(Section section, const std::vector<std::string> &body_names)
{
  std::vector<std::string> kinds;
  std::string text = "What holds there.";
  for (const auto &[name, entry] : condition_family<dim>()) {
    kinds.push_back(name);
    text += " '" + name + "': " + entry.text;
  }
  std::string kind = "fixed";
  section.add("Kind", kind, kinds, text);
  section.require("Kind", "condition '" + section.name() + "'");
  const Place<dim> place(section, body_names);
  if (section.describing())
    for (const auto &[name, entry] : condition_family<dim>())
      entry.make(section.subsection("(Kind = " + name + ")"), place);
  return condition_family<dim>().at(kind).make(section, place);
}

template struct Place<2>;
template struct Place<3>;
template class Condition<2>;
template class Condition<3>;
template std::map<std::string, ConditionEntry<2>> &condition_family<2>();
template std::map<std::string, ConditionEntry<3>> &condition_family<3>();
template std::unique_ptr<Condition<2>> make_condition<2>(Section, const std::vector<std::string> &);
template std::unique_ptr<Condition<3>> make_condition<3>(Section, const std::vector<std::string> &);
} // namespace peat
