// Particles in the caller's memory, at any stride.
#pragma once

#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

#include "meniscus/export.hpp"
#include "meniscus/types.hpp"

namespace meniscus MENISCUS_API {

/// Numbers at even distances in memory that somebody else owns, float or double, at any alignment.
/// Doubles are rounded to the nearest float as they are read.
class Column {
 public:
  Column() = default;
  Column(const std::vector<float>& values) : Column(values.data(), values.size()) {}
  Column(const float* first, std::size_t size, std::ptrdiff_t stride = sizeof(float))
      : first_(reinterpret_cast<const char*>(first)), size_(size), stride_(stride) {}
  Column(const double* first, std::size_t size, std::ptrdiff_t stride = sizeof(double))
      : first_(reinterpret_cast<const char*>(first)), size_(size), stride_(stride), wide_(true) {}

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  std::ptrdiff_t stride() const { return stride_; }  // bytes from one number to the next, any sign
  bool wide() const { return wide_; }                // whether they are doubles
  const char* data() const { return first_; }        // the first of them

  float operator[](std::size_t i) const {
    const char* const at = first_ + static_cast<std::ptrdiff_t>(i) * stride_;
    if (wide_) return static_cast<float>(load<double>(at));
    return load<float>(at);
  }

  /// Copies `count` numbers from number `from` on.
  void copy(std::size_t from, std::size_t count, float* to) const {
    const char* at = first_ + static_cast<std::ptrdiff_t>(from) * stride_;
    if (wide_)
      for (std::size_t i = 0; i < count; ++i, at += stride_)
        to[i] = static_cast<float>(load<double>(at));
    else if (stride_ == sizeof(float) && count > 0)
      std::memcpy(to, at, count * sizeof(float));
    else
      for (std::size_t i = 0; i < count; ++i, at += stride_) to[i] = load<float>(at);
  }

 private:
  template <class T>
  static T load(const char* from) {
    T value;
    std::memcpy(&value, from, sizeof value);
    return value;
  }

  const char* first_ = nullptr;
  std::size_t size_ = 0;
  std::ptrdiff_t stride_ = 0;
  bool wide_ = false;
};

/// One number for each particle that is interpolated on the surface, as Attribute.
struct BorrowedAttribute {
  std::string name;
  Column values;  // [n]; NaN: not known
};

/// One frame of particles as they lie in the memory of a simulation: nothing is copied but into
/// what the device reads. The memory must stay as it is for as long as this is used.
struct BorrowedParticles {
  BorrowedParticles() = default;
  BorrowedParticles(const Particles& owner)
      : x(owner.x),
        y(owner.y),
        z(owner.z),
        vx(owner.vx),
        vy(owner.vy),
        vz(owner.vz),
        radius(owner.radius),
        particle_radius(owner.particle_radius) {
    for (const Attribute& attribute : owner.attributes)
      attributes.push_back({attribute.name, attribute.values});
  }

  Column x, y, z;              // [n] position, world units
  Column vx, vy, vz;           // [n] velocity, world units per second; optional
  Column radius;               // [n] particle radius, world units; optional
  double particle_radius = 0;  // world units; 0: not known
  std::vector<BorrowedAttribute> attributes;

  std::size_t size() const { return x.size(); }
};

}  // namespace MENISCUS_API
