#pragma once

#include <peat/condition/condition.h>
#include <peat/grid/grid.h>
#include <peat/material/material.h>
#include <peat/points/body.h>
#include <peat/simulation/output_parameters.h>
#include <peat/simulation/recorder.h>
#include <peat/simulation/reference.h>
#include <peat/solver/scheme.h>

#include <memory>
#include <string>
#include <vector>

namespace peat {
/// One subsection of `Stages`: a part of the run with its own duration.
struct StageParameters
{
  explicit StageParameters(Section section);

  std::string name;
  double duration = 1.; ///< [s]
  double local_damping = 0.;
};

/// The entry `Dimension`, which decides what all others mean.
unsigned int read_dimension(const ParameterFile &file);

/// All that a parameter file says, read and checked before anything is built.
template <int dim>
struct Case
{
  /// Throws InputError.
  explicit Case(const ParameterFile &file);

  const Material &material(const std::string &name) const;
  bool is_saturated() const;
  double end_time() const;

  Section section; ///< the top of the file
  std::string title;
  GridParameters<dim> grid;
  std::vector<std::unique_ptr<Material>> materials;
  std::vector<BodyParameters<dim>> bodies;
  std::vector<std::unique_ptr<Condition<dim>>> conditions;
  Function gravity;
  SchemeParameters scheme;
  std::vector<StageParameters> stages;
  std::vector<ProbeParameters<dim>> probes;
  std::vector<ReferenceParameters<dim>> references;
  OutputParameters output;
  CompareParameters compare;

private:
  void check(const Section &root) const;
};
} // namespace peat
