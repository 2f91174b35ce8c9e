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

/// The first of the words typed that neither `program` nor the command chosen knows, with the
/// nearest that it does know: "there is no command exract, did you mean extract?". Empty: all are
/// known.
std::string unknown_word(const CLI::App& program, const std::vector<std::string>& typed);

}  // namespace meniscus::cli
