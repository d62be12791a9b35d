#include <peat/simulation/probes.h>

#include <peat/base/nan.h>
#include <peat/simulation/projection.h>
#include <peat/simulation/table.h>

#include <deal.II/base/mpi.h>

#include <cmath>
#include <iomanip>

namespace peat {
namespace {
/// A probe touches a cell that is so near [cell sizes].
constexpr double touching = 1e-6;
const std::vector<std::string> axis_names = {"x", "y", "z"};

void sum_over_ranks(std::vector<double> &data, MPI_Comm communicator)
{
  if (dealii::Utilities::MPI::n_mpi_processes(communicator) == 1)
    return;
  const int ierr = MPI_Allreduce(MPI_IN_PLACE, data.data(), data.size(), MPI_DOUBLE, MPI_SUM, communicator);
  AssertThrowMPI(ierr);
}
} // namespace

template <int dim>
ProbeWriter<dim>::ProbeWriter(const Case<dim> &parameters, const Scene<dim> &scene, const Grid<dim> &grid,
                              const std::string &file_name)
    : scene(scene), grid(grid), last_time(nan)
{
  for (const auto &probe : parameters.probes)
    probes.push_back({probe.name, probe.point, probe.follow,
                      scene.body_at(probe.point, touching * grid.smallest_cell_size())});
  choose_fields(parameters);
  values.assign(probes.size() * (dim + fields.size()), nan);
  std::string problem;
  if (!probes.empty() && dealii::Utilities::MPI::this_mpi_process(grid.communicator()) == 0)
    try {
      file = GrowingFile(file_name);
    } catch (const InputError &error) {
      problem = error.what();
    }
  problem = dealii::Utilities::MPI::broadcast(grid.communicator(), problem);
  if (!problem.empty())
    throw InputError(problem);
}

template <int dim>
void ProbeWriter<dim>::choose_fields(const Case<dim> &parameters)
{
  for (const std::string name : {"displacement ", "velocity "})
    for (unsigned int d = 0; d < dim; ++d)
      fields.push_back(name + axis_names[d]);
  if (scene.is_saturated())
    fields.push_back("pressure");
  for (const std::string name : {"xx", "yy", "zz", "xy", "yz", "zx"})
    if (dim == 3 || (name != "yz" && name != "zx"))
      fields.push_back("effective stress " + name);
  for (const auto &reference : parameters.references)
    if (reference.kind == ReferenceParameters<dim>::Kind::history &&
        std::find(fields.begin(), fields.end(), reference.field) == fields.end())
      fields.push_back(reference.field);

  units.assign(fields.size(), "");
  for (const auto &body : scene.bodies) {
    access.emplace_back();
    for (std::size_t f = 0; f < fields.size(); ++f) {
      access.back().emplace_back(fields[f], body->layout(), body->material());
      if (access.back().back().available())
        units[f] = access.back().back().unit();
    }
  }
}

template <int dim>
void ProbeWriter<dim>::write_header()
{
  std::ostream &out = file.lines();
  out << "time [s]";
  for (const Probe &probe : probes) {
    for (unsigned int d = 0; d < dim; ++d)
      out << ',' << csv_entry(probe.name + '/' + axis_names[d] + " [m]");
    for (std::size_t f = 0; f < fields.size(); ++f)
      out << ','
          << csv_entry(probe.name + '/' + fields[f] + " [" + (units[f].empty() ? "-" : units[f]) + ']');
  }
  out << std::endl;
}

template <int dim>
void ProbeWriter<dim>::write(const double time)
{
  last_time = time;
  if (probes.empty())
    return;
  const std::vector<double> places = find_places();
  const std::vector<double> sums = sum_moments(places);
  const std::size_t n_values = dim + fields.size();
  for (std::size_t p = 0; p < probes.size(); ++p)
    evaluate(probes[p], &places[p * n_place], &sums[p * scene.bodies.size() * block_size()],
             &values[p * n_values]);

  if (!file.is_open())
    return;
  if (file.is_new())
    write_header();
  std::ostream &out = file.lines();
  out << std::setprecision(12) << time << std::setprecision(10);
  for (const double value : values) {
    out << ',';
    if (std::isfinite(value))
      out << value;
  }
  out << std::endl;
}

template <int dim>
std::vector<double> ProbeWriter<dim>::find_places() const
{
  std::vector<double> places(probes.size() * n_place, 0.);
  const auto put = [&](const std::size_t p, const dealii::Point<dim> &x) {
    places[p * n_place] = 1.;
    for (unsigned int d = 0; d < dim; ++d) {
      places[p * n_place + 1 + d] = x[d];
      places[p * n_place + 1 + dim + d] = x[d] - probes[p].start[d];
    }
  };
  if (scene.probes)
    for (const auto &tracer : scene.probes->tracers())
      if (probes[tracer.id].follows)
        put(tracer.id, tracer.position);
  if (dealii::Utilities::MPI::this_mpi_process(grid.communicator()) == 0)
    for (std::size_t p = 0; p < probes.size(); ++p)
      if (!probes[p].follows)
        put(p, probes[p].start);
  sum_over_ranks(places, grid.communicator());
  return places;
}

template <int dim>
std::size_t ProbeWriter<dim>::block_size() const
{
  return 1 + LinearFit<dim>::n_moments + fields.size() * (1 + dim);
}

template <int dim>
std::vector<double> ProbeWriter<dim>::sum_moments(const std::vector<double> &places) const
{
  const std::size_t n_bodies = scene.bodies.size();
  std::vector<double> sums(probes.size() * n_bodies * block_size(), 0.);
  for (std::size_t p = 0; p < probes.size(); ++p) {
    const double *place = &places[p * n_place];
    if (place[0] == 0.)
      continue;
    dealii::Point<dim> x;
    dealii::Tensor<1, dim> size;
    std::array<int, dim> first, last;
    for (unsigned int d = 0; d < dim; ++d)
      x[d] = place[1 + d];
    const auto lattice = grid.locate(x);
    for (unsigned int d = 0; d < dim; ++d) {
      const auto &planes = grid.planes(d);
      size[d] = planes[lattice[d] + 1] - planes[lattice[d]];
      first[d] = last[d] = lattice[d];
      while (first[d] > 0 && planes[first[d]] > x[d] - LinearFit<dim>::reach * size[d])
        --first[d];
      while (last[d] < grid.n_cells(d) - 1 && planes[last[d] + 1] < x[d] + LinearFit<dim>::reach * size[d])
        ++last[d];
    }
    for (auto at = first; at[dim - 1] <= last[dim - 1];) {
      const CellId cell = grid.cell_at(at);
      if (cell != no_index && grid.is_owned(cell))
        for (std::size_t b = 0; b < n_bodies; ++b)
          add_cell(cell, x, size, b, &sums[(p * n_bodies + b) * block_size()]);
      unsigned int d = 0;
      while (++at[d] > last[d] && d + 1 < dim) {
        at[d] = first[d];
        ++d;
      }
    }
  }
  sum_over_ranks(sums, grid.communicator());
  return sums;
}

template <int dim>
void ProbeWriter<dim>::add_cell(const CellId cell, const dealii::Point<dim> &x,
                                const dealii::Tensor<1, dim> &size, const unsigned int b, double *sums) const
{
  const Body<dim> &body = *scene.bodies[b];
  const auto &slices = body.slices();
  const auto slice = std::lower_bound(slices.begin(), slices.end(), cell,
                                      [](const Slice &s, const CellId id) { return s.cell < id; });
  if (slice == slices.end() || slice->cell != cell)
    return;
  double volume = 0.;
  dealii::Point<dim> centroid;
  std::vector<double> means(fields.size(), 0.);
  integrate(body, *slice, access[b], volume, centroid, means.data());
  centroid /= volume;

  bool touches = true;
  for (unsigned int d = 0; d < dim; ++d)
    touches = touches && x[d] >= grid.lower(cell, d) - touching * size[d] &&
              x[d] <= grid.lower(cell, d) + grid.size(cell, d) + touching * size[d];
  if (touches)
    sums[0] += volume;
  dealii::Tensor<1, dim> distance = centroid - x;
  for (unsigned int d = 0; d < dim; ++d)
    distance[d] /= size[d];
  const double weight = LinearFit<dim>::weight(distance);
  if (weight == 0.)
    return;
  LinearFit<dim>::add(weight * volume, distance, ++sums);
  sums += LinearFit<dim>::n_moments;
  for (const double mean : means) {
    *sums++ += weight * mean;
    for (unsigned int d = 0; d < dim; ++d)
      *sums++ += weight * mean * distance[d];
  }
}

template <int dim>
int ProbeWriter<dim>::choose_body(const Probe &probe, const double *sums) const
{
  const auto block = [&](const std::size_t b) { return sums + b * block_size(); };
  // Material that a probe follows may have left the cell by the tracer's own error.
  if (probe.follows && probe.home >= 0 && block(probe.home)[1] > 0.)
    return probe.home;
  int best = -1;
  double most = 0.;
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    if (block(b)[0] > most && block(b)[1] > 0.) {
      most = block(b)[0];
      best = b;
    }
  return best;
}

template <int dim>
void ProbeWriter<dim>::evaluate(const Probe &probe, const double *place, const double *sums,
                                double *result) const
{
  std::fill_n(result, dim + fields.size(), nan);
  if (place[0] == 0.)
    return;
  std::copy_n(place + 1, dim, result);
  const int b = choose_body(probe, sums);
  if (b >= 0) {
    const double *moments = sums + b * block_size() + 1;
    const auto c = LinearFit<dim>::coefficients(moments);
    const double *data = moments + LinearFit<dim>::n_moments;
    for (std::size_t f = 0; f < fields.size(); ++f, data += 1 + dim)
      if (access[b][f].available()) {
        double value = 0.;
        for (unsigned int k = 0; k < 1 + dim; ++k)
          value += c[k] * data[k];
        result[dim + f] = value;
      }
  }
  if (probe.follows)
    std::copy_n(place + 1 + dim, dim, result + dim);
}

template <int dim>
double ProbeWriter<dim>::value(const std::string &probe, const std::string &field) const
{
  const auto p = std::find_if(probes.begin(), probes.end(), [&](const Probe &q) { return q.name == probe; });
  if (p == probes.end())
    return nan;
  const double *row = &values[(p - probes.begin()) * (dim + fields.size())];
  for (unsigned int d = 0; d < dim; ++d)
    if (field == axis_names[d])
      return row[d];
  const auto f = std::find(fields.begin(), fields.end(), field);
  return f == fields.end() ? nan : row[dim + (f - fields.begin())];
}

template class ProbeWriter<2>;
template class ProbeWriter<3>;
} // namespace peat
