#include <peat/simulation/checkpoint.h>

#include <peat/base/error.h>
#include <peat/base/text.h>
#include <peat/simulation/simulation.h>

#include <deal.II/base/mpi.h>

#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <iomanip>
#include <sstream>

namespace peat {
namespace {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

const char *const index_name = "index.json";

std::string checkpoint_directory(const std::string &run_directory)
{
  return run_directory + "/checkpoint";
}

/// FNV-1a over words of eight bytes: any one change changes the result.
class Checksum
{
public:
  void add(const char *data, const std::size_t n)
  {
    for (std::size_t i = 0; i < n; i += sizeof(std::uint64_t)) {
      std::uint64_t word = 0;
      std::memcpy(&word, data + i, std::min(sizeof(word), n - i));
      state = (state ^ word) * 0x100000001b3u;
    }
  }
  std::string text() const
  {
    std::ostringstream text;
    text << std::hex << std::setw(16) << std::setfill('0') << state;
    return text.str();
  }

private:
  std::uint64_t state = 0xcbf29ce484222325u;
};

std::string checksum_of(const std::string &text)
{
  Checksum sum;
  sum.add(text.data(), text.size());
  return sum.text();
}

/// Names in whatever encoding.
std::string dump(const Json &json, const int indentation)
{
  return json.dump(indentation, ' ', false, Json::error_handler_t::replace);
}

/// A file as the index knows it: its length and checksum; "" if it cannot be read.
std::string signature(const std::string &name)
{
  std::ifstream file(name, std::ios::binary);
  std::vector<char> part(1 << 20); // whole words
  Checksum sum;
  std::uint64_t length = 0;
  while (file) {
    file.read(part.data(), part.size());
    sum.add(part.data(), file.gcount());
    length += file.gcount();
  }
  return file.eof() ? std::to_string(length) + " bytes, " + sum.text() : "";
}

/// To the disk, so that what is renamed later is there even if the machine goes down.
bool flush_to_disk(const std::string &name)
{
  const int descriptor = ::open(name.c_str(), O_RDONLY);
  if (descriptor < 0)
    return false;
  const bool good = ::fsync(descriptor) == 0;
  ::close(descriptor);
  return good;
}

/// The first that is not empty, the same on all ranks. Collective.
std::string first_message(const std::string &mine, MPI_Comm communicator)
{
  for (const std::string &one : dealii::Utilities::MPI::all_gather(communicator, mine))
    if (!one.empty())
      return one;
  return "";
}

bool is_first_rank(MPI_Comm communicator)
{
  return dealii::Utilities::MPI::this_mpi_process(communicator) == 0;
}

/// What a run does not compute with.
bool is_of_no_account(const ParameterValue &entry)
{
  if (entry.sections.empty())
    return entry.key == "Title";
  return is_one_of({"Compare", "Sweep"}, entry.sections.front());
}

bool is_output_interval(const ParameterValue &entry)
{
  return entry.sections == std::vector<std::string>{"Output"} &&
         is_one_of({"Interval", "Statistics interval", "Probe interval"}, entry.key);
}

bool is_checkpoint_interval(const ParameterValue &entry)
{
  return entry.sections == std::vector<std::string>{"Output"} && entry.key == "Checkpoint interval";
}

/// The number of the stage whose duration it is, or the number of stages.
std::size_t stage_of_duration(const ParameterValue &entry, const std::vector<StageSpan> &stages)
{
  std::size_t s = 0;
  if (entry.key == "Duration" && entry.sections.size() == 2 && entry.sections.front() == "Stages")
    while (s < stages.size() && stages[s].name != entry.sections.back())
      ++s;
  else
    s = stages.size();
  return s;
}

[[noreturn]] void refuse(const ParameterFile &file, const ParameterValue &entry, const std::string &why)
{
  Section section = file.root();
  for (const std::string &name : entry.sections)
    section = section.subsection(name);
  section.fail(entry.key, why);
}
} // namespace

CheckpointWriter::CheckpointWriter(const std::string &run_directory, const ParameterFile &file,
                                   const bool is_new_run, MPI_Comm communicator)
    : directory(checkpoint_directory(run_directory)), parameters(file.values()), communicator(communicator)
{
  std::error_code error;
  if (is_new_run && is_first_rank(communicator))
    fs::remove_all(directory, error);
}

std::string CheckpointWriter::write_state(const std::string &name,
                                          const std::function<void(Archive &)> &save) const
{
  {
    std::ofstream file(name, std::ios::binary);
    Archive archive(static_cast<std::ostream &>(file));
    save(archive);
    file.close();
    if (!file)
      return "cannot write '" + name + "'";
  }
  return flush_to_disk(name) ? "" : "cannot write '" + name + "' to the disk";
}

std::string CheckpointWriter::write_index(const CheckpointMoment &moment,
                                          const std::vector<std::string> &names,
                                          const std::vector<std::string> &files) const
{
  Json index;
  index["version"] = PEAT_VERSION;
  index["ranks"] = names.size();
  index["stage"] = moment.stage;
  index["time"] = moment.time;
  index["step"] = moment.step;
  index["files"] = Json::object();
  for (std::size_t rank = 0; rank < names.size(); ++rank)
    index["files"][names[rank]] = files[rank];
  index["parameters"] = Json::array();
  for (const ParameterValue &entry : parameters)
    index["parameters"].push_back(
        {entry.sections, entry.key, entry.value, entry.is_expression, entry.is_constant});
  index["checksum"] = checksum_of(dump(index, -1));

  const std::string name = directory + '/' + index_name;
  {
    std::ofstream file(name + ".tmp");
    file << dump(index, 1) << std::endl;
    file.close();
    if (!file || !flush_to_disk(name + ".tmp"))
      return "cannot write '" + name + "'";
  }
  std::error_code error;
  fs::rename(name + ".tmp", name, error);
  return error || !flush_to_disk(directory) ? "cannot write '" + name + "'" : "";
}

void CheckpointWriter::remove_others(const std::vector<std::string> &names) const
{
  std::error_code error;
  std::vector<fs::path> others;
  for (const auto &entry : fs::directory_iterator(directory, error))
    if (const std::string name = entry.path().filename().string();
        name != index_name && !is_one_of(names, name))
      others.push_back(entry.path());
  for (const fs::path &other : others)
    fs::remove(other, error);
}

std::string CheckpointWriter::write(const CheckpointMoment &moment,
                                    const std::function<void(Archive &)> &save)
{
  const unsigned int n_ranks = dealii::Utilities::MPI::n_mpi_processes(communicator);
  std::string problem;
  if (is_first_rank(communicator)) {
    std::error_code error;
    fs::create_directories(directory, error);
    if (error)
      problem = "cannot make '" + directory + "'";
  }
  problem = first_message(problem, communicator);
  if (!problem.empty())
    return problem;

  std::vector<std::string> names;
  for (unsigned int rank = 0; rank < n_ranks; ++rank)
    names.push_back("step-" + std::to_string(moment.step) + "-rank-" + std::to_string(rank));
  const std::string mine = directory + '/' + names[dealii::Utilities::MPI::this_mpi_process(communicator)];
  problem = first_message(write_state(mine, save), communicator);
  if (!problem.empty())
    return problem;
  const auto files = dealii::Utilities::MPI::gather(communicator, signature(mine), 0);
  if (is_first_rank(communicator)) {
    problem = write_index(moment, names, files);
    if (problem.empty())
      remove_others(names);
  }
  return first_message(problem, communicator);
}

Checkpoint::Checkpoint(const std::string &run_directory, const ParameterFile &file,
                       const std::vector<StageSpan> &stages, MPI_Comm communicator)
    : reader(static_cast<std::istream &>(state))
{
  // One rank reads the index, so that all read the same.
  const std::string directory = checkpoint_directory(run_directory), name = directory + '/' + index_name;
  std::string text;
  if (is_first_rank(communicator)) {
    std::ifstream stream(name);
    std::ostringstream content;
    content << stream.rdbuf();
    text = content.str();
  }
  text = dealii::Utilities::MPI::broadcast(communicator, text);
  if (text.empty())
    throw InputError("'" + run_directory + "' holds no checkpoint to resume from");
  const auto damaged = [&](const std::string &what) {
    return "the checkpoint in '" + directory + "' is damaged: '" + what + "' is not what was written";
  };
  Json index = Json::parse(text, nullptr, false);
  if (index.is_discarded() || !index.is_object() || !index.contains("checksum"))
    throw InputError(damaged(index_name));
  const Json checksum = index["checksum"];
  index.erase("checksum");
  if (checksum != checksum_of(dump(index, -1)))
    throw InputError(damaged(index_name));

  if (index["version"] != PEAT_VERSION)
    throw InputError("the checkpoint in '" + directory + "' was written by version " +
                     index["version"].get<std::string>() + ", this is version " PEAT_VERSION);
  const unsigned int n_ranks = dealii::Utilities::MPI::n_mpi_processes(communicator);
  if (index["ranks"] != n_ranks)
    throw InputError("the checkpoint in '" + directory + "' is that of " + index["ranks"].dump() +
                     " rank(s) and goes on with as many, not with " + std::to_string(n_ranks));
  when.stage = index["stage"];
  when.time = index["time"];
  when.step = index["step"];
  std::vector<ParameterValue> before;
  for (const Json &entry : index["parameters"])
    before.push_back({entry[0].get<std::vector<std::string>>(), entry[1].get<std::string>(),
                      entry[2].get<std::string>(), entry[3].get<bool>(), entry[4].get<bool>()});
  compare_parameters(before, file, stages);

  auto mine = index["files"].begin();
  std::advance(mine, dealii::Utilities::MPI::this_mpi_process(communicator));
  const std::string path = directory + '/' + mine.key();
  const std::string problem =
      first_message(signature(path) == mine.value() ? "" : damaged(mine.key()), communicator);
  if (!problem.empty())
    throw InputError(problem);
  state.open(path, std::ios::binary);
}

void Checkpoint::compare_parameters(const std::vector<ParameterValue> &before, const ParameterFile &file,
                                    const std::vector<StageSpan> &stages)
{
  const std::vector<ParameterValue> now = file.values();
  const auto find = [](const std::vector<ParameterValue> &list, const ParameterValue &entry) {
    return std::find_if(list.begin(), list.end(), [&](const ParameterValue &one) {
      return one.sections == entry.sections && one.key == entry.key;
    });
  };
  const auto may_differ = [&](const ParameterValue &entry) {
    if (is_of_no_account(entry) || is_checkpoint_interval(entry))
      return true;
    // Numbers that are made of constants are compared themselves.
    if (entry.is_constant)
      return std::none_of(now.begin(), now.end(), [&](const ParameterValue &other) {
        return !is_of_no_account(other) && other.mentions(entry.key);
      });
    const std::size_t stage = stage_of_duration(entry, stages);
    if (!is_output_interval(entry) && (stage == stages.size() || stage < when.stage))
      return false;
    other_times = true;
    return true;
  };
  for (const ParameterValue &entry : now) {
    const auto old = find(before, entry);
    const std::string old_value = old == before.end() ? "(not set)" : old->value;
    if (entry.value != old_value && !may_differ(entry))
      refuse(file, entry,
             "is " + in_quotes(entry.value) + ", but " + in_quotes(old_value) +
                 " in the run that is to be resumed");
  }
  for (const ParameterValue &entry : before)
    if (find(now, entry) == now.end() && entry.value != "(not set)" && !may_differ(entry))
      throw InputError(entry.path() + ": is not set, but " + in_quotes(entry.value) +
                       " in the run that is to be resumed");

  // What the user names: its order decides on that of points and stages.
  const auto names = [](const std::vector<ParameterValue> &list) {
    std::map<std::string, std::vector<std::string>> names;
    for (const ParameterValue &entry : list)
      if (entry.sections.size() == 2 && !is_one_of(names[entry.sections[0]], entry.sections[1]))
        names[entry.sections[0]].push_back(entry.sections[1]);
    return names;
  };
  const auto old_names = names(before);
  for (const auto &[section, list] : names(now))
    if (const auto old = old_names.find(section); old != old_names.end() && old->second != list)
      file.root().subsection(section).fail("", "names " + in_quotes(list) + ", but " +
                                                   in_quotes(old->second) +
                                                   " in the run that is to be resumed");

  double end = 0.;
  for (std::size_t s = 0; s <= when.stage && s < stages.size(); ++s)
    end += stages[s].duration;
  if (other_times && end < when.time)
    file.root()
        .subsection("Stages")
        .subsection(stages[when.stage].name)
        .fail("Duration", "ends before " + to_text(when.time) + " s, the time of the checkpoint");
}

Watch::Watch(const double interval, MPI_Comm communicator)
    : interval(interval), communicator(communicator),
      parallel(dealii::Utilities::MPI::n_mpi_processes(communicator) > 1), last_checkpoint(Clock::now()),
      last_question(last_checkpoint)
{}

Watch::Call Watch::ask()
{
  constexpr double pace = 0.2; // [s] between questions of ranks
  constexpr double most_steps = 100.;
  double has_signal = signal_was_caught(), is_due = 0.;
  if (parallel) {
    if (++n_steps < steps_asked_over)
      return Call::none;
    const auto now = Clock::now();
    const std::chrono::duration<double> elapsed = now - last_question;
    const double waited = interval.count() > 0. && now - last_checkpoint >= interval;
    const std::vector<double> mine = {has_signal, waited, elapsed.count()};
    std::vector<double> all(mine.size());
    dealii::Utilities::MPI::max(mine, communicator, all);
    has_signal = all[0];
    is_due = all[1];
    steps_asked_over = std::min(most_steps, std::max(1., n_steps * pace / std::max(all[2], 1e-9)));
    n_steps = 0;
    last_question = now;
  } else if (interval.count() > 0.)
    is_due = Clock::now() - last_checkpoint >= interval;
  if (has_signal == 0. && is_due == 0.)
    return Call::none;
  last_checkpoint = Clock::now();
  return has_signal != 0. ? Call::end : Call::checkpoint;
}
} // namespace peat
