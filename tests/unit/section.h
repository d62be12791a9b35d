#pragma once

#include <peat/base/parameters.h>

#include <cstdio>
#include <fstream>
#include <string>

#include <unistd.h>

/// What `make` makes of the section "sand" of a parameter file with these lines in it. The file must hold
/// nothing that was not read.
template <typename Make>
auto from_text(const std::string &lines, const Make &make)
{
  const std::string name = "peat_test_section_" + std::to_string(getpid()) + ".prm";
  std::ofstream(name) << "subsection sand\n" << lines << "\nend\n";
  try {
    peat::ParameterFile file(name, {});
    std::remove(name.c_str());
    auto result = make(file.root().subsection("sand"));
    file.refuse_unknown_entries();
    return result;
  } catch (...) {
    std::remove(name.c_str());
    throw;
  }
}
