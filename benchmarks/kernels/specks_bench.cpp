// close_specks, on the frame's surface with holes and specks put into it.
#include <memory>

#include "kernels/cases.hpp"
#include "kernels/native/native.hpp"
#include "stages/sample/specks.hpp"

namespace meniscus::bench {
namespace {

constexpr std::size_t kMargin = 64;  // what the native version may read around a map
constexpr int kRounds = 4;           // of close_specks

template <class T>
struct Padded {
  std::vector<T> all;
  std::size_t size;
  explicit Padded(const std::vector<T>& values)
      : all(values.size() + 2 * kMargin), size(values.size()) {
    for (std::size_t k = 0; k < size; ++k) all[kMargin + k] = values[k];
  }
  T* data() { return all.data() + kMargin; }
  std::vector<T> values() const {
    std::vector<T> result(size);
    for (std::size_t k = 0; k < size; ++k) result[k] = all[kMargin + k];
    return result;
  }
};

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

// The native version's maps and its rounds.
struct Closing {
  Maps given;
  Padded<float> depth, normal, new_depth, new_normal;
  Padded<std::int32_t> group, new_group;
  Padded<std::uint8_t> kind, new_kind, change;
  std::vector<std::uint8_t> changed, changes;

  explicit Closing(const Maps& maps)
      : given(maps),
        depth(maps.depth),
        normal(maps.normal),
        new_depth(maps.depth),
        new_normal(maps.normal),
        group(maps.group),
        new_group(maps.group),
        kind(maps.kind),
        new_kind(maps.kind),
        change(maps.kind) {}

  void reset() {
    depth = Padded<float>(given.depth);
    normal = Padded<float>(given.normal);
    group = Padded<std::int32_t>(given.group);
    kind = Padded<std::uint8_t>(given.kind);
  }

  void run(Workers& workers) {
    const SampleGrid& grid = given.grid;
    const std::size_t rows = static_cast<std::size_t>(grid.ny);
    const std::size_t strips = static_cast<std::size_t>((grid.nx + 7) / 8);
    changed.assign(strips * rows, 1);
    changes.assign(strips * rows, 0);
    for (int round = 0; round < kRounds; ++round) {
      const native::Specks input{
          depth.data(),      normal.data(),    group.data(),    kind.data(),   new_depth.data(),
          new_normal.data(), new_group.data(), new_kind.data(), change.data(), changed.data(),
          changes.data(),    grid.nx,          grid.ny,         3.0f,          2.0f};
      workers.run(rows, 8, [&](std::size_t begin, std::size_t end) {
        native::close_specks(input, begin, end);
      });
      workers.run(rows, 8, [&](std::size_t begin, std::size_t end) {
        native::apply_closed(input, begin, end);
      });
      std::swap(changed, changes);
    }
  }
};

}  // namespace

Case prepare_specks(Frame& frame) {
  const auto closing = std::make_shared<Closing>(damaged_surface(frame.frames(Method::fit).image));
  const Maps& given = closing->given;
  Case result{.unit = "pixels"};
  for (const float t : given.depth) result.items += t < kNoSurface;
  // Depth and kind of every pixel and normals of the surface, read once; little is written.
  result.bytes = 5.0 * static_cast<double>(given.depth.size()) + 12 * result.items;
  // A pixel of the surface: differences 8, maxima 8, sums 32, their lengths 16.
  result.operations = 64 * result.items;
  result.also = "apply_closed";
  const auto surface = std::make_shared<SurfaceBuffers>();
  result.launch = [&frame, closing, surface] {
    Device& device = frame.device;
    const Maps& maps = closing->given;
    *surface = {maps.grid,
                upload(device, maps.depth),
                upload(device, maps.normal),
                upload(device, maps.group),
                filled<float>(device, maps.depth.size(), 0.0f),
                upload(device, maps.kind)};
    close_specks(device, *surface, blocks_of(device, maps.grid, true), kNoSurface);
  };
  result.reset_native = [closing] { closing->reset(); };
  result.native = [closing](Workers& workers) { closing->run(workers); };
  result.differing = [&frame, closing, surface] {
    return count_differing(closing->depth.values(), download(frame.device, surface->depth)) +
           count_differing(closing->normal.values(), download(frame.device, surface->normal));
  };
  return result;
}

}  // namespace meniscus::bench
