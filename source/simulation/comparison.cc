#include <peat/simulation/comparison.h>

#include <peat/base/nan.h>
#include <peat/base/text.h>

#include <deal.II/base/mpi.h>

#include <cmath>
#include <filesystem>
#include <iomanip>

namespace peat {
namespace {
/// How far beyond its ends a table counts, as a share of its length.
constexpr double table_tolerance = 1e-6;

template <int dim>
bool is_history(const ReferenceParameters<dim> &reference)
{
  return reference.kind == ReferenceParameters<dim>::Kind::history;
}

bool reaches(const Curve &curve, const double x)
{
  const double tolerance = table_tolerance * (curve.upper() - curve.lower());
  return x >= curve.lower() - tolerance && x <= curve.upper() + tolerance;
}

/// The columns of displacement in a list of fields, added to it if they are needed to find places at the
/// start.
template <int dim>
std::vector<std::string> fields_for(const std::string &field)
{
  std::vector<std::string> fields = {field};
  if (field.rfind("displacement ", 0) == 0)
    for (unsigned int d = 0; d < dim; ++d)
      fields.push_back(std::string("displacement ") + "xyz"[d]);
  return fields;
}

template <int dim>
std::vector<const Body<dim> *> chosen_bodies(const Scene<dim> &scene, const std::string &name)
{
  std::vector<const Body<dim> *> bodies;
  for (const auto &body : scene.bodies)
    if (name.empty() || body->name() == name)
      bodies.push_back(body.get());
  return bodies;
}

/// Takes one value into the sums of which norms are made; L1 and L2 hold sum V |e| and sum V e^2 until
/// finish().
template <int dim>
void accumulate(typename Comparison<dim>::Norms &norms, const double V, const double value,
                const double reference, const dealii::Point<dim> &x)
{
  if (std::isnan(reference) || std::isnan(value)) {
    ++norms.n_outside;
    return;
  }
  const double e = std::abs(value - reference);
  norms.weight += V;
  norms.L1 += V * e;
  norms.L2 += V * e * e;
  norms.largest_reference = std::max(norms.largest_reference, std::abs(reference));
  if (++norms.n == 1 || e > norms.Linf) {
    norms.Linf = e;
    norms.worst_time = norms.time;
    norms.worst_place = x;
    norms.worst_value = value;
    norms.worst_reference = reference;
  }
}

/// Takes the sums of others, e.g. other ranks or times, into these.
template <int dim>
void merge(typename Comparison<dim>::Norms &sums, const typename Comparison<dim>::Norms &other)
{
  sums.weight += other.weight;
  sums.L1 += other.L1;
  sums.L2 += other.L2;
  sums.largest_reference = std::max(sums.largest_reference, other.largest_reference);
  sums.n_outside += other.n_outside;
  if (other.n > 0 && (sums.n == 0 || other.Linf > sums.Linf)) {
    sums.Linf = other.Linf;
    sums.worst_time = other.worst_time;
    sums.worst_place = other.worst_place;
    sums.worst_value = other.worst_value;
    sums.worst_reference = other.worst_reference;
  }
  sums.n += other.n;
}

template <int dim>
void finish(typename Comparison<dim>::Norms &sums)
{
  sums.L1 = sums.n > 0 ? sums.L1 / sums.weight : nan;
  sums.L2 = sums.n > 0 ? std::sqrt(sums.L2 / sums.weight) : nan;
  sums.Linf = sums.n > 0 ? sums.Linf : nan;
}

template <int dim>
typename Comparison<dim>::Norms merge_ranks(const typename Comparison<dim>::Norms &mine,
                                            MPI_Comm communicator)
{
  using Norms = typename Comparison<dim>::Norms;
  static_assert(std::is_trivially_copyable<Norms>::value, "sent as bytes");
  std::vector<Norms> all(dealii::Utilities::MPI::n_mpi_processes(communicator));
  const int ierr =
      MPI_Allgather(&mine, sizeof(Norms), MPI_BYTE, all.data(), sizeof(Norms), MPI_BYTE, communicator);
  AssertThrowMPI(ierr);
  Norms sums = all.front();
  for (std::size_t rank = 1; rank < all.size(); ++rank)
    merge<dim>(sums, all[rank]);
  return sums;
}
} // namespace

template <int dim>
Comparison<dim>::Comparison(const Case<dim> &parameters, const std::string &directory)
    : finite_elements(parameters.method == Method::fem), time_tolerance(1e-9 * parameters.end_time())
{
  for (const ReferenceParameters<dim> &given : parameters.references) {
    require_field(parameters, given.body, given.field, given.section, "Field");
    Reference reference;
    reference.parameters = &given;
    for (const auto &body : parameters.bodies) {
      const Material &material = parameters.material(body.material);
      const FieldAccess access(given.field, Layout(dim, material, parameters.fields()), material);
      reference.unit = access.available() ? access.unit() : reference.unit;
    }
    if (given.kind != ReferenceParameters<dim>::Kind::formula)
      read_table(reference, directory, parameters);
    if (is_history(given) && given.start >= parameters.end_time())
      given.section.fail("Start", "reference '" + given.name +
                                      "' is to be compared from t = " + to_text(given.start) +
                                      " s on, but the run ends at " + to_text(parameters.end_time()) + " s");
    if (is_history(given)) {
      for (const auto &probe : parameters.probes)
        reference.place = probe.name == given.probe ? probe.point : reference.place;
    } else
      reference.times = given.times.empty() ? std::vector<double>{parameters.end_time()} : given.times;
    for (const double time : reference.times) {
      if (time > parameters.end_time() + time_tolerance)
        given.section.fail("Times", "reference '" + given.name +
                                        "' is to be compared at t = " + to_text(time) +
                                        " s, but the run ends at " + to_text(parameters.end_time()) + " s");
      all_times.push_back(time);
    }
    references.push_back(std::move(reference));
  }
  std::sort(all_times.begin(), all_times.end());
  const auto same = [&](const double a, const double b) { return b - a <= time_tolerance; };
  all_times.erase(std::unique(all_times.begin(), all_times.end(), same), all_times.end());
}

template <int dim>
void Comparison<dim>::read_table(Reference &reference, const std::string &directory,
                                 const Case<dim> &parameters) const
{
  const ReferenceParameters<dim> &given = *reference.parameters;
  const double lower = is_history(given) ? given.start : parameters.grid.lower[given.axis];
  const double upper = is_history(given) ? parameters.end_time() : parameters.grid.upper[given.axis];
  const std::filesystem::path path(given.file);
  const std::string file =
      path.is_absolute() ? given.file : (std::filesystem::path(directory) / path).string();
  const auto read = [&] {
    try {
      return Table(file);
    } catch (const InputError &error) {
      given.section.fail("File", error.what());
    }
  };
  const Table table = read();
  const std::string coordinate = given.coordinate.empty() ? table.names().front() : given.coordinate;
  const auto require = [&](const std::string &key, const std::string &column) {
    if (!table.has(column))
      given.section.fail(key, "table '" + file + "' has no column " + in_quotes(column) +
                                  suggestion(column, table.names()));
  };
  require("Coordinate", coordinate);
  if (is_history(given) && given.columns.size() != 1)
    given.section.fail("Columns", "a history is compared with one column");
  for (const std::string &column : given.columns) {
    require("Columns", column);
    reference.curves.emplace_back(table.column(coordinate), table.column(column));
    const Curve &curve = reference.curves.back();
    if (curve.empty())
      given.section.fail("Columns", "table '" + file + "' has no numbers in column " + in_quotes(column));
    if (curve.upper() < lower || curve.lower() > upper)
      given.section.fail(given.coordinate.empty() ? "File" : "Coordinate",
                         "nothing is compared: table '" + file + "' goes from " + to_text(curve.lower()) +
                             " to " + to_text(curve.upper()) + ", the " +
                             (is_history(given) ? "run" : "mesh") + " from " + to_text(lower) + " to " +
                             to_text(upper));
  }
}

template <int dim>
double Comparison<dim>::expected(const Reference &reference, const Curve *curve, const dealii::Point<dim> &x,
                                 const double time) const
{
  if (curve) {
    const double coordinate = x[reference.parameters->axis];
    return reaches(*curve, coordinate) ? curve->value(coordinate) : nan;
  }
  double place[3] = {0., 0., 0.};
  for (unsigned int d = 0; d < dim; ++d)
    place[d] = x[d];
  return reference.parameters->formula.value(place, time);
}

template <int dim>
void Comparison<dim>::compare(const double time, const Scene<dim> &scene, MPI_Comm communicator)
{
  for (Reference &reference : references)
    for (std::size_t k = 0; k < reference.times.size(); ++k) {
      const bool is_done = std::any_of(reference.done.begin(), reference.done.end(),
                                       [&](const Norms &norms) { return norms.time == reference.times[k]; });
      if (is_done || std::abs(reference.times[k] - time) > time_tolerance)
        continue;
      const Curve *curve = reference.curves.empty() ? nullptr : &reference.curves[k];
      const bool points = finite_elements || (reference.parameters->single_points && !curve);
      const Norms mine = points ? compare_points(reference, curve, reference.times[k], scene)
                                : compare_cells(reference, curve, reference.times[k], scene);
      reference.done.push_back(merge_ranks<dim>(mine, communicator));
    }
}

template <int dim>
typename Comparison<dim>::Norms Comparison<dim>::compare_cells(const Reference &reference, const Curve *curve,
                                                               const double time,
                                                               const Scene<dim> &scene) const
{
  Norms norms;
  norms.time = time;
  const CellMeans<dim> means = cell_means(chosen_bodies(scene, reference.parameters->body),
                                          fields_for<dim>(reference.parameters->field));
  for (std::size_t e = 0; e < means.size(); ++e) {
    dealii::Point<dim> x = means.centroid[e];
    for (unsigned int d = 0; d + 1 < means.n_fields; ++d)
      x[d] -= means.value(e, 1 + d);
    accumulate<dim>(norms, means.volume[e], means.value(e, 0), expected(reference, curve, x, time),
                    means.centroid[e]);
  }
  return norms;
}

template <int dim>
typename Comparison<dim>::Norms Comparison<dim>::compare_points(const Reference &reference,
                                                                const Curve *curve, const double time,
                                                                const Scene<dim> &scene) const
{
  Norms norms;
  norms.time = time;
  const bool at_start = fields_for<dim>(reference.parameters->field).size() > 1;
  for (const Body<dim> *body : chosen_bodies(scene, reference.parameters->body)) {
    const FieldAccess access(reference.parameters->field, body->layout(), body->material());
    if (!access.available())
      continue;
    for (const std::uint32_t handle : body->handles()) {
      const double *row = body->row(handle);
      dealii::Point<dim> x = body->position(handle);
      for (unsigned int d = 0; d < dim && at_start; ++d)
        x[d] -= row[body->layout().displacement + d];
      accumulate<dim>(norms, row[body->layout().volume], access(row), expected(reference, curve, x, time),
                      body->position(handle));
    }
  }
  return norms;
}

template <int dim>
void Comparison<dim>::compare(const ProbeWriter<dim> &probes)
{
  const double time = probes.time();
  for (Reference &reference : references) {
    const ReferenceParameters<dim> &given = *reference.parameters;
    if (!is_history(given) || time < given.start - time_tolerance)
      continue;
    const Curve &curve = reference.curves.front();
    const double value = probes.value(given.probe, given.field);
    if (std::isnan(value) || !reaches(curve, time))
      ++reference.n_outside;
    else if (reference.samples.empty() || time > reference.samples.back()[0])
      reference.samples.push_back({time, value, curve.value(time)});
  }
}

/// For each time; of a history one.
template <int dim>
std::vector<typename Comparison<dim>::Norms> Comparison<dim>::norms(const Reference &reference) const
{
  if (!is_history(*reference.parameters))
    return reference.done;
  const auto &samples = reference.samples;
  Norms norms;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const auto &[time, value, expected] = samples[k];
    norms.time = time;
    const double before = k > 0 ? samples[k - 1][0] : time,
                 after = k + 1 < samples.size() ? samples[k + 1][0] : time;
    const double weight = samples.size() == 1 ? 1. : 0.5 * (after - before);
    accumulate<dim>(norms, weight, value, expected, reference.place);
  }
  norms.n_outside += reference.n_outside;
  return {norms};
}

