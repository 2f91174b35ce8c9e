#include <bit>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "io/input_file.hpp"
#include "io/output_file.hpp"
#include "meniscus/extract.hpp"
#include "meniscus/whitewater.hpp"
#include "program/cli/commands.hpp"
#include "program/cli/options.hpp"
#include "program/cli/progress.hpp"
#include "program/cli/report.hpp"
#include "program/cli/terminal.hpp"
#include "program/dam_break.hpp"
#include "program/made_whitewater.hpp"

namespace meniscus::cli {
namespace {

struct GenerateOptions {
  std::int64_t particles = 0;
  std::uint64_t seed = 1;
  double noise = DamBreak::kNoise;
  std::optional<WhitewaterType> whitewater;
  std::string water, output;
  bool quiet = false;
};

// Particles that are handed out in blocks of so many values each.
struct Made {
  std::string comments, values;  // lines of the header, "x y z"
  std::int64_t count;
  std::size_t values_each;
  std::function<void(const std::function<void(std::span<const float>)>&)> emit;
};

void write_made(const GenerateOptions& options, const Made& made) {
  OutputFile file(options.output);
  std::string header = "ply\nformat binary_little_endian 1.0\n" + made.comments + ", seed " +
                       std::to_string(options.seed) + "\nelement vertex " +
                       std::to_string(made.count) + "\n";
  std::string word;
  for (const char c : made.values + " ")
    if (c == ' ') {
      header += "property float " + word + "\n";
      word.clear();
    } else {
      word += c;
    }
  file.write(header + "end_header\n");
  {
    Progress progress("generate", "particles", made.count, options.quiet);
    std::int64_t done = 0;
    made.emit([&](std::span<const float> block) {
      static_assert(std::endian::native == std::endian::little);
      file.write(block.data(), block.size_bytes());
      progress.reached(done += static_cast<std::int64_t>(block.size() / made.values_each));
    });
  }
  file.commit();
}

void generate_dam(const GenerateOptions& options) {
  const DamBreak dam =
      as_usage([&] { return DamBreak(options.particles, options.seed, options.noise); });
  const std::string radius = printed("%.9g", dam.particle_radius());
  write_made(options, {"comment particle_radius " + radius +
                           "\ncomment a dam break of meniscus generate " + version(),
                       "x y z", dam.size(), 3, [&](const auto& take) { dam.emit(take); }});
  if (!options.quiet)
    print_line(stderr,
               printed("%-10s %s: %s particles of radius %s", "wrote", options.output.c_str(),
                       grouped(dam.size()).c_str(), radius.c_str()));
}

void generate_whitewater(const GenerateOptions& options) {
  const std::string type = to_string(*options.whitewater);
  const MadeWhitewater made(read_particles(options.water), *options.whitewater, options.particles,
                            options.seed);
  write_made(options, {"comment " + type + " of meniscus generate " + version(),
                       "x y z vx vy vz radius", options.particles, MadeWhitewater::kValues,
                       [&](const auto& take) { made.emit(take); }});
  if (!options.quiet)
    print_line(stderr, printed("%-10s %s: %s particles of %s", "wrote", options.output.c_str(),
                               grouped(options.particles).c_str(), type.c_str()));
}

void run_generate(const GenerateOptions& options) {
  if (!lower_case(options.output).ends_with(".ply"))
    throw CLI::ValidationError("output " + options.output + ": must end in .ply");
  OutputFile probe(options.output);  // better now than later
  if (options.whitewater)
    as_usage([&] { generate_whitewater(options); });
  else
    generate_dam(options);
}

}  // namespace

void add_generate_command(CLI::App& program) {
  CLI::App& command = *program.add_subcommand(
      "generate", "Make a breaking dam of any size, or whitewater for a frame");
  const auto options = std::make_shared<GenerateOptions>();
  GenerateOptions& o = *options;
  command
      .add_option_function<std::string>(
          "--particles", [&o](const std::string& text) { o.particles = parse_particles(text); },
          "how many, 10 to 1e9")
      ->required()
      ->type_name("N");
  command.add_option("--seed", o.seed, "another seed is another frame (default 1)")->type_name("S");
  CLI::Option* noise = command.add_option(
      "--noise", o.noise,
      "noise of the water's particles along each axis, its standard deviation in spacings: .29 is "
      "as irregular as FLIP and MPM are (default 0.05)");
  noise->type_name("N");
  CLI::Option* type = command.add_option_function<std::string>(
      "--whitewater",
      [&o](const std::string& text) {
        o.whitewater = as_usage([&] { return whitewater_named(text); });
      },
      "make foam, spray or bubble (one of these words) for the water of --from instead");
  type->type_name("TYPE")->excludes(noise);
  CLI::Option* water = command.add_option(
      "--from", o.water, "particles of water with velocities and a radius, as for extract");
  water->type_name("FILE")->needs(type);
  type->needs(water);
  command.add_option("-o,--output", o.output, "what to write: .ply (binary)")
      ->required()
      ->type_name("FILE");
  command.add_flag("-q,--quiet", o.quiet, "print only errors");
  command.callback([options] { run_generate(*options); });
}

}  // namespace meniscus::cli
