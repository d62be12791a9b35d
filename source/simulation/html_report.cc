#include "html_report.h"

#include <cstdlib>
#include <filesystem>
#include <vector>

namespace peat {
namespace {
std::string quoted(const std::string &word)
{
  std::string text = "'";
  for (const char c : word)
    text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

/// A Python that has what the page needs, or "".
std::string find_python()
{
  const char *chosen = std::getenv("PEAT_PYTHON");
  std::vector<std::string> candidates = {"python3", "/usr/bin/python3"};
  if (chosen)
    candidates = {chosen};
  for (const std::string &candidate : candidates) {
    const std::string probe = quoted(candidate) +
                              " -c 'import importlib.util as u, sys; sys.exit(not all(u.find_spec(m) "
                              "for m in (\"numpy\", \"matplotlib\")))' > /dev/null 2>&1";
    if (std::system(probe.c_str()) == 0)
      return candidate;
  }
  return "";
}
} // namespace

void write_html_report(const std::string &script_name, const std::string &directory,
                       const std::string &numbers_name, Log &log)
{
  const char *chosen = std::getenv("PEAT_SCRIPTS");
  const std::string script = std::string(chosen ? chosen : PEAT_SCRIPTS) + '/' + script_name;
  const std::string numbers = "; the numbers are in " + directory + '/' + numbers_name;
  if (!std::filesystem::exists(script)) {
    log.line("no report.html: there is no '" + script + "' (set PEAT_SCRIPTS to its directory)" + numbers);
    return;
  }
  const std::string python = find_python();
  if (python.empty()) {
    log.line(
        "no report.html: it needs python3 with numpy and matplotlib (apt-get install python3-matplotlib)" +
        numbers);
    return;
  }
  const std::string errors = directory + "/report.log";
  const std::string command =
      quoted(python) + ' ' + quoted(script) + ' ' + quoted(directory) + " > " + quoted(errors) + " 2>&1";
  if (std::system(command.c_str()) == 0) {
    std::filesystem::remove(errors);
    log.line("report: " + directory + "/report.html");
  } else
    log.line("no report.html: the script failed, see " + errors + numbers);
}
} // namespace peat
