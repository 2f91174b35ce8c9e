// zlib's state while it unpacks.
#pragma once

#include <zlib.h>

#include <string>

#include "io/bytes.hpp"

namespace meniscus {

/// What stands around the packed data, as inflateInit2() wants it: bits of the window, 16 more for
/// gzip, below zero for nothing.
enum class Wrapping { gzip = 15 + 16, zlib = 15, none = -15 };

struct InflateStream : z_stream {
  /// Throws InputError where zlib has no memory.
  template <class File>
  InflateStream(Wrapping wrapping, const File& of, const std::string& place) : z_stream{} {
    if (inflateInit2(this, static_cast<int>(wrapping)) != Z_OK)
      fail(of, place, "cannot be unpacked: no memory for zlib");
  }
  ~InflateStream() { inflateEnd(this); }
  InflateStream(const InflateStream&) = delete;
  InflateStream& operator=(const InflateStream&) = delete;
};

}  // namespace meniscus
