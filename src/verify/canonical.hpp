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

/// Where canonical bits come from.
struct Origin {
  std::vector<std::string> devices;  // that gave these bits, with platform and driver
  std::string commit;                // of the sources, as whoever recorded them named it
  std::uint64_t references = 0;  // values of stages held against double precision, all in bounds
  double share = 0;              // of its bound that the worst of them used

  /// "recorded on A and B at commit C; 120 outputs within their bounds of double precision".
  std::string words() const;
};

/// All that is known of what devices should compute.
struct Canonical {
  Origin origin;
  std::map<std::string, Trace> traces;  // by the case's name and the variant's
  std::map<std::uint64_t, std::vector<std::uint8_t>> values;  // of small cases, by their hash
  std::map<std::string, std::uint64_t> frames;  // content_hash of whole frames, by name
};

/// What several devices computed, if all of them say the same; the origin names them all. Throws
/// InvalidArgument, naming two devices, the case and the first launch that differs.
Canonical agreed(const std::vector<Canonical>& found);

/// As the bytes of a file, deflated, and back. Throws InputError when the bytes are none. A file of
/// before there were origins has an empty one.
std::string to_bytes(const Canonical& canonical);
Canonical canonical_from(std::string_view bytes);

/// What this release was made with.
const Canonical& shipped_canonical();

}  // namespace meniscus::verify

namespace meniscus {

/// The bytes of the file that the build puts into the program ("canonical.bin").
std::string_view canonical_file(std::string_view name);

}  // namespace meniscus
