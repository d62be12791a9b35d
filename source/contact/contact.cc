#include <peat/base/text.h>
#include <peat/contact/contact.h>

#include <algorithm>

namespace peat {
template <int dim>
ContactParameters<dim>::ContactParameters(Section section, const std::vector<std::string> &body_names,
                                          const std::vector<std::string> &rigid_names)
    : origin(section.origin("Bodies")), name(section.name())
{
  std::vector<std::string> bodies;
  std::string interface_text = "impermeable", normal_text = "automatic";
  std::vector<double> vector(dim, 0.);
  vector[dim - 1] = 1.;
  section.add("Bodies", bodies,
              "Two names of 'Bodies' or 'Rigid bodies', not two of the latter. In implicit and quasi-static "
              "stages contacts of a rigid body act; two deformable bodies are tied where they meet.");
  law = make_contact_law(section);
  section.add("Interface", interface_text, {"impermeable", "drained"},
              "What pore fluid meets at the interface: no flow through it, or a given pressure.");
  section.add("Interface pressure", pressure, any("Pa"), "Pore pressure at a drained interface.");
  section.add("Normal", normal_text, {"automatic", "regression", "gradient", "prescribed"},
              "Where the interface's direction comes from, between two deformable bodies: a plane that "
              "separates their points (regression; automatic means it), the gradients of their volumes, or "
              "'Normal direction'.");
  section.add("Normal direction", vector, dim, any(""), "From the first body to the second; prescribed.");
  if (section.describing())
    return;
  section.require("Bodies", "contact '" + name + "'");
  if (bodies.size() != 2)
    section.fail("Bodies", "a contact needs two bodies, not " + std::to_string(bodies.size()));
  first = bodies[0];
  second = bodies[1];
  std::vector<std::string> known = body_names;
  known.insert(known.end(), rigid_names.begin(), rigid_names.end());
  for (const std::string &body : bodies)
    if (std::find(known.begin(), known.end(), body) == known.end())
      section.fail("Bodies", "there is no body " + in_quotes(body) + suggestion(body, known));
  if (first == second)
    section.fail("Bodies", "a body has no contact with itself");
  const auto is_rigid = [&](const std::string &body) {
    return std::find(rigid_names.begin(), rigid_names.end(), body) != rigid_names.end();
  };
  if (is_rigid(first) && is_rigid(second))
    section.fail("Bodies", "two rigid bodies do not feel each other");
  if (section.has("Interface pressure") && interface_text != "drained")
    section.fail("Interface pressure", "holds where the interface is drained; set 'Interface = drained'");
  const bool deformable = !is_rigid(first) && !is_rigid(second);
  if (!deformable && section.has("Normal"))
    section.fail("Normal", "a rigid body's own surface has the normal; leave this out");
  if (section.has("Normal direction") && normal_text != "prescribed")
    section.fail("Normal direction", "holds with 'Normal = prescribed'");
  interface = interface_text == "drained" ? Interface::drained : Interface::impermeable;
  if (normal_text == "gradient")
    normal = Normal::gradient;
  if (normal_text == "prescribed") {
    section.require("Normal direction", "contact '" + name + "' with a prescribed normal");
    normal = Normal::prescribed;
    for (unsigned int d = 0; d < dim; ++d)
      direction[d] = vector[d];
    if (direction.norm() == 0.)
      section.fail("Normal direction", "has no length");
    direction /= direction.norm();
  }
}

template <int dim>
ContactParameters<dim> ContactParameters<dim>::tied(const std::string &first, const std::string &second)
{
  ContactParameters contact;
  contact.name = first + " and " + second;
  contact.first = first;
  contact.second = second;
  contact.law = tied_law();
  contact.interface = Interface::open;
  return contact;
}

template struct ContactParameters<2>;
template struct ContactParameters<3>;
} // namespace peat
