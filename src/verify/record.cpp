#include "verify/record.hpp"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "base/content_hash.hpp"
#include "meniscus/error.hpp"
#include "verify/cases.hpp"
#include "verify/results.hpp"
#include "verify/trace.hpp"

namespace meniscus::verify {
namespace {

using Say = std::function<void(const std::string&)>;

constexpr int kWidths[] = {1, 8};  // of vectors

Variant plain_variant(int width) { return {"", width, false, kRowGroup, 0}; }

// Holds all stages against double precision at one width: what is wrong here is not to become what
// all others must compute.
void check_stages(Device& device, int width, const Say& say, Origin& origin) {
  const AsVariant as(device, plain_variant(width));
  for (const StageCase& stage : stage_cases())
    for (const int size : stage.sizes) {
      say(std::string("references of ") + stage.stage + ", size " + std::to_string(size) +
          ", width " + std::to_string(width));
      for (const ReferenceError& error : stage.run(device, size)) {
        require(error.ulp <= error.allowed,
                "stage " + std::string(stage.stage) + ", width " + std::to_string(width) +
                    ", size " + std::to_string(size) + ": " + error.output + " of " + error.kernel +
                    " is " + error_in_words(error.ulp) + " off double precision, " +
                    error_in_words(error.allowed) + " allowed");
        ++origin.references;
        if (error.allowed > 0) origin.share = std::max(origin.share, error.ulp / error.allowed);
      }
    }
}

// Keeps the trace of what `run` launches at one width and, where `values`, what small buffers hold.
template <class Run>
void record_trace(Device& device, const std::string& key, int width, bool values, const Run& run,
                  const Say& say, Canonical& canonical) {
  constexpr std::size_t kMost = 16384;  // bytes of a buffer whose values are kept
  say(key);
  const AsVariant as(device, plain_variant(width));
  std::map<std::uint64_t, std::vector<std::uint8_t>> written;
  Tracer tracer(device, values ? &written : nullptr);
  run();
  canonical.traces[key] = tracer.trace();
  for (auto& [hash, bytes] : written)
    if (bytes.size() <= kMost) canonical.values.emplace(hash, std::move(bytes));
}

}  // namespace

Canonical record_canonical(Device& device, const Say& say) {
  Canonical canonical;
  const DeviceInfo& info = device.info();
  canonical.origin.devices = {
      title_of(DeviceName{info.name, info.platform, info.driver, info.version})};
  for (const int width : kWidths) check_stages(device, width, say, canonical.origin);
  for (const int width : kWidths) {
    for (const Case& which : kernel_cases())
      record_trace(
          device, key_of(which, width), width, which.values, [&] { which.run(device); }, say,
          canonical);
    for (const Scene& frame : whole_frames())
      for (const Method method : frame.methods) {
        const std::string name = frame_key(frame, method);
        const auto run = [&] {
          const std::uint64_t hash = content_hash(surface_of(device, frame, method));
          const auto [place, first] = canonical.frames.emplace(name, hash);
          require(first || place->second == hash,
                  name + ": widths 1 and 8 give different bits on this device");
        };
        record_trace(device, name + ", width " + std::to_string(width), width, false, run, say,
                     canonical);
      }
  }
  return canonical;
}

}  // namespace meniscus::verify
