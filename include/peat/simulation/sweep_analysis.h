#pragma once

#include <optional>
#include <string>
#include <vector>

namespace peat {
/// What a run cost and how good it was.
struct Bought
{
  double seconds = 0.; ///< of the time loop [s]
  double error = 0.;   ///< relative; NaN: not known
};

/// Whether each run is on the Pareto front: no other one is at least as fast and as accurate and better in
/// one of them. Runs without an error are not. Of equal runs the first one counts.
std::vector<bool> pareto_front(const std::vector<Bought> &runs);

/// The fastest run with an error of at most `target`, if any.
std::optional<std::size_t> cheapest(const std::vector<Bought> &runs, double target);

/// y = factor x^exponent.
struct PowerLaw
{
  double factor = 0.;
  double exponent = 0.;

  double operator()(double x) const;
};

/// Least squares of the logarithms over the pairs in which both are positive and finite; nothing if these are
/// fewer than two different x.
std::optional<PowerLaw> fit_power_law(const std::vector<double> &x, const std::vector<double> &y);

/// A finished run of a series in which only the mesh differs.
struct SeriesRun
{
  double cell_size = 0.; ///< smallest one [m]
  Bought bought;
};

/// Time and error of a run with smaller cells than all runs of its series, from the two with the smallest
/// ones; nothing if there are fewer than two, or the cells are not smaller. An error that grew is taken to
/// stay as it is.
std::optional<Bought> forecast(const std::vector<SeriesRun> &series, double cell_size);

/// What an error costs in a series.
struct TargetCost
{
  double cell_size = 0.;    ///< [m]
  double seconds = 0.;      ///< [s]
  bool is_measured = false; ///< lies between runs, or is the coarsest one; else beyond the finest one
};

/// Cell size and time at which a series comes to an error of `target`: between runs by power laws, beyond the
/// finest one by those of the last two; of the coarsest run if that is good enough. Nothing if that is
/// too far to tell: the error of the last two falls with an order below 1/4, or cells would be 32 times
/// smaller.
std::optional<TargetCost> cost_of_target(const std::vector<SeriesRun> &series, double target);

/// The run that makes another one not worth while: it was faster and more accurate by more than the factor
/// `margin` than the other one is expected to be. Nothing for a margin below 1.
std::optional<std::size_t> better_run(const Bought &expected, const std::vector<Bought> &finished,
                                      double margin);
} // namespace peat
