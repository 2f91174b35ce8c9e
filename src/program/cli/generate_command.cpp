#include <bit>
#include <cstdio>
#include <memory>
#include <string>

#include "io/input_file.hpp"
#include "io/output_file.hpp"
#include "meniscus/meniscus.hpp"
#include "program/cli/commands.hpp"
#include "program/cli/options.hpp"
#include "program/cli/progress.hpp"
#include "program/cli/report.hpp"
#include "program/cli/terminal.hpp"
#include "program/dam_break.hpp"

namespace meniscus::cli {
namespace {

struct GenerateOptions {
  std::int64_t particles = 0;
  std::uint64_t seed = 1;
  std::string output;
  bool quiet = false;
};

void run_generate(const GenerateOptions& options) {
  if (!lower_case(options.output).ends_with(".ply"))
    throw CLI::ValidationError("output " + options.output + ": must end in .ply");
  OutputFile file(options.output);
  const DamBreak dam(options.particles, options.seed);
  char radius[32];
  std::snprintf(radius, sizeof radius, "%.9g", dam.particle_radius());
  file.write("ply\nformat binary_little_endian 1.0\ncomment particle_radius " +
             std::string(radius) + "\ncomment a dam break of meniscus generate " + version() +
             ", seed " + std::to_string(options.seed) + "\nelement vertex " +
             std::to_string(dam.size()) +
             "\nproperty float x\nproperty float y\nproperty float z\nend_header\n");
  {
    Progress progress("generate", "particles", dam.size(), options.quiet);
    std::int64_t done = 0;
    dam.emit([&](std::span<const float> block) {
      static_assert(std::endian::native == std::endian::little);
      file.write(block.data(), block.size_bytes());
      progress.reached(done += static_cast<std::int64_t>(block.size() / 3));
    });
  }
  file.commit();
  if (!options.quiet)
    print_line(stderr, printed("%-10s %s: %s particles of radius %s", "wrote",
                               options.output.c_str(), grouped(dam.size()).c_str(), radius));
}

}  // namespace

void add_generate_command(CLI::App& program) {
  CLI::App& command =
      *program.add_subcommand("generate", "Make a breaking dam of any number of particles");
  const auto options = std::make_shared<GenerateOptions>();
  GenerateOptions& o = *options;
  command
      .add_option_function<std::string>(
          "--particles", [&o](const std::string& text) { o.particles = parse_particles(text); },
          "how many, 10 to 1e9")
      ->required()
      ->type_name("N");
  command.add_option("--seed", o.seed, "another seed is another frame (default 1)")->type_name("S");
  command.add_option("-o,--output", o.output, "what to write: .ply (binary)")
      ->required()
      ->type_name("FILE");
  command.add_flag("-q,--quiet", o.quiet, "print only errors");
  command.callback([options] { run_generate(*options); });
}

}  // namespace meniscus::cli
