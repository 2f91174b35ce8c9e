#include "program/cli/help_formatter.hpp"

#include <sstream>
#include <vector>

namespace meniscus::cli {
namespace {

constexpr std::size_t kIndent = 34, kWidth = 100;  // columns

// What most people need of a command with many options.
constexpr const char* kMostUsed[] = {
    "--output", "--particle-radius", "--camera", "--eye",     "--target", "--up",     "--fov",
    "--size",   "--frames",          "--resume", "--log",     "--report", "--method", "--aov",
    "--layers", "--preview",         "--device", "--timings", "--quiet",  "--help",   "--help-all"};

}  // namespace

HelpFormatter::HelpFormatter() {
  column_width(kIndent);
  label("SUBCOMMAND", "COMMAND");  // documents and messages call it a command
}

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
  return option->get_type_size() == 0 ? "" : " " + option->get_type_name();
}

std::string HelpFormatter::make_help(const CLI::App* command, std::string name,
                                     CLI::AppFormatMode mode) const {
  if (!command->get_help_all_ptr() || mode != CLI::AppFormatMode::Normal)
    return CLI::Formatter::make_help(command, name, mode);
  std::vector<const CLI::Option*> options;
  for (const char* most_used : kMostUsed)
    if (const CLI::Option* option = command->get_option_no_throw(most_used))
      options.push_back(option);
  std::string text = make_description(command) + make_usage(command, name) +
                     make_positionals(command) + "\nOptions:\n";
  for (const CLI::Option* option : options) text += wrapped(option, false, first_clause(option));
  return text + make_footer(command);
}

std::string HelpFormatter::make_footer(const CLI::App* command) const {
  if (!command->get_help_all_ptr()) return CLI::Formatter::make_footer(command);
  return "\nmeniscus " + command->get_name() + " --help-all explains all " +
         std::to_string(command->get_options().size()) + " options.\n";
}

std::string HelpFormatter::make_option(const CLI::Option* option, bool is_positional) const {
  return wrapped(option, is_positional, make_option_desc(option));
}

std::string HelpFormatter::first_clause(const CLI::Option* option) const {
  const std::string text = make_option_desc(option);
  return text.substr(0, text.find(';'));
}

std::string HelpFormatter::wrapped(const CLI::Option* option, bool is_positional,
                                   const std::string& description) const {
  std::string text = "  " + make_option_name(option, is_positional) + make_option_opts(option);
  if (text.size() + 2 > kIndent)
    text += "\n" + std::string(kIndent, ' ');
  else
    text.resize(kIndent, ' ');
  std::size_t column = kIndent;
  std::istringstream words(description);
  for (std::string word; words >> word;) {
    if (column > kIndent && column + 1 + word.size() > kWidth) {
      text += "\n" + std::string(kIndent, ' ');
      column = kIndent;
    } else if (column > kIndent) {
      text += ' ';
      ++column;
    }
    text += word;
    column += word.size();
  }
  return text + "\n";
}

}  // namespace meniscus::cli
