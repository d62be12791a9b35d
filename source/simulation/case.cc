#include <peat/simulation/case.h>

#include <peat/base/text.h>

#include <cmath>
#include <sstream>

namespace peat {
StageParameters::StageParameters(Section section, const Scheme common) : name(section.name())
{
  std::string solver_name = "dynamic";
  section.add(
      "Solver", solver_name, {"dynamic", "quasi-static", "static"},
      "'dynamic': the full equations. 'quasi-static': without inertia, in steps as long as the pressures "
      "change slowly; free rigid bodies are in equilibrium with what they rest on. 'static': the state of "
      "equilibrium and of steady seepage under the loads at that "
      "time.");
  solver = solver_name == "static"         ? Solver::static_state
           : solver_name == "quasi-static" ? Solver::quasi_static
                                           : Solver::dynamic;
  if (solver != Solver::static_state || section.describing())
    section.add("Duration", duration, positive("s"), "How long the stage lasts; a static one takes no time.");
  std::string state_name = "points";
  section.add(
      "Static state", state_name, {"points", "fem"},
      "Of a static stage with material points. 'points': on the points' own quadrature, so that an "
      "explicit stage which follows stays at rest to round-off. 'fem': on the finite element mesh, from "
      "which the points take their stresses and pressures.");
  static_on_points = state_name == "points";
  section.add(
      "K0", K0, nonnegative(""),
      "Static: horizontal over vertical effective stress, where not given by elasticity (0). The vertical "
      "direction is the last one; what is then out of balance is balanced elastically.");
  if (K0 > 0. && solver != Solver::static_state)
    section.fail("K0", "belongs to static stages");
  section.add("Reset displacements", reset_displacements,
              "Count displacements from the end of this stage; stresses, pressures and history stay.");
  section.add(
      "Local damping", local_damping, between(0., 0.99),
      "Share of each node's out-of-balance force that acts against its velocity in this stage; for dynamic "
      "relaxation to rest.");
  std::string scheme_name = name_of(common);
  section.add("Scheme", scheme_name, scheme_names(),
              "Dynamic: that of this stage, if it is another one than the file's.");
  scheme = scheme_of(scheme_name);
  if (section.describing())
    return;
  if (solver != Solver::static_state)
    section.require("Duration", "stage '" + name + "'");
  if (solver == Solver::static_state && section.has("Duration"))
    section.fail("Duration", "a static stage takes no time");
  if (solver == Solver::static_state)
    duration = 0.;
  for (const char *key : {"Static state", "Reset displacements"})
    if (solver != Solver::static_state && section.has(key))
      section.fail(key, "belongs to static stages");
  for (const char *key : {"Local damping", "Scheme"})
    if (solver != Solver::dynamic && section.has(key))
      section.fail(key, "belongs to dynamic stages");
}

unsigned int read_dimension(const ParameterFile &file)
{
  double dimension = 2;
  Section root = file.root();
  root.add("Dimension", dimension, between(2, 3), "2 (plane strain) or 3.");
  if (dimension != 2 && dimension != 3)
    root.fail("Dimension", "'Dimension' must be 2 or 3");
  root.set_dimension(dimension == 2 ? 2 : 3);
  return dimension == 2 ? 2 : 3;
}

namespace {
std::string read_title(Section root)
{
  std::string title;
  root.add("Title", title, "A name for the run.");
  return title;
}

std::vector<std::unique_ptr<Material>> read_materials(const Section &section)
{
  std::vector<std::unique_ptr<Material>> materials;
  for (const std::string &name : section.user_sections("MATERIAL"))
    materials.push_back(std::make_unique<Material>(section.subsection(name)));
  return materials;
}

template <typename Named>
std::vector<std::string> names(const std::vector<Named> &list)
{
  std::vector<std::string> result;
  for (const auto &item : list)
    result.push_back(item.name);
  return result;
}

template <int dim>
std::vector<BodyParameters<dim>> read_bodies(const Section &section,
                                             const std::vector<std::unique_ptr<Material>> &materials)
{
  std::vector<std::string> material_names;
  for (const auto &material : materials)
    material_names.push_back(material->name());
  if (material_names.empty())
    section.fail("",
                 "the file has no material: a section 'Materials' with one subsection a material is needed");
  std::vector<BodyParameters<dim>> bodies;
  for (const std::string &name : section.user_sections("BODY"))
    bodies.emplace_back(section.subsection(name), material_names);
  if (bodies.empty())
    section.fail("", "the file has no body: a section 'Bodies' with one subsection a body is needed");
  return bodies;
}

template <int dim>
std::vector<RigidBodyParameters<dim>> read_rigid_bodies(const Section &section,
                                                        const std::vector<std::string> &body_names)
{
  std::vector<RigidBodyParameters<dim>> bodies;
  for (const std::string &name : section.user_sections("RIGID BODY")) {
    if (std::find(body_names.begin(), body_names.end(), name) != body_names.end())
      section.subsection(name).fail("", "there is a body " + in_quotes(name) + " in 'Bodies' already");
    bodies.emplace_back(section.subsection(name));
  }
  return bodies;
}

template <int dim>
std::vector<ContactParameters<dim>> read_contacts(const Section &section,
                                                  const std::vector<std::string> &body_names,
                                                  const std::vector<std::string> &rigid_names)
{
  std::vector<ContactParameters<dim>> contacts;
  for (const std::string &name : section.user_sections("CONTACT")) {
    const Section one = section.subsection(name);
    contacts.emplace_back(one, body_names, rigid_names);
    const auto &last = contacts.back();
    for (std::size_t c = 0; c + 1 < contacts.size(); ++c)
      if ((contacts[c].first == last.first && contacts[c].second == last.second) ||
          (contacts[c].first == last.second && contacts[c].second == last.first))
        one.fail("Bodies", "contact " + in_quotes(contacts[c].name) + " is of the same two bodies");
  }
  return contacts;
}

template <int dim>
std::vector<std::unique_ptr<Condition<dim>>> read_conditions(const Section &section,
                                                             const std::vector<std::string> &bodies)
{
  std::vector<std::unique_ptr<Condition<dim>>> conditions;
  for (const std::string &name : section.user_sections("CONDITION"))
    conditions.push_back(make_condition<dim>(section.subsection(name), bodies));
  return conditions;
}

template <int dim>
Function read_gravity(Section root)
{
  Function gravity(dim == 2 ? "0, 0" : "0, 0, 0", {}, {});
  root.add("Gravity", gravity, dim, "m/s^2",
           "Acceleration of gravity; may depend on t, e.g. 0, -9.81*min(1, t/0.1).");
  if (!gravity.is_uniform())
    root.fail("Gravity", "'Gravity' may depend on t but not on place");
  root.require_start("Gravity", gravity);
  return gravity;
}

Method read_method(Section root)
{
  std::string name = "mpm";
  root.add(
      "Method", name, {"mpm", "fem"},
      "'mpm': the coupled material point method. 'fem': u-p finite elements on the cells that the bodies "
      "fill.");
  return name == "fem" ? Method::fem : Method::mpm;
}

Scheme read_common_scheme(Section root)
{
  std::string name = "auto";
  root.add("Scheme", name, scheme_names(),
           "How dynamic stages of material points step in time. 'explicit': many cheap steps, limited by "
           "undrained waves and by the diffusion of pressures. 'semi-implicit': pore pressures from a linear "
           "system; only the wave in the skeleton limits the step. 'implicit': motion and pressures from one "
           "system; steps are as long as 'Implicit solver/Step tolerance' allows. 'auto': the one that is "
           "estimated to cost least of those that apply.");
  return scheme_of(name);
}

SchemeParameters read_scheme(Section root)
{
  SchemeParameters scheme(root.subsection("Explicit MPM"));
  root.add(
      "Seepage inertia", scheme.seepage_inertia,
      "Keep the term rho_f a in Darcy's law (the full u-p form). Without it the form is well posed for every "
      "material.");
  return scheme;
}

template <typename Parameters, typename... Arguments>
std::vector<Parameters> read_list(const Section &section, const std::string &example,
                                  const Arguments &...arguments)
{
  std::vector<Parameters> list;
  for (const std::string &name : section.user_sections(example))
    list.emplace_back(section.subsection(name), arguments...);
  return list;
}
} // namespace

namespace {
/// Whether a stress that comes with no strain survives an update.
bool keeps_stress(const Law &law)
{
  std::vector<Lanes> state;
  for (const StateField &field : law.state())
    for (const double value : field.initial)
      state.push_back(broadcast(value));
  StressLanes stress;
  stress.fill(broadcast(1.));
  law.update({}, stress, state.data());
  return std::abs(stress[0][0] - 1.) < 1e-6;
}

bool is_zero(const Function &function)
{
  const double origin[3] = {0., 0., 0.};
  bool zero = function.is_constant();
  for (unsigned int c = 0; c < function.n_components() && zero; ++c)
    zero = function.value(origin, 0., c) == 0.;
  return zero;
}
} // namespace

template <int dim>
Case<dim>::Case(const ParameterFile &file)
    : section(file.root()), title(read_title(file.root())), grid(file.root().subsection("Grid")),
      materials(read_materials(file.root().subsection("Materials"))),
      bodies(read_bodies<dim>(file.root().subsection("Bodies"), materials)),
      rigid_bodies(read_rigid_bodies<dim>(file.root().subsection("Rigid bodies"), names(bodies))),
      contacts(read_contacts<dim>(file.root().subsection("Contacts"), names(bodies), names(rigid_bodies))),
      conditions(read_conditions<dim>(file.root().subsection("Conditions"), names(bodies))),
      gravity(read_gravity<dim>(file.root())), method(read_method(file.root())),
      common_scheme(read_common_scheme(file.root())), scheme(read_scheme(file.root())),
      implicit(file.root().subsection("Implicit solver")), linear(file.root().subsection("Linear solver")),
      stages(read_list<StageParameters>(file.root().subsection("Stages"), "STAGE", common_scheme)),
      probes(read_list<ProbeParameters<dim>>(file.root().subsection("Probes"), "PROBE")),
      references(read_list<ReferenceParameters<dim>>(file.root().subsection("References"), "REFERENCE",
                                                     names(probes))),
      output(file.root().subsection("Output")), compare(file.root().subsection("Compare")),
      sweep(file.root().subsection("Sweep"))
{
  if (file.root().describing())
    return;
  file.refuse_unknown_entries();
  check(file.root());
  check_contacts();
  set_fall_velocities();
}

template <int dim>
void Case<dim>::check_contacts() const
{
  for (const auto &contact : contacts)
    if (method == Method::fem && !contact.law->ties())
      throw InputError(contact.origin,
                       "finite elements tie bodies where they meet, and have no other contact; "
                       "set 'Law = tied', or 'Method = mpm'");
  for (const auto &contact : contacts)
    for (const auto &body : bodies)
      if ((contact.first == body.name || contact.second == body.name) && !body.shape->is_distance())
        throw InputError(contact.origin, "contact '" + contact.name +
                                             "' needs to know where the surface of '" + body.name +
                                             "' is, which the shape 'inside' does not tell");
  for (const auto &body : bodies) {
    if (body.from_stage.empty())
      continue;
    const std::vector<std::string> known = names(stages);
    if (std::find(known.begin(), known.end(), body.from_stage) == known.end())
      body.section.fail("From stage", "there is no stage " + in_quotes(body.from_stage) +
                                          suggestion(body.from_stage, known));
    if (method == Method::fem && body.from_stage != stages.front().name)
      body.section.fail("From stage", "finite elements have all bodies from the start");
  }
}

template <int dim>
std::string Case<dim>::entry_stage(const BodyParameters<dim> &body) const
{
  return stages.empty() || body.from_stage == stages.front().name ? "" : body.from_stage;
}

template <int dim>
std::vector<std::size_t> Case<dim>::entering_bodies(const StageParameters &stage) const
{
  std::vector<std::size_t> entering;
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (entry_stage(bodies[b]) == stage.name)
      entering.push_back(b);
  return entering;
}

template <int dim>
void Case<dim>::set_fall_velocities()
{
  const auto fall_velocity = [&](const double height, const double time, const Section &where) {
    const double origin[3] = {0., 0., 0.};
    dealii::Tensor<1, dim> g;
    for (unsigned int d = 0; d < dim; ++d)
      g[d] = gravity.value(origin, time, d);
    if (g.norm() == 0.)
      where.fail("Fall height", "there is no gravity at t = " + to_text(time) + " s to fall in");
    return std::sqrt(2. * height / g.norm()) * g;
  };
  double first_motion = 0., start = 0.;
  for (const auto &stage : stages) {
    if (stage.solver != StageParameters::Solver::static_state) {
      first_motion = start;
      break;
    }
    start += stage.duration;
  }
  for (auto &body : bodies) {
    double entry = 0.;
    for (const auto &stage : stages) {
      if (stage.name == entry_stage(body))
        break;
      entry += entry_stage(body).empty() ? 0. : stage.duration;
    }
    if (body.fall_height > 0.)
      body.fall_velocity = fall_velocity(body.fall_height, entry, body.section);
  }
  for (auto &body : rigid_bodies)
    if (body.fall_height > 0.) {
      const auto v = fall_velocity(body.fall_height, first_motion, body.section);
      for (unsigned int d = 0; d < dim; ++d)
        body.initial_velocity[d] += body.is_free[d] ? v[d] : 0.;
    }
}

template <int dim>
void Case<dim>::check(const Section &root) const
{
  if (stages.empty())
    root.fail("", "the file has no stage: a section 'Stages' with one subsection a stage is needed");
  for (const auto &body : bodies) {
    const Mixture *mixture = material(body.material).mixture();
    if (!mixture && body.section.has("Initial pressure"))
      body.section.fail("Initial pressure", "body '" + body.name + "' is of the dry material '" +
                                                body.material + "' and has no pore pressure");
    if (!keeps_stress(material(body.material).law()) && !is_zero(body.initial_stress))
      body.section.fail("Initial stress",
                        "with the law of material '" + body.material +
                            "' stress follows from strain alone, and the body starts without strain; "
                            "use 'linear elastic' or 'jaumann'");
    if (!mixture || !scheme.seepage_inertia)
      continue;
    const double M = material(body.material).initial_modulus();
    if (mixture->well_posedness(M) <= 0.) {
      std::ostringstream message;
      const double r = mixture->r();
      message << "with material '" << body.material
              << "' the u-p form with seepage inertia is ill-posed: it needs "
              << "alpha^2 Q (1 - r) > r M, but "
              << std::pow(mixture->biot_coefficient(), 2) * mixture->Q() * (1. - r) << " < " << r * M
              << " Pa (r = alpha rho_f/rho); set 'Seepage inertia = false', or a stiffer fluid";
      root.subsection("Materials").subsection(body.material).fail("", message.str());
    }
  }
  check_schemes(root);
  for (const auto &stage : stages)
    if (method == Method::fem && stage.local_damping > 0.)
      root.subsection("Stages")
          .subsection(stage.name)
          .fail("Local damping", "damps explicit material points; finite elements do not have it");
  for (const auto &stage : stages)
    for (const auto &body : bodies)
      if (stage.K0 > 0. && !keeps_stress(material(body.material).law()))
        root.subsection("Stages")
            .subsection(stage.name)
            .fail("K0", "with the law of material '" + body.material +
                            "' stress follows from strain alone; use 'linear elastic' or 'jaumann'");
  if (method == Method::fem && !rigid_bodies.empty())
    rigid_bodies.front().section.fail(
        "", "rigid bodies act on material points by contact; finite elements do not "
            "have it");
  for (const auto &condition : conditions)
    if (condition->concerns_fluid() && !is_saturated())
      condition->section.fail("Kind", "condition '" + condition->name +
                                          "' is about pore fluid, but no body is saturated");
  for (const auto &condition : conditions)
    for (const auto &body : bodies)
      if (condition->concerns_fluid() && condition->surface_of() == body.name &&
          !material(body.material).mixture())
        condition->section.fail("Where", "condition '" + condition->name +
                                             "' is about pore fluid, but body '" + body.name + "' is dry");
  for (const auto &condition : conditions)
    for (unsigned int d = 0; d < dim; ++d)
      if (condition->ties(d) && !contacts.empty())
        condition->section.fail("Kind", "condition '" + condition->name +
                                            "' ties nodes, which does not go with 'Contacts'; a rigid body "
                                            "with one of its 'Free components' is a plate, too");
  constexpr double most_lines = 1e7;
  const Section section = root.subsection("Output");
  for (const auto &[key, interval] : {std::make_pair("Interval", output.interval),
                                      std::make_pair("Statistics interval", output.statistics_interval),
                                      std::make_pair("Probe interval", output.probe_interval)})
    if (interval > 0. && end_time() / interval > most_lines)
      section.fail(key, "in " + to_text(end_time()) + " s this makes more than 1e7 entries");
}

template <int dim>
std::string Case<dim>::why_not_semi_implicit() const
{
  if (!is_saturated())
    return "it is for saturated bodies, and there is none";
  if (!scheme.pressure_of_cells)
    return "it has one pressure a cell, but 'Explicit MPM/Pressure = point'";
  const Mixture *first = nullptr;
  for (const auto &body : bodies)
    if (const Mixture *mixture = material(body.material).mixture()) {
      if (first && mixture->biot_coefficient() != first->biot_coefficient())
        return "it needs the same 'Biot coefficient' in all saturated bodies; that of '" + body.name +
               "' differs";
      first = mixture;
    }
  return "";
}

template <int dim>
bool Case<dim>::concerns_rigid_body(const ContactParameters<dim> &contact) const
{
  return std::any_of(rigid_bodies.begin(), rigid_bodies.end(), [&](const auto &rigid) {
    return rigid.name == contact.first || rigid.name == contact.second;
  });
}

template <int dim>
std::string Case<dim>::why_not_implicit(const StageParameters &stage) const
{
  // Whether the force of an impact matters nobody but the user knows.
  if (stage.scheme == Scheme::automatic && (!contacts.empty() || !rigid_bodies.empty()))
    return "with 'Contacts' it is taken only where 'Scheme = implicit' asks for it";
  for (const auto &contact : contacts)
    if (!concerns_rigid_body(contact))
      return "it ties deformable bodies where they meet, and does not go with 'Contacts' between them, as '" +
             contact.name + "' is";
  if (std::max(scheme.local_damping, stage.local_damping) > 0.)
    return "it does not have 'Local damping'";
  if (scheme.grid_velocity || scheme.relaxation_time > 0.)
    return "it has no 'Transfer = pic' and no 'Relaxation time'";
  return "";
}

template <int dim>
std::string Case<dim>::why_not(const Scheme wanted, const StageParameters &stage) const
{
  if (wanted == Scheme::implicit)
    return why_not_implicit(stage);
  for (const auto &condition : conditions)
    if (condition->has_fluid_source())
      return "it knows no fluid sources, as condition '" + condition->name + "'";
  return wanted == Scheme::semi_implicit ? why_not_semi_implicit() : "";
}

template <int dim>
bool Case<dim>::may_have(const Scheme wanted) const
{
  return method == Method::mpm && std::any_of(stages.begin(), stages.end(), [&](const auto &stage) {
           return stage.solver == StageParameters::Solver::dynamic &&
                  (stage.scheme == wanted ||
                   (stage.scheme == Scheme::automatic && why_not(wanted, stage).empty()));
         });
}

template <int dim>
void Case<dim>::check_schemes(const Section &root) const
{
  if (method == Method::fem)
    return;
  for (const auto &stage : stages) {
    if (stage.solver != StageParameters::Solver::dynamic)
      continue;
    const Section own = root.subsection("Stages").subsection(stage.name);
    const Section where = own.has("Scheme") ? own : root;
    if (stage.scheme != Scheme::automatic) {
      const std::string reason = why_not(stage.scheme, stage);
      if (!reason.empty())
        where.fail("Scheme", in_quotes(name_of(stage.scheme)) + ": " + reason);
      continue;
    }
    std::string reasons;
    for (const Scheme one : {Scheme::explicit_steps, Scheme::semi_implicit, Scheme::implicit}) {
      const std::string reason = why_not(one, stage);
      if (reason.empty()) {
        reasons.clear();
        break;
      }
      reasons += (reasons.empty() ? "" : "; ") + in_quotes(name_of(one)) + ": " + reason;
    }
    if (!reasons.empty())
      where.fail("Scheme", "no scheme applies to stage " + in_quotes(stage.name) + ": " + reasons);
  }
  const Section section = root.subsection("Explicit MPM");
  if (!may_have(Scheme::semi_implicit))
    for (const char *key : {"Pressure stabilisation", "Pressure tolerance"})
      if (section.has(key))
        section.fail(key, "is for 'Scheme = semi-implicit'");
}

template <int dim>
bool Case<dim>::is_implicit() const
{
  return method == Method::fem || may_have(Scheme::implicit) ||
         std::any_of(stages.begin(), stages.end(),
                     [](const auto &stage) { return stage.solver != StageParameters::Solver::dynamic; });
}

template <int dim>
SchemeFields Case<dim>::fields() const
{
  if (method == Method::fem)
    return gauss_fields();
  SchemeFields fields = scheme.fields();
  fields.surface_depth = !contacts.empty();
  fields.pressure_rate = may_have(Scheme::semi_implicit);
  return fields;
}

template <int dim>
SchemeFields Case<dim>::gauss_fields() const
{
  SchemeFields fields;
  fields.gauss_points = static_cast<unsigned int>(implicit.element);
  return fields;
}

template <int dim>
Nodes Case<dim>::displacement_nodes() const
{
  if (method == Method::fem)
    return implicit.element;
  return scheme.basis == Basis::gimp ? Nodes::gimp : Nodes::q1;
}

template <int dim>
const Material &Case<dim>::material(const std::string &name) const
{
  for (const auto &material : materials)
    if (material->name() == name)
      return *material;
  throw InputError("there is no material '" + name + "'");
}

template <int dim>
bool Case<dim>::is_saturated() const
{
  for (const auto &body : bodies)
    if (material(body.material).mixture())
      return true;
  return false;
}

template <int dim>
double Case<dim>::end_time() const
{
  double end = 0.;
  for (const auto &stage : stages)
    end += stage.duration;
  return end;
}

template struct Case<2>;
template struct Case<3>;
} // namespace peat
