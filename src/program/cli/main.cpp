// The program meniscus: arguments in, exit code out. All errors end here, as one line.
#include <fcntl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <thread>
#include <vector>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "meniscus/extract.hpp"
#include "program/cli/commands.hpp"
#include "program/cli/extract_options.hpp"
#include "program/cli/help_formatter.hpp"
#include "program/cli/newer_tbb.hpp"
#include "program/cli/signals.hpp"
#include "program/cli/terminal.hpp"
#include "program/cli/unknown_word.hpp"
#include "program/mpi/launch.hpp"
#include "program/wording.hpp"

namespace {

enum ExitCode { kDone = 0, kFailed = 1, kBadUsage = 2 };  // 3 and more: see extract

int fail(ExitCode code, const std::string& what) {
  const std::string line = meniscus::end_team(what.empty() ? "unknown error" : what);
  if (meniscus::launch().rank > 0) {
    if (meniscus::has_team()) return code;
    // Most likely all processes have the same to say: mpirun stops the others when one has ended.
    std::this_thread::sleep_for(std::chrono::seconds(5));
  }
  meniscus::cli::print_line(stderr, "meniscus: error: " + line);
  return code;
}

/// A name that is empty is most likely a variable that a script has not set: taken for none, it
/// would mean a camera that nobody chose, or no log.
void refuse_empty_names(CLI::App& command) {
  const CLI::Validator named(
      [](const std::string& text) {
        return text.empty() ? std::string("is empty, must be a name") : std::string();
      },
      "");
  for (CLI::Option* option : command.get_options()) {
    const std::string type = option->get_type_name();
    if (type.starts_with("FILE") || type == "DIR" || type.find(".json") != std::string::npos)
      option->check(named);
  }
  for (CLI::App* part : command.get_subcommands({})) refuse_empty_names(*part);
}

/// CLI11's error in the words of all others: what was found, and what is wanted.
std::string in_own_words(const CLI::ParseError& error) {
  const std::string what = error.what();
  const std::string unread = "Could not convert: ", repeated = ": At Most 1 required but received ",
                    excluding = " excludes ",
                    unexpected = " not expected: ", out_of_range = ": is ",
                    missing = ": 1 required ", most = ": At Most ",
                    received = " required but received ";
  if (const std::size_t at = what.find(out_of_range);
      (what.starts_with("--") || what.starts_with("INPUT: ") || what.starts_with("LOG: ")) &&
      at != std::string::npos)
    return what.substr(0, at) + what.substr(at + 1);
  if (const std::size_t at = what.find(missing); at != std::string::npos)
    return what.substr(0, at) + " is given without its value";
  if (const std::size_t at = what.find(unexpected); at != std::string::npos)
    return what.substr(at + unexpected.size()) +
           ": no word is wanted here (options begin with -, names with spaces want quotes)";
  if (const std::size_t at = what.find(" = ");
      what.starts_with(unread) && at != std::string::npos) {
    const std::string text = what.substr(at + 3);
    double number = 0;
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number);
    const bool is_number = code == std::errc() && end == text.data() + text.size();
    return what.substr(unread.size(), at - unread.size()) + " is " + text + ", must be a " +
           (is_number ? "whole number" : "number");
  }
  if (const std::size_t at = what.find(repeated); at != std::string::npos)
    return what.substr(0, at) + " is given " + what.substr(at + repeated.size()) +
           " times, must be given once";
  if (const std::size_t at = what.find(most), then = what.find(received);
      at != std::string::npos && then != std::string::npos)
    return what.substr(0, at) + " is given " + what.substr(then + received.size()) +
           " names, must be at most " + what.substr(at + most.size(), then - at - most.size());
  if (const std::size_t at = what.find(excluding); at != std::string::npos) {
    const std::string one = what.substr(0, at), other = what.substr(at + excluding.size());
    return one + " and " + other + " are both given, must be one of them";
  }
  return what;
}

/// What is wrong with the words that were typed, and where to read more.
std::string misuse(const CLI::App& program, const std::vector<std::string>& typed,
                   const CLI::ParseError& error) {
  const CLI::App& command = meniscus::cli::chosen_command(program);
  const std::string see = "see " + meniscus::cli::spelled(command) + " --help)";
  if (const std::string what = meniscus::cli::unknown_word(program, typed); !what.empty())
    return what + " (" + see;
  const std::string name = command.get_name();
  const bool makes_surface = name == "extract" || name == "mesh";
  const bool lacks = dynamic_cast<const CLI::RequiredError*>(&error) != nullptr;
  std::vector<std::string> unknown = program.remaining(true);
  unknown.erase(std::remove(unknown.begin(), unknown.end(), "--"), unknown.end());
  // A shell puts all frames in the place of a * without quotes; and who forgets -o has two names.
  if (makes_surface && (lacks || dynamic_cast<const CLI::ExtrasError*>(&error)) && !unknown.empty())
    return "wanted one INPUT, found " + std::to_string(unknown.size()) + " more, e.g. " +
           unknown.front() +
           " (each output wants an -o before it; of a sequence give one name in quotes, e.g. "
           "'dam.####.ply'; " +
           see;
  if (&command == &program)
    return "no command is given, e.g. meniscus extract FILE -o surface.png (" + see;
  const std::string words = in_own_words(error);
  if (makes_surface && words == "INPUT is required")
    return words + ", e.g. " + meniscus::cli::spelled(command) + " frame.ply -o surface." +
           (name == "mesh" ? "ply (" : "png (") + see;
  if (makes_surface && words == "--output is required")
    return words + ", e.g. -o surface." + (name == "mesh" ? "ply (" : "png (") + see;
  if (name == "report" && words.ends_with(" is required"))
    return words + ", e.g. meniscus report dam.jsonl -o report.html (" + see;
  if (name == "generate" && words.find("--from") != std::string::npos)
    return words +
           ", e.g. meniscus generate --whitewater foam --from water.ply --particles 1e6 "
           "-o foam.ply (" +
           see;
  if (name == "generate" && words.ends_with(" is required"))
    return words + ", e.g. meniscus generate --particles 1e5 -o dam.ply (" + see;
  if (words.ends_with(')')) return words.substr(0, words.size() - 1) + "; " + see;
  return words + " (" + see;
}

