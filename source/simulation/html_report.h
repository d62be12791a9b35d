#pragma once

#include <peat/simulation/log.h>

#include <string>

namespace peat {
/// Has the Python script of that name make report.html in the directory. Without Python, numpy or matplotlib
/// there is no page, and the log says where the `numbers` (a file in the directory) are.
void write_html_report(const std::string &script, const std::string &directory, const std::string &numbers,
                       Log &log);
} // namespace peat