template <int dim>
typename Comparison<dim>::Result Comparison<dim>::result(const Reference &reference) const
{
  Result result;
  result.reference = reference.parameters->name;
  result.field = reference.parameters->field;
  result.unit = reference.unit;
  for (const Norms &one : norms(reference)) {
    merge<dim>(result.norms, one);
    result.norms.time = one.time;
  }
  finish<dim>(result.norms);
  result.scale =
      reference.parameters->scale > 0. ? reference.parameters->scale : result.norms.largest_reference;
  result.relative_L1 = result.norms.L1 / result.scale;
  result.relative_L2 = result.norms.L2 / result.scale;
  result.relative_Linf = result.norms.Linf / result.scale;
  return result;
}

template <int dim>
std::vector<typename Comparison<dim>::Result> Comparison<dim>::results() const
{
  std::vector<Result> list;
  for (const Reference &reference : references)
    list.push_back(result(reference));
  return list;
}

template <int dim>
void Comparison<dim>::write_errors(const std::string &file_name) const
{
  std::ofstream file(file_name);
  file << "reference,time [s],L2,Linf,relative L2,relative Linf,n\n" << std::setprecision(10);
  for (const Reference &reference : references) {
    const double scale = result(reference).scale;
    for (Norms one : norms(reference)) {
      finish<dim>(one);
      file << csv_entry(reference.parameters->name) << ',' << one.time << ',' << one.L2 << ',' << one.Linf
           << ',' << one.L2 / scale << ',' << one.Linf / scale << ',' << one.n << '\n';
    }
  }
  if (!file)
    throw NumericalError("cannot write '" + file_name + "'");
}

template <int dim>
void Comparison<dim>::persist(Archive &archive)
{
  archive.begin("comparison");
  for (Reference &reference : references)
    archive(reference.done, reference.samples, reference.n_outside);
}

template class Comparison<2>;
template class Comparison<3>;
} // namespace peat
