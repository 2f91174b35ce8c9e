#include "stages/project.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "base/parallel.hpp"
#include "device/kernels.hpp"
#include "device/together.hpp"

namespace meniscus {
namespace {

// Particles a launch takes: bounds the device memory for any number of particles.
constexpr std::size_t kChunk = std::size_t{1} << 22;

}  // namespace

records::Projection projection_of(const View& view, double margin) {
  records::Projection to{};
  for (std::size_t k = 0; k < 9; ++k)
    to.rotation[k] = static_cast<float>(view.rotation[k] / view.radius);
  const auto put = [](const auto& from, float* values) {
    std::transform(std::begin(from), std::end(from), values,
                   [](double value) { return static_cast<float>(value); });
  };
  put(std::array{view.shift.x, view.shift.y, view.shift.z}, to.shift);
  put(std::array{view.origin.x, view.origin.y, view.origin.z}, to.origin);
  put(view.u_row, to.u_row);
  put(view.v_row, to.v_row);
  put(view.w_row, to.w_row);
  to.u_scale = static_cast<float>(view.u_scale);
  to.v_scale = static_cast<float>(view.v_scale);
  to.near_depth = static_cast<float>(view.near_depth);
  to.margin = static_cast<float>(margin);
  to.width = static_cast<float>(view.width);
  to.height = static_cast<float>(view.height);
  return to;
}

Projected project_particles(Device& device, const View& view, const WorldParticles& particles,
                            double margin) {
  const records::Projection to = projection_of(view, margin);
  Projected kept;
  const std::size_t n = particles.x.size();
  for (std::size_t first = 0; first < n; first += kChunk) {
    const std::size_t count = std::min(kChunk, n - first);
    const std::size_t stride = (count + 63) / 64 * 64;
    UploadTogether<float, float, float, float> chunk(device, {stride, stride, stride, stride});
    const auto put = [&](const std::vector<float>& values, float* to) {
      if (!values.empty()) std::copy_n(values.data() + first, count, to);
      std::fill(to + (values.empty() ? 0 : count), to + stride, 1.0f);
    };
    put(particles.x, chunk.data<0>());
    put(particles.y, chunk.data<1>());
    put(particles.z, chunk.data<2>());
    put(particles.scale, chunk.data<3>());
    const auto [x, y, z, scale] = chunk.done();
    const Together<float, float> made(device, {3 * stride, 4 * stride});
    const auto& [eye, screen] = made.parts;
    const int width = device.state().vector_width;
    launch(device, kernels::project_particles, width, {stride / static_cast<std::size_t>(width)}, x,
           y, z, scale, eye, screen, static_cast<cl_int>(stride), to);
    const ViewTogether on_host(device, made);
    const float *const e = on_host.data<0>(), *const u = on_host.data<1>();
    const float *v = u + stride, *ku = v + stride, *kv = ku + stride;
    const std::size_t had = kept.index.size();
    kept.index.reserve(had + count);
    for (std::size_t i = 0; i < count; ++i)
      if (ku[i] > 0) kept.index.push_back(static_cast<std::uint32_t>(first + i));
    const float* const scale_of =
        particles.scale.empty() ? nullptr : particles.scale.data() + first;
    const std::array<std::pair<std::vector<float>*, const float*>, 8> rows{
        {{&kept.x, e},
         {&kept.y, e + stride},
         {&kept.z, e + 2 * stride},
         {&kept.u, u},
         {&kept.v, v},
         {&kept.ku, ku},
         {&kept.kv, kv},
         {&kept.scale, scale_of}}};
    parallel_for(rows.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        const auto [to, from] = rows[row];
        if (from && kept.index.size() == had + count) {  // all: mostly
          to->insert(to->end(), from, from + count);
          continue;
        }
        to->resize(kept.index.size(), 1.0f);
        if (!from) continue;
        for (std::size_t k = had; k < to->size(); ++k) (*to)[k] = from[kept.index[k] - first];
      }
    });
  }
  return kept;
}

void project_again(const View& view, Projected& particles) {
  constexpr std::size_t kGrain = 4096;  // particles that are worth a thread
  parallel_for(particles.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Vec3d eye = particles.eye(i);
      eye.z = std::min(eye.z, -view.near_depth);
      const PixelPosition at = project(view, eye);
      particles.z[i] = static_cast<float>(eye.z);
      particles.u[i] = static_cast<float>(at.u);
      particles.v[i] = static_cast<float>(at.v);
      particles.ku[i] = static_cast<float>(view.u_scale * particles.scale[i] / at.w);
      particles.kv[i] = static_cast<float>(view.v_scale * particles.scale[i] / at.w);
    }
  });
}

Projected place_particles(const View& view, const WorldParticles& particles) {
  const std::size_t n = particles.x.size();
  Projected placed;
  placed.index.resize(n);
  std::iota(placed.index.begin(), placed.index.end(), std::uint32_t{0});
  placed.scale = particles.scale;
  placed.scale.resize(n, 1.0f);
  const auto place = [&](const std::vector<float>& world, double origin, std::vector<float>& to) {
    to.resize(n);
    constexpr std::size_t kGrain = 16384;  // particles that are worth a thread
    parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        to[i] = static_cast<float>((world[i] - origin) / view.radius);
    });
  };
  place(particles.x, view.origin.x, placed.x);
  place(particles.y, view.origin.y, placed.y);
  place(particles.z, view.origin.z, placed.z);
  return placed;
}

}  // namespace meniscus
