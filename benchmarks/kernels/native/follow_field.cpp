#define MENISCUS_WIDE
#include <limits>

#include "kernels/native/field.hpp"

namespace meniscus::bench::native {
namespace {

constexpr float kNowhere = std::numeric_limits<float>::infinity(), kWindow = 8.0f;
constexpr float kNewton = 1.0f / 2048.0f, kNearly = 0.1f;
constexpr int kTakes = kWidth * kVectors, kRefine = 8;

// As many as kVectors vectors of a tile's list from `place` on, which share a search.
inline int load_work(const Lists& lists, int tile, int place, Lanes* lanes, Around& around) {
  int v = 0;
  for (; v < kVectors && place + kWidth * v < lists.count[tile]; ++v) {
    load_lanes(lists, tile, place + kWidth * v, lanes[v]);
    around.rays[v] = lanes[v].rays;
    around.wanted[v] = lanes[v].used;
  }
  around.vectors = v;
  around.from = all(kNowhere);
  around.to = Floats{};
  around.searched = false;
  return v;
}

struct Crossing {
  Floats depth = all(kNowhere), nx{}, ny{}, nz{}, most{};
};

// Depths of rays at which the density is measured, and what it is.
struct Probes {
  const float* weight;
  Floats at;
  Ints wanted;
  Floats density;
};

// Finds the crossings between `low` and `high`, where the field lies short_of < 0 and `over` above
// the level.
[[gnu::always_inline]] inline void refine_crossing(const Cells& cells, const float* weight,
                                                   Near& near, const Lines& line, const Rays& r,
                                                   float level, Ints found, Floats low,
                                                   Floats short_of, Floats high, Floats over,
                                                   Crossing& crossing) {
  Floats middle = low + (high - low) * (short_of / (short_of - over));
  for (int round = 1;; ++round) {
    const FieldAt f = field_near<true>(cells, weight, near, line, middle);
    const Floats gx = gradient_of(f.gx), gy = gradient_of(f.gy), gz = gradient_of(f.gz);
    const Floats there = f.c * kFieldNorm - level, slope = line.deep * (gx * r.dx + gy * r.dy - gz);
    const Ints ready = slope * kNewton >= magnitude(there);
    const Ints done = round == kRefine ? found : found & ready;
    const Floats size = root(gx * gx + gy * gy + gz * gz);
    const Ints crossed = done & (size > 0.0f);
    crossing.depth = crossed ? line.deep * middle : crossing.depth;
    crossing.nx = crossed ? -gx / size : crossing.nx;
    crossing.ny = crossed ? -gy / size : crossing.ny;
    crossing.nz = crossed ? -gz / size : crossing.nz;
    found &= ~done;
    if (!any(found)) return;
    const Floats a = low - middle, b = high - middle;
    const Floats bend_a = (short_of - there - slope * a) / (a * a);
    const Floats bend_b = (over - there - slope * b) / (b * b);
    const Floats cube = (bend_b - bend_a) / (b - a), square = bend_a - cube * a;
    Floats away = -there / slope;
    for (int k = 0; k < 2; ++k)
      away -= (there + away * (slope + away * (square + away * cube))) /
              (slope + away * (2.0f * square + 3.0f * cube * away));
    const Ints less = found & (there < 0.0f), more = found & ~(there < 0.0f);
    low = less ? middle : low;
    short_of = less ? there : short_of;
    high = more ? middle : high;
    over = more ? there : over;
    const Floats guess = middle + away;
    middle = ((guess > low) & (guess < high)) ? guess : 0.5f * (low + high);
  }
}

Crossing first_crossing(const Cells& cells, const float* weight, const Rays& r, const Floats& from,
                        const Floats& to, float level, const Ints& wanted, Around& around,
                        Probes& probes) {
  Crossing crossing;
  const Lines line(r);
  Near near;
  const Floats at = line.length * probes.at, end = line.length * to;
  const float per_sum = -1.5f * kFieldNorm / level;
  Floats l = line.length * from, low = l, short_of = all(-level);
  Ints going = wanted & (from <= to), fresh = going, steps{}, left = probes.wanted;
  while (any(going | left)) {
    const Floats next = going ? (left ? smaller(l, at) : l) : left ? at : all(kNowhere);
    const Floats window = line.length * (-most_lane(-(line.deep * next)) + kWindow);
    const Ints probed = left & (at <= window), stepped = going & (l <= window);
    const Floats last = smaller(end, window);
    list_near(cells, around, line, probed | stepped,
              stepped ? (probed ? smaller(low, at) : low) : at,
              stepped ? (probed ? larger(last, at) : last) : at, near);
    if (any(probed)) {
      const Floats c = field_near<false>(cells, probes.weight, near, line, at).c * kFieldNorm;
      probes.density = probed ? c : probes.density;
      left &= ~probed;
    }
    Ints here = stepped, found{};
    Floats over{};
    while (any(here)) {
      const Floats sum = field_near<false>(cells, weight, near, line, l).c, c = sum * kFieldNorm;
      const Ints inside = here & (c >= level), below = here & (c < level);
      over = inside ? c - level : over;
      found |= inside & ~fresh;
      fresh &= ~here;
      low = below ? l : low;
      short_of = below ? c - level : short_of;
      crossing.most = here ? larger(crossing.most, smaller(c, all(level))) : crossing.most;
      const Floats step = fused(sum, all(per_sum), all(1.5f));
      l = below ? l + smaller(larger(step, all(0.3f)), all(1.0f)) : l;
      steps -= here;
      going &= ~inside & (l <= end) & (steps < 1000);
      here = going & (l <= window);
    }
    if (!any(found)) continue;
    refine_crossing(cells, weight, near, line, r, level, found, low, short_of, l, over, crossing);
  }
  return crossing;
}

// What samples carry of the blend: its trust and where it lies.
struct Trust {
  Floats share;
  Ints on_edge, ended, passed;
  explicit Trust(const Floats& carried) {
    ended = carried > 3.5f;
    on_edge = ~ended & (carried > 1.5f);
    passed = carried > 7.5f;
    share = carried - (passed ? all(8.0f) : ended ? all(4.0f) : on_edge ? all(2.0f) : Floats{});
  }
  Floats contour(float density) const { return (on_edge ? all(0.3f) : all(1.0f)) * density; }
};

Floats search_from(const Follow& in, const Floats& t, const Floats& t0, const Floats& last) {
  return larger(smaller(smaller(t, t0) - in.search, last + in.beyond), all(1e-3f));
}

Floats search_to(const Floats& t, const Floats& t0, float beyond) {
  return (t < kNowhere ? larger(t, t0) : t0) + beyond;
}

void follow(const Follow& in, const Lanes& lanes, const Floats& last, Around& around) {
  const std::int32_t* const at = lanes.at;
  const Rays& r = lanes.rays;
  const Floats none{}, one = all(1.0f);
  const Floats t0 = gather(in.reference, at), t = gather(in.depth, at);
  const Ints met = t < kNowhere;
  const Trust trust(met ? gather(in.trust, at) : none);
  const Floats from = search_from(in, t, t0, last);
  const Floats to = search_to(t, t0, in.beyond);
  const Ints reaches = lanes.used & (from <= to);
  Probes probes{in.weight, t, lanes.used & met, none};
  const Crossing c =
      first_crossing(in.cells, in.level_weight, r, from, to, in.level, reaches, around, probes);
  const Floats inside = probes.density - trust.contour(in.contour) - 0.1f * (1.0f - trust.share);
  Floats share = trust.share * smaller(larger(20.0f * inside, none), one);
  const Ints crossed = c.depth < kNowhere, compared = crossed & (share > 0.0f);
  float* const normal[3] = {in.normal, in.normal + in.samples, in.normal + 2 * in.samples};
  Floats mx{}, my{}, mz{};
  if (any(compared)) {
    mx = gather(normal[0], at);
    my = gather(normal[1], at);
    mz = gather(normal[2], at);
    const Floats apart = magnitude(c.depth - t) * magnitude(mx * r.dx + my * r.dy - mz);
    const Floats alike = mx * c.nx + my * c.ny + mz * c.nz;
    const float d = in.disorder;
    const Floats agreement = (1.0f - smooth_step(0.5f + 0.5f * d, 1.0f + d, apart)) *
                             smooth_step(0.6f - 0.6f * d, 0.92f - 0.32f * d, alike);
    const Floats mark = smaller(larger(100.0f * (1.0f - trust.share), none), one);
    const Floats keeps = 1.0f - mark * mark * (1.0f - agreement);
    share = compared & ~trust.on_edge ? share * keeps : share;
  }
  const Floats missing = in.level - c.most;
  const Ints near_it = (1.0f - share) * missing < (kNearly * in.level) * share;
  const Ints stays = (trust.on_edge & (share > 0.5f)) | (~trust.on_edge & near_it);
  share = crossed ? share : stays ? one : none;
  const Ints changed = lanes.used & (share < 1.0f), both = share > 0.0f;
  const Ints drawn = changed & crossed, gone = changed & ~crossed;
  const Floats rest = 1.0f - share;
  Floats nx = both ? share * mx + rest * c.nx : c.nx;
  Floats ny = both ? share * my + rest * c.ny : c.ny;
  Floats nz = both ? share * mz + rest * c.nz : c.nz;
  const Floats size = 1.0f / root(larger(nx * nx + ny * ny + nz * nz, all(1e-30f)));
  nx *= size;
  ny *= size;
  nz *= size;
  face_eye(r.dx, r.dy, nx, ny, nz);
  scatter(both ? share * t + rest * c.depth : c.depth, in.depth, at, drawn);
  scatter(nx, normal[0], at, drawn);
  scatter(ny, normal[1], at, drawn);
  scatter(nz, normal[2], at, drawn);
  const Ints splash = drawn & (share <= 0.5f);
  scatter(Ints{} - 1, in.group, at, splash);
  scatter(Ints{} + 2, in.kind, at, splash);
  scatter(all(kNowhere), in.depth, at, gone);
  scatter(gone ? t0 : all(kNowhere), in.behind, at, lanes.used);
}

}  // namespace

void follow_field(const Follow& in, std::size_t begin, std::size_t end) {
  Lanes lanes[kVectors];
  Floats last[kVectors];
  Around around;
  for (int tile = static_cast<int>(begin); tile < static_cast<int>(end); ++tile)
    for (int place = 0; place < in.lists.count[tile]; place += kTakes) {
      const int vectors = load_work(in.lists, tile, place, lanes, around);
      for (int v = 0; v < vectors; ++v) {
        const Floats t0 = gather(in.reference, lanes[v].at), t = gather(in.depth, lanes[v].at);
        last[v] = gather(in.behind, lanes[v].at);
        need_between(search_from(in, t, t0, last[v]), search_to(t, t0, in.beyond), lanes[v].used,
                     around);
        need_between(t, t, lanes[v].used & (t < kNowhere), around);
      }
      for (int v = 0; v < vectors; ++v) follow(in, lanes[v], last[v], around);
    }
}

}  // namespace meniscus::bench::native
