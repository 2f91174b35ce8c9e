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

// The particles of [begin, end) that are kept, as project_particles of project.cl makes them: with
// the same operations in the same order, for the same bits.
Projected project_some(const records::Projection& to, const WorldParticles& particles,
                       std::size_t begin, std::size_t end) {
  Projected kept;
  const auto row = [](const auto& m, std::size_t at, float x, float y, float z, float w) {
    return m[at] * x + m[at + 1] * y + m[at + 2] * z + w;
  };
  for (std::size_t i = begin; i < end; ++i) {
    const float px = particles.x[i] - to.origin[0], py = particles.y[i] - to.origin[1],
                pz = particles.z[i] - to.origin[2];
    const float x = row(to.rotation, 0, px, py, pz, to.shift[0]),
                y = row(to.rotation, 3, px, py, pz, to.shift[1]),
                z = row(to.rotation, 6, px, py, pz, to.shift[2]);
    const float w = row(to.w_row, 0, x, y, z, to.w_row[3]);
    const float u = row(to.u_row, 0, x, y, z, to.u_row[3]) / w,
                v = row(to.v_row, 0, x, y, z, to.v_row[3]) / w;
    const float scale = particles.scale.empty() ? 1.0f : particles.scale[i];
    const float ku = to.u_scale * scale / w, kv = to.v_scale * scale / w;
    const float mu = to.margin * ku, mv = to.margin * kv;
    if (!((-z > to.near_depth) & (u + mu >= 0.0f) & (u - mu <= to.width) & (v + mv >= 0.0f) &
          (v - mv <= to.height) & (ku > 0)))
      continue;
    kept.x.push_back(x);
    kept.y.push_back(y);
    kept.z.push_back(z);
    kept.u.push_back(u);
    kept.v.push_back(v);
    kept.ku.push_back(ku);
    kept.kv.push_back(kv);
    kept.scale.push_back(scale);
    kept.index.push_back(static_cast<std::uint32_t>(i));
  }
  return kept;
}

// All of them. A device with memory of its own would take longer to fetch and return them.
Projected project_on_host(const records::Projection& to, const WorldParticles& particles) {
  constexpr std::size_t kGrain = 4096;  // particles that are worth a thread
  const std::size_t n = particles.x.size();
  std::vector<Projected> parts((n + kGrain - 1) / kGrain);
  parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part)
      parts[part] = project_some(to, particles, part * kGrain, std::min(n, (part + 1) * kGrain));
  });
  std::size_t size = 0;
  for (const Projected& part : parts) size += part.size();
  Projected kept;
  const auto join = [&](auto Projected::*row) {
    (kept.*row).reserve(size);
    for (const Projected& part : parts)
      (kept.*row).insert((kept.*row).end(), (part.*row).begin(), (part.*row).end());
  };
  constexpr std::array kRows{&Projected::x, &Projected::y,  &Projected::z,  &Projected::u,
                             &Projected::v, &Projected::ku, &Projected::kv, &Projected::scale};
  parallel_for(kRows.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) join(kRows[row]);
  });
  join(&Projected::index);
  return kept;
}

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
  // Whoever watches launches sees the kernel on all devices.
  if (!device.state().is_in_place() && !device.state().observer)
    return project_on_host(to, particles);
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
