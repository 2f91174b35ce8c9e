// A launch with all that it takes to run it again, here or elsewhere.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "device/device.hpp"

namespace meniscus::verify {

using Bytes = std::vector<std::uint8_t>;

struct SavedLaunch {
  struct Argument {
    std::string name;        // in the kernel's text
    bool is_buffer = false;  // else a scalar
    bool floats = false;     // the values are float, else integers
    Bytes before;            // the buffer's values before the launch, or the scalar
    std::size_t room = 0;    // bytes of the whole buffer; zeros behind its values
    // Of buffers: what the launch should leave.
    std::uint64_t hash = 0;         // as hash_of() has it
    std::optional<Bytes> expected;  // not known: none
  };
  std::string file, kernel, options;  // as the stage gave them
  std::string source, build_options;  // as the compiler got them
  Range wanted, range;                // asked for, and launched
  std::vector<Argument> arguments;
};

/// `before` is what the launch's buffers held, `names` what its arguments are called. What the
/// launch should leave is filled in by the caller. `built`: the kernel is, and says how large its
/// groups may be.
SavedLaunch saved(Device& device, const KernelLaunch& launch, const std::vector<Bytes>& before,
                  const std::vector<std::string>& names, bool built);

/// Bytes of an entry of a list that atomics fill in any order, which the kernels that read it do
/// not care for; 0: the values of this argument have an order.
std::size_t unordered_entry(const std::string& argument);

/// Of a buffer's values; of lists without an order, of their entries in any.
std::uint64_t hash_of(const Bytes& bytes, const std::string& argument);

/// "argument depth: 3 of 64 values differ, the first at 5: found 0x3f800001 (1.00000012), wanted
/// 0x3f800000 (1)". `ulp`, where given, becomes the largest difference of floats if it is larger.
std::string difference(const std::string& argument, bool floats, const Bytes& expected,
                       const Bytes& found, double* ulp = nullptr);

/// Runs it on any device, built from that device's own text of the kernels. Returns what it leaves
/// in each argument; of scalars nothing. Throws DeviceError.
std::vector<Bytes> run_again(Device& device, const SavedLaunch& launch);

}  // namespace meniscus::verify
