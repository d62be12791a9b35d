#pragma once

#include <peat/base/lanes.h>
#include <peat/base/parameters.h>
#include <peat/base/registry.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace peat {
/// A symmetric tensor per lane in the order xx, yy, zz, xy, yz, zx (tensor components, no factor 2).
using StressLanes = std::array<Lanes, 6>;
/// A full tensor per lane, row by row: gradient[3 * i + j] = d u_i / d x_j.
using GradientLanes = std::array<Lanes, 9>;

/// A named quantity that points remember: a field of the points, a column of the output, part of a
/// checkpoint.
struct StateField
{
  std::string name;
  std::string unit;
  /// Value of each component at the start.
  std::vector<double> initial;
};

/// The skeleton's constitutive law, for eight points at a time. Stresses are effective Cauchy stresses [Pa],
/// tension positive. A law is three-dimensional, knows neither mesh nor method, and keeps no data of points:
/// what it remembers per point it names in state() and gets handed back.
class Law
{
public:
  virtual ~Law() = default;

  /// What the law remembers per point besides the stress.
  virtual std::vector<StateField> state() const { return {}; }

  /// Whether volumes and extents of points follow the motion. Small-strain laws refer everything to the
  /// volume at the start.
  virtual bool finite_strain() const = 0;

  /// Whether the tangent is the same for every stress and state.
  virtual bool is_linear() const { return false; }

  /// Advance one step. `increment` is the displacement gradient of the step, dt * grad v, referred to the
  /// positions at its start; `stress` and `state` (one Lanes per component, fields in the order of state())
  /// are updated in place. Lanes that hold no point carry zero increments and the state of a valid point.
  virtual void update(const GradientLanes &increment, StressLanes &stress, Lanes *state) const = 0;

  /// Consistent tangent d(stress)/d(increment's symmetric part) at the present state, [Pa], `tangent[6 * i +
  /// j]` in the order of StressLanes; column j is the response to an engineering shear for j >= 3.
  virtual void tangent(const StressLanes &stress, const Lanes *state,
                       std::array<Lanes, 36> &tangent) const = 0;

  /// Elastic energy stored per present volume [J/m^3].
  virtual Lanes stored_energy(const StressLanes &stress, const Lanes *state) const = 0;

  /// Largest stiffness of a plane compression wave in any direction [Pa]: sets the stable step.
  virtual Lanes wave_modulus(const StressLanes &stress, const Lanes *state) const = 0;
};

/// Lame's constants from the pair that engineers give; declares "Young modulus" and "Poisson ratio".
struct ElasticModuli
{
  explicit ElasticModuli(Section section);
  double lambda;
  double mu;
  double wave_modulus() const { return lambda + 2. * mu; }
};
} // namespace peat
