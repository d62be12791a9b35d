#pragma once

#include <peat/base/parameters.h>

#include <functional>
#include <map>
#include <memory>
#include <string>

namespace peat {
/// What an interface bears. A law knows neither mesh nor bodies: forces [N] (2-D: per metre of depth) at one
/// place of an interface with its area [m^2] (2-D: [m]).
class ContactLaw
{
public:
  virtual ~ContactLaw() = default;

  /// Largest shear force that the interface bears under a compressive normal force, not sliding or sliding.
  virtual double shear_limit(double normal_force, double area, bool sliding) const = 0;
  /// Largest tensile normal force.
  virtual double tension_limit(double /*area*/) const { return 0.; }
  /// Whether normal_force of shear_limit() is what the skeleton bears, without the pore pressure's part.
  virtual bool on_effective_stress() const { return true; }
  /// Whether it holds the bodies together where they meet, as if they were one.
  virtual bool ties() const { return false; }
};

/// A member of the family of contact laws: one .cc, one line
///   const ContactLawMember<Coulomb> member("coulomb", "Sentence.");
struct ContactLawEntry
{
  std::string text;
  /// Reads its own entries of the contact's section.
  std::function<std::unique_ptr<ContactLaw>(const Section &)> make;
};

std::map<std::string, ContactLawEntry> &contact_law_family();

template <typename Member>
struct ContactLawMember
{
  ContactLawMember(const std::string &name, const std::string &text)
  {
    contact_law_family()[name] = {text,
                                  [](const Section &section) { return std::make_unique<Member>(section); }};
  }
};

/// Reads `Law` and the law's own entries of one subsection of `Contacts`.
std::unique_ptr<ContactLaw> make_contact_law(Section section);
/// The law of bodies that move as one.
std::unique_ptr<ContactLaw> tied_law();
} // namespace peat
