#pragma once

#include <peat/simulation/fields.h>
#include <peat/simulation/growing_file.h>
#include <peat/solver/explicit_mpm.h>

#include <string>
#include <vector>

namespace peat {
/// Records fields at the probes: probes.csv, one line a call.
///
/// Position and displacement of a probe that follows the material are those of its tracer. All other fields
/// are linear fits (LinearFit) through means over the cells around the probe, of one body: for a probe that
/// follows, the body it was in at the start; for one that stays, the body that now fills most of the cells it
/// touches. There is no value where there is no material.
///
/// Velocities come from the points, too, weighted with their volumes: nodal velocities are renumbered and
/// zero after a step in which points have entered new cells.
template <int dim>
class ProbeWriter
{
public:
  /// Collective. Opens the file on the first rank and writes the line of names: "time [s]", then for each
  /// probe "NAME/x [m]", ..., "NAME/displacement x [m]", "NAME/velocity x [m/s]", "NAME/pressure [Pa]"
  /// (saturated cases), "NAME/effective stress xx [Pa]", ..., and what histories in `References` ask for
  /// beyond these. The bodies and tracers (whose ids are the numbers of the probes) are those of `scene`,
  /// which must live as long as this.
  ProbeWriter(const Case<dim> &parameters, const Scene<dim> &scene, const Grid<dim> &grid,
              const std::string &file_name);

  /// Record all probes as they are now. Collective.
  void write(double time);

  /// Of the last write(), the same on all ranks; NaN where there is no material or no such field.
  double value(const std::string &probe, const std::string &field) const;
  double time() const { return last_time; }
  void persist(Archive &archive) { archive(file, last_time, values); }

private:
  struct Probe
  {
    std::string name;
    dealii::Point<dim> start;
    bool follows;
    int home; ///< the body it follows; -1: none
  };

  void choose_fields(const Case<dim> &parameters);
  void write_header();
  /// Where each probe is: 1 if anybody knows, position, displacement; n_place numbers a probe.
  std::vector<double> find_places() const;
  /// For each probe and body: volume in the cells that the probe touches, moments of places, and for each
  /// field sum w f, sum w d f; summed over the ranks.
  std::vector<double> sum_moments(const std::vector<double> &places) const;
  void add_cell(CellId cell, const dealii::Point<dim> &x, const dealii::Tensor<1, dim> &size,
                unsigned int body, double *sums) const;
  int choose_body(const Probe &probe, const double *sums) const;
  void evaluate(const Probe &probe, const double *place, const double *sums, double *result) const;

  static constexpr unsigned int n_place = 1 + 2 * dim;
  std::size_t block_size() const;

  const Scene<dim> &scene;
  const Grid<dim> &grid;
  std::vector<Probe> probes;
  std::vector<std::string> fields; ///< those with fits; the first dim are the displacements
  std::vector<std::string> units;
  std::vector<std::vector<FieldAccess>> access; ///< [body][field]

  GrowingFile file;
  double last_time;
  std::vector<double> values; ///< [probe][position, fields]
};
} // namespace peat
