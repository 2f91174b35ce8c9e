// What people read on standard output and standard error. It names files, devices and what stands
// in files: others choose these texts, and a terminal does what they say.
#pragma once

#include <cstdio>
#include <string>

namespace meniscus::cli {

/// Prints one line and ends it: line ends in it become blanks, what could steer the terminal is
/// spelled out, and a line that no one would read to its end is cut.
void print_line(std::FILE* stream, const std::string& text);

/// The same for text of several lines, which keeps its line ends.
void print_lines(std::FILE* stream, const std::string& text);

/// "meniscus: warning: ..." on standard error.
void warn(const std::string& what);

}  // namespace meniscus::cli
