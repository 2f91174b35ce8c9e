#include <algorithm>
#include <limits>

#include "kernels/native/samples.hpp"

namespace meniscus::bench::native {
namespace {

constexpr float kNone = std::numeric_limits<float>::infinity();
constexpr std::uint8_t kEmpty = 0, kOpen = 1, kSmooth = 3;  // as in interpolate.cl
constexpr std::int32_t kOfCorner = 1 << 30;

struct Corner {
  Floats x, y, z, nx, ny, nz, t;
};

// The ray of the sample right of and below the first corner of eight cells of row b from cell a on.
inline Rays ray_of(const Interpolate& in, int a, int b, int right, int down) {
  return rays_at(
      in.ray,
      in.first + in.step * (2.0f * (static_cast<float>(a) + kLanes) + static_cast<float>(right)),
      all(in.first + in.step * static_cast<float>(2 * b + down)));
}

inline Corner corner_of(const Interpolate& in, int a, int b, int right, int down) {
  const auto inside = [](int i, int n) { return i < n - 1 ? i : n - 1; };
  std::int32_t at[8];
  for (int k = 0; k < 8; ++k) {
    const int cell = inside(a + k, in.cells_x);
    at[k] = inside(in.every * (2 * b + down), in.ny) * in.nx +
            inside(in.every * (2 * cell + right), in.nx);
  }
  const std::ptrdiff_t n = std::ptrdiff_t{in.nx} * in.ny;
  const Rays r = ray_of(in, a, b, right, down);
  Corner c;
  c.t = gather(in.depth, at);
  c.nx = gather(in.normal, at);
  c.ny = gather(in.normal + n, at);
  c.nz = gather(in.normal + 2 * n, at);
  c.x = r.ox + c.t * r.dx;
  c.y = r.oy + c.t * r.dy;
  c.z = -c.t;
  return c;
}

struct Between {
  Floats depth{}, nx{}, ny{}, nz{};
  Ints sure;
};

template <class... Corners>
[[gnu::always_inline]] inline Between between(const Rays& r, const Ints& smooth, float spread,
                                              bool perspective, const Corners&... corners) {
  Between b;
  b.sure = smooth;
  Floats linear{}, low = all(kNone), high{};
  const auto add = [&](const Corner& c) {
    const Floats slope = c.nx * r.dx + c.ny * r.dy - c.nz;
    const Floats t = (c.nx * (c.x - r.ox) + c.ny * (c.y - r.oy) + c.nz * c.z) / slope;
    b.sure &= slope < -0.1f;
    b.depth += t;
    low = smaller(t, low);
    high = larger(t, high);
    linear += perspective ? 1.0f / c.t : c.t;
    b.nx += c.nx;
    b.ny += c.ny;
    b.nz += c.nz;
  };
  (add(corners), ...);
  b.sure &= high - low < spread;
  constexpr float kShare = 1.0f / static_cast<float>(sizeof...(corners));
  linear = perspective ? 1.0f / (linear * kShare) : linear * kShare;
  b.depth = 0.5f * (linear + b.depth * kShare);
  const Floats size = 1.0f / root(larger(b.nx * b.nx + b.ny * b.ny + b.nz * b.nz, all(1e-30f)));
  b.nx *= size;
  b.ny *= size;
  b.nz *= size;
  return b;
}

void fill_cells(const Interpolate& in, int a, int b) {
  std::uint8_t shown[3][8];
  Ints smooth[3];
  bool all_empty = true;
  for (int k = 0; k < 8; ++k) {
    const int c = a + k < in.cells_x ? a + k : in.cells_x - 1;
    const std::uint8_t* const shows = in.shows + std::ptrdiff_t{b} * in.stride + c;
    const std::uint8_t own = *shows;
    shown[0][k] = std::max(own, b == 0 ? own : shows[-in.stride]);
    shown[1][k] = std::max(own, c == 0 ? own : shows[-1]);
    shown[2][k] = own;
    for (int m = 0; m < 3; ++m) {
      smooth[m][k] = shown[m][k] == kSmooth ? -1 : 0;
      all_empty &= shown[m][k] == kEmpty;
    }
  }
  if (all_empty) return;
  const bool any_smooth = any(smooth[0] | smooth[1] | smooth[2]);
  Between found[3];
  for (Between& f : found) f.sure = Ints{};
  if (any_smooth) {
    const Corner c0 = corner_of(in, a, b, 0, 0), c1 = corner_of(in, a, b, 2, 0),
                 c2 = corner_of(in, a, b, 0, 2), c3 = corner_of(in, a, b, 2, 2);
    found[0] = between(ray_of(in, a, b, 1, 0), smooth[0], in.spread, in.perspective, c0, c1);
    found[1] = between(ray_of(in, a, b, 0, 1), smooth[1], in.spread, in.perspective, c0, c2);
    found[2] =
        between(ray_of(in, a, b, 1, 1), smooth[2], in.spread, in.perspective, c0, c1, c2, c3);
  }
  const std::ptrdiff_t n = std::ptrdiff_t{in.nx} * in.ny;
  for (int m = 0; m < 3; ++m) {
    const int right = m != 1, down = m != 0, row = in.every * (2 * b + down);
    if (row >= in.ny) continue;
    const Between& f = found[m];
    for (int k = 0; k < 8; ++k) {
      const int i = in.every * (2 * (a + k) + right);
      if (i >= in.nx || shown[m][k] == kEmpty) continue;
      const std::ptrdiff_t at = std::ptrdiff_t{row} * in.nx + i;
      if (f.sure[k]) {
        const std::ptrdiff_t corner = std::ptrdiff_t{2} * in.every * (b * in.nx + a + k);
        in.depth[at] = f.depth[k];
        in.normal[at] = f.nx[k];
        in.normal[n + at] = f.ny[k];
        in.normal[2 * n + at] = f.nz[k];
        in.group[at] = in.group[corner] | kOfCorner;
        in.kind[at] = in.kind[corner];
      } else {
        const int block = row / 8 * ((in.nx + kTile - 1) / kTile * 2) + i / 8;
        const float reference = in.occupied[block] ? in.reference[at] : kNone;
        const float splash = in.splash_occupied[block] ? in.splash[at] : kNone;
        if (shown[m][k] == kOpen && reference < kNone)
          in.open[at] = reference;
        else
          in.wanted[std::ptrdiff_t{b} * in.stride + a + k] |=
              (reference < kNone) << m | (splash < kNone) << (3 + m);
      }
    }
  }
}

}  // namespace

void interpolate_samples(const Interpolate& in, std::size_t begin, std::size_t end) {
  const std::size_t tiles = static_cast<std::size_t>((in.nx + kTile - 1) / kTile) *
                            static_cast<std::size_t>((in.ny + kTile - 1) / kTile);
  const std::size_t rows = static_cast<std::size_t>(in.cells_y);
  for (std::size_t b = begin * rows / tiles; b < end * rows / tiles; ++b)
    for (int a = 0; a < in.cells_x; a += 8) fill_cells(in, a, static_cast<int>(b));
}

}  // namespace meniscus::bench::native
