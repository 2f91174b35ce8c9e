#include "cli/commands.hpp"

namespace meniscus::cli {

void add_bench_command(CLI::App& program) {
  CLI::App& command =
      *program.add_subcommand("bench", "Measure how fast this machine's devices are");
  command.require_subcommand(1);
  add_bench_frame_command(command);
}

}  // namespace meniscus::cli
