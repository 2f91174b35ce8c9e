// Several arrays in one piece of memory: each is a buffer of its own to kernels, and one command
// fills, writes or reads them all. Where the device gives no buffer that large, each has its own.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/rounded_up.hpp"
#include "device/device.hpp"

namespace meniscus {

/// Where arrays of so many values lie in the memory that they share.
template <class... T>
struct PartLayout {
  static constexpr std::array<std::size_t, sizeof...(T)> value_bytes{sizeof(T)...};
  explicit PartLayout(const std::array<std::size_t, sizeof...(T)>& values) : size(values) {
    for (std::size_t k = 0; k < sizeof...(T); ++k) {
      origin[k] = bytes;
      bytes += Device::State::part_bytes(size[k] * value_bytes[k]);
    }
  }
  std::size_t end(std::size_t k) const { return origin[k] + size[k] * value_bytes[k]; }  // bytes

  std::array<std::size_t, sizeof...(T)> size;      // values
  std::array<std::size_t, sizeof...(T)> origin{};  // bytes
  std::size_t bytes = 0;                           // of all
};

/// The arrays as buffers: parts of `whole`.
template <class... T>
std::tuple<Buffer<T>...> parts_of(Device& device, const Memory& whole,
                                  const PartLayout<T...>& layout) {
  return [&]<std::size_t... K>(std::index_sequence<K...>) {
    return std::tuple<Buffer<T>...>{
        Buffer<T>{device.state().part_of(whole, layout.origin[K], layout.size[K] * sizeof(T)),
                  layout.size[K]}...};
  }
  (std::index_sequence_for<T...>());
}

/// Whether a device gives one buffer for all of them.
template <class... T>
bool fits_in_one(Device& device, const PartLayout<T...>& layout) {
  return layout.bytes <= device.state().most_bytes();
}

/// Arrays that the host writes, all of them, for buffers that done() makes by one upload.
template <class... T>
class UploadTogether {
 public:
  UploadTogether(Device& device, const std::array<std::size_t, sizeof...(T)>& sizes)
      : device_(device), layout_(sizes), in_one_(fits_in_one(device, layout_)) {
    if (in_one_) memory_[0] = device.state().host_bytes(layout_.bytes);
    for (std::size_t k = 0; k < sizeof...(T) && !in_one_; ++k)
      memory_[k] = device.state().host_bytes(layout_.size[k] * layout_.value_bytes[k]);
  }
  UploadTogether(const UploadTogether&) = delete;
  UploadTogether& operator=(const UploadTogether&) = delete;

  /// Where array K is to be written.
  template <std::size_t K>
  auto* data() {
    using Value = std::tuple_element_t<K, std::tuple<T...>>;
    if (!in_one_) return static_cast<Value*>(memory_[K].bytes.get());
    return reinterpret_cast<Value*>(static_cast<char*>(memory_[0].bytes.get()) + layout_.origin[K]);
  }

  std::tuple<Buffer<T>...> done() {
    Device::State& state = device_.state();
    if (in_one_) return parts_of(device_, state.done_bytes(std::move(memory_[0])), layout_);
    return [&]<std::size_t... K>(std::index_sequence<K...>) {
      return std::tuple<Buffer<T>...>{
          Buffer<T>{state.done_bytes(std::move(memory_[K])), layout_.size[K]}...};
    }
    (std::index_sequence_for<T...>());
  }

 private:
  Device& device_;
  PartLayout<T...> layout_;
  bool in_one_;
  std::array<HostMemory, sizeof...(T)> memory_;  // the first alone, or one for each
};

/// Copies arrays of the host into new buffers by one upload.
template <class... T>
std::tuple<Buffer<T>...> upload_together(Device& device, const std::vector<T>&... values) {
  UploadTogether<T...> upload(device, {values.size()...});
  [&]<std::size_t... K>(std::index_sequence<K...>) {
    (std::copy(values.begin(), values.end(), upload.template data<K>()), ...);
  }
  (std::index_sequence_for<T...>());
  return upload.done();
}

/// Buffers that one command fills, or the host reads.
template <class... T>
struct Together {
  Together() = default;
  Together(Device& device, const std::array<std::size_t, sizeof...(T)>& sizes) : layout(sizes) {
    if (fits_in_one(device, layout)) {
      whole = {device.state().allocate_bytes(layout.bytes), layout.bytes};
      parts = parts_of(device, whole.memory, layout);
    } else {
      [&]<std::size_t... K>(std::index_sequence<K...>) {
        ((std::get<K>(parts) = allocate<T>(device, layout.size[K])), ...);
      }
      (std::index_sequence_for<T...>());
    }
  }

  template <std::size_t K>
  const auto& part() const {
    return std::get<K>(parts);
  }

  /// The arrays from First on, of which these are the types: one command reads them.
  template <std::size_t First, class... Some>
  Together<Some...> some(Device& device) const {
    constexpr std::size_t kLast = First + sizeof...(Some) - 1;
    Together<Some...> found;
    [&]<std::size_t... K>(std::index_sequence<K...>) {
      found.layout = PartLayout<Some...>({layout.size[First + K]...});
      found.parts = {std::get<First + K>(parts)...};
    }
    (std::index_sequence_for<Some...>());
    if (whole.size > 0)
      found.whole = {device.state().part_of(whole.memory, layout.origin[First],
                                            layout.end(kLast) - layout.origin[First]),
                     found.layout.bytes};
    return found;
  }

  /// Fills the arrays from First to Last by one command; where one is not of floats, with 0.
  template <std::size_t First, std::size_t Last>
  void fill_some(Device& device, float value) const {
    if (whole.size > 0) {
      // Whole vectors: an array is padded.
      const std::size_t bytes = rounded_up(layout.end(Last) - layout.origin[First], 64);
      const Memory from = device.state().part_of(whole.memory, layout.origin[First], bytes);
      return fill(device, Buffer<float>{from, bytes / sizeof value}, value);
    }
    [&]<std::size_t... K>(std::index_sequence<K...>) {
      (fill(device, std::get<First + K>(parts),
            static_cast<typename std::tuple_element_t<First + K, decltype(parts)>::Value>(value)),
       ...);
    }
    (std::make_index_sequence<Last - First + 1>());
  }

  PartLayout<T...> layout{{}};
  Buffer<cl_uchar> whole;  // empty where each has its own
  std::tuple<Buffer<T>...> parts;
};

/// Their values on the host, as HostView has those of one.
template <class... T>
class ViewTogether {
 public:
  ViewTogether(Device& device, const Together<T...>& buffers) : layout_(buffers.layout) {
    if (buffers.whole.size > 0) {
      bytes_.emplace(device, buffers.whole);
      return;
    }
    [&]<std::size_t... K>(std::index_sequence<K...>) {
      (std::get<K>(apart_).emplace(device, buffers.template part<K>()), ...);
    }
    (std::index_sequence_for<T...>());
  }

  template <std::size_t K>
  const auto* data() const {
    using Value = std::tuple_element_t<K, std::tuple<T...>>;
    if (!bytes_) return static_cast<const Value*>(std::get<K>(apart_)->data());
    return reinterpret_cast<const Value*>(bytes_->data() + layout_.origin[K]);
  }

 private:
  const PartLayout<T...>& layout_;
  std::optional<HostView<cl_uchar>> bytes_;
  std::tuple<std::optional<HostView<T>>...> apart_;
};

}  // namespace meniscus
