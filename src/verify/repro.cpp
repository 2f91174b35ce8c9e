#include "verify/repro.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "base/printed.hpp"
#include "device/installation.hpp"
#include "io/input_file.hpp"
#include "io/output_file.hpp"
#include "meniscus/extract.hpp"

namespace meniscus::verify {
namespace {

namespace fs = std::filesystem;

constexpr char kUnfinished[] = ".part";  // behind a name that begins with a dot

// For names of files: letters, digits and underscores.
std::string plain(const std::string& text) {
  std::string name;
  for (const char c : text) {
    const bool good = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    if (good || c == '_')
      name += c;
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  return name;
}

std::string hex_of(const Bytes& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += printed("%02x", byte);
  return text;
}

// One line, whatever a driver says of itself.
std::string in_one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

void write_file(const fs::path& path, std::string_view text) {
  std::ofstream file(path, std::ios::binary);
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  file.close();
  if (!file) throw OutputError(cannot_be_written(path.string(), errno));
}

void write_file(const fs::path& path, const Bytes& bytes) {
  write_file(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

// Asks other devices for values whose hashes alone are known. Returns who knew them.
std::string find_expected(SavedLaunch& launch, const OtherDevices& others) {
  const auto unknown = [](const SavedLaunch::Argument& a) { return a.is_buffer && !a.expected; };
  const auto any_unknown = [&] {
    return std::any_of(launch.arguments.begin(), launch.arguments.end(), unknown);
  };
  if (!any_unknown()) return "the canonical ones, which are part of Meniscus";
  for (std::size_t k = 0; Device* const other = others ? others(k) : nullptr; ++k) try {
      const std::vector<Bytes> left = run_again(*other, launch);
      for (std::size_t a = 0; a < left.size(); ++a)
        if (SavedLaunch::Argument& argument = launch.arguments[a];
            unknown(argument) && hash_of(left[a], argument.name) == argument.hash)
          argument.expected = left[a];
      if (!any_unknown())
        return "what " + other->info().name + " (" + other->info().platform + ", driver " +
               other->info().driver + ") leaves, whose hash is the canonical one";
    } catch (const DeviceError&) {
      // It cannot run this; the next one may.
    }
  return "not known for all arguments: Meniscus has only their hash, and no other device here "
         "leaves the same";
}

// "argument depth: 3 of 64 values differ, ..." of the first argument that does.
std::string verdict_of(const SavedLaunch& launch, const std::vector<Bytes>& found) {
  for (std::size_t k = 0; k < found.size(); ++k) {
    const SavedLaunch::Argument& argument = launch.arguments[k];
    if (!argument.is_buffer || hash_of(found[k], argument.name) == argument.hash) continue;
    return argument.expected
               ? difference(argument.name, argument.floats, *argument.expected, found[k])
               : "argument " + argument.name + ": other bits than the canonical ones";
  }
  return "";
}

std::string range_of(const Range& range) {
  return std::to_string(range.nx) + " x " + std::to_string(range.ny) + " work-items in groups of " +
         std::to_string(range.group_x) + " x " + std::to_string(range.group_y);
}

// The lines of launch.txt before those of the arguments.
std::string head_of(const SavedLaunch& launch, const DeviceInfo& device) {
  std::string text = "device " + in_one_line(device.name) + "\n";
  if (const char* mode = std::getenv(kIntelVectorizer))
    text += std::string("environment ") + kIntelVectorizer + " " + mode + "\n";
  const Range& range = launch.range;
  return text + "kernel " + launch.kernel + "\noptions " + in_one_line(launch.build_options) +
         "\nrange " + std::to_string(range.nx) + " " + std::to_string(range.ny) + " groups " +
         std::to_string(range.group_x) + " " + std::to_string(range.group_y) + "\n";
}

// What launch.txt and the README say of the arguments.
struct WrittenArguments {
  std::string lines, table;
};

// Writes the values of the buffers as files of the folder.
WrittenArguments write_arguments(const SavedLaunch& launch, const fs::path& folder) {
  WrittenArguments written;
  auto& [lines, table] = written;
  for (std::size_t k = 0; k < launch.arguments.size(); ++k) {
    const SavedLaunch::Argument& argument = launch.arguments[k];
    const std::string own = argument.name.empty() ? "argument" : argument.name;
    table += "| " + std::to_string(k) + " | " + own + " | ";
    if (!argument.is_buffer) {
      lines += "scalar " + own + " " + hex_of(argument.before) + "\n";
      table += counted(argument.before.size(), "byte") + " | " + hex_of(argument.before) + " |\n";
      continue;
    }
    const std::string before = printed("%02zu_", k) + plain(own) + ".before.bin",
                      after = printed("%02zu_", k) + plain(own) + ".expected.bin";
    write_file(folder / before, argument.before);
    const bool same = argument.expected && *argument.expected == argument.before;
    if (argument.expected && !same) write_file(folder / after, *argument.expected);
    const std::string expected = !argument.expected ? "-" : same ? before : after;
    const std::size_t bytes = argument.before.size();
    lines += "buffer " + own + " floats " + (argument.floats ? "1" : "0") + " entry " +
             std::to_string(unordered_entry(own)) + " bytes " + std::to_string(bytes) + " room " +
             std::to_string(argument.room) + " " + before + " " + expected + "\n";
    table += counted(bytes, "byte") + (argument.floats ? " of floats" : "") + " | " + before +
             (same                ? ", stays as it is"
              : argument.expected ? ", becomes " + after
                                  : "") +
             " |\n";
  }
  return written;
}

}  // namespace

Reproducers::Reproducers(std::string folder, const DeviceInfo& device, OtherDevices others)
    : folder_(std::move(folder)), device_(device), others_(std::move(others)) {}

void Reproducers::set_case(const std::string& variant, const std::string& size) {
  variant_ = variant;
  size_ = size;
}

std::string Reproducers::how_it_ended(const std::string& kernel) const {
  const auto found = ended_.find(kernel);
  return found == ended_.end() ? "" : found->second;
}

std::string Reproducers::name_of(const std::string& kernel) const {
  return plain(kernel) + "." + plain(variant_) + ".device_" + std::to_string(device_.index);
}

bool Reproducers::wants(const std::string& kernel) const {
  const std::string name = name_of(kernel);
  return !written_.contains(name) && !fs::exists(fs::path(folder_) / name);
}

std::string Reproducers::write(SavedLaunch launch, const std::string& where,
                               const std::vector<Bytes>& found, const std::string& what) {
  const std::string name = name_of(launch.kernel);
  written_.insert(name);
  const std::string origin = find_expected(launch, others_);

  const fs::path folder = fs::path(folder_) / name,
                 unfinished = fs::path(folder_) / ("." + name + kUnfinished);
  std::error_code error;
  fs::remove_all(unfinished, error);
  if (!fs::create_directories(unfinished, error))
    throw OutputError(cannot_be_written(unfinished.string(), error.value()));
  const WrittenArguments arguments = write_arguments(launch, unfinished);
  write_file(unfinished / "launch.txt", head_of(launch, device_) + arguments.lines);
  write_file(unfinished / "kernel.cl", launch.source);
  for (const char* file : {"host.c", "Makefile"}) write_file(unfinished / file, repro_file(file));
  write_file(
      unfinished / "README.md",
      "# " + launch.kernel + " on " + in_one_line(device_.name) + "\n\n**" +
          (what.empty() ? verdict_of(launch, found) : what) + "**\n\nFound by `meniscus verify` " +
          version() + " in " + where + " of " + size_ + ", " + variant_ +
          ".\n\n"
          "    make && ./host          # here; ./host GPU 100: on a device with GPU in its "
          "name, up to 100 runs; else 20 runs, and more until 10 s have passed\n\n"
          "The host says what differs and ends with exit code 1, or with 0 where all bits "
          "are as expected. Where the launch crashes or hangs, so does the host. It needs a C "
          "compiler and an OpenCL 1.2 loader with its headers, and nothing of Meniscus.\n\n"
          "- Device: " +
          in_one_line(device_.name + ", " + device_.platform + ", driver " + device_.driver + ", " +
                      device_.version) +
          "\n- Source: kernel.cl, which is records.h, nouns.h, prelude.cl and " + launch.file +
          " in one; built with `" + launch.build_options + "`\n- Range: " + range_of(launch.range) +
          "\n- Expected bits: " + origin +
          "\n\n| argument | name | size | value |\n|---|---|---|---|\n" + arguments.table);
  fs::rename(unfinished, folder, error);
  if (error) throw OutputError(cannot_be_written(folder.string(), error.value()));
  return folder.string();
}

void make_folder(const std::string& folder) {
  std::error_code error;
  const fs::file_status status = fs::status(folder, error);
  require(!fs::exists(status) || fs::is_directory(status),
          folder + ": is no folder, wanted one that is empty or not there");
  const bool is_empty = !fs::exists(status) || fs::is_empty(folder, error);
  if (fs::exists(status) && error) throw OutputError(cannot_be_written(folder, error.value()));
  require(is_empty,
          folder +
              ": is not empty, wanted a folder that is empty or not there (name another one, "
              "or remove what is in it)");
  error.clear();
  fs::create_directories(folder, error);
  if (error) throw OutputError(cannot_be_written(folder, error.value()));
}

std::vector<std::string> finish_folder(const std::string& folder) {
  std::vector<std::string> names;
  std::vector<fs::path> unfinished;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.') && name.ends_with(kUnfinished))
      unfinished.push_back(entry.path());
    else
      names.push_back(name);
  }
  for (const fs::path& path : unfinished) fs::remove_all(path, error);
  if (names.empty()) fs::remove(folder, error);
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace meniscus::verify
