#include "stages/frame/project.hpp"

#include <algorithm>
#include <array>
#include <numeric>

#include "base/all_true.hpp"
#include "base/parallel.hpp"

namespace meniscus {
namespace {

constexpr std::array kValues{&Projected::x, &Projected::y,  &Projected::z,  &Projected::u,
                             &Projected::v, &Projected::ku, &Projected::kv, &Projected::scale};

// Particles that are projected at a time: into arrays of their own, which nothing else can be, so
// that the loop becomes one of vectors.
constexpr std::size_t kAtATime = 256;

// Projects particles [begin, end) into rows of all of them, and says which are kept: 1.
void project_some(const records::Projection& to, const WorldParticles& particles, std::size_t begin,
                  std::size_t end, Projected& all, std::vector<std::uint32_t>& kept) {
  std::array<std::array<float, kAtATime>, 7> rows;
  auto& [ex, ey, ez, u, v, ku, kv] = rows;
  std::array<std::uint32_t, kAtATime> in_view;
  for (std::size_t first = begin; first < end; first += kAtATime) {
    const std::size_t n = std::min(kAtATime, end - first);
    const float *const x = &particles.x[first], *const y = &particles.y[first],
                       *const z = &particles.z[first], *const scale = &all.scale[first];
    for (std::size_t i = 0; i < n; ++i) {
      const float px = x[i] - to.origin[0], py = y[i] - to.origin[1], pz = z[i] - to.origin[2];
      const float* const turn = to.rotation;
      ex[i] = turn[0] * px + turn[1] * py + turn[2] * pz + to.shift[0];
      ey[i] = turn[3] * px + turn[4] * py + turn[5] * pz + to.shift[1];
      ez[i] = turn[6] * px + turn[7] * py + turn[8] * pz + to.shift[2];
      const auto along = [x = ex[i], y = ey[i], z = ez[i]](const float* row) {
        return row[0] * x + row[1] * y + row[2] * z + row[3];
      };
      const float w = along(to.w_row);
      u[i] = along(to.u_row) / w;
      v[i] = along(to.v_row) / w;
      ku[i] = to.u_scale * scale[i] / w;
      kv[i] = to.v_scale * scale[i] / w;
      const float mu = to.margin * ku[i], mv = to.margin * kv[i];
      in_view[i] = all_true(ku[i] > 0, -ez[i] > to.near_depth, u[i] + mu >= 0,
                            u[i] - mu <= to.width, v[i] + mv >= 0, v[i] - mv <= to.height);
    }
    for (std::size_t row = 0; row < rows.size(); ++row)
      std::copy_n(rows[row].data(), n, &(all.*kValues[row])[first]);
    std::copy_n(in_view.data(), n, &kept[first]);
  }
}

// Leaves the particles that `all.index` names.
void keep_indexed(Projected& all) {
  parallel_for(kValues.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      std::vector<float>& row = all.*kValues[r];
      for (std::size_t k = 0; k < all.index.size(); ++k) row[k] = row[all.index[k]];
      row.resize(all.index.size());
    }
  });
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

Projected project_particles(const View& view, const WorldParticles& particles, double margin) {
  const records::Projection to = projection_of(view, margin);
  const std::size_t n = particles.x.size();
  Projected all;
  parallel_for(kValues.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      if (kValues[r] == &Projected::scale) all.scale = particles.scale;
      (all.*kValues[r]).resize(n, 1.0f);
    }
  });
  std::vector<std::uint32_t> kept(n);
  constexpr std::size_t kGrain = 4096;  // particles that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    project_some(to, particles, begin, end, all, kept);
  });
  all.index.reserve(n);
  for (std::size_t i = 0; i < n; ++i)
    if (kept[i]) all.index.push_back(static_cast<std::uint32_t>(i));
  if (all.index.size() < n) keep_indexed(all);
  return all;
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
