#include "program/batch/job.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <vector>

#include "base/content_hash.hpp"
#include "base/printed.hpp"
#include "io/input_file.hpp"
#include "io/parts.hpp"
#include "io/seal.hpp"
#include "program/batch/outputs.hpp"

namespace meniscus {
namespace {

namespace fs = std::filesystem;

// What tells a file from another of its name: size, time, and a hash of its content, of which as
// much is read as is cheap beside extracting it: all of up to 16 MiB, else pieces from its begin to
// its end.
std::string trace_of(const std::string& path) {
  constexpr std::uintmax_t kPieces = 16;
  std::vector<char> piece(std::size_t{1} << 20);
  const OpenFile file = open_input(path);
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  const auto time = fs::last_write_time(path, error).time_since_epoch().count();
  const std::uintmax_t step = std::max<std::uintmax_t>(
      piece.size(), size > piece.size() ? (size - piece.size()) / (kPieces - 1) : 0);
  std::string trace =
      fs::path(path).filename().string() + '\n' + std::to_string(size) + ' ' + std::to_string(time);
  for (std::uintmax_t k = 0; k < kPieces; ++k) {
    std::fseek(file.get(), static_cast<long>(k * step), SEEK_SET);
    const std::size_t count = std::fread(piece.data(), 1, piece.size(), file.get());
    if (count == 0) break;
    trace += ' ' + hex_digits(content_hash(piece.data(), count));
  }
  return trace + '\n';
}

// How an output was made where each 16 digits of its job differ.
constexpr std::array kOtherJobs{"by another program", "with other parameters",
                                "with another camera", "from another input"};

std::string exactly(double value) { return printed("%a ", value); }

std::string parameters_in_words(const BatchSettings& settings,
                                const std::vector<std::string>& outputs) {
  // How files of a kind are written does not matter where there is none of it.
  const auto writes = [&](OutputKind kind) {
    return std::ranges::any_of(outputs,
                               [kind](const std::string& path) { return kind_of(path) == kind; });
  };
  const bool exr = writes(OutputKind::exr), png = writes(OutputKind::png);
  std::string words = describe(settings.parameters);
  for (const double value :
       {settings.particle_radius, settings.parameters.particle_radius, settings.others_radius,
        static_cast<double>(settings.parameters.motion), exr ? settings.frames_per_second : 0,
        exr ? static_cast<double>(settings.writing.compression) : 0,
        exr ? static_cast<double>(settings.writing.half) : 0,
        png ? static_cast<double>(settings.writing.preview) : 0})
    words += exactly(value);
  for (const std::string& name : settings.reading.attributes) words += name + '\n';
  if (settings.closed)
    words += "closed " + exactly(settings.closed->cell) + exactly(settings.closed->adaptive);
  return words + settings.reading.dataset + '\n' + std::to_string(settings.reading.timestep);
}

std::string cameras_in_words(const Camera& camera, const Camera& next_camera) {
  std::string words = std::to_string(camera.width) + " " + std::to_string(camera.height) + "\n";
  for (const auto* matrix :
       {&camera.view, &camera.projection, &next_camera.view, &next_camera.projection})
    for (const double value : *matrix) words += exactly(value);
  return words;
}

std::string inputs_in_words(const FrameJob& job) {
  std::string words;
  for (const std::string& part : part_files(job.input)) words += trace_of(part);
  for (const WhitewaterInput& input : job.whitewater) {
    words += to_string(input.type) + " " + input.attribute + printed(" %.17g\n", input.value);
    if (!input.path.empty())
      for (const std::string& part : part_files(input.path)) words += trace_of(part);
  }
  return words;
}

}  // namespace

std::string job_of(const FrameJob& job, const Camera& camera, const Camera& next_camera,
                   const BatchSettings& settings) {
  std::string digits;  // in the order of kOtherJobs
  for (const std::string& part : {settings.program, parameters_in_words(settings, job.outputs),
                                  cameras_in_words(camera, next_camera), inputs_in_words(job)})
    digits += hex_digits(content_hash(part));
  return digits;
}

std::string flaw_in_detail(const std::string& path, const std::string& job) {
  const std::string flaw = flaw_of(path, job);
  if (flaw.empty()) return flaw;
  const std::string made = stated_job(path, job.size());
  if (made.size() != job.size() || !flaw_of(path, "").empty()) return flaw;
  std::string differs;
  for (std::size_t k = 0; k < kOtherJobs.size(); ++k)
    if (const std::size_t at = 16 * k; made.compare(at, 16, job, at, 16) != 0)
      differs.append(differs.empty() ? "was made " : ", ").append(kOtherJobs[k]);
  return differs;
}

}  // namespace meniscus
