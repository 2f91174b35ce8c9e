// FLIP Fluids' particles (fluidparticles000001.ffp3). Written from what its add-on for Blender
// reads.
//
//   uint32  particles at the surface, at boundaries and inside; a limit L
//   uint32  [L][3] how many of each kind are to be shown at a share k / L
//   values  of each particle, kind after kind
//
// Each kind of value has a file of its own: fluidparticlesvelocity000001.ffp3 beside the positions.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "io/readers.hpp"

namespace meniscus {
namespace {

constexpr std::uint64_t kHead = 16;

struct Values {
  std::uint64_t count = 0, offset = 0, each = 0;  // particles; bytes
};

Values values_of(const Bytes& file) {
  const std::string head = text_at(file, 0, kHead);
  std::uint64_t numbers[4];
  for (std::size_t k = 0; k < 4; ++k)
    numbers[k] = load<std::uint32_t>(head.data() + 4 * k, std::endian::little);
  Values values;
  values.count = numbers[0] + numbers[1] + numbers[2];
  values.offset = kHead + numbers[3] * 3 * 4;
  if (values.offset > file.size())
    fail(file, "",
         "its limit of " + std::to_string(numbers[3]) + " does not fit its " +
             std::to_string(file.size()) + " bytes, wanted .ffp3 of FLIP Fluids");
  const std::uint64_t left = file.size() - values.offset;
  if (values.count == 0 ? left != 0 : left % values.count != 0)
    fail(file, "",
         "states " + std::to_string(values.count) + " particles, but has " + std::to_string(left) +
             " bytes of values (truncated?)");
  values.each = values.count == 0 ? 0 : left / values.count;
  return values;
}

// fluidparticles000001.ffp3 -> fluidparticlesvelocity000001.ffp3; empty where it is not so named.
std::string beside(const std::string& path, const std::string& kind) {
  const std::filesystem::path name(path);
  const std::string stem = name.stem().string(), start = "fluidparticles";
  if (!lower_case(stem).starts_with(start) ||
      stem.find_first_not_of("0123456789", start.size()) != std::string::npos)
    return "";
  return (name.parent_path() / (stem.substr(0, start.size()) + kind + stem.substr(start.size()) +
                                name.extension().string()))
      .string();
}

}  // namespace

Layout ffp3_layout(const std::shared_ptr<const Bytes>& file, const ReadOptions& options) {
  const Values positions = values_of(*file);
  constexpr std::uint64_t kVector = 12;
  if (positions.count > 0 && positions.each != kVector)
    fail(*file, "",
         "has " + std::to_string(positions.each) +
             " bytes a particle, wanted 12: positions (fluidparticles000001.ffp3)");
  const auto array = [](const std::string& name, const std::shared_ptr<const Bytes>& bytes,
                        const Values& values, Scalar type) {
    return DataArray{
        name,
        static_cast<std::size_t>(std::max<std::uint64_t>(1, values.each / size_of(type))),
        type,
        std::endian::little,
        bytes,
        values.offset,
        values.each,
        size_of(type)};
  };
  std::vector<DataArray> arrays{array("positions", file, positions, Scalar::float32)};
  const auto add = [&](const std::string& name, const std::string& kind) {
    const std::string path = beside(file->name(), kind);
    std::error_code error;
    if (path.empty() || !std::filesystem::is_regular_file(path, error)) return;
    const auto bytes = bytes_of_file(path);
    const Values values = values_of(*bytes);
    if (values.count != positions.count)
      fail(*bytes, "",
           "has " + std::to_string(values.count) + " particles, " + file->name() + " has " +
               std::to_string(positions.count));
    const bool whole = kind == "id" || kind == "uid" || kind == "sourceid";
    const Scalar type = values.each == 8   ? Scalar::uint64
                        : values.each == 2 ? Scalar::uint16
                        : whole            ? Scalar::int32
                                           : Scalar::float32;
    if (values.count > 0 && values.each != kVector && values.each != size_of(type))
      fail(*bytes, "",
           "has " + std::to_string(values.each) +
               " bytes a particle, wanted 2, 4, 8 "
               "or 12");
    arrays.push_back(array(name, bytes, values, type));
  };
  add("velocity", "velocity");
  add("id", "uid");
  for (const std::string& name : options.attributes) {
    std::string kind = lower_case(name);
    std::erase(kind, '_');
    if (kind != "velocity" && kind != "id") add(name, kind);
  }
  if (positions.count == 0) {
    Layout none;
    none.particle_radius = options.particle_radius;
    none.attributes = options.attributes;
    return none;
  }
  return layout_of(*file, arrays, 0, static_cast<std::int64_t>(positions.count), options);
}

}  // namespace meniscus
