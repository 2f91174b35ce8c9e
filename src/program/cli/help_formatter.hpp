// How --help looks.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace meniscus::cli {

/// CLI11's help, with descriptions wrapped and without its remarks on what needs or excludes what.
/// Of a command with --help-all, --help has only what most people need, on one screen.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter();
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_option_opts(const CLI::Option* option) const override;
  std::string make_help(const CLI::App* command, std::string name,
                        CLI::AppFormatMode mode) const override;
  std::string make_footer(const CLI::App* command) const override;

 private:
  std::string first_clause(const CLI::Option* option) const;
  std::string wrapped(const CLI::Option* option, bool is_positional,
                      const std::string& description) const;
};

}  // namespace meniscus::cli
