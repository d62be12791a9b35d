#include <peat/simulation/fields.h>

#include <peat/base/text.h>

#include <cmath>

namespace peat {
namespace {
struct NamedField
{
  std::string name;
  std::string unit;
  std::function<double(const double *)> get;
};

std::vector<std::string> component_names(const Layout::Field &field)
{
  static const std::vector<std::string> axes = {"x", "y", "z"}, pairs = {"xx", "yy", "zz", "xy", "yz", "zx"};
  std::vector<std::string> names;
  for (unsigned int c = 0; c < field.n_components; ++c)
    switch (field.kind) {
    case Layout::Kind::scalar:
      names.push_back(field.name);
      break;
    case Layout::Kind::vector:
      names.push_back(field.name + " " + axes[c]);
      break;
    case Layout::Kind::stress:
      names.push_back(field.name + " " + pairs[c]);
      break;
    case Layout::Kind::other:
      names.push_back(field.name + " " +
                      (field.n_components == 9 ? std::to_string(c / 3 + 1) + std::to_string(c % 3 + 1)
                                               : std::to_string(c + 1)));
      break;
    }
  return names;
}

void add_stored(std::vector<NamedField> &list, const Layout &layout)
{
  for (const Layout::Field &field : layout.fields) {
    int column = field.first_column;
    for (const std::string &name : component_names(field)) {
      list.push_back({name, field.unit, [column](const double *row) { return row[column]; }});
      ++column;
    }
  }
}

void add_stresses(std::vector<NamedField> &list, const Layout &layout, const Material &material)
{
  Layout::Field total = *layout.find("effective stress");
  total.name = "total stress";
  const int s = layout.stress, p = layout.pressure;
  unsigned int component = 0;
  for (const std::string &name : component_names(total)) {
    const int column = s + component;
    if (p < 0 || component >= 3)
      list.push_back({name, total.unit, [=](const double *row) { return row[column]; }});
    else {
      const double alpha = material.mixture()->biot_coefficient();
      list.push_back({name, total.unit, [=](const double *row) { return row[column] - alpha * row[p]; }});
    }
    ++component;
  }
  list.push_back({"mean effective stress", total.unit,
                  [=](const double *row) { return (row[s] + row[s + 1] + row[s + 2]) / 3.; }});
}

void add_other(std::vector<NamedField> &list, const Layout &layout, const Material &material)
{
  const int mass = layout.mass, volume = layout.volume, v = layout.velocity;
  const int dim = layout.find("velocity")->n_components;
  list.push_back({"density", "kg/m^3", [=](const double *row) { return row[mass] / row[volume]; }});
  list.push_back({"speed", "m/s", [=](const double *row) {
                    return std::sqrt(row[v] * row[v] + row[v + 1] * row[v + 1] +
                                     (dim == 3 ? row[v + 2] * row[v + 2] : 0.));
                  }});
  if (material.mixture() && layout.porosity < 0) {
    const double n = material.mixture()->porosity();
    list.push_back({"porosity", "", [n](const double *) { return n; }});
  }
}

std::vector<NamedField> all_fields(const Layout &layout, const Material &material)
{
  std::vector<NamedField> list;
  add_stored(list, layout);
  add_stresses(list, layout, material);
  add_other(list, layout, material);
  return list;
}
} // namespace

FieldAccess::FieldAccess(const std::string &name, const Layout &layout, const Material &material)
{
  for (NamedField &field : all_fields(layout, material))
    if (field.name == name) {
      unit_text = field.unit;
      get = std::move(field.get);
      return;
    }
}

std::vector<std::string> FieldAccess::names(const Layout &layout, const Material &material)
{
  std::vector<std::string> result;
  for (const NamedField &field : all_fields(layout, material))
    result.push_back(field.name);
  return result;
}

template <int dim>
void require_field(const Case<dim> &parameters, const std::string &body, const std::string &field,
                   const Section &section, const std::string &key)
{
  std::vector<std::string> known, bodies;
  for (const auto &candidate : parameters.bodies) {
    bodies.push_back(candidate.name);
    if (!body.empty() && candidate.name != body)
      continue;
    const Material &material = parameters.material(candidate.material);
    for (const std::string &name : FieldAccess::names(Layout(dim, material, parameters.fields()), material))
      if (std::find(known.begin(), known.end(), name) == known.end())
        known.push_back(name);
  }
  if (known.empty())
    section.fail("Body", "there is no body " + in_quotes(body) + suggestion(body, bodies));
  if (std::find(known.begin(), known.end(), field) == known.end())
    section.fail(key, (body.empty() ? "no body" : "body " + in_quotes(body)) +
                          (body.empty() ? " has a field " : " has no field ") + in_quotes(field) +
                          suggestion(field, known));
}

namespace {
/// Cells in which any of the bodies has points, ascending.
template <int dim>
std::vector<CellId> occupied_cells(const std::vector<const Body<dim> *> &bodies)
{
  std::vector<CellId> cells;
  for (const Body<dim> *body : bodies)
    for (const Slice &slice : body->slices())
      cells.push_back(slice.cell);
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

} // namespace

template <int dim>
void integrate(const Body<dim> &body, const Slice &slice, const std::vector<FieldAccess> &fields,
               double &volume, dealii::Point<dim> &moment, double *sums)
{
  for (std::uint32_t k = slice.begin; k < slice.end; ++k) {
    const std::uint32_t handle = body.handles()[k];
    const double *row = body.row(handle);
    const double V = row[body.layout().volume];
    volume += V;
    moment += V * body.position(handle);
    for (std::size_t f = 0; f < fields.size(); ++f)
      if (fields[f].available())
        sums[f] += V * fields[f](row);
  }
}

template <int dim>
CellMeans<dim> cell_means(const std::vector<const Body<dim> *> &bodies,
                          const std::vector<std::string> &fields)
{
  std::vector<const Body<dim> *> chosen;
  std::vector<std::vector<FieldAccess>> accesses;
  for (const Body<dim> *body : bodies) {
    std::vector<FieldAccess> access;
    bool complete = true;
    for (const std::string &name : fields) {
      access.emplace_back(name, body->layout(), body->material());
      complete = complete && access.back().available();
    }
    if (complete) {
      chosen.push_back(body);
      accesses.push_back(std::move(access));
    }
  }

  CellMeans<dim> means;
  means.n_fields = fields.size();
  means.cell = occupied_cells(chosen);
  means.volume.assign(means.size(), 0.);
  means.centroid.assign(means.size(), dealii::Point<dim>());
  means.values.assign(means.size() * fields.size(), 0.);
  for (std::size_t b = 0; b < chosen.size(); ++b) {
    std::size_t entry = 0; // slices are in ascending order of cells, too
    for (const Slice &slice : chosen[b]->slices()) {
      while (means.cell[entry] < slice.cell)
        ++entry;
      integrate(*chosen[b], slice, accesses[b], means.volume[entry], means.centroid[entry],
                means.values.data() + entry * fields.size());
    }
  }
  for (std::size_t entry = 0; entry < means.size(); ++entry) {
    means.centroid[entry] /= means.volume[entry];
    for (std::size_t f = 0; f < fields.size(); ++f)
      means.values[entry * fields.size() + f] /= means.volume[entry];
  }
  return means;
}

#define PEAT_INSTANTIATE(dim)                                                                                \
  template void require_field<dim>(const Case<dim> &, const std::string &, const std::string &,              \
                                   const Section &, const std::string &);                                    \
  template void integrate<dim>(const Body<dim> &, const Slice &, const std::vector<FieldAccess> &, double &, \
                               dealii::Point<dim> &, double *);                                              \
  template CellMeans<dim> cell_means<dim>(const std::vector<const Body<dim> *> &,                            \
                                          const std::vector<std::string> &);
PEAT_INSTANTIATE(2)
PEAT_INSTANTIATE(3)
#undef PEAT_INSTANTIATE
} // namespace peat