/// The end of work that succeeded here; other processes may have failed.
int done(int code) {
  if (std::fflush(stdout) != 0)
    return fail(kFailed, std::string("standard output cannot be written: ") + std::strerror(errno));
  const std::string error = meniscus::end_team("");
  return error.empty() ? code : fail(kFailed, error);
}

// A stream that was closed at the start gives its number to the next file that is opened, and what
// is printed would go into that file.
void keep_closed_streams_closed() {
  int held = 0;
  while ((held = open("/dev/null", O_RDONLY)) >= 0 && held <= STDERR_FILENO) {
  }
  close(held);
}

// Frames need much the same memory one after the other. Left alone, glibc returns what a frame
// frees to the system, and the next frame pays for every page again: a third of the processor time
// of a fast method. Blocks beyond 64 MB still go back at once.
void keep_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 64 << 20);
  mallopt(M_TRIM_THRESHOLD, 512 << 20);
#endif
}

int run(int argc, char** argv) {
  CLI::App program(
      "Meniscus turns the particles of a fluid simulation into the surface that a camera sees.",
      "meniscus");
  program.formatter(std::make_shared<meniscus::cli::HelpFormatter>());
  program.set_version_flag("-V,--version", "meniscus " + meniscus::version());
  program.require_subcommand(1);
  int exit_code = kDone;
  meniscus::cli::add_extract_command(program, exit_code);
  meniscus::cli::add_mesh_command(program, exit_code);
  meniscus::cli::add_devices_command(program);
  meniscus::cli::add_generate_command(program);
  meniscus::cli::add_report_command(program);
#ifdef MENISCUS_TOOLS
  meniscus::cli::add_bench_command(program, exit_code);
  meniscus::cli::add_verify_command(program, exit_code);
  meniscus::cli::add_tune_command(program);
#else
  for (const char* name : {"bench", "verify", "tune"})
    program.add_subcommand(name, "Not in this program: build it with -DMENISCUS_TOOLS=ON")
        ->allow_extras()
        ->callback([name] {
          throw meniscus::Error(
              std::string(name) +
              " is not in this program, which scripts/demo.sh may have built: run "
              "cmake --preset release && cmake --build --preset release");
        });
#endif
  for (CLI::App* command : program.get_subcommands({})) {
    command->group("Commands");
    for (CLI::App* part : command->get_subcommands({})) part->group("Commands");
  }
  program.footer(
      "meniscus help extract explains the options of extract, and so on.\n"
      "A first picture: meniscus generate --particles 1e5 -o dam.ply && meniscus extract dam.ply "
      "-o a.png");
  refuse_empty_names(program);
  std::vector<std::string> typed(argv + std::min(argc, 1), argv + argc);
  if (!typed.empty() && typed.front() == "help") {  // meniscus help extract
    typed.erase(typed.begin());
    typed.push_back("--help");
  }
  if (typed.empty() || typed.front() != "extract")  // others have all of it on --help
    std::ranges::replace(typed, std::string("--help-all"), std::string("--help"));
  if (!typed.empty() && typed.front() == "mesh") meniscus::cli::fill_in_numbers(typed);
  try {
    program.parse(std::vector<std::string>(typed.rbegin(), typed.rend()));
    return done(exit_code);
  } catch (const CLI::Success& help) {  // --help and --version
    std::erase_if(typed, [](const std::string& word) { return word.starts_with('-'); });
    if (const std::string what = meniscus::cli::unknown_word(program, typed); !what.empty())
      return fail(kBadUsage, what + " (see meniscus --help)");
    return done(program.exit(help));
  } catch (const CLI::ParseError& error) {
    return fail(kBadUsage, misuse(program, typed, error));
  }
}

}  // namespace

int main(int argc, char** argv) {
  int code = kDone;
  try {
    keep_closed_streams_closed();
    meniscus::cli::start_with_newer_tbb(argv);
    keep_freed_memory();
    meniscus::cli::handle_signals();
    code = run(argc, argv);
  } catch (const std::bad_alloc&) {
    code = fail(kFailed, "out of memory: use fewer particles or a smaller image");
  } catch (const std::exception& error) {
    code = fail(kFailed, meniscus::words_of(error));
  }
  meniscus::leave_team();
  return meniscus::cli::end_with(code);
}
