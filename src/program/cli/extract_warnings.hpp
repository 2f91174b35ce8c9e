// What is worth a warning before an extraction begins.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "program/cli/extract_options.hpp"

namespace meniscus::cli {

/// Whether one of the outputs can hold velocities and attributes of the particles.
bool has_carried_values(const std::vector<std::string>& outputs);

/// Options that were given and change nothing, each with why.
std::vector<std::string> without_effect(const CLI::App& command, const ExtractOptions& options,
                                        bool is_sequence);

/// Where the pixels of a camera are not square: most likely its size is not that of its projection.
std::vector<std::string> warnings_of(const Camera& camera, const std::string& origin);

/// Where a * stands for nothing but numbers: most likely the frames of a sequence are meant. Where
/// the input is a PLY of faces: a mesh.
std::vector<std::string> warnings_of_input(const std::string& input);

}  // namespace meniscus::cli
