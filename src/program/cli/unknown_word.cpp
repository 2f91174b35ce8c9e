#include "program/cli/unknown_word.hpp"

#include <algorithm>

#include "base/edit_distance.hpp"

namespace meniscus::cli {
namespace {

std::string question(const std::string& nearest) {
  return nearest.empty() ? "" : ", did you mean " + nearest + "?";
}

// The name that differs least from `word`, where few letters do; else empty.
std::string nearest_name(const std::string& word, const std::vector<std::string>& names) {
  std::string best;
  const std::size_t letters_in_word =
      word.size() - std::min(word.size(), word.find_first_not_of('-'));
  std::size_t least = std::max<std::size_t>(1, letters_in_word / 3) + 1;
  for (const std::string& name : names)
    if (const std::size_t letters = edit_distance(word, name); letters < least) {
      least = letters;
      best = name;
    }
  return best;
}

}  // namespace

const CLI::App& chosen_command(const CLI::App& program) {
  const auto chosen = program.get_subcommands();
  return chosen.empty() ? program : chosen_command(*chosen.front());
}

std::string spelled(const CLI::App& command) {
  const CLI::App* const above = command.get_parent();
  return (above ? spelled(*above) + " " : "") + command.get_name();
}

std::string unknown_word(const CLI::App& program, const std::vector<std::string>& typed) {
  const std::vector<std::string> unknown = program.remaining(true);
  const auto is_unknown = [&](const std::string& word) {
    return std::find(unknown.begin(), unknown.end(), word) != unknown.end();
  };
  const CLI::App& command = chosen_command(program);
  for (const std::string& word : typed) {
    if (!is_unknown(word)) continue;
    if (word.starts_with('-') && word.size() > 1) {
      const std::string name = word.substr(0, word.find('='));
      std::vector<std::string> names;
      for (const CLI::Option* option : command.get_options())
        for (const std::string& known : option->get_lnames()) names.push_back("--" + known);
      return spelled(command) + " has no option " + name + question(nearest_name(name, names));
    }
    if (!command.get_subcommands([](const CLI::App*) { return true; }).empty()) {
      std::vector<std::string> names;
      for (const CLI::App* known : command.get_subcommands([](const CLI::App*) { return true; }))
        names.push_back(known->get_name());
      return "there is no command " + word + question(nearest_name(word, names));
    }
  }
  return "";
}

}  // namespace meniscus::cli
