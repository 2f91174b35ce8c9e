#include "program/cli/unknown_word.hpp"

#include <algorithm>
#include <filesystem>

#include "base/edit_distance.hpp"

namespace meniscus::cli {
namespace {

std::string question(const std::string& nearest) {
  return nearest.empty() ? "" : ", did you mean " + nearest + "?";
}

std::vector<const CLI::App*> commands_of(const CLI::App& program) {
  return program.get_subcommands([](const CLI::App*) { return true; });
}

// ", which is of meniscus extract, bench and verify", of an option that only other commands have.
std::string others_with(const CLI::App& program, const std::string& option) {
  std::vector<std::string> names;
  for (const CLI::App* command : commands_of(program))
    if (command->get_option_no_throw(option)) names.push_back(command->get_name());
  std::string others;
  for (std::size_t k = 0; k < names.size(); ++k)
    others += (k == 0                 ? ", which is of meniscus "
               : k + 1 < names.size() ? ", "
                                      : " and ") +
              names[k];
  return others;
}

// The first name with the same last word: --particle-radius for --radius.
std::string name_that_ends_as(const std::string& option, const std::vector<std::string>& names) {
  const auto found = std::find_if(names.begin(), names.end(), [&](const std::string& name) {
    return option.starts_with("--") && name.ends_with(option.substr(1));
  });
  return found != names.end() ? *found : "";
}

// Where an earlier run's results are given without the option that takes them.
std::string comparison_for(const CLI::App& command, const std::string& word) {
  if (!word.ends_with(".json") || !command.get_option_no_throw("--compare")) return "";
  return word + ": no word is wanted here, did you mean --compare " + word + "?";
}

std::string unknown_command(const CLI::App& parent, const std::string& word) {
  const std::string line = "there is no command " + word;
  if (std::filesystem::exists(word) && !parent.get_parent())
    return line + ", to extract the surface of a file: meniscus extract " + word +
           " -o surface.png";
  std::vector<std::string> names;
  for (const CLI::App* known : commands_of(parent)) names.push_back(known->get_name());
  return line + question(nearest_name(word, names));
}

}  // namespace

const CLI::App& chosen_command(const CLI::App& program) {
  const CLI::App* command = &program;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  return *command;
}

std::string spelled(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  return parent ? spelled(*parent) + " " + command.get_name() : "meniscus";
}

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

std::string unknown_word(const CLI::App& program, const std::vector<std::string>& typed) {
  const std::vector<std::string> unknown = program.remaining(true);
  const auto is_unknown = [&](const std::string& word) {
    return std::find(unknown.begin(), unknown.end(), word) != unknown.end();
  };
  const CLI::App& command = chosen_command(program);
  for (const std::string& word : typed) {
    if (word == "--") break;  // what follows is no option
    if (!is_unknown(word)) continue;
    if (word.starts_with('-') && word.size() > 1) {
      const std::string name = word.substr(0, word.find('='));
      const std::string line = spelled(command) + " has no option " + name;
      if (const std::string others = others_with(program, name); !others.empty())
        return line + others;
      std::vector<std::string> names;
      for (const CLI::Option* option : command.get_options())
        for (const std::string& known : option->get_lnames()) names.push_back("--" + known);
      const std::string nearest = nearest_name(name, names);
      return line + question(nearest.empty() ? name_that_ends_as(name, names) : nearest);
    }
    if (const std::string what = comparison_for(command, word); !what.empty()) return what;
    if (!commands_of(command).empty()) return unknown_command(command, word);
  }
  return "";
}

}  // namespace meniscus::cli
