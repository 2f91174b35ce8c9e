// The groups and data sets of an HDF5 file: where they are and what their messages say. A reader of
// our own of what h5py and PySPH write by default, from the HDF5 File Format Specification (version
// 3). It knows groups of both kinds but those of very many links, numbers in contiguous, compact
// and chunked data sets, and the filters deflate, shuffle and fletcher32.
#pragma once

#include <bit>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/bytes.hpp"
#include "io/scalar.hpp"

namespace meniscus {

/// An address that leads nowhere.
constexpr std::uint64_t kHdf5Undefined = UINT64_MAX;

/// What a data set's messages say.
struct Hdf5DataSet {
  std::string path;  // in the file, without the first /
  bool has_space = false, has_layout = false;
  std::optional<Scalar> type;  // none: no number that is read
  std::endian order = std::endian::little;
  std::size_t components = 1;  // of an array as an element
  std::size_t element = 0;     // bytes
  std::vector<std::uint64_t> shape;
  int storage = 1;  // 0 compact, 1 contiguous, 2 chunked
  std::uint64_t address = kHdf5Undefined, size = 0;
  std::string compact;
  std::vector<std::uint64_t> chunk;  // along each dimension
  std::vector<int> filters;
  std::string unknown;  // why it cannot be read
};

/// What a file holds.
struct Hdf5Objects {
  std::vector<Hdf5DataSet> sets;
  std::string unknown;      // a group that could not be read, and why
  std::uint64_t base = 0;   // is added to addresses
  std::size_t offsets = 8;  // bytes of an address
};

/// Reads headers alone, no values. Throws InputError.
Hdf5Objects hdf5_objects(const std::shared_ptr<const Bytes>& file);

}  // namespace meniscus
