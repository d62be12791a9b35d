#pragma once

#include <peat/simulation/growing_file.h>
#include <peat/solver/totals.h>

#include <string>

namespace peat {
/// statistics.csv: one line a report.
template <int dim>
class Statistics
{
public:
  /// Only rank 0 opens the file. `scene` must live as long as this.
  Statistics(const std::string &directory, const Scene<dim> &scene, bool is_first_rank);

  void write(double time, unsigned long step, double dt, const std::string &limit, const Totals<dim> &totals,
             const Balances<dim> &balances);
  void persist(Archive &archive) { archive(file); }

private:
  void write_header();

  const Scene<dim> &scene;
  GrowingFile file;
};
} // namespace peat
