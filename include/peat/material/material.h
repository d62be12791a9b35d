#pragma once

#include <peat/material/law.h>
#include <peat/material/mixture.h>

#include <memory>
#include <string>

namespace peat {
/// What a body is made of: a law for the skeleton and, if the material is saturated, the mixture with the
/// pore fluid. A section of the file with "Porosity" describes a saturated material, one without it a dry
/// material.
class Material
{
public:
  /// Throws InputError, also where the file mixes what belongs to a dry and to a saturated material.
  explicit Material(Section section);

  /// The user's name for it.
  const std::string &name() const { return given_name; }
  const Law &law() const { return *skeleton; }
  /// nullptr for a dry material.
  const Mixture *mixture() const { return pores.get(); }
  /// Stiffness of the skeleton to a plane compression wave at the start, without stress [Pa].
  double initial_modulus() const;
  /// The law's tangent at the start, without stress [Pa].
  void initial_tangent(std::array<Lanes, 36> &tangent) const;
  /// Mass per volume at the start, of the mixture if saturated [kg/m^3].
  double density() const { return pores ? pores->density() : dry_density; }

private:
  const std::string given_name;
  std::unique_ptr<Law> skeleton;
  std::unique_ptr<Mixture> pores;
  double dry_density = 2000.;
};
} // namespace peat
