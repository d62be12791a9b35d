#pragma once

#include <peat/condition/condition.h>
#include <peat/contact/contact.h>
#include <peat/contact/rigid_body.h>
#include <peat/grid/grid.h>
#include <peat/material/material.h>
#include <peat/points/body.h>
#include <peat/simulation/output_parameters.h>
#include <peat/simulation/recorder.h>
#include <peat/simulation/reference.h>
#include <peat/simulation/sweep_parameters.h>
#include <peat/solver/implicit_parameters.h>
#include <peat/solver/linear_solver.h>
#include <peat/solver/scheme.h>

#include <memory>
#include <string>
#include <vector>

namespace peat {
/// What solves the equations: material points or finite elements.
enum class Method { mpm, fem };

/// One subsection of `Stages`: a part of the run with its own duration.
struct StageParameters
{
  /// `common`: the scheme of stages that do not name one.
  StageParameters(Section section, Scheme common);

  enum class Solver { dynamic, quasi_static, static_state };

  std::string name;
  Solver solver = Solver::dynamic;
  double duration = 1.; ///< [s]; 0 of a static stage
  bool reset_displacements = false;
  bool static_on_points = true; ///< of material points: else on the finite element mesh
  double K0 = 0.;               ///< static: horizontal over vertical effective stress; 0: from elasticity
  double local_damping = 0.;
  Scheme scheme; ///< dynamic stages of material points
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
  /// Whether any stage is, or may turn out to be, solved implicitly.
  bool is_implicit() const;
  /// Why a scheme does not apply to a dynamic stage; "" if it does.
  std::string why_not(Scheme scheme, const StageParameters &stage) const;
  /// Whether a dynamic stage of material points has, or may choose, the scheme.
  bool may_have(Scheme scheme) const;
  /// What the points store for the method.
  SchemeFields fields() const;
  /// What Gauss points of the finite element method store.
  SchemeFields gauss_fields() const;
  /// Shape functions of displacements of the implicit solvers, by the method.
  Nodes displacement_nodes() const;

  Section section; ///< the top of the file
  std::string title;
  GridParameters<dim> grid;
  std::vector<std::unique_ptr<Material>> materials;
  std::vector<BodyParameters<dim>> bodies;
  std::vector<RigidBodyParameters<dim>> rigid_bodies;
  std::vector<ContactParameters<dim>> contacts;
  std::vector<std::unique_ptr<Condition<dim>>> conditions;
  Function gravity;
  Method method;
  Scheme common_scheme; ///< of stages that name none
  SchemeParameters scheme;
  ImplicitParameters implicit;
  LinearSolverParameters linear;
  std::vector<StageParameters> stages;
  std::vector<ProbeParameters<dim>> probes;
  std::vector<ReferenceParameters<dim>> references;
  OutputParameters output;
  CompareParameters compare;
  SweepParameters sweep;

  /// Name of the stage with which a body comes in, "" for those that are there from the start.
  std::string entry_stage(const BodyParameters<dim> &body) const;
  /// Numbers of the bodies that come in with this stage.
  std::vector<std::size_t> entering_bodies(const StageParameters &stage) const;

private:
  void check(const Section &root) const;
  void check_contacts() const;
  void set_fall_velocities();
  void check_schemes(const Section &root) const;
  std::string why_not_semi_implicit() const;
  std::string why_not_implicit(const StageParameters &stage) const;
};
} // namespace peat
