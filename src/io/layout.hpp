// Where the values of particles lie in bytes, for formats that tell before any value is read. One
// description serves to read all of them into memory and to leave them where they are.
#pragma once

#include <bit>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "io/bytes.hpp"
#include "io/fields.hpp"
#include "io/scalar.hpp"
#include "meniscus/io.hpp"
#include "meniscus/source.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

/// An array of a file: a value, or a few, for each particle.
struct DataArray {
  std::string name;
  std::size_t components = 1;
  Scalar type = Scalar::float32;
  std::endian order = std::endian::little;
  std::shared_ptr<const Bytes> bytes;
  std::uint64_t offset = 0;            // of the first particle's first component
  std::uint64_t stride = 0;            // bytes from a particle to the next
  std::uint64_t component_stride = 0;  // bytes from a component to the next
};

struct Layout {
  struct Column {
    Field field = Field::none;  // none: an attribute
    std::size_t attribute = 0;  // which one
    std::string name;           // for messages
    Scalar type = Scalar::float32;
    std::endian order = std::endian::little;
    std::shared_ptr<const Bytes> bytes;
    std::uint64_t offset = 0, stride = 0;  // bytes
  };
  std::int64_t count = 0;  // particles
  std::vector<Column> columns;
  std::vector<std::string> attributes;  // names
  double particle_radius = 0, time = 0;
  std::string item = "particle";  // what the format calls one
};

/// A layout of `count` particles of these arrays: the first named for positions and the others by
/// their names (fields.hpp); the attributes that are asked for. Arrays that hold too little are an
/// error, before any memory is taken.
///
///   positions  index of the array of positions among `arrays`, of 2 or 3 components, or where each
///              coordinate is an array of its own kSeparate
///
/// Throws InputError.
inline constexpr std::size_t kSeparate = static_cast<std::size_t>(-1);
Layout layout_of(const Bytes& file, const std::vector<DataArray>& arrays, std::size_t positions,
                 std::int64_t count, const ReadOptions& options);

/// Everything that a layout describes. Throws InputError.
Particles read_layout(const Bytes& file, const Layout& layout);

/// Whether all values are left on disk.
bool is_on_disk(const Layout& layout);

/// A source that leaves the values where they are, and `file` open.
std::unique_ptr<ParticleSource> source_of(std::shared_ptr<const Bytes> file, Layout layout);

}  // namespace meniscus
