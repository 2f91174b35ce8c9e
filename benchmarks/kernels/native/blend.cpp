#define MENISCUS_WIDE
#include "kernels/native/hidden.hpp"

namespace meniscus::bench::native {
namespace {

constexpr int kCached = 48;
constexpr int kBlock = 128;  // fits of a list that are met before they are weighed
constexpr float kOver = 0.06f, kSurelyOver = 0.8f;

// The hits that are kept; others, from place `rest` of the list on, are found again.
struct Cache {
  Hit hit[kCached];
  std::int32_t fit[kCached];
  int kept = 0, rest;
};

// All that rays meet, but the hits themselves.
struct Met {
  Sheet sum;  // as if it were of one sheet
  Floats best{}, trust{}, firm{}, height{};
  Floats ax{}, ay{}, az{};  // the heaviest hit's gradient
  Ints group = Ints{} - 1;  // and its fit
};

// The samples of a blend, and the fits of their tile.
struct Blender {
  const Blend& in;
  const Sample& s;
  const Listed& listed;

  const float* fit_at(int fit) const { return in.records + std::ptrdiff_t{fit} * kRecord; }
  const float* foot_of(int fit) const { return in.feet + std::ptrdiff_t{fit} * 4; }
  Floats same(const Floats& cosine) const { return smooth_step(in.same_low, in.same_high, cosine); }

