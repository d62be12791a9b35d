#include <peat/simulation/output_parameters.h>

namespace peat {
template <int dim>
ProbeParameters<dim>::ProbeParameters(Section section) : section(section), name(section.name())
{
  std::vector<double> x(dim, 0.);
  section.add("Point", x, dim, any("m"), "Where it is at the start.");
  section.add("Follow material", follow,
              "Move with the material that is there at the start; otherwise stay in place.");
  section.require("Point", "probe '" + name + "'");
  for (unsigned int d = 0; d < dim; ++d)
    point[d] = x[d];
}

OutputParameters::OutputParameters(Section section)
{
  section.add("Interval", interval, nonnegative("s"),
              "Time between the pictures in solution.pvd; 0: start and end of each stage.");
  section.add("Pictures", pictures, "Write solution.pvd (grid and points, for ParaView).");
  section.add("Statistics interval", statistics_interval, nonnegative("s"),
              "Time between the lines of statistics.csv; 0: 200 lines a stage.");
  section.add("Probe interval", probe_interval, nonnegative("s"),
              "Time between the lines of probes.csv; 0: as statistics.csv.");
  section.add("Checkpoint interval", checkpoint_interval, nonnegative("min"),
              "Wall-clock time between checkpoints, from which 'peat run --resume' goes on; 0: only when a "
              "signal ends the run.");
}

template struct ProbeParameters<2>;
template struct ProbeParameters<3>;
} // namespace peat
