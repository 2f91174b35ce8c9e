// Scan lines packed with ZIP, as OpenEXR files have them.
#pragma once

#include <ImfFrameBuffer.h>
#include <ImfHeader.h>

#include "io/output_file.hpp"

namespace meniscus {

/// Writes the whole file: magic number, header, table of offsets, and the lines in blocks of one
/// (ZIPS) or 16 (ZIP), the predictor and packing of which are OpenEXR's. Departs from
/// Imf::OutputFile in that libdeflate packs them, in half of zlib's time, on all processors. What
/// OpenEXR reads back is the same.
///
///   header  scan lines from the top, ZIP or ZIPS, names of channels of at most 31 letters
///   frame   a slice for every channel
///
/// Throws OutputError.
void write_zipped(OutputFile& file, const Imf::Header& header, const Imf::FrameBuffer& frame);

}  // namespace meniscus
