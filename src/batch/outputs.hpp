// One frame's outputs: which kinds there are, and writing them, all or none.
#pragma once

#include <string>
#include <vector>

#include "meniscus/io.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

enum class OutputKind { exr, mesh, png };

/// By the ending. Throws InvalidArgument.
OutputKind kind_of(const std::string& path);

/// Whether two names lead to one file, there or not.
bool same_file(const std::string& a, const std::string& b);

/// Throws InvalidArgument for endings that nobody knows, an output that is named twice, and one
/// that is the input or the camera's file. `others` are written, too, whatever their endings: logs,
/// reports, or none where a name is empty.
void check_outputs(const std::string& input, const std::vector<std::string>& outputs,
                   const std::vector<std::string>& others = {}, const std::string& camera = "");

/// How files are written.
struct WriteOptions {
  Compression compression = Compression::zip;
  bool half = false;  // see write_exr
  Preview preview = Preview::lit;
  std::string job;  // see io/seal.hpp
};

/// All or nothing: no file appears under its name before all are complete. Returns their bytes.
/// Throws OutputError.
std::uint64_t write_outputs(const std::vector<std::string>& paths, const Surface& surface,
                            const Parameters& parameters, const WriteOptions& options);

}  // namespace meniscus
