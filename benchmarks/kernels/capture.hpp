// What the launches of a kernel in a whole frame read and wrote: the inputs of its native version,
// and what that has to come to.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "kernels/frame.hpp"

namespace meniscus::bench {

/// A launch. Arguments are numbered as in the kernel's head.
class CapturedLaunch {
 public:
  std::size_t number = 0;  // of the kernel's launches in the frame, from 0

  /// An argument that the kernel only reads. A vector may be loaded from where its last value is.
  template <class T>
  const T* read(std::size_t argument) const {
    return reinterpret_cast<const T*>(before_[argument]->data());
  }
  /// An argument that the kernel writes, for the native version to write instead.
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
  std::vector<std::shared_ptr<const Bytes>> before_, after_;  // null: a scalar, or only read
  std::vector<Bytes> own_;
};

/// The launches of a kernel in a frame, in order. `written` are the arguments that it writes.
std::vector<CapturedLaunch> capture_launches(Frame& frame, Method method, const std::string& kernel,
                                             const std::vector<std::size_t>& written);

}  // namespace meniscus::bench
