#include <peat/base/error.h>
#include <peat/simulation/commands.h>

#include <boost/program_options.hpp>

#include <deal.II/base/mpi.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>
#include <vector>

namespace {
using namespace peat;
namespace options = boost::program_options;

const char *const usage =
    R"(PEAT: Poromechanics with Elements And maTerial points

  peat run CASE.prm           run a case (also: peat CASE.prm; mpirun -np N peat run CASE.prm)
  peat run CASE.prm --resume  go on with a run that was ended by a signal, or that wrote checkpoints
  peat compare CASE.prm       run it with two methods or settings and report where the results differ
  peat sweep CASE.prm         run it with all combinations of some settings: error against run time
  peat check CASE.prm         validate a case and say what it would take; runs nothing
  peat parameters             every parameter with meaning, unit, default and range
)";

struct CommandLine
{
  std::string command;
  RunOptions run;
  SweepOptions sweep;
  std::string format = "prm";
  unsigned int dimension = 2;
};

/// Prints help or version and returns true if that was all that was wanted.
bool parse(const int argc, char **argv, const bool first_rank, CommandLine &line)
{
  std::vector<std::string> words;
  options::options_description visible("Options");
  visible.add_options()("set",
                        options::value(&line.run.overrides)->composing()->value_name("\"Section/Key=value\""),
                        "override an entry of the file; repeatable")(
      "output", options::value(&line.run.output)->value_name("DIR"), "directory for results (output/CASE)")(
      "resume", options::bool_switch(&line.run.resume),
      "of 'peat run': go on from the checkpoint in the directory for results")(
      "quiet", options::bool_switch(&line.run.quiet), "say nothing on the terminal but errors")(
      "vary", options::value(&line.sweep.vary)->composing()->value_name("\"Section/Key=a,b\""),
      "of 'peat sweep': values of an entry; repeatable, all combinations are run")(
      "target", options::value(&line.sweep.target)->value_name("ERROR"),
      "of 'peat sweep': relative error to look for (1e-2)")(
      "jobs", options::value(&line.sweep.n_jobs)->value_name("N"), "of 'peat sweep': runs at a time (1)")(
      "format", options::value(&line.format)->value_name("prm|markdown|json"),
      "of 'peat parameters'")("dimension", options::value(&line.dimension)->value_name("2|3"),
                              "of 'peat parameters'")("help", "this text")("version", "the version");
  options::options_description all;
  all.add(visible).add_options()("words", options::value(&words));
  options::positional_options_description positions;
  positions.add("words", -1);

  options::variables_map values;
  try {
    options::store(options::command_line_parser(argc, argv).options(all).positional(positions).run(), values);
    options::notify(values);
  } catch (const options::error &error) {
    throw InputError(std::string(error.what()) + "; see peat --help");
  }
  if (values.count("version")) {
    if (first_rank)
      std::cout << "peat " << PEAT_VERSION << std::endl;
    return true;
  }
  if (values.count("help") || words.empty()) {
    if (first_rank)
      std::cout << usage << '\n' << visible << std::endl;
    return true;
  }

  if (values.count("output") && line.run.output.empty())
    throw InputError("'--output' needs the name of a directory");
  const std::string &first = words.front();
  const std::vector<std::string> commands = {"run", "compare", "sweep", "check", "parameters"};
  const bool is_command = std::find(commands.begin(), commands.end(), first) != commands.end();
  line.command = is_command ? first : "run";
  if (!is_command && (first.size() < 4 || first.substr(first.size() - 4) != ".prm"))
    throw InputError("'" + first + "' is no command and no parameter file (.prm); see peat --help");
  for (const char *option : {"vary", "target", "jobs"})
    if (values.count(option) && line.command != "sweep")
      throw InputError("'--" + std::string(option) + "' is for 'peat sweep'");
  if (line.run.resume && line.command != "run")
    throw InputError("'--resume' is for 'peat run'");
  if (values.count("target") && !(line.sweep.target > 0. && std::isfinite(line.sweep.target)))
    throw InputError("'--target' must be a relative error > 0");
  if (values.count("jobs") && (line.sweep.n_jobs < 1 || line.sweep.n_jobs > 1000))
    throw InputError("'--jobs' must be >= 1 and <= 1000");
  const std::size_t n_words = is_command ? 2 : 1;
  if (line.command == "parameters") {
    if (words.size() > 1)
      throw InputError("'peat parameters' takes no file");
    if (line.format != "prm" && line.format != "markdown" && line.format != "json")
      throw InputError("'--format " + line.format + "' is unknown; use prm, markdown or json");
    if (line.dimension != 2 && line.dimension != 3)
      throw InputError("'--dimension' must be 2 or 3");
    return false;
  }
  if (words.size() != n_words)
    throw InputError(words.size() < n_words
                         ? "'peat " + line.command + "' needs a parameter file"
                         : "one parameter file at a time, please; got also '" + words[n_words] + "'");
  line.run.file = words.back();
  return false;
}
} // namespace

int main(int argc, char **argv)
{
  dealii::Utilities::MPI::MPI_InitFinalize mpi(argc, argv, 1);
  const MPI_Comm communicator = MPI_COMM_WORLD;
  const bool first_rank = dealii::Utilities::MPI::this_mpi_process(communicator) == 0;
  const auto complain = [&](const std::string &message) {
    // An error that only one rank met must not leave the others waiting for it.
    std::cerr << "peat: " + message + "\n" << std::flush;
  };
  try {
    CommandLine line;
    if (parse(argc, argv, first_rank, line))
      return exit_success;
    if (line.command == "parameters")
      return first_rank ? command_parameters(line.format, line.dimension) : exit_success;
    if (line.command == "sweep") {
      line.sweep.run = line.run;
      return command_sweep(line.sweep, communicator);
    }
    if (line.command == "compare")
      return command_compare(line.run, communicator);
    return line.command == "check" ? command_check(line.run, communicator)
                                   : command_run(line.run, communicator);
  } catch (const InputError &error) {
    if (first_rank)
      complain(error.what());
    return exit_input_error;
  } catch (const NumericalError &error) {
    if (first_rank)
      complain(error.what());
    return exit_numerical_error;
  } catch (const std::exception &error) {
    complain(std::string("internal error: ") + error.what());
    MPI_Abort(communicator, exit_numerical_error);
    return exit_numerical_error;
  }
}
