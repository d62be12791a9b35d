#pragma once

#include <peat/simulation/fields.h>
#include <peat/simulation/probes.h>
#include <peat/simulation/table.h>
#include <peat/solver/explicit_mpm.h>

#include <string>
#include <vector>

namespace peat {
/// How far a run is from its `References`.
///
/// Profiles and formulas: at each of their times the means over cells (CellMeans) of the reference's body, or
/// of all that have the field, are compared at their centroids; a formula with `Single points` is compared
/// with each point, and so is everything that finite elements give, at their Gauss points. With e = value -
/// reference and the volumes V,
///   L1 = sum V |e| / sum V,   L2 = sqrt(sum V e^2 / sum V),   Linf = max |e|.
/// Displacements are compared as functions of the place at the start, place - displacement.
///
/// Histories: the value at the probe at each of its output times from `Start` on, as far as the table goes:
///   L1 = integral |e| dt / T,   L2 = sqrt(integral e^2 dt / T)   by the trapezoidal rule.
///
/// Between the entries of a table the reference is interpolated by Curve. Where a table does not reach (more
/// than 1e-6 of its length) nothing is compared; such values are counted.
template <int dim>
class Comparison
{
public:
  /// Reads all tables; relative file names start from `directory`, that of the parameter file. Throws
  /// InputError. The case must live as long as this.
  Comparison(const Case<dim> &parameters, const std::string &directory);

  bool empty() const { return references.empty(); }

  /// When compare() is to be called, ascending [s].
  const std::vector<double> &times() const { return all_times; }

  /// Compare profiles and formulas whose time this is (up to 1e-9 of the run), each time once. Collective.
  void compare(double time, const Scene<dim> &scene, MPI_Comm communicator);
  /// Compare histories with what the probes have just recorded; to be called after each ProbeWriter::write().
  void compare(const ProbeWriter<dim> &probes);

  void persist(Archive &archive);

  struct Norms
  {
    double time = 0.;                   ///< of a comparison; of a history the last [s]
    double weight = 0.;                 ///< sum V, or T
    double L1 = 0., L2 = 0., Linf = 0.; ///< in the field's unit
    double largest_reference = 0.;
    unsigned long n = 0;         ///< values compared
    unsigned long n_outside = 0; ///< values that a table does not reach or that are missing
    double worst_time = 0.;      ///< where |e| is largest
    dealii::Point<dim> worst_place;
    double worst_value = 0.;
    double worst_reference = 0.;
  };
  struct Result
  {
    std::string reference;
    std::string field;
    std::string unit;
    double scale = 0.; ///< by which relative errors are divided
    double relative_L1 = 0., relative_L2 = 0., relative_Linf = 0.;
    Norms norms; ///< over all times
  };

  /// One for each reference, in the order of the file, over what was compared so far; n = 0 and NaN if
  /// nothing was. The same on all ranks.
  std::vector<Result> results() const;

  /// errors.csv: one line for each reference and time. To be called on one rank.
  void write_errors(const std::string &file_name) const;

private:
  struct Reference
  {
    const ReferenceParameters<dim> *parameters;
    std::vector<double> times;
    std::vector<Curve> curves; ///< of a profile one for each time, of a history one
    dealii::Point<dim> place;  ///< of a history's probe
    std::string unit;
    std::vector<Norms> done;                    ///< of a profile or formula, for each time that has passed
    std::vector<std::array<double, 3>> samples; ///< of a history: time, value, reference
    unsigned long n_outside = 0;
  };

  void read_table(Reference &reference, const std::string &directory, const Case<dim> &parameters) const;
  double expected(const Reference &reference, const Curve *curve, const dealii::Point<dim> &x,
                  double time) const;
  Norms compare_cells(const Reference &reference, const Curve *curve, double time,
                      const Scene<dim> &scene) const;
  Norms compare_points(const Reference &reference, const Curve *curve, double time,
                       const Scene<dim> &scene) const;
  std::vector<Norms> norms(const Reference &reference) const;
  Result result(const Reference &reference) const;

  const bool finite_elements;
  std::vector<Reference> references;
  std::vector<double> all_times;
  double time_tolerance;
};
} // namespace peat
