// Several arrays in one piece of memory: each is a buffer of its own to kernels, and one command
// fills, writes or reads them all. Where the device gives no buffer that large, each has its own.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

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

/// Buffers of so many values each that begin as `value` everywhere, filled by one command; of
/// several types, with 0.
template <class... T>
std::tuple<Buffer<T>...> filled_together(Device& device, float value,
                                         const std::array<std::size_t, sizeof...(T)>& sizes) {
  if constexpr (!(... && std::is_same_v<T, float>))
    if (value != 0 || std::signbit(value)) throw DeviceError("one pattern fills all: 0");
  const PartLayout<T...> layout(sizes);
  if (fits_in_one(device, layout))
    return parts_of(device, device.state().filled_bytes(&value, sizeof value, layout.bytes),
                    layout);
  return [&]<std::size_t... K>(std::index_sequence<K...>) {
    return std::tuple<Buffer<T>...>{filled<T>(device, layout.size[K], static_cast<T>(value))...};
  }
  (std::index_sequence_for<T...>());
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

/// Buffers that kernels write and the host reads by one command.
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
