#include <peat/simulation/statistics.h>

namespace peat {
template <int dim>
Statistics<dim>::Statistics(const std::string &directory, const Scene<dim> &scene, const bool is_first_rank)
    : scene(scene)
{
  if (!is_first_rank)
    return;
  file.open(directory + "/statistics.csv");
  file.precision(15);
  file << "time [s],step,dt [s],binding limit,mass [kg],kinetic energy [J],elastic energy [J],fluid energy "
          "[J],"
          "external work [J],gravity work [J],seepage dissipation [J],contact dissipation [J],numerical dissipation [J],fluid "
          "outflow [m^"
       << dim << "],largest speed [m/s]";
  const char axes[] = "xyz";
  for (const std::string quantity : {"momentum", "impulse", "center"})
    for (unsigned int d = 0; d < dim; ++d)
      file << ',' << quantity << ' ' << axes[d] << (quantity == "center" ? " [m]" : " [N s]");
  for (const auto &contact : scene.contacts) {
    for (unsigned int d = 0; d < dim; ++d)
      file << ',' << contact.name << "/force " << axes[d] << " [N]";
    file << ',' << contact.name << "/normal force [N]," << contact.name << "/area [m^" << dim - 1 << "],"
         << contact.name << "/gap [m]";
  }
  file << ",fluid mass error,momentum error,energy error\n";
}

template <int dim>
void Statistics<dim>::write(const double time, const unsigned long step, const double dt,
                            const std::string &limit, const Totals<dim> &totals,
                            const Balances<dim> &balances)
{
  if (!file.is_open())
    return;
  const Ledger<dim> &book = balances.ledger();
  file << time << ',' << step << ',' << dt << ',' << limit << ',' << totals.mass << ','
       << totals.kinetic_energy << ',' << totals.elastic_energy << ',' << totals.fluid_energy << ','
       << book.external_work << ',' << book.gravity_work << ',' << book.seepage_dissipation << ','
       << book.contact_dissipation << ',' << balances.numerical_dissipation << ',' << book.fluid_outflow << ',' << totals.largest_speed;
  for (const auto &vector : {totals.momentum, book.impulse, totals.center})
    for (unsigned int d = 0; d < dim; ++d)
      file << ',' << vector[d];
  for (const auto &contact : scene.contacts) {
    const auto found = scene.contact_states.find(contact.name);
    const ContactState<dim> state =
        found == scene.contact_states.end() ? ContactState<dim>() : found->second;
    for (unsigned int d = 0; d < dim; ++d)
      file << ',' << state.force[d];
    file << ',' << state.normal_force << ',' << state.area << ','
         << (std::isfinite(state.gap) ? state.gap : std::numeric_limits<double>::quiet_NaN());
  }
  file << ',' << balances.fluid_error << ',' << balances.momentum_error << ',' << balances.energy_error
       << std::endl;
}

template class Statistics<2>;
template class Statistics<3>;
} // namespace peat
