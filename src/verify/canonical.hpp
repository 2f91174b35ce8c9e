// The canonical bits: what every launch of every case leaves in its buffers, on any device.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace meniscus::verify {

/// What a launch left in a buffer that it changed.
struct Written {
  int argument = 0;        // of the kernel, from 0 on
  std::uint64_t hash = 0;  // of the buffer's values after the launch
  bool operator==(const Written&) const = default;
};

/// A launch, as far as it can be compared from device to device.
struct TracedLaunch {
  std::string stage, kernel;
  std::uint64_t inputs = 0;  // hash of all buffers before the launch
  std::vector<Written> written;
};

using Trace = std::vector<TracedLaunch>;

/// All that is known of what devices should compute.
struct Canonical {
  std::map<std::string, Trace> traces;  // by the case's name and the variant's
  std::map<std::uint64_t, std::vector<std::uint8_t>> values;  // of small cases, by their hash
  std::map<std::string, std::uint64_t> frames;  // content_hash of whole frames, by name
};

/// As the bytes of a file, deflated, and back. Throws InputError when the bytes are none.
std::string to_bytes(const Canonical& canonical);
Canonical canonical_from(std::string_view bytes);

/// What this release was made with.
const Canonical& shipped_canonical();

}  // namespace meniscus::verify

namespace meniscus {

/// The bytes of the file that the build puts into the program ("canonical.bin").
std::string_view canonical_file(std::string_view name);

}  // namespace meniscus
