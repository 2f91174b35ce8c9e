// Kernels of others: what a manifest says of one, and running it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "device/device.hpp"
#include "io/input_file.hpp"
#include "verify/run.hpp"
#include "verify/saved_launch.hpp"

namespace meniscus::verify {

/// A type of OpenCL C: "float", or "int4".
struct ValueType {
  enum class Kind { integer, unsigned_integer, floating };
  std::string name;
  Kind kind = Kind::integer;
  std::size_t bytes = 4;  // of a component
  std::size_t components = 1;

  std::size_t size() const { return bytes * (components == 3 ? 4 : components); }
};

struct ProgramArgument {
  enum class Kind { buffer, value, local };
  std::string name;  // for messages
  Kind kind = Kind::buffer;
  ValueType type;
  Bytes bytes;                    // a buffer's before the launch, or the value
  std::size_t local_bytes = 0;    // of local memory
  bool compared = true;           // buffers: what the launch leaves in it counts
  double ulp = 0;                 // units in the last place that floats may differ by
  std::optional<Bytes> expected;  // buffers: what the launch should leave
};

/// A kernel and all that one launch of it takes.
struct Program {
  std::string name;             // of its manifest, for messages
  std::string source, options;  // as the compiler gets them
  std::string kernel;
  std::vector<std::size_t> range, group;  // work-items; an empty group is left to the driver
  int repeat = 3;                         // runs that must leave the same bits
  std::vector<ProgramArgument> arguments;
};

/// What a manifest says (docs/portability.md). Files that it names lie in its folder, or where
/// their absolute names say. Throws InputError that names the place, what was found and what was
/// wanted. Sizes are checked before anything is allocated or read.
Program read_program(const std::string& source, const std::string& manifest);
/// The same of texts at hand; a manifest that names files is refused.
Program program_of(const std::string& source, const InputFile& manifest);

/// How two contents of a buffer differ: empty where they do not, by more than is allowed. NaN is
/// like NaN.
std::string difference(const ProgramArgument& argument, const Bytes& expected, const Bytes& found,
                       double* ulp = nullptr);

/// Runs it on a device, `repeat` times, each from the same inputs, and tells a row for each of
/// these: whether all runs left the same, and for each argument that is expected to be something,
/// whether it is. Returns what the first run left in each buffer. Throws DeviceError.
std::vector<Bytes> run_program(Device& device, const Program& program, const std::string& group,
                               const Report& report);

/// Rows that say whether devices agree with the first that ran: for each device what it left, empty
/// where it did not run.
void compare_devices(const Program& program, const std::vector<std::string>& names,
                     const std::vector<std::vector<Bytes>>& left,
                     const std::function<void(std::size_t device, Row)>& report);

/// As bytes, one buffer behind the other, and back; empty: `bytes` are no such buffers.
Bytes joined(const std::vector<Bytes>& buffers);
std::vector<Bytes> parted(const Program& program, const Bytes& bytes);

}  // namespace meniscus::verify
