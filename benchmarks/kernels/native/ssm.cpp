#include <limits>

#include "kernels/native/samples.hpp"

namespace meniscus::bench::native {
namespace {

constexpr float kNone = std::numeric_limits<float>::infinity();

// Up to eight samples from p; beyond `count` there is no surface.
inline Floats load_some(const float* p, int count) {
  if (count >= 8) return load(p);
  Floats v = all(kNone);
  for (int k = 0; k < count; ++k) v[k] = p[k];
  return v;
}

// See smooth() of ssm.cl. neighbours(k, before, after) loads the samples k to both sides; `reach`
// is how many there are, `most` in any lane.
template <class Neighbours>
[[gnu::always_inline]] inline Floats smooth(const Floats& centre, const Floats& reach, int most,
                                            const Smoothing& in, const Neighbours& neighbours) {
  const Floats scale = in.spread[1] + in.spread[2] * centre;
  const Floats n = in.spread[0] / (scale * scale);
  Floats weight = all(1.0f), weights{}, sum{}, tap{};
  Ints open = (magnitude(centre) < kNone);
  for (int k = 0; k < most && any(open); ++k) {
    weight = weight * ((n - tap) / (n + (tap + 1.0f)));
    open = open & (tap < reach) & (weight >= 1.0f / 1024.0f);
    tap = tap + 1.0f;
    Floats before, after;
    neighbours(k + 1, before, after);
    before -= centre;
    after -= centre;
    open = open & (larger(magnitude(before), magnitude(after)) <= in.z_max);
    sum += open ? weight * (before + after) : Floats{};
    weights += open ? weight : Floats{};
  }
  return centre + sum / (1.0f + 2.0f * weights);
}

}  // namespace

void smooth_columns(const Smoothing& in, std::size_t begin, std::size_t end) {
  for (std::size_t row = begin; row < end; ++row) {
    const int j = static_cast<int>(row);
    const int reach = j < in.ny - 1 - j ? j : in.ny - 1 - j;
    const std::ptrdiff_t stride = in.nx;
    for (int i = 0; i < in.nx; i += 8) {
      const int count = in.nx - i;
      const float* const here = in.depth + j * stride + i;
      const Floats smoothed = smooth(load_some(here, count), all(static_cast<float>(reach)), reach,
                                     in, [&](int k, Floats& before, Floats& after) {
                                       before = load_some(here - k * stride, count);
                                       after = load_some(here + k * stride, count);
                                     });
      store_first(smoothed, in.smoothed + j * stride + i, count);
    }
  }
}

void smooth_rows(const Smoothing& in, std::size_t begin, std::size_t end) {
  for (std::size_t row = begin; row < end; ++row) {
    const float* const line = in.depth + row * static_cast<std::size_t>(in.nx);
    float* const to = in.smoothed + row * static_cast<std::size_t>(in.nx);
    for (int i = 0; i < in.nx; i += 8) {
      const int count = in.nx - i;
      const Floats place = static_cast<float>(i) + kLanes;
      const Floats left = static_cast<float>(in.nx - 1) - place;
      const Floats reach = place < left ? place : left;
      int most = 0;
      for (int k = 0; k < 8; ++k)
        if (reach[k] > static_cast<float>(most)) most = static_cast<int>(reach[k]);
      const Floats smoothed = smooth(
          load_some(line + i, count), reach, most, in, [&](int k, Floats& before, Floats& after) {
            if (i - k >= 0 && i + k + 8 <= in.nx) {
              before = load(line + i - k);
              after = load(line + i + k);
              return;
            }
            for (int lane = 0; lane < 8; ++lane) {
              before[lane] = i + lane - k >= 0 && i + lane < in.nx ? line[i + lane - k] : kNone;
              after[lane] = i + lane + k < in.nx ? line[i + lane + k] : kNone;
            }
          });
      store_first(smoothed, to + i, count);
    }
  }
}

void depth_normals(const Normals& in, std::size_t begin, std::size_t end) {
  const std::size_t size = static_cast<std::size_t>(in.nx) * static_cast<std::size_t>(in.ny);
  const float step = in.step, z_max = in.z_max;
  for (std::size_t j = begin; j < end; ++j)
    for (int i = 0; i < in.nx; i += 8) {
      const int count = in.nx - i;
      const std::size_t at = j * static_cast<std::size_t>(in.nx) + static_cast<std::size_t>(i);
      const float* const here = in.depth + at;
      const Floats t = load_some(here, count), none = all(kNone);
      const Ints surface = t < kNone;
      Floats x{}, y{}, z{};
      if (any(surface)) {
        Floats left, right;
        if (i > 0) {
          left = load_some(here - 1, count + 1);
        } else {
          left[0] = kNone;
          for (int k = 1; k < 8; ++k) left[k] = k <= count ? here[k - 1] : kNone;
        }
        right = load_some(here + 1, count - 1);
        const Floats above = j > 0 ? load_some(here - in.nx, count) : none;
        const Floats below =
            j + 1 < static_cast<std::size_t>(in.ny) ? load_some(here + in.nx, count) : none;
        const Ints use_left = magnitude(left - t) <= z_max,
                   use_right = magnitude(right - t) <= z_max;
        const Ints use_above = magnitude(above - t) <= z_max,
                   use_below = magnitude(below - t) <= z_max;
        const Floats u = in.first + step * (static_cast<float>(i) + kLanes);
        const Floats v = all(in.first + step * static_cast<float>(j));
        const Rays centre = rays_at(in.ray, u, v);
        const Rays to_right = rays_at(in.ray, (use_left & ~use_right) ? u : u + step, v);
        const Rays to_left = rays_at(in.ray, use_left ? u - step : u, v);
        const Rays to_below = rays_at(in.ray, u, (use_above & ~use_below) ? v : v + step);
        const Rays to_above = rays_at(in.ray, u, use_above ? v - step : v);
        const Floats t_right = use_right ? right : t, t_left = use_left ? left : t;
        const Floats t_below = use_below ? below : t, t_above = use_above ? above : t;
        const Floats ux =
            (to_right.ox + t_right * to_right.dx) - (to_left.ox + t_left * to_left.dx);
        const Floats uy =
            (to_right.oy + t_right * to_right.dy) - (to_left.oy + t_left * to_left.dy);
        const Floats uz = -t_right - -t_left;
        const Floats vx =
            (to_below.ox + t_below * to_below.dx) - (to_above.ox + t_above * to_above.dx);
        const Floats vy =
            (to_below.oy + t_below * to_below.dy) - (to_above.oy + t_above * to_above.dy);
        const Floats vz = -t_below - -t_above;
        x = vy * uz - vz * uy;
        y = vz * ux - vx * uz;
        z = vx * uy - vy * ux;
        const Floats away = x * centre.dx + y * centre.dy - z;
        const Floats scale = (away > 0.0f ? all(-1.0f) : all(1.0f)) / root(x * x + y * y + z * z);
        x = surface ? x * scale : Floats{};
        y = surface ? y * scale : Floats{};
        z = surface ? z * scale : Floats{};
      }
      store_first(x, in.normal + at, count);
      store_first(y, in.normal + size + at, count);
      store_first(z, in.normal + 2 * size + at, count);
    }
}

}  // namespace meniscus::bench::native
