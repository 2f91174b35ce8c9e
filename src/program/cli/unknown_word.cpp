#include "program/cli/unknown_word.hpp"

#include <algorithm>
#include <filesystem>
#include <numeric>

namespace meniscus::cli {
namespace {

// How many letters must be put in, taken out or replaced.
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] != b[j]);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string question(const std::string& nearest) {
  return nearest.empty() ? "" : ", did you mean " + nearest + "?";
}

std::vector<const CLI::App*> commands_of(const CLI::App& program) {
  return program.get_subcommands([](const CLI::App*) { return true; });
}

// ", which is of meniscus extract and meniscus bench", of an option that only other commands have.
std::string others_with(const CLI::App& program, const std::string& option) {
  if (option == "--help-all") return "";
  std::string others;
  for (const CLI::App* command : commands_of(program))
    if (command->get_option_no_throw(option))
      others +=
          (others.empty() ? ", which is of meniscus " : " and meniscus ") + command->get_name();
  return others;
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

std::string nearest_name(const std::string& word, const std::vector<std::string>& names) {
  std::string best;
  const std::size_t letters_in_word =
      word.size() - std::min(word.size(), word.find_first_not_of('-'));
  std::size_t least = std::max<std::size_t>(1, letters_in_word / 3) + 1;
  for (const std::string& name : names)
    if (const std::size_t letters = distance(word, name); letters < least) {
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
  const CLI::App* command = &program;
  std::string path = "meniscus";
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
    path += " " + command->get_name();
  }
  for (const std::string& word : typed) {
    if (!is_unknown(word)) continue;
    if (word.starts_with('-') && word.size() > 1) {
      const std::string name = word.substr(0, word.find('='));
      const std::string line = path + " has no option " + name;
      if (const std::string others = others_with(program, name); !others.empty())
        return line + others;
      std::vector<std::string> names;
      for (const CLI::Option* option : command->get_options())
        for (const std::string& known : option->get_lnames()) names.push_back("--" + known);
      return line + question(nearest_name(name, names));
    }
    if (!commands_of(*command).empty()) return unknown_command(*command, word);
  }
  return "";
}

}  // namespace meniscus::cli
