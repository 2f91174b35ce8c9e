// What tells a whole output from anything else. Every output bears a hash of its bytes and, where
// the caller names one, its job: a short text that says what it was made from and with.
//
//   EXR       string attributes meniscus.hash and meniscus.job
//   PLY, OBJ  comment lines "meniscus.hash ..." and "meniscus.job ..." at the top
//   VTP       comments <!-- meniscus.hash ... --> and <!-- meniscus.job ... --> at the top
//   GLB       "meniscus.hash" and "meniscus.job" in the extras of the JSON's asset
//   STL       in its head of 80 bytes, the job by the 16 hex digits of its own hash
//   PNG       tEXt chunks meniscus.hash and meniscus.job
//
// The hash is XXH3 (64 bits, 16 hex digits) of all bytes of the file but its own digits, and in a
// PNG their checksum, which follows from them: no bit of the file can change unseen.
#pragma once

#include <cstddef>
#include <string>

#include "io/output_file.hpp"

namespace meniscus {

enum class OutputFormat { exr, ply, obj, vtp, glb, stl, png };

/// Stands where the hash will be.
inline constexpr char kNoHash[] = "0000000000000000";

/// Throws InvalidArgument unless `job` is empty or 1 to 64 letters, digits, dots and dashes.
void check_job(const std::string& job);

/// The seal as lines that begin with `mark`, which makes them comments: for PLY and OBJ.
std::string seal_lines(const std::string& mark, const std::string& job);

/// The seal as chunks of a PNG file: they go after its first one.
std::string seal_chunks(const std::string& job);

/// The head of an STL, 80 bytes, with the seal.
std::string stl_head(const std::string& job);

/// Puts the hash in its place, which lies in the first 64 KiB. Everything must be written; nothing
/// may be written afterwards. Throws OutputError.
void seal(OutputFile& file, OutputFormat format);

/// Why `path` is not an output of `job`, byte by byte as it was written, in words that follow the
/// file's name: "is missing", "is cut off or damaged ..."; empty: it is. An empty job is any job.
/// Its ending says what it must be. Never throws for what it finds.
std::string flaw_of(const std::string& path, const std::string& job);

/// The job of `length` letters that an output states; empty: it states none, as an STL, which has
/// but a hash of it. Never throws for what it finds.
std::string stated_job(const std::string& path, std::size_t length);

}  // namespace meniscus
