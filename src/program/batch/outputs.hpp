// One frame's outputs: which kinds there are, and writing them, all or none.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "meniscus/io.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

enum class OutputKind { exr, deep, mesh, png };

/// Whether a file of this name holds a mesh, by its ending.
bool is_mesh(const std::string& path);

/// Throws InvalidArgument where a name asks for a file of scenes, such as USD or Alembic: it says
/// which mesh to write instead.
void refuse_scene(const std::string& path);

/// By the ending, which is .deep.exr of deep. Throws InvalidArgument.
OutputKind kind_of(const std::string& path);

/// What a command reads, whether all of it is asked for or not. Empty names are none.
struct InputNames {
  std::vector<std::string> inputs;   // a * stands for the parts of a frame
  std::vector<std::string> cameras;  // their files
};

/// Throws InvalidArgument for endings that nobody knows, an output that is named twice, and one
/// that is an input or a camera's file. `others` are written, too, whatever their endings: logs,
/// reports, or none where a name is empty.
void check_outputs(const InputNames& read, const std::vector<std::string>& outputs,
                   const std::vector<std::string>& others = {});

/// How files are written.
struct WriteOptions {
  Compression compression = Compression::zip;
  bool half = false;  // see write_exr
  Preview preview = Preview::lit;
  std::string job;                      // see io/seal.hpp
  std::function<void(double)> reached;  // if set, called with the share that is done, 0 to 1
};

/// All or nothing: no file appears under its name before all are complete. Returns their bytes.
/// Throws OutputError.
std::uint64_t write_outputs(const std::vector<std::string>& paths, const Surface& surface,
                            const Parameters& parameters, const WriteOptions& options);

}  // namespace meniscus
