#pragma once

#include <peat/material/material.h>

#include <string>
#include <vector>

namespace peat {
/// How many columns a law may remember.
constexpr unsigned int max_state_columns = 32;

/// What a scheme needs stored with the points beyond what the material asks for.
struct SchemeFields
{
  bool extent = false;
  bool velocity_gradient = false;
  bool surface_depth = false; ///< and `extent`; for contact
  bool pressure_rate = false; ///< of saturated bodies
  /// Put Gauss points, so many per direction, into full cells instead of evenly spaced points; 0: no.
  unsigned int gauss_points = 0;
};

/// The columns of a body's points: what is stored, under which name, and where in the row of a point. A body
/// stores only what its material and the scheme use; a column that does not exist has the index -1.
///
/// Vectors have dim components. Stress has xx, yy, zz, xy in 2-D and xx, yy, zz, xy, yz, zx in 3-D.
struct Layout
{
  enum class Kind { scalar, vector, stress, other };
  struct Field
  {
    std::string name;
    std::string unit;
    int first_column;
    unsigned int n_components;
    Kind kind;
  };

  Layout(unsigned int dim, const Material &material, const SchemeFields &scheme);

  /// Nullptr if there is no field of that name.
  const Field *find(const std::string &name) const;

  unsigned int n_columns = 0;
  std::vector<Field> fields;

  int mass = -1;              ///< [kg]
  int volume = -1;            ///< [m^dim]; per metre of depth in 2-D
  int velocity = -1;          ///< [m/s]
  int velocity_gradient = -1; ///< [1/s], row by row: dv_x/dx, dv_x/dy, ...; affine transfers
  int displacement = -1;      ///< [m] since the start
  int stress = -1;            ///< effective Cauchy stress [Pa]
  int pressure = -1;          ///< pore pressure [Pa]; saturated bodies
  int pressure_rate = -1;     ///< of the last step [Pa/s]; saturated bodies with implicit pressures
  int porosity = -1;          ///< [-]; saturated bodies under finite strain (constant otherwise)
  int extent = -1;            ///< half the edge lengths of the point's domain [m]; GIMP and contact
  bool wide_domains = false;  ///< domains reach nodes beyond the point's cell: GIMP
  /// How deep below the body's surface the point was at the start, in units of its half extent towards the
  /// surface; 0 for points far from it; contact.
  int surface_depth = -1;
  int state = -1;           ///< what the law remembers
  unsigned int n_state = 0; ///< number of columns of the law's memory

private:
  int add(const std::string &name, const std::string &unit, unsigned int n_components, Kind kind);
};
} // namespace peat
