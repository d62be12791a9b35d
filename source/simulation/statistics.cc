#include <peat/simulation/statistics.h>

namespace peat {
template <int dim>
Statistics<dim>::Statistics(const std::string &directory, const bool is_first_rank)
{
  if (!is_first_rank)
    return;
  file.open(directory + "/statistics.csv");
  file.precision(15);
  file << "time [s],step,dt [s],binding limit,mass [kg],kinetic energy [J],elastic energy [J],fluid energy "
          "[J],"
          "external work [J],gravity work [J],seepage dissipation [J],numerical dissipation [J],fluid "
          "outflow [m^"
       << dim << "],largest speed [m/s]";
  const char axes[] = "xyz";
  for (const std::string quantity : {"momentum", "impulse", "center"})
    for (unsigned int d = 0; d < dim; ++d)
      file << ',' << quantity << ' ' << axes[d] << (quantity == "center" ? " [m]" : " [N s]");
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
       << balances.numerical_dissipation << ',' << book.fluid_outflow << ',' << totals.largest_speed;
  for (const auto &vector : {totals.momentum, book.impulse, totals.center})
    for (unsigned int d = 0; d < dim; ++d)
      file << ',' << vector[d];
  file << ',' << balances.fluid_error << ',' << balances.momentum_error << ',' << balances.energy_error
       << std::endl;
}

template class Statistics<2>;
template class Statistics<3>;
} // namespace peat
