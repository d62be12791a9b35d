#pragma once

#include <peat/contact/contact_law.h>

#include <deal.II/base/tensor.h>

#include <memory>
#include <string>
#include <vector>

namespace peat {
/// One subsection of `Contacts`: two bodies, and what happens where they meet.
template <int dim>
struct ContactParameters
{
  ContactParameters(Section section, const std::vector<std::string> &body_names,
                    const std::vector<std::string> &rigid_names);
  /// What holds between bodies of which the file names no contact: they move as one where they meet.
  static ContactParameters tied(const std::string &first, const std::string &second);

  /// What pore fluid meets at the interface.
  enum class Interface {
    impermeable, ///< R.n = 0
    drained,     ///< a given pressure
    open         ///< nothing: bodies that share their fluid, as those do between which no contact is named
  };
  /// Where the normal of two deformable bodies comes from.
  enum class Normal {
    regression, ///< the plane that separates their points (Nairn2020)
    gradient,   ///< the gradients of their volumes (Bardenhagen2001)
    prescribed
  };

  Origin origin; ///< where `Bodies` stands in the file
  std::string name;
  std::string first, second;
  std::shared_ptr<const ContactLaw> law;
  Interface interface = Interface::impermeable;
  double pressure = 0.; ///< of a drained interface [Pa]
  Normal normal = Normal::regression;
  dealii::Tensor<1, dim> direction; ///< unit vector from the first to the second; prescribed

private:
  ContactParameters() = default;
};
} // namespace peat
