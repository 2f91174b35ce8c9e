#include "stages/project.hpp"

#include <algorithm>

namespace meniscus {
namespace {

cl_float4 row(const std::array<double, 4>& r) {
  return {{static_cast<float>(r[0]), static_cast<float>(r[1]), static_cast<float>(r[2]),
           static_cast<float>(r[3])}};
}

// Particles a launch takes: bounds the device memory for any number of particles.
constexpr std::size_t kChunk = std::size_t{1} << 22;

}  // namespace

Projected project_particles(Device& device, const View& view, const WorldParticles& particles,
                            double margin) {
  cl_float16 from_world{};
  for (int k = 0; k < 9; ++k) from_world.s[k] = static_cast<float>(view.rotation[k] / view.radius);
  const double tail[6] = {view.shift.x,  view.shift.y,  view.shift.z,
                          view.origin.x, view.origin.y, view.origin.z};
  for (int k = 0; k < 6; ++k) from_world.s[9 + k] = static_cast<float>(tail[k]);
  const cl_float4 extent{{static_cast<float>(view.u_scale), static_cast<float>(view.v_scale),
                          static_cast<float>(view.near_depth), static_cast<float>(margin)}};
  const cl_float2 size{{static_cast<float>(view.width), static_cast<float>(view.height)}};

  Projected kept;
  const std::size_t n = particles.x.size();
  for (std::size_t first = 0; first < n; first += kChunk) {
    const std::size_t count = std::min(kChunk, n - first);
    const std::size_t stride = (count + 63) / 64 * 64;
    const auto chunk = [&](const std::vector<float>& values) {
      std::vector<float> padded(stride, 1.0f);
      if (!values.empty())
        std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(first), count, padded.begin());
      return upload(device, padded);
    };
    const auto x = chunk(particles.x), y = chunk(particles.y), z = chunk(particles.z);
    const auto scale = chunk(particles.scale);
    const auto eye = allocate<float>(device, 3 * stride);
    const auto screen = allocate<float>(device, 4 * stride);
    launch(device, "project.cl", "project_particles", {stride}, "", x, y, z, scale, eye, screen,
           static_cast<cl_int>(stride), from_world, row(view.u_row), row(view.v_row),
           row(view.w_row), extent, size);
    const std::vector<float> e = download(device, eye), s = download(device, screen);
    for (std::size_t i = 0; i < count; ++i) {
      if (!(s[2 * stride + i] > 0)) continue;
      kept.x.push_back(e[i]);
      kept.y.push_back(e[stride + i]);
      kept.z.push_back(e[2 * stride + i]);
      kept.u.push_back(s[i]);
      kept.v.push_back(s[stride + i]);
      kept.ku.push_back(s[2 * stride + i]);
      kept.kv.push_back(s[3 * stride + i]);
      kept.scale.push_back(particles.scale.empty() ? 1.0f : particles.scale[first + i]);
    }
  }
  return kept;
}

}  // namespace meniscus
