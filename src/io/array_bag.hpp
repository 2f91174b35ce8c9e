// Formats that hold arrays by name and leave it to the reader which of them are particles.
#pragma once

#include <string>
#include <vector>

#include "io/layout.hpp"

namespace meniscus {

struct BagArray {
  DataArray data;
  std::uint64_t rows = 0;
};

/// The layout of the particles among some arrays. Positions are the array that `dataset` names,
/// else one of two or three components with a name for positions, else x, y and z, else the only
/// array of three components or more that is not named as velocities or such. Arrays with another
/// number of rows are of something else.
/// Throws InputError.
Layout layout_of_bag(const Bytes& file, std::vector<BagArray> arrays, const std::string& dataset,
                     const ReadOptions& options);

/// Whether an array so named holds positions.
bool is_position(const std::string& name);

/// Whether an array so named has a use: one that cannot be read is then an error.
bool has_use(const std::string& name);

/// Throws InputError where an array of positions seems to be transposed: a few rows of more
/// numbers than particles have; or holds tables, such as those of several frames. Other names are
/// not looked at.
void refuse_shape(const Bytes& file, const std::string& place, const std::string& name,
                  const std::vector<std::uint64_t>& shape);

/// Whether so many packed bytes of particles may unpack to so many: they become a tenth or a third,
/// not a hundredth, of their size. Up to 16 MiB are always believed.
bool may_unpack_to(std::uint64_t packed, std::uint64_t unpacked);
inline constexpr std::uint64_t kMostUnpacked = 100;  // bytes that one becomes

/// Throws InputError where `unpacked` bytes are not to be believed of a file.
void check_unpacked(const Bytes& file, std::uint64_t unpacked, const std::string& place);

}  // namespace meniscus
