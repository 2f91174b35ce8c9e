// What the launches of a kernel read and wrote: the inputs of its native version, and what that has
// to come to.
#pragma once

#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "device/device.hpp"
#include "kernels/cases.hpp"
#include "kernels/native/native.hpp"

namespace meniscus::bench {

/// A launch. Arguments are numbered as in the kernel's head.
class CapturedLaunch {
 public:
  /// The value of an argument that is no buffer.
  template <class T>
  T scalar(std::size_t argument) const {
    T value;
    std::memcpy(&value, before_[argument]->data(), sizeof value);
    return value;
  }
  /// A buffer that the kernel only reads. A vector may be loaded from where its last value is.
  template <class T>
  const T* read(std::size_t argument) const {
    return reinterpret_cast<const T*>(before_[argument]->data());
  }
  /// A buffer that the kernel writes, for the native version to write instead.
  template <class T>
  T* write(std::size_t argument) {
    return reinterpret_cast<T*>(own_[argument].data());
  }
  /// Before a run of the native version.
  void reset();
  /// How many words of what it wrote are not the kernel's.
  std::size_t differing() const;

 private:
  friend class Capture;
  using Bytes = std::vector<std::uint8_t>;
  std::vector<std::shared_ptr<const Bytes>> before_, after_;  // after_ is null where only read
  std::vector<Bytes> own_;
};

/// The launches of a kernel, in order, while `run` runs. `written` are the arguments that it
/// writes.
std::vector<CapturedLaunch> capture_launches(Device& device, const std::string& kernel,
                                             const std::vector<std::size_t>& written,
                                             const std::function<void()>& run);

/// Gives a case a native version that goes through captured launches, one by one.
void add_native(Case& result, std::vector<CapturedLaunch> captured,
                const std::function<void(CapturedLaunch& launch, Workers& workers)>& run);

}  // namespace meniscus::bench
