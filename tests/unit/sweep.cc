#define BOOST_TEST_MODULE sweep
#include <boost/test/unit_test.hpp>

#include <peat/simulation/sweep_analysis.h>
#include <peat/simulation/sweep_plan.h>

#include "section.h"

#include <cmath>

using namespace peat;

namespace {
constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

SweepRun done_run(const std::vector<std::string> &values, const double cell_size, const double seconds,
                  const double error)
{
  SweepRun run;
  run.values = values;
  run.name = run_name(values);
  run.state = SweepRun::State::done;
  run.cell_size = cell_size;
  run.seconds = run.total_seconds = seconds;
  run.nominal_seconds = 1.;
  run.error = error;
  return run;
}

SweepRun waiting_run(const std::vector<std::string> &values, const double cell_size,
                     const double nominal_seconds)
{
  SweepRun run = done_run(values, cell_size, 0., unknown);
  run.state = SweepRun::State::waiting;
  run.nominal_seconds = nominal_seconds;
  return run;
}
} // namespace

BOOST_AUTO_TEST_CASE(values_are_split)
{
  const std::vector<std::string> words = {"gimp", "q1"}, corners = {"1, 2", "3, 4"},
                                 calls = {"max(1, 2)", "3"};
  BOOST_TEST(SweepAxis("Explicit MPM/Basis", "gimp, q1").values == words);
  BOOST_TEST(SweepAxis("Grid/Cells", "1, 2; 3, 4").values == corners);
  BOOST_TEST(SweepAxis("Constants/h", "max(1, 2), 3").values == calls);
  BOOST_TEST(SweepAxis(" Explicit MPM/Basis ", "q1").name() == "Basis");
  BOOST_TEST(SweepAxis("Title", "q1").name() == "Title");
}

BOOST_AUTO_TEST_CASE(axes_that_make_no_sense_are_refused)
{
  BOOST_CHECK_THROW(SweepAxis("", "1, 2"), InputError);
  BOOST_CHECK_THROW(SweepAxis("Constants/", "1, 2"), InputError);
  BOOST_CHECK_THROW(SweepAxis("Constants/h", "1,, 2"), InputError);
  BOOST_CHECK_THROW(SweepAxis("Constants/h", ""), InputError);
  BOOST_CHECK_THROW(SweepAxis("Constants/h", "1, 2, 1"), InputError);
  BOOST_CHECK_THROW(SweepAxis("Sweep/Target", "1, 2"), InputError);
}

BOOST_AUTO_TEST_CASE(numbers_are_told_from_words)
{
  BOOST_TEST(SweepAxis("Constants/h", "1, 2e-3, -4").is_numeric());
  BOOST_TEST(!SweepAxis("Constants/h", "1, H/2").is_numeric());
  BOOST_TEST(!SweepAxis("Method", "mpm, fem").is_numeric());
}

BOOST_AUTO_TEST_CASE(section_gives_axes_and_defaults)
{
  const SweepParameters sweep =
      from_text("set Target = 5e-3\n"
                "subsection mesh\nset Key = Constants/cells\nset Values = 10, 20\nend\n"
                "subsection scheme\nset Key = Method\nset Values = mpm, fem\nend",
                [](const Section &section) { return SweepParameters(section); });
  BOOST_TEST(sweep.target == 5e-3);
  BOOST_TEST(sweep.n_jobs == 1u);
  BOOST_TEST_REQUIRE(sweep.axes.size() == 2u);
  BOOST_TEST(sweep.axes[0].key == "Constants/cells");
  BOOST_TEST(sweep.axes[1].values.back() == "fem");
}

BOOST_AUTO_TEST_CASE(product_is_complete_and_in_order)
{
  const auto all = combinations({SweepAxis("a", "1, 2"), SweepAxis("b", "x, y, z")});
  BOOST_TEST_REQUIRE(all.size() == 6u);
  const std::vector<std::string> first = {"1", "x"}, second = {"1", "y"}, last = {"2", "z"};
  BOOST_TEST(all[0] == first);
  BOOST_TEST(all[1] == second);
  BOOST_TEST(all[5] == last);
}

