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
      const Buffer<float> part = filled(device, stride, 1.0f);
      if (!values.empty())
        device.state().write_bytes(part.memory, values.data() + first, count * sizeof(float));
      return part;
    };
    const auto x = chunk(particles.x), y = chunk(particles.y), z = chunk(particles.z);
    const auto scale = chunk(particles.scale);
    const auto eye = allocate<float>(device, 3 * stride);
    const auto screen = allocate<float>(device, 4 * stride);
    const int width = device.state().vector_width;
    launch(device, "project.cl", "project_particles", {stride / static_cast<std::size_t>(width)},
           width_option(width), x, y, z, scale, eye, screen, static_cast<cl_int>(stride),
           from_world, row(view.u_row), row(view.v_row), row(view.w_row), extent, size);
    const HostView e(device, eye), on_screen(device, screen);
    const float *u = on_screen.data(), *v = u + stride, *ku = v + stride, *kv = ku + stride;
    std::vector<std::uint32_t> index;  // of those in view, in this chunk
    index.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
      if (ku[i] > 0) index.push_back(static_cast<std::uint32_t>(i));
    const auto keep = [&](std::vector<float>& to, const float* from) {
      const std::size_t had = to.size();
      to.resize(had + index.size());
      for (std::size_t k = 0; k < index.size(); ++k) to[had + k] = from[index[k]];
    };
    keep(kept.x, e.data());
    keep(kept.y, e.data() + stride);
    keep(kept.z, e.data() + 2 * stride);
    keep(kept.u, u);
    keep(kept.v, v);
    keep(kept.ku, ku);
    keep(kept.kv, kv);
    for (const std::uint32_t i : index) kept.index.push_back(static_cast<std::uint32_t>(first + i));
    if (particles.scale.empty())
      kept.scale.resize(kept.x.size(), 1.0f);
    else
      keep(kept.scale, particles.scale.data() + first);
  }
  return kept;
}

}  // namespace meniscus
