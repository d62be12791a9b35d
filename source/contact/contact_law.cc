#include <peat/contact/contact_law.h>

#include <limits>

namespace peat {
namespace {
constexpr double infinite = std::numeric_limits<double>::infinity();

class Tied : public ContactLaw
{
public:
  Tied() = default;
  explicit Tied(const Section &) {}
  double shear_limit(double, double, bool) const override { return infinite; }
  double tension_limit(double) const override { return infinite; }
  bool ties() const override { return true; }
};
const ContactLawMember<Tied> tied("tied", "the bodies move as one where they meet.");

class Stick : public ContactLaw
{
public:
  explicit Stick(const Section &) {}
  double shear_limit(double, double, bool) const override { return infinite; }
};
const ContactLawMember<Stick> stick("stick", "no sliding; the bodies separate freely.");

class Frictionless : public ContactLaw
{
public:
  explicit Frictionless(const Section &) {}
  double shear_limit(double, double, bool) const override { return 0.; }
};
const ContactLawMember<Frictionless> frictionless("frictionless", "sliding without resistance.");

/// |t| <= mu sigma_n.
class Coulomb : public ContactLaw
{
public:
  explicit Coulomb(Section section)
  {
    std::string normal_stress = "effective stress";
    section.add("Friction", friction, nonnegative(""), "Coefficient of kinetic friction.");
    section.add("Static friction", static_friction, nonnegative(""),
                "Coefficient up to which nothing slides; 0: that of kinetic friction.");
    section.add("Friction on", normal_stress, {"effective stress", "total stress"},
                "The normal stress that friction is proportional to. The pore pressure has its part of the "
                "total one.");
    if (section.has("Static friction") && static_friction > 0. && static_friction < friction)
      section.fail("Static friction", "must not be below 'Friction'");
    if (!section.describing())
      section.require("Friction", "contact '" + section.name() + "' with Coulomb's law");
    effective = normal_stress == "effective stress";
  }
  double shear_limit(const double normal_force, double, const bool sliding) const override
  {
    return (sliding ? friction : std::max(friction, static_friction)) * normal_force;
  }
  bool on_effective_stress() const override { return effective; }

private:
  double friction = 0.;
  double static_friction = 0.;
  bool effective = true;
};
const ContactLawMember<Coulomb> coulomb("coulomb", "sliding when the shear stress reaches friction times "
                                                   "normal stress.");

/// |t| <= mu sigma_n + c, sigma_n >= -c.
class Adhesive : public ContactLaw
{
public:
  explicit Adhesive(Section section)
  {
    section.add("Friction", friction, nonnegative(""), "Coefficient of friction.");
    section.add("Adhesion", adhesion, positive("Pa"),
                "What the interface bears in tension, and in shear beside friction.");
    if (!section.describing())
      section.require("Adhesion", "contact '" + section.name() + "' with adhesion");
  }
  double shear_limit(const double normal_force, const double area, bool) const override
  {
    return friction * normal_force + adhesion * area;
  }
  double tension_limit(const double area) const override { return adhesion * area; }

private:
  double friction = 0.;
  double adhesion = 1e3;
};
const ContactLawMember<Adhesive> adhesive("adhesive", "Coulomb's law with a strength of its own in shear and "
                                                      "tension.");
} // namespace

std::unique_ptr<ContactLaw> tied_law()
{
  return std::make_unique<Tied>();
}

std::map<std::string, ContactLawEntry> &contact_law_family()
{
  static std::map<std::string, ContactLawEntry> entries;
  return entries;
}

std::unique_ptr<ContactLaw> make_contact_law(Section section)
{
  std::vector<std::string> names;
  std::string text = "What the interface bears.";
  for (const auto &[name, entry] : contact_law_family()) {
    names.push_back(name);
    text += " '" + name + "': " + entry.text;
  }
  std::string law = "frictionless";
  section.add("Law", law, names, text);
  if (section.describing())
    for (const auto &[name, entry] : contact_law_family())
      entry.make(section.subsection("(Law = " + name + ")"));
  else
    section.require("Law", "contact '" + section.name() + "'");
  return contact_law_family().at(law).make(section);
}
} // namespace peat
