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

// The strip of eight samples from (i, j), as specks.cl has it.
bool close_strip(const Specks& in, int i, int j) {
  const std::ptrdiff_t s = std::ptrdiff_t{j} * in.nx + i;
  const std::ptrdiff_t n = std::ptrdiff_t{in.nx} * in.ny;
  const float* const depth = in.depth + s;
  const float* const normal[3] = {in.normal + s, in.normal + n + s, in.normal + 2 * n + s};
  const Floats t = load(depth), column = static_cast<float>(i) + Floats{0, 1, 2, 3, 4, 5, 6, 7};
  const Ints empty = ~(t < kNone);
  const Ints eligible = (column > 0.0f) & (column < static_cast<float>(in.nx - 1));
  if (!any(eligible)) return false;
  Floats far{}, near = Floats{} + kNone, apart{};
  Ints covered{}, joined{}, linked{}, around{};
  std::ptrdiff_t shift[8];
  for (int k = 0, m = 0; k < 9; ++k)
    if (k != 4) shift[m++] = (k / 3 - 1) * std::ptrdiff_t{in.nx} + k % 3 - 1;
  for (const std::ptrdiff_t to : shift) {
    const Floats d = load(depth + to), lower = d - t, away = lower < 0.0f ? -lower : lower;
    const Ints there = d < kNone, hangs = there & (away <= in.jump);
    covered -= there;
    far = there ? larger(far, d) : far;
    near = smaller(near, d);
    joined -= hangs;
    apart = there & ~hangs ? larger(apart, d) : apart;
    if (to == 1 || to == -1 || to == in.nx || to == -in.nx) linked |= away <= in.link;
  }
  if (!any(eligible & (~empty | (covered > 0)))) return false;
  const Ints in_layer = ~empty & (covered == 8) & (joined >= 3) & linked & (far - near <= in.jump);
  if (!any(eligible & ~in_layer)) {
    Floats sx{}, sy{}, sz{};
    for (const std::ptrdiff_t to : shift) {
      sx += load(normal[0] + to);
      sy += load(normal[1] + to);
      sz += load(normal[2] + to);
    }
    const Floats size = root(sx * sx + sy * sy + sz * sz), agreement = size / 8.0f;
    const Floats along = load(normal[0]) * sx + load(normal[1]) * sy + load(normal[2]) * sz;
    if (!any(eligible & (agreement > 0.93f) & (along < (agreement - 0.03f) * size))) return false;
  }
  if (j > 1 && j < in.ny - 2 && any(eligible & empty & (covered < 6))) {
    for (int k = 0; k < 25; ++k)
      around -= load(depth + (k / 5 - 2) * std::ptrdiff_t{in.nx} + k % 5 - 2) < kNone;
    around = ((column > 1.0f) & (column < static_cast<float>(in.nx - 2))) ? around : Ints{};
  }
  const Ints speck = ~empty & ((joined < 3) | ~linked);
  Ints between{};
  for (int k = 0; k < 4; ++k)
    between |= larger(load(depth + shift[k]), load(depth + shift[7 - k])) < t - in.jump;
  const Floats layer = (speck & between) ? apart : far;
  Floats sum{}, sx{}, sy{}, sz{};
  Ints count{}, first{};
  for (const std::ptrdiff_t to : shift) {
    const Floats d = load(depth + to);
    const Ints deep = (d <= layer) & ~(layer - d > in.jump);
    first = (deep & (count == 0)) ? every(static_cast<int>(to)) : first;
    count -= deep;
    sum += deep ? d : Floats{};
    sx += deep ? load(normal[0] + to) : Floats{};
    sy += deep ? load(normal[1] + to) : Floats{};
    sz += deep ? load(normal[2] + to) : Floats{};
  }
  const Floats size = root(sx * sx + sy * sy + sz * sz);
  const Floats along = load(normal[0]) * sx + load(normal[1]) * sy + load(normal[2]) * sz;
  const Floats number = __builtin_convertvector(count > 1 ? count : every(1), Floats);
  const Floats agreement = size / number;
  const Ints alone = (count >= 6) & (count == covered) & (agreement > 0.93f) &
                     (along < (agreement - 0.03f) * size);
  const Ints goes = eligible & speck & (covered < 5);
  const Ints wants = empty ? (covered >= 6) | (around >= 17) : speck | alone;
  const Ints takes =
      eligible & ~goes & wants & (count >= (empty ? every(1) : every(3))) & (size > 0.0f);
  if (!any(goes | takes)) return false;
  const Floats new_depth = sum / number, nx = sx / size, ny = sy / size, nz = sz / size;
  for (int k = 0; k < 8 && i + k < in.nx; ++k) {
    const std::ptrdiff_t at = s + k;
    in.change[at] = goes[k] || takes[k];
    if (!in.change[at]) continue;
    in.new_depth[at] = takes[k] ? new_depth[k] : kNone;
    in.new_normal[at] = takes[k] ? nx[k] : 0.0f;
    in.new_normal[n + at] = takes[k] ? ny[k] : 0.0f;
    in.new_normal[2 * n + at] = takes[k] ? nz[k] : 0.0f;
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
