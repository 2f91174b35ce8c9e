#include <algorithm>
#include <memory>

#include "kernels/cases.hpp"
#include "kernels/native/native.hpp"

namespace meniscus::bench {
namespace {

// What the native version reads and writes.
struct Arrays {
  std::vector<float> x, y, z, scale, eye, screen;
  native::Projection input{};
};

std::shared_ptr<Arrays> arrays_of(const Frame& frame, double margin) {
  const auto arrays = std::make_shared<Arrays>();
  const std::size_t n = frame.world.x.size(), stride = (n + 63) / 64 * 64;
  const auto padded = [&](const std::vector<float>& values) {
    std::vector<float> result(stride, 1.0f);
    std::copy(values.begin(), values.end(), result.begin());
    return result;
  };
  arrays->x = padded(frame.world.x);
  arrays->y = padded(frame.world.y);
  arrays->z = padded(frame.world.z);
  arrays->scale = padded({});
  arrays->eye.resize(3 * stride);
  arrays->screen.resize(4 * stride);

  native::Projection& in = arrays->input;
  in.x = arrays->x.data();
  in.y = arrays->y.data();
  in.z = arrays->z.data();
  in.scale = arrays->scale.data();
  in.eye = arrays->eye.data();
  in.screen = arrays->screen.data();
  in.stride = stride;
  const View& view = frame.view;
  for (int k = 0; k < 9; ++k) in.from_world[k] = static_cast<float>(view.rotation[k] / view.radius);
  const double tail[6] = {view.shift.x,  view.shift.y,  view.shift.z,
                          view.origin.x, view.origin.y, view.origin.z};
  for (int k = 0; k < 6; ++k) in.from_world[9 + k] = static_cast<float>(tail[k]);
  for (int k = 0; k < 4; ++k) {
    in.u_row[k] = static_cast<float>(view.u_row[k]);
    in.v_row[k] = static_cast<float>(view.v_row[k]);
    in.w_row[k] = static_cast<float>(view.w_row[k]);
  }
  const double extent[4] = {view.u_scale, view.v_scale, view.near_depth, margin};
  for (int k = 0; k < 4; ++k) in.extent[k] = static_cast<float>(extent[k]);
  in.size[0] = static_cast<float>(view.width);
  in.size[1] = static_cast<float>(view.height);
  return arrays;
}

}  // namespace

Case prepare_project(Frame& frame) {
  constexpr double kMargin = 4;  // particle radii
  const double n = static_cast<double>(frame.world.x.size());
  Case result;
  result.unit = "particles";
  result.items = n;
  // Reads x, y, z and scale; writes three values of eye space and four of the screen.
  result.bytes = 44 * n;
  // Origin 3, rotation and shift 18, w 6, u and v 7 each, two extents 2 each, margins 2, sums 4.
  result.operations = 51 * n;
  const auto kept = std::make_shared<Projected>();
  result.launch = [&frame, kept] {
    *kept = project_particles(frame.device, frame.view, frame.world, kMargin);
  };
  const auto arrays = arrays_of(frame, kMargin);
  result.native = [arrays](Workers& workers) {
    workers.run(arrays->input.stride, 4096, [&](std::size_t begin, std::size_t end) {
      native::project_particles(arrays->input, begin, end);
    });
  };
  result.differing = [arrays, kept, count = frame.world.x.size()] {
    const std::size_t stride = arrays->input.stride;
    std::vector<std::vector<float>> rows(7);
    for (std::size_t i = 0; i < count; ++i) {
      if (!(arrays->screen[2 * stride + i] > 0)) continue;
      for (std::size_t r = 0; r < 7; ++r)
        rows[r].push_back(r < 3 ? arrays->eye[r * stride + i]
                                : arrays->screen[(r - 3) * stride + i]);
    }
    const std::vector<float>* const columns[7] = {&kept->x, &kept->y,  &kept->z, &kept->u,
                                                  &kept->v, &kept->ku, &kept->kv};
    std::size_t differing = 0;
    for (std::size_t r = 0; r < 7; ++r) differing += count_differing(rows[r], *columns[r]);
    return differing;
  };
  return result;
}

}  // namespace meniscus::bench
