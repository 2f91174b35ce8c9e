#include "program/cli/terminal.hpp"

#include <algorithm>
#include <string_view>

#include "base/printable.hpp"

namespace meniscus::cli {
namespace {

constexpr std::size_t kLongest =
    16'384;  // characters of a line: a few paths of the greatest length

}  // namespace

void print_line(std::FILE* stream, const std::string& text) {
  std::string line = text;
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::fputs((printable(line, kLongest) + '\n').c_str(), stream);
}

void print_lines(std::FILE* stream, const std::string& text) {
  std::string all;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t end = rest.find('\n');
    all += printable(rest.substr(0, end), kLongest);
    if (end == std::string_view::npos) break;
    all += '\n';
    rest.remove_prefix(end + 1);
  }
  std::fputs(all.c_str(), stream);
}

void warn(const std::string& what) { print_line(stderr, "meniscus: warning: " + what); }

}  // namespace meniscus::cli
