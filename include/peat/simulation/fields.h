#pragma once

#include <peat/points/body.h>
#include <peat/simulation/case.h>

#include <functional>
#include <string>
#include <vector>

namespace peat {
/// One number of every point of a body, under the name a user knows it by:
///   - each component of each stored field: "pressure", "displacement x", "effective stress xy",
///     "deformation gradient 11" (nine components: row and column; other numbers of them: 1, 2, ...);
///   - "total stress xx" = effective stress - alpha p (the effective stress itself in a dry body),
///     "mean effective stress" = (xx + yy + zz) / 3, "density" = mass / volume, "speed" = |velocity|;
///   - "porosity" of saturated bodies, also where it is a constant of the material.
class FieldAccess
{
public:
  /// Not available if points with this layout have no such field, e.g. the pore pressure of a dry body.
  FieldAccess(const std::string &name, const Layout &layout, const Material &material);

  bool available() const { return bool(get); }
  /// The row of a point, see Body::row().
  double operator()(const double *row) const { return get(row); }
  /// "" for a pure number.
  const std::string &unit() const { return unit_text; }

  /// All that are available.
  static std::vector<std::string> names(const Layout &layout, const Material &material);

private:
  std::string unit_text;
  std::function<double(const double *)> get;
};

/// Throws an InputError at `key` of the section unless the body (with body = "": any body of the case) has
/// the field; the message suggests what there is. Also if there is no such body.
template <int dim>
void require_field(const Case<dim> &parameters, const std::string &body, const std::string &field,
                   const Section &section, const std::string &key);

/// Add the volumes of the points of a slice, volume times position, and volume times each field (available
/// ones).
template <int dim>
void integrate(const Body<dim> &body, const Slice &slice, const std::vector<FieldAccess> &fields,
               double &volume, dealii::Point<dim> &moment, double *sums);

/// Means over the points of a cell, weighted with their volumes. This is how fields that jump from cell to
/// cell, above all the pore pressure, are second-order accurate: at the centroid.
template <int dim>
struct CellMeans
{
  unsigned int n_fields;
  std::vector<CellId> cell; ///< ascending; cells of this rank that hold points
  std::vector<double> volume;
  std::vector<dealii::Point<dim>> centroid;
  std::vector<double> values; ///< n_fields a cell

  std::size_t size() const { return cell.size(); }
  double value(const std::size_t entry, const unsigned int field) const
  {
    return values[entry * n_fields + field];
  }
};

/// Of these fields, over the points of those bodies that have all of them. No communication.
template <int dim>
CellMeans<dim> cell_means(const std::vector<const Body<dim> *> &bodies,
                          const std::vector<std::string> &fields);
} // namespace peat