  // Calls visit(hit, record, foot) for all hits.
  template <class Visit>
  [[gnu::always_inline]] void each_hit(const Cache& cache, const Visit& visit) const {
    for (int k = 0; k < cache.kept; ++k)
      visit(cache.hit[k], fit_at(cache.fit[k]), foot_of(cache.fit[k]));
    for (int k = cache.rest; k < listed.met.count; ++k) {
      const int fit = listed.met.fit[k];
      const float *const g = fit_at(fit), *const foot = foot_of(fit);
      const Entry entry = entry_of(g, foot, s, in.d_max);
      Hit hit;
      if (!entry.counts() || !weigh(g, foot, s, in.d_max, entry, hit)) continue;
      fade(entry, hit);
      visit(hit, g, foot);
    }
  }
};

[[gnu::always_inline]] inline void add_met(const Blender& by, int place, const Entry& entry,
                                           Cache& cache, Met& met) {
  const int fit = by.listed.met.fit[place];
  const float *const g = by.fit_at(fit), *const foot = by.foot_of(fit);
  Hit hit;
  if (!weigh(g, foot, by.s, by.in.d_max, entry, hit)) return;
  met.firm = fused(hit.weight, all(g[14]), met.firm);
  fade(entry, hit);
  if (cache.kept < kCached) {
    cache.hit[cache.kept] = hit;
    cache.fit[cache.kept++] = fit;
  } else if (cache.rest == by.listed.met.count) {
    cache.rest = place;
  }
  const Ints better = hit.weight > met.best;
  met.best = better ? hit.weight : met.best;
  met.group = better ? Ints{} + fit : met.group;
  met.ax = better ? hit.gx : met.ax;
  met.ay = better ? hit.gy : met.ay;
  met.az = better ? hit.gz : met.az;
  met.trust = fused(hit.weight, all(g[12]), met.trust);
  met.height = fused(hit.weight, entry.height, met.height);
  add_hit(met.sum, foot, by.s, hit, all(1.0f));
}

// Half of the fits near the beam are met beyond their reach, and which could not be foreseen: first
// all that rays meet, without a branch, then the weights of those that count.
[[gnu::always_inline]] inline void meet_all(const Blender& by, Cache& cache, Met& met) {
  const List& list = by.listed.met;
  const Beam beam = beam_of(by.s);
  cache.rest = list.count;
  for (int from = 0; from < list.count; from += kBlock) {
    const int to = from + kBlock < list.count ? from + kBlock : list.count;
    std::int32_t place[kBlock + kWidth];  // in the list
    Entry entry[kBlock];
    int near = 0, count = 0;
    for (int k = from; k < to; k += kWidth) {
      const unsigned bits = near_beam(list, k, beam);
      pack(bits, k + kPlaces, place + near);
      near += __builtin_popcount(bits);
    }
    for (int n = 0; n < near; ++n) {
      const std::int32_t at = place[n], fit = list.fit[at];  // before `count` is waited for
      place[count] = at;
      entry[count] = entry_of(by.fit_at(fit), by.foot_of(fit), by.s, by.in.d_max);
      count += entry[count].counts();
    }
    for (int n = 0; n < count; ++n) add_met(by, place[n], entry[n], cache, met);
  }
}

// What rays meet in one sheet, in two, or in three.
struct Sheets {
  Sheet A, B, C;
  bool one = false;  // all is of A
  Floats third{};    // how far there is C
};

// Two rounds of mean shift. Returns whether all hits are of the sheet around the axis.
[[gnu::always_inline]] inline bool find_axis(const Blender& by, const Cache& cache, const Met& met,
                                             Axis& axis) {
  bool one_sheet = cache.rest == by.listed.met.count;
  for (int round = 0; round < 2; ++round) {
    if (one_sheet) {
      Floats least = all(1.0f);
      for (int k = 0; k < cache.kept; ++k) {
        const Floats agrees = axis.alike(cache.hit[k], by.fit_at(cache.fit[k]));
        least = smaller(least, cache.hit[k].weight > 0.0f ? agrees : all(1.0f));
      }
      one_sheet = !any(by.same(least) < 1.0f);
    }
    Axis sum{met.sum.nx, met.sum.ny, met.sum.nz};
    if (!one_sheet) {
      sum = {};
      by.each_hit(cache, [&](const Hit& hit, const float* g, const float*) {
        sum.add(hit, hit.weight * by.same(axis.alike(hit, g)));
      });
    }
    axis.turn_to(sum);
  }
  return one_sheet;
}

// Sheet A lies around the axis. Where what is not of A faces two ways, it makes sheets B and C.
[[gnu::always_inline]] inline void split(const Blender& by, const Cache& cache, const Axis& axis,
                                         Sheets& sheets) {
  Sheet &A = sheets.A, &B = sheets.B, &C = sheets.C;
  A = Sheet{};
  Axis other;
  Floats most{};
  by.each_hit(cache, [&](const Hit& hit, const float* g, const float* foot) {
    const Floats share = by.same(axis.alike(hit, g)), left = (1.0f - share) * hit.weight;
    add_hit(A, foot, by.s, hit, share);
    add_hit(B, foot, by.s, hit, 1.0f - share);
    const Ints better = left > most;
    most = better ? left : most;
    other.take(hit, better);
  });
  const Floats length = root(square_of(B.nx, B.ny, B.nz)) / larger(B.w, all(kTiny));
  const Floats third = (1.0f - smooth_step(0.95f, 0.98f, length)) *
                       smooth_step(0.003f, 0.02f, B.w / larger(A.w + B.w, all(kTiny)));
  sheets.third = third;
  if (!any(third > 0.0f)) return;
  Axis sum;
  by.each_hit(cache, [&](const Hit& hit, const float* g, const float*) {
    const Floats rest = 1.0f - by.same(axis.alike(hit, g));
    sum.add(hit, rest * hit.weight * by.same(other.alike(hit, g)));
  });
  other.turn_to(sum);
  B = Sheet{};
  by.each_hit(cache, [&](const Hit& hit, const float* g, const float* foot) {
    const Floats rest = 1.0f - by.same(axis.alike(hit, g));
    const Floats of_c = third * (1.0f - by.same(other.alike(hit, g)));
    add_hit(B, foot, by.s, hit, rest * (1.0f - of_c));
    add_hit(C, foot, by.s, hit, rest * of_c);
  });
}

[[gnu::always_inline]] inline Sheets sheets_of(const Blender& by, const Cache& cache,
                                               const Met& met) {
  Sheets sheets;
  sheets.A = met.sum;
  Axis axis{met.ax, met.ay, met.az};
  sheets.one = find_axis(by, cache, met, axis);
  if (!sheets.one) split(by, cache, axis, sheets);
  return sheets;
}

// The middles of the sheets, and what of them is shown.
struct Meeting {
  Middle a, b, c;
  Floats weights;
  Shares shares{};
  Ints edge{};  // convex
};

// Two sheets or three meet.
[[gnu::always_inline]] inline void share_out(const Blender& by, const Sheets& sheets, Meeting& m) {
  const float crease = by.in.crease;
  const Sheet &A = sheets.A, &B = sheets.B, &C = sheets.C;
  const Floats per_all = 1.0f / larger(m.weights, all(kTiny));
  const Floats some_b = smooth_step(0.003f, 0.02f, B.w * per_all);
  const Ints convex = convex_between(m.a, m.b), only_b = ~(A.w > 1e-9f * B.w);
  const Floats apart = magnitude(m.a.z - m.b.z);
  m.edge = (B.w > 0.03f * A.w) & convex & (apart <= crease);
  if (any(sheets.third > 0.0f)) {
    const Floats some_c = smooth_step(0.003f, 0.02f, C.w * per_all);
    m.shares = shares_in_corner(m.a, m.b, m.c, some_b, some_c, only_b, crease);
    m.edge |= (C.w > 0.03f * A.w) & convex_between(m.a, m.c) & (magnitude(m.a.z - m.c.z) <= crease);
  } else {
    m.shares.b = only_b ? all(1.0f) : takes_over(m.a.z, m.b.z, convex, some_b, crease);
  }
  // A third face may hold the nearer of A and B.
  const Ints beside = convex & (apart <= crease) & ~only_b & (some_b > 0.0f) & (apart > kMeeting);
  if (!any(beside)) return;
  const Ints is_near = m.a.z < m.b.z;
  const Middle near = either_sheet(m.a, m.b, is_near), deep = either_sheet(m.b, m.a, is_near);
  const Floats held = held_by(by.in, by.s, by.listed.rim, near, deep, m.weights, beside);
  m.shares.b = is_near ? m.shares.b * (1.0f - held)
                       : fused(held, some_b * (1.0f - m.shares.c) - m.shares.b, m.shares.b);
}

[[gnu::always_inline]] inline Meeting meeting_of(const Blender& by, const Sheets& sheets) {
  Meeting m{middle_of(sheets.A), middle_of(sheets.B), middle_of(sheets.C),
            sheets.A.w + sheets.B.w + sheets.C.w};
  if (!sheets.one) share_out(by, sheets, m);
  return m;
}

// Sets depth and normal. Returns the middle of what is shown.
[[gnu::always_inline]] inline Axis show(const Sample& s, const Met& met, const Sheets& sheets,
                                        const Meeting& m, Blended& out) {
  const auto& [a, b, c, weights, shares, edge] = m;
  const Floats of_a = all(1.0f) - shares.b - shares.c, of_b = shares.b, of_c = shares.c;
  out.group = met.group;
  out.depth = met.best > 0.0f ? s.t + a.z * of_a + b.z * of_b + c.z * of_c : out.depth;
  add_normal(sheets.A, a.z, of_a, out);
  if (!sheets.one) {
    add_normal(sheets.B, b.z, of_b, out);
    add_normal(sheets.C, c.z, of_c, out);
  }
  const Floats size = inverse_root(square_of(out.nx, out.ny, out.nz), kTiny);
  out.nx *= size;
  out.ny *= size;
  out.nz *= size;
  face_eye(s.dx, s.dy, out.nx, out.ny, out.nz);
  return {fused(a.cx, of_a, fused(b.cx, of_b, c.cx * of_c)),
          fused(a.cy, of_a, fused(b.cy, of_b, c.cy * of_c)),
          fused(a.cz, of_a, fused(b.cz, of_b, c.cz * of_c))};
}

// The trust of what is shown, and its mark.
[[gnu::always_inline]] inline Floats trust_of(const Sample& s, const Met& met, const Sheets& sheets,
                                              const Meeting& m, const Hidden& hidden,
                                              const Ints& ended) {
  const Floats none{}, one = all(1.0f), tiny = all(kTiny), weights = m.weights;
  const Sheet &A = sheets.A, &B = sheets.B, &C = sheets.C;
  Floats trust = smaller(1.001f * weights / larger(met.trust, tiny), one) *
                 smooth_step(0.002f, 0.015f, met.firm);
  const Floats least = trust >= 1.0f ? all(kVouchingSure) : all(kVouching);
  const Ints edge = m.edge | ((hidden.within > least) & (hidden.within > hidden.beyond));
  const Floats entering =
      dot_of(A.nx + B.nx + C.nx, A.ny + B.ny + C.ny, A.nz + B.nz + C.nz, s.dx, s.dy, all(-1.0f));
  const Ints over =
      (met.height > kOver * weights) | (hidden.turning.height_over(weights, entering) > kOver);
  const Ints passed = over & (trust > kSurelyOver);
  trust = over & ~passed ? none : trust;
  const Floats one_face = 1.0f - smooth_step(0.003f, 0.02f, (B.w + C.w) / larger(weights, tiny));
  const Floats doubt = (1.0f - trust) * (1.0f - smooth_step(0.8f, 1.4f, met.firm) * one_face);
  trust = over | ended ? trust : 1.0f - doubt;
  return trust + (passed ? all(8.0f) : ended ? all(4.0f) : edge ? all(2.0f) : none);
}

Blended blend_at(const Blend& in, const Sample& s, const Listed& listed) {
  const Blender by{in, s, listed};
  Blended out;
  Cache cache;
  Met met;
  meet_all(by, cache, met);
  if (!any(met.best > 0.0f)) return out;
  const Sheets sheets = sheets_of(by, cache, met);
  const Meeting meeting = meeting_of(by, sheets);
  const Axis middle = show(s, met, sheets, meeting, out);
  const Hidden hidden = hidden_at(in, s, listed.rim, middle, out);
  out.trust = trust_of(s, met, sheets, meeting, hidden, ended_by(hidden, middle, out));
  return out;
}

}  // namespace

void blend_groups(const Blend& in, std::size_t begin, std::size_t end) {
  for (std::size_t k = begin; k < end; ++k) {
    const int tile = static_cast<int>(k);
    const auto list = [k](const FitList& fits) {
      const std::int32_t first = fits.start[k];
      return List{fits.fit + first, fits.place + first, fits.stride, fits.start[k + 1] - first};
    };
    const Listed listed = {list(in.met), list(in.rim)};
    for (int place = 0; place < in.lists.count[k]; place += kWidth) {
      Lanes lanes;
      load_lanes(in.lists, tile, place, lanes);
      const Rays& r = lanes.rays;
      const Floats t = gather(in.reference, lanes.at);
      const Blended b = blend_at(in, {r.ox + t * r.dx, r.oy + t * r.dy, t, r.dx, r.dy}, listed);
      scatter(b.depth, in.depth, lanes.at, lanes.used);
      scatter(b.nx, in.normal, lanes.at, lanes.used);
      scatter(b.ny, in.normal + in.samples, lanes.at, lanes.used);
      scatter(b.nz, in.normal + 2 * in.samples, lanes.at, lanes.used);
      scatter(b.trust, in.trust, lanes.at, lanes.used);
      scatter(b.group, in.group, lanes.at, lanes.used);
    }
  }
}

}  // namespace meniscus::bench::native
