// What launches the kernels that are verified, and in which variants.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <tuple>
#include <vector>

#include "device/device.hpp"
#include "verify/scenes.hpp"
#include "verify/stage_cases.hpp"

namespace meniscus::verify {

/// How the kernels are built and launched. All variants of a width have the same launches.
struct Variant {
  std::string name;
  int width;
  bool wide;                  // vectors of 16 where they are kept busy (Device::State::wide_width)
  std::size_t group;          // of rows of work-items
  std::size_t largest_group;  // that the device is taken to allow; 0: its own
};

const std::vector<Variant>& variants();

/// Sets a device to a variant while it lives.
class AsVariant {
 public:
  AsVariant(Device& device, const Variant& variant) : state_(device.state()), before_(settings()) {
    std::uint64_t largest = state_.info.largest_group;
    if (variant.largest_group > 0)
      largest = std::min<std::uint64_t>(largest, variant.largest_group);
    // What draws by minima has cases of its own.
    settings() = std::tuple{variant.width, variant.wide, variant.group, DiscForm::bins, largest};
  }
  ~AsVariant() { settings() = before_; }
  AsVariant(const AsVariant&) = delete;
  AsVariant& operator=(const AsVariant&) = delete;

 private:
  std::tuple<int&, bool&, std::size_t&, DiscForm&, std::uint64_t&> settings() {
    return {state_.vector_width, state_.wide, state_.row_group, state_.discs,
            state_.info.largest_group};
  }
  Device::State& state_;
  std::tuple<int, bool, std::size_t, DiscForm, std::uint64_t> before_;
};

/// Something that launches kernels, always the same ones.
struct Case {
  std::string name, size;
  bool small, values;  // values: the canonical ones are shipped, not only their hashes
  std::function<void(Device&)> run;
};

/// Every method, pass and stage that launches kernels of ours.
const std::vector<Case>& kernel_cases();

/// The one of a stage and one of its sizes.
Case case_of(const StageCase& stage, int size);

/// What a case's canonical trace is called at a width of vectors; what a frame is called.
std::string key_of(const Case& which, int width);
std::string frame_key(const Scene& frame, Method method);

}  // namespace meniscus::verify
