#include <limits>

#include "kernels/native/lanes.hpp"
#include "kernels/native/native.hpp"

namespace meniscus::bench::native {
namespace {

constexpr float kNone = std::numeric_limits<float>::infinity();

inline Ints every(int x) { return Ints{} + x; }

// Whether something within two samples of this strip changed in the round before.
bool changed_near(const Specks& in, int strip, int j) {
  const int strips = in.strips();
  for (int y = j > 2 ? j - 2 : 0; y <= (j + 2 < in.ny ? j + 2 : in.ny - 1); ++y)
    for (int x = strip > 0 ? strip - 1 : 0; x <= (strip + 1 < strips ? strip + 1 : strip); ++x)
      if (in.changed[y * strips + x]) return true;
  return false;
}

// A strip of eight samples from (i, j), and the maps there.
struct Strip {
  const Specks& in;
  int i, j;
  std::ptrdiff_t at = std::ptrdiff_t{j} * in.nx + i, n = std::ptrdiff_t{in.nx} * in.ny;
  const float* depth = in.depth + at;
  const float* normal[3] = {in.normal + at, in.normal + n + at, in.normal + 2 * n + at};
  std::ptrdiff_t shift[8] = {-in.nx - 1, -in.nx, -in.nx + 1, -1, 1, in.nx - 1, in.nx, in.nx + 1};
  Floats t = load(depth), column = static_cast<float>(i) + Floats{0, 1, 2, 3, 4, 5, 6, 7};
  Ints empty = ~(t < kNone);
  Ints eligible = (column > 0.0f) & (column < static_cast<float>(in.nx - 1));
};

// The eight neighbours of each sample, and how it hangs together with them.
struct Around {
  Floats far{}, near = Floats{} + kNone, apart{};
  Ints covered{}, joined{}, linked{};
};

[[gnu::always_inline]] inline Around look_around(const Strip& s) {
  Around around;
  for (const std::ptrdiff_t to : s.shift) {
    const Floats d = load(s.depth + to), lower = d - s.t, away = lower < 0.0f ? -lower : lower;
    const Ints there = d < kNone, hangs = there & (away <= s.in.jump);
    around.covered -= there;
    around.far = there ? larger(around.far, d) : around.far;
    around.near = smaller(around.near, d);
    around.joined -= hangs;
    around.apart = there & ~hangs ? larger(around.apart, d) : around.apart;
    if (to == 1 || to == -1 || to == s.in.nx || to == -s.in.nx) around.linked |= away <= s.in.link;
  }
  return around;
}

// Sums over neighbours, and what a sample's normal has along their normals'.
struct Sum {
  Floats depth{}, x{}, y{}, z{};
  Floats size() const { return root(x * x + y * y + z * z); }
  Floats along(const Strip& s) const {
    return load(s.normal[0]) * x + load(s.normal[1]) * y + load(s.normal[2]) * z;
  }
};

inline Ints alone_in(const Floats& agreement, const Floats& along, const Floats& size) {
  return (agreement > 0.93f) & (along < (agreement - 0.03f) * size);
}

// Whether all samples stay: most strips lie in one layer.
[[gnu::always_inline]] inline bool all_stay(const Strip& s, const Around& around) {
  if (!any(s.eligible & (~s.empty | (around.covered > 0)))) return true;
  const Ints in_layer = ~s.empty & (around.covered == 8) & (around.joined >= 3) & around.linked &
                        (around.far - around.near <= s.in.jump);
  if (any(s.eligible & ~in_layer)) return false;
  Sum sum;
  for (const std::ptrdiff_t to : s.shift) {
    sum.x += load(s.normal[0] + to);
    sum.y += load(s.normal[1] + to);
    sum.z += load(s.normal[2] + to);
  }
  const Floats size = sum.size();
  return !any(s.eligible & alone_in(size / 8.0f, sum.along(s), size));
}

// How many of the 24 around samples without surface have some, where this may close a hole.
[[gnu::always_inline]] inline Ints covered_within_two(const Strip& s, const Ints& covered) {
  const int nx = s.in.nx;
  if (s.j < 2 || s.j >= s.in.ny - 2 || !any(s.eligible & s.empty & (covered < 6))) return Ints{};
  Ints within{};
  for (int k = 0; k < 25; ++k)
    within -= load(s.depth + (k / 5 - 2) * std::ptrdiff_t{nx} + k % 5 - 2) < kNone;
  return ((s.column > 1.0f) & (s.column < static_cast<float>(nx - 2))) ? within : Ints{};
}

// The farthest layer of the neighbours; in a pit of those that a sample does not hang together
// with.
struct Layer {
  Sum sum;
  Ints count{}, first{};
};

[[gnu::always_inline]] inline Layer far_layer(const Strip& s, const Around& around,
                                              const Ints& speck) {
  Ints in_pit{};
  for (int k = 0; k < 4; ++k)
    in_pit |= larger(load(s.depth + s.shift[k]), load(s.depth + s.shift[7 - k])) < s.t - s.in.jump;
  const Floats farthest = (speck & in_pit) ? around.apart : around.far;
  Layer layer;
  for (const std::ptrdiff_t to : s.shift) {
    const Floats d = load(s.depth + to);
    const Ints deep = (d <= farthest) & ~(farthest - d > s.in.jump);
    layer.first = (deep & (layer.count == 0)) ? every(static_cast<int>(to)) : layer.first;
    layer.count -= deep;
    layer.sum.depth += deep ? d : Floats{};
    layer.sum.x += deep ? load(s.normal[0] + to) : Floats{};
    layer.sum.y += deep ? load(s.normal[1] + to) : Floats{};
    layer.sum.z += deep ? load(s.normal[2] + to) : Floats{};
  }
  return layer;
}

// The strip of eight samples from (i, j), as specks.cl has it. Returns whether one changed.
bool close_strip(const Specks& in, int i, int j) {
  const Strip s{in, i, j};
  if (!any(s.eligible)) return false;
  const Around around = look_around(s);
  if (all_stay(s, around)) return false;
  const Ints within_two = covered_within_two(s, around.covered);
  const Ints speck = ~s.empty & ((around.joined < 3) | ~around.linked);
  const auto [sum, count, first] = far_layer(s, around, speck);
  const Floats size = sum.size();
  const Floats number = __builtin_convertvector(count > 1 ? count : every(1), Floats);
  const Ints alone =
      (count >= 6) & (count == around.covered) & alone_in(size / number, sum.along(s), size);
  const Ints goes = s.eligible & speck & (around.covered < 5);
  const Ints wants = s.empty ? (around.covered >= 6) | (within_two >= 17) : speck | alone;
  const Ints takes =
      s.eligible & ~goes & wants & (count >= (s.empty ? every(1) : every(3))) & (size > 0.0f);
  if (!any(goes | takes)) return false;
  const Floats new_depth = sum.depth / number, nx = sum.x / size, ny = sum.y / size,
               nz = sum.z / size;
  for (int k = 0; k < 8 && i + k < in.nx; ++k) {
    const std::ptrdiff_t at = s.at + k;
    in.change[at] = goes[k] || takes[k];
    if (!in.change[at]) continue;
    in.new_depth[at] = takes[k] ? new_depth[k] : kNone;
    in.new_normal[at] = takes[k] ? nx[k] : 0.0f;
    in.new_normal[s.n + at] = takes[k] ? ny[k] : 0.0f;
    in.new_normal[2 * s.n + at] = takes[k] ? nz[k] : 0.0f;
    in.new_group[at] = takes[k] ? in.group[at + first[k]] : -1;
    in.new_kind[at] = static_cast<std::uint8_t>(takes[k] ? in.kind[at + first[k]] : 0);
  }
  return true;
}

}  // namespace

void close_specks(const Specks& in, std::size_t begin, std::size_t end) {
  for (std::size_t row = begin; row < end; ++row) {
    const int j = static_cast<int>(row);
    for (int strip = 0; strip < in.strips(); ++strip)
      in.changes[j * in.strips() + strip] =
          j > 0 && j < in.ny - 1 && changed_near(in, strip, j) && close_strip(in, 8 * strip, j);
  }
}

void apply_closed(const Specks& in, std::size_t begin, std::size_t end) {
  const std::ptrdiff_t n = std::ptrdiff_t{in.nx} * in.ny;
  for (std::size_t row = begin; row < end; ++row)
    for (int strip = 0; strip < in.strips(); ++strip) {
      if (!in.changes[row * static_cast<std::size_t>(in.strips()) + strip]) continue;
      for (int i = 8 * strip; i < 8 * strip + 8 && i < in.nx; ++i) {
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(row) * in.nx + i;
        if (!in.change[at]) continue;
        in.depth[at] = in.new_depth[at];
        for (int axis = 0; axis < 3; ++axis)
          in.normal[axis * n + at] = in.new_normal[axis * n + at];
        in.group[at] = in.new_group[at];
        in.kind[at] = in.new_kind[at];
      }
    }
}

}  // namespace meniscus::bench::native
