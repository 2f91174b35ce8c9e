// Binary files whose particles are rows of one size: they can be read from any place.
#pragma once

#include <bit>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "io/fields.hpp"
#include "io/input_file.hpp"
#include "io/scalar.hpp"
#include "meniscus/io.hpp"
#include "meniscus/source.hpp"

namespace meniscus {

/// Where the rows lie in a file, and the particle's fields in a row.
struct RowLayout {
  struct Column {
    Field field;
    std::size_t offset;  // in the row, bytes
    Scalar type;
    std::size_t attribute = 0;  // which one, where there is no field
  };
  std::uint64_t offset = 0;  // of the first row, bytes
  std::size_t stride = 0;    // bytes
  std::int64_t count = 0;    // rows
  std::endian order = std::endian::little;
  std::vector<Column> columns;
  std::vector<std::string> attributes{};  // names
  double particle_radius = 0;             // as the header states it; 0: it does not
};

/// The rows of a PLY file of `file_size` bytes that begins with `head`; none where it has no such
/// rows or is not what its header says: read_ply then says what is wrong. Throws InputError when
/// the header is bad or does not end within `head`.
std::optional<RowLayout> ply_rows(const InputFile& head, std::uint64_t file_size,
                                  const ReadOptions& options = {});

/// Whether a file is a PLY of faces, whose vertices are those of a mesh. False where its header
/// cannot be read.
bool has_faces(const std::string& path);

/// A file's rows as a source that leaves them on disk; null where it has no such rows: then
/// read_particles reads it or says what is wrong with it.
std::unique_ptr<ParticleSource> open_rows(const std::string& path, const ReadOptions& options);

/// Opens one file: its rows where they are many, else all of it in memory. Throws InputError.
std::unique_ptr<ParticleSource> open_file(const std::string& path, const ReadOptions& options);

}  // namespace meniscus
