#include <peat/simulation/statistics.h>

#include <peat/simulation/table.h>

namespace peat {
namespace {
template <typename Vector>
void append(std::vector<double> &row, const Vector &vector)
{
  for (unsigned int d = 0; d < Vector::dimension; ++d)
    row.push_back(vector[d]);
}

/// The columns of a rigid body.
template <int dim>
std::vector<std::string> rigid_columns(const std::string &name)
{
  std::vector<std::string> columns;
  const auto add = [&](const std::string &quantity, const std::string &unit, const bool is_rotational) {
    const unsigned int n = is_rotational && dim == 2 ? 1 : dim;
    for (unsigned int d = 0; d < n; ++d)
      columns.push_back(name + '/' + quantity + (n == 1 ? "" : std::string(" ") + "xyz"[d]) + " [" + unit +
                        ']');
  };
  add("position", "m", false);
  add("velocity", "m/s", false);
  add("rotation", "rad", true);
  add("spin", "rad/s", true);
  add("force", "N", false);
  add("moment", "N m", true);
  return columns;
}

template <int dim>
std::vector<double> rigid_row(const RigidBody<dim> &body)
{
  std::vector<double> row;
  append(row, body.center());
  append(row, body.velocity());
  append(row, body.rotation_vector());
  append(row, body.spin());
  append(row, body.last_force);
  append(row, body.last_moment);
  return row;
}

template <int dim>
std::vector<std::string> contact_columns(const std::string &name)
{
  std::vector<std::string> columns;
  for (unsigned int d = 0; d < dim; ++d)
    columns.push_back(name + "/force " + "xyz"[d] + " [N]");
  columns.push_back(name + "/normal force [N]");
  columns.push_back(name + "/area [m^" + std::to_string(dim - 1) + ']');
  columns.push_back(name + "/gap [m]");
  return columns;
}

/// Of a stage whose solver knows no contact: no force, and no gap.
template <int dim>
std::vector<double> contact_row(const Scene<dim> &scene, const std::string &name)
{
  const auto found = scene.contact_states.find(name);
  const ContactState<dim> state = found == scene.contact_states.end() ? ContactState<dim>() : found->second;
  std::vector<double> row;
  append(row, state.force);
  row.insert(row.end(), {state.normal_force, state.area,
                         std::isfinite(state.gap) ? state.gap : std::numeric_limits<double>::quiet_NaN()});
  return row;
}
} // namespace

template <int dim>
Statistics<dim>::Statistics(const std::string &directory, const Scene<dim> &scene, const bool is_first_rank)
    : scene(scene), file(is_first_rank ? GrowingFile(directory + "/statistics.csv") : GrowingFile())
{}

template <int dim>
void Statistics<dim>::write_header()
{
  std::ostream &out = file.lines();
  out << "time [s],step,dt [s],binding limit,mass [kg],kinetic energy [J],elastic energy [J],fluid energy "
         "[J],"
         "external work [J],gravity work [J],seepage dissipation [J],contact dissipation [J],numerical "
         "dissipation [J],fluid "
         "outflow [m^"
      << dim << "],largest speed [m/s]";
  const char axes[] = "xyz";
  for (const std::string quantity : {"momentum", "impulse", "center"})
    for (unsigned int d = 0; d < dim; ++d)
      out << ',' << quantity << ' ' << axes[d] << (quantity == "center" ? " [m]" : " [N s]");
  out << ",fluid mass error,momentum error,energy error";
  for (const auto &contact : scene.contacts)
    for (const std::string &column : contact_columns<dim>(contact.name))
      out << ',' << csv_entry(column);
  for (const auto &rigid : scene.rigid_bodies)
    for (const std::string &column : rigid_columns<dim>(rigid->name()))
      out << ',' << csv_entry(column);
  out << '\n';
}

template <int dim>
void Statistics<dim>::write(const double time, const unsigned long step, const double dt,
                            const std::string &limit, const Totals<dim> &totals,
                            const Balances<dim> &balances)
{
  if (!file.is_open())
    return;
  if (file.is_new())
    write_header();
  const Ledger<dim> &book = balances.ledger();
  std::ostream &out = file.lines();
  out.precision(15);
  out << time << ',' << step << ',' << dt << ',' << limit << ',' << totals.mass << ','
      << totals.kinetic_energy << ',' << totals.elastic_energy << ',' << totals.fluid_energy << ','
      << book.external_work << ',' << book.gravity_work << ',' << book.seepage_dissipation << ','
      << book.contact_dissipation << ',' << balances.numerical_dissipation << ',' << book.fluid_outflow << ','
      << totals.largest_speed;
  for (const auto &vector : {totals.momentum, book.impulse, totals.center})
    for (unsigned int d = 0; d < dim; ++d)
      out << ',' << vector[d];
  out << ',' << balances.fluid_error << ',' << balances.momentum_error << ',' << balances.energy_error;
  for (const auto &contact : scene.contacts)
    for (const double value : contact_row(scene, contact.name))
      out << ',' << value;
  for (const auto &rigid : scene.rigid_bodies)
    for (const double value : rigid_row(*rigid))
      out << ',' << value;
  out << std::endl;
}

template class Statistics<2>;
template class Statistics<3>;
} // namespace peat
