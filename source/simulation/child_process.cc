#include "child_process.h"

#include <peat/base/error.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

namespace peat {
namespace {
/// The environment without what a launcher of MPI has put there.
std::vector<std::string> environment_without_mpi()
{
  std::vector<std::string> kept;
  for (char **entry = environ; *entry != nullptr; ++entry) {
    const std::string variable = *entry;
    bool is_mpi = false;
    for (const char *prefix : {"OMPI_", "PMIX_", "PMI_", "PRTE_", "HYDRA_", "MPIR_"})
      is_mpi = is_mpi || variable.compare(0, std::strlen(prefix), prefix) == 0;
    if (!is_mpi)
      kept.push_back(variable);
  }
  // Otherwise Open MPI starts a daemon with each program.
  kept.push_back("OMPI_MCA_ess_singleton_isolated=1");
  return kept;
}

std::vector<char *> pointers(std::vector<std::string> &words)
{
  std::vector<char *> list;
  for (std::string &word : words)
    list.push_back(word.data());
  list.push_back(nullptr);
  return list;
}
} // namespace

ChildProcess::ChildProcess(const std::vector<std::string> &command, const std::string &errors)
{
  std::vector<std::string> words = command, environment = environment_without_mpi();
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, errors.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const int problem = posix_spawn(&process, words.front().c_str(), &files, nullptr, pointers(words).data(),
                                  pointers(environment).data());
  posix_spawn_file_actions_destroy(&files);
  if (problem != 0)
    throw InputError("cannot start '" + command.front() + "': " + std::strerror(problem));
}

ChildProcess::ChildProcess(ChildProcess &&other) noexcept : process(other.process)
{
  other.process = -1;
}

ChildProcess::~ChildProcess()
{
  if (process < 0)
    return;
  terminate();
  int status = 0;
  while (waitpid(process, &status, 0) < 0 && errno == EINTR)
    ;
}

std::optional<ChildEnd> ChildProcess::poll()
{
  int status = 0;
  if (waitpid(process, &status, WNOHANG) != process)
    return {};
  process = -1;
  ChildEnd end;
  end.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  end.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + end.signal;
  return end;
}

void ChildProcess::terminate() const
{
  if (process > 0)
    kill(process, SIGTERM);
}

std::string own_executable()
{
  std::error_code error;
  const std::string path = std::filesystem::read_symlink("/proc/self/exe", error).string();
  if (error)
    throw InputError("cannot find the file of this program in /proc: " + error.message());
  return path;
}
} // namespace peat