BOOST_AUTO_TEST_CASE(names_are_fit_for_directories)
{
  BOOST_TEST(run_name({"20", "", "q1"}) == "20_q1");
  BOOST_TEST(run_name({"1, 2", "a/b"}) == "1__2_a_b");
  BOOST_TEST(run_name({""}).empty());
}

BOOST_AUTO_TEST_CASE(comparisons_are_no_part_of_a_run)
{
  const std::string text =
      "set Title = a\n\nsubsection Sweep\n  subsection mesh\n    set Key = b\n  end\nend\n"
      "subsection Grid\n  set Cells = 4\nend\n";
  const std::string expected = "set Title = a\n\nsubsection Grid\n  set Cells = 4\nend\n";
  BOOST_TEST(without_comparisons(text) == expected);
  BOOST_TEST(without_comparisons(expected) == expected);
}

BOOST_AUTO_TEST_CASE(pareto_front_holds_what_nothing_beats)
{
  const std::vector<Bought> runs = {{1., 0.1},      {2., 0.05}, {2.5, 0.05}, {3., 0.2},
                                    {0.5, unknown}, {4., 0.01}, {1., 0.1}};
  const std::vector<bool> expected = {true, true, false, false, false, true, false};
  const std::vector<bool> front = pareto_front(runs);
  BOOST_TEST(front == expected, boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(cheapest_is_the_fastest_within_the_target)
{
  const std::vector<Bought> runs = {{1., 0.1}, {5., 0.01}, {3., 0.009}, {2., unknown}};
  BOOST_TEST(cheapest(runs, 0.01).value() == 2u);
  BOOST_TEST(cheapest(runs, 0.1).value() == 0u);
  BOOST_TEST(!cheapest(runs, 0.001).has_value());
}

BOOST_AUTO_TEST_CASE(power_laws_are_found)
{
  const auto law = fit_power_law({0.1, 0.2, 0.4, 0.3}, {0.02, 0.08, 0.32, unknown});
  BOOST_TEST_REQUIRE(law.has_value());
  BOOST_TEST(law->exponent == 2., boost::test_tools::tolerance(1e-12));
  BOOST_TEST(law->factor == 2., boost::test_tools::tolerance(1e-12));
  BOOST_TEST(!fit_power_law({0.1, 0.1}, {1., 2.}).has_value());
  BOOST_TEST(!fit_power_law({0.1, 0.2}, {1., 0.}).has_value());
}

BOOST_AUTO_TEST_CASE(forecast_continues_the_last_two_meshes)
{
  // From the coarsest one alone nothing could be told; it must not count beside two finer ones.
  const std::vector<SeriesRun> series = {{0.1, {8., 0.01}}, {0.4, {1., 0.9}}, {0.2, {1., 0.04}}};
  const auto expected = forecast(series, 0.05);
  BOOST_TEST_REQUIRE(expected.has_value());
  BOOST_TEST(expected->seconds == 64., boost::test_tools::tolerance(1e-12));
  BOOST_TEST(expected->error == 0.0025, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(!forecast(series, 0.1).has_value());
  BOOST_TEST(!forecast({series[0]}, 0.05).has_value());
  // An error that grows with finer meshes is not taken to go on growing.
  BOOST_TEST(forecast({{0.2, {1., 0.01}}, {0.1, {8., 0.02}}}, 0.05)->error == 0.01);
}

BOOST_AUTO_TEST_CASE(margin_decides_what_is_worth_while)
{
  const std::vector<Bought> finished = {{10., 0.001}, {1., 0.05}};
  BOOST_TEST(better_run({40., 0.004}, finished, 3.).value() == 0u);
  BOOST_TEST(!better_run({20., 0.004}, finished, 3.).has_value()); // not slow enough
  BOOST_TEST(!better_run({40., 0.002}, finished, 3.).has_value()); // not bad enough
  BOOST_TEST(!better_run({40., 0.004}, finished, 0.).has_value());
}

BOOST_AUTO_TEST_CASE(target_lies_between_runs_or_beyond_them)
{
  const std::vector<SeriesRun> series = {{0.4, {1., 0.16}}, {0.2, {8., 0.04}}, {0.1, {64., 0.01}}};
  const auto between = cost_of_target(series, 0.09);
  BOOST_TEST_REQUIRE(between.has_value());
  BOOST_TEST(between->is_measured);
  BOOST_TEST(between->cell_size == 0.3, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(between->seconds == std::pow(0.4 / 0.3, 3), boost::test_tools::tolerance(1e-12));
  const auto beyond = cost_of_target(series, 0.0025);
  BOOST_TEST_REQUIRE(beyond.has_value());
  BOOST_TEST(!beyond->is_measured);
  BOOST_TEST(beyond->seconds == 512., boost::test_tools::tolerance(1e-12));
  BOOST_TEST(cost_of_target(series, 0.5)->seconds == 1.);
  BOOST_TEST(!cost_of_target({{0.2, {1., 0.04}}, {0.1, {8., 0.0399}}}, 0.01).has_value());
  BOOST_TEST(!cost_of_target(series, 1e-6).has_value());
  BOOST_TEST(!cost_of_target({}, 0.01).has_value());
}

BOOST_AUTO_TEST_CASE(runs_go_from_cheap_to_dear)
{
  const std::vector<SweepRun> runs = {waiting_run({"1"}, 1., 5.), waiting_run({"2"}, 1., 1.),
                                      done_run({"3"}, 1., 0.1, 0.1), waiting_run({"4"}, 1., 3.)};
  const std::vector<std::size_t> expected = {1, 3, 0};
  BOOST_TEST(order_of_runs(runs) == expected, boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(mesh_axis_is_the_one_that_refines)
{
  const std::vector<SweepAxis> axes = {SweepAxis("factor", "0.5, 0.8"), SweepAxis("cells", "10, 20")};
  const std::vector<SweepRun> runs = {
      done_run({"0.5", "10"}, 0.1, 1., 0.1), done_run({"0.5", "20"}, 0.05, 1., 0.1),
      done_run({"0.8", "10"}, 0.1, 1., 0.1), done_run({"0.8", "20"}, 0.05, 1., 0.1)};
  BOOST_TEST(mesh_axis(runs, axes).value() == 1u);
  BOOST_TEST(!mesh_axis({runs[0], runs[2]}, axes).has_value());
  BOOST_TEST(same_but_for(runs[0], runs[1], 1));
  BOOST_TEST(!same_but_for(runs[0], runs[3], 1));
}

BOOST_AUTO_TEST_CASE(a_run_is_skipped_for_a_reason)
{
  std::vector<SweepRun> runs = {done_run({"slow", "10"}, 0.4, 10., 0.16),
                                done_run({"slow", "20"}, 0.2, 80., 0.04),
                                done_run({"fast", "40"}, 0.1, 5., 0.001)};
  const SweepRun next = waiting_run({"slow", "40"}, 0.1, 100.);
  BOOST_TEST(reason_to_skip(next, runs, 1, 3.).find("fast_40") != std::string::npos);
  BOOST_TEST(reason_to_skip(next, runs, 1, 0.).empty());
  BOOST_TEST(reason_to_skip(next, runs, {}, 3.).empty());
  runs[2].error = 0.005;
  BOOST_TEST(reason_to_skip(next, runs, 1, 3.).empty());
  runs.pop_back();
  BOOST_TEST(reason_to_skip(next, runs, 1, 3.).empty());
}

BOOST_AUTO_TEST_CASE(expected_time_follows_the_own_series)
{
  const std::vector<SweepRun> runs = {done_run({"slow", "10"}, 0.4, 10., 0.16),
                                      done_run({"fast", "10"}, 0.4, 0.1, 0.1)};
  BOOST_TEST(expected_seconds(waiting_run({"slow", "20"}, 0.2, 4.), runs, 1) == 40.,
             boost::test_tools::tolerance(1e-9));
  BOOST_TEST(expected_seconds(waiting_run({"other", "20"}, 0.2, 4.), runs, 1) == 4.,
             boost::test_tools::tolerance(1e-9));
  BOOST_TEST(expected_seconds(waiting_run({"slow", "20"}, 0.2, 4.), {}, 1) == 4.);
}
