// The surface on a sample grid while it is on the device.
#pragma once

#include <optional>

#include "device/device.hpp"
#include "device/records.hpp"
#include "device/together.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {

/// Like SurfaceMap, on the device.
struct SurfaceBuffers {
  SampleGrid grid;
  Buffer<float> depth;    // [samples] particle radii; kNoSurface
  Buffer<float> normal;   // [3][samples] unit, eye axes
  Buffer<cl_int> group;   // [samples] -1: none
  Buffer<float> trust;    // [samples] of the fits that made the sample, 0 .. 1 (trust.hpp), plus
                          // where it lies (blend.cl)
  Buffer<cl_uchar> kind;  // [samples] where there is a depth: Kind::splash; anything else: surface
  /// Depth, normal and kind where one command reads them all; else empty.
  Together<float, float, cl_uchar> shown{};
};

/// What a sample with a depth is.
inline Kind kind_of(cl_uchar shown) {
  return static_cast<Kind>(shown) == Kind::splash ? Kind::splash : Kind::surface;
}

/// A surface of which one command reads what `shown` has; the rest is what was in memory.
SurfaceBuffers surface_of(Device& device, const SampleGrid& grid,
                          const Together<float, float, cl_uchar>& shown);

/// No surface anywhere; normals, groups and trust are what was in memory.
SurfaceBuffers empty_surface(Device& device, const SampleGrid& grid);

/// What samples show on the host, as HostView has a buffer: by one command where all of it lies
/// together and more than the depth is wanted. Null: not wanted, or the surface has none.
class ShownView {
 public:
  ShownView(Device& device, const SurfaceBuffers& surface, bool wants_normal, bool wants_kind);

  const float* depth = nullptr;    // [samples]
  const float* normal = nullptr;   // [3][samples]
  const cl_uchar* kind = nullptr;  // [samples]

 private:
  std::optional<ViewTogether<float, float, cl_uchar>> all_;
  std::optional<HostView<float>> depth_, normal_;
  std::optional<HostView<cl_uchar>> kind_;
};

/// Waits and copies to the host; samples without depth get zero normals, no group, no kind. Without
/// a buffer for them, no sample has a group, and all kinds are `surface`.
SurfaceMap download(Device& device, const SurfaceBuffers& surface);

/// The other way, without trust.
SurfaceBuffers upload(Device& device, const SurfaceMap& map);

/// The rays of a view, as kernels take them.
records::RayMap kernel_rays(const View& view);

/// Where a grid's samples lie, and the rays of a view through them.
records::Screen screen_of(const View& view, const SampleGrid& grid);

}  // namespace meniscus
