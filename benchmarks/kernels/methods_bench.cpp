// The kernels that only the other methods have, measured in their whole frames.
#include "kernels/cases.hpp"

namespace meniscus::bench {
namespace {

Case frame_case(Frame& frame, Method method, const char* kernel, double bytes_a_pixel) {
  const Frame::Frames& frames = frame.frames(method);
  Case result{.unit = "pixels"};
  for (const float t : frames.image.depth) result.items += t < kNoSurface;
  result.bytes = bytes_a_pixel * result.items;
  result.frame_ms = frame.frame_ms(method, kernel);
  return result;
}

}  // namespace

Case prepare_shape_kernels(Frame& frame) {
  // A position read and eleven values written a particle.
  Case result = frame_case(frame, Method::anisotropic, "shape_kernels", 0);
  result.unit = "particles";
  result.items = static_cast<double>(frame.projected().size());
  result.bytes = 56 * result.items;
  return result;
}

Case prepare_cast_field(Frame& frame) {
  // Point and two depths read, depth and normal written; fifteen values a particle are not counted,
  // as most are hidden.
  return frame_case(frame, Method::anisotropic, "cast_field", 32);
}

}  // namespace meniscus::bench
