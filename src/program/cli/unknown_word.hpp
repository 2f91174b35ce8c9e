// What to say of a word on the command line that the program does not know.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace meniscus::cli {

/// The command that was chosen on the command line, or `program` where none was.
const CLI::App& chosen_command(const CLI::App& program);

/// The words that a command is called with: "meniscus bench frame".
std::string spelled(const CLI::App& command);

/// The first of the words typed that neither `program` nor the command chosen knows, with what may
/// have been meant: the nearest word that it does know ("there is no command exract, did you mean
/// extract?"), or the other commands that have such an option. Empty: all are known.
std::string unknown_word(const CLI::App& program, const std::vector<std::string>& typed);

/// The name that differs least from `word`, where few letters do; else empty.
std::string nearest_name(const std::string& word, const std::vector<std::string>& names);

}  // namespace meniscus::cli
