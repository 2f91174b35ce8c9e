// The values of a chunked data set of HDF5, unpacked chunk by chunk when they are read.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "io/bytes.hpp"

namespace meniscus {

/// The values as one row after the other.
///
///   place    what the data set is called in messages
///   base     what is added to addresses; `tree` leads to the index of chunks, a number of
///   `offsets`
///            bytes
///   shape    of the data set, and of a chunk
///   element  bytes
///   filters  in the order in which they were applied: 1 deflate, 2 shuffle, 3 fletcher32
///
/// A chunk that was never written holds zeros. Throws InputError.
std::shared_ptr<const Bytes> hdf5_chunks(const std::shared_ptr<const Bytes>& file,
                                         const std::string& place, std::uint64_t base,
                                         std::uint64_t tree, std::size_t offsets,
                                         const std::vector<std::uint64_t>& shape,
                                         const std::vector<std::uint64_t>& chunk,
                                         std::size_t element, const std::vector<int>& filters);

}  // namespace meniscus
