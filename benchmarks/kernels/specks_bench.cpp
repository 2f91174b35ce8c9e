// close_specks, on the frame's surface with holes and specks put into it.
#include <memory>

#include "kernels/cases.hpp"
#include "stages/sample/specks.hpp"

namespace meniscus::bench {
namespace {

struct Maps {
  SampleGrid grid;
  std::vector<float> depth, normal;  // as they are given
  std::vector<cl_int> group;
  std::vector<cl_uchar> kind;
};

Maps damaged_surface(const SurfaceMap& image) {
  const std::size_t n = image.grid.size();
  Maps maps{image.grid, image.depth, std::vector<float>(3 * n), image.group, {}};
  for (std::size_t s = 0; s < n; ++s) {
    maps.normal[s] = image.normal[s].x;
    maps.normal[n + s] = image.normal[s].y;
    maps.normal[2 * n + s] = image.normal[s].z;
    maps.kind.push_back(static_cast<cl_uchar>(image.kind[s]));
    const std::uint32_t mixed = static_cast<std::uint32_t>(s) * 2654435761u >> 8;
    if (mixed % 997 == 0) maps.depth[s] = kNoSurface;
    if (mixed % 997 == 1 && maps.depth[s] < kNoSurface) maps.depth[s] += 10;
  }
  return maps;
}

}  // namespace

Case prepare_specks(Frame& frame) {
  const auto given = std::make_shared<Maps>(damaged_surface(frame.frames(Method::fit).image));
  Case result{.unit = "pixels"};
  for (const float t : given->depth) result.items += t < kNoSurface;
  // Depth and kind of every pixel and normals of the surface, read once; little is written.
  result.bytes = 5.0 * static_cast<double>(given->depth.size()) + 12 * result.items;
  // A pixel of the surface: differences 8, maxima 8, sums 32, their lengths 16.
  result.operations = 64 * result.items;
  result.also = "apply_closed";
  result.launch = [&frame, given] {
    Device& device = frame.device;
    const SurfaceBuffers surface{given->grid,
                                 upload(device, given->depth),
                                 upload(device, given->normal),
                                 upload(device, given->group),
                                 filled<float>(device, given->depth.size(), 0.0f),
                                 upload(device, given->kind)};
    close_specks(device, surface, blocks_of(device, given->grid, true), kNoSurface);
  };
  return result;
}

}  // namespace meniscus::bench
