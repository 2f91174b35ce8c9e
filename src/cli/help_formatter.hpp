// How --help looks.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace meniscus::cli {

/// CLI11's help, with descriptions wrapped and without its remarks on what needs or excludes what.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter();
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_option_opts(const CLI::Option* option) const override;
};

}  // namespace meniscus::cli
