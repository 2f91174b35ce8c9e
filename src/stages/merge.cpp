#include "stages/merge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstdio>

#include "parallel.hpp"
#include "stages/cells.hpp"

namespace meniscus {
namespace {

double env(const char* name, double otherwise) {
  const char* s = std::getenv(name);
  return s ? std::atof(s) : otherwise;
}

constexpr std::size_t kGrain = 256;

struct Pair {
  std::int32_t other;
  float distance, same;  // particle radii; product of both normals
};

struct Pairs {
  std::vector<std::size_t> start;
  std::vector<Pair> pair;
};

Pairs pairs_within(const Projected& projected, const SurfaceParticles& around, float reach) {
  const std::size_t n = around.index.size();
  const Cells cells = cells_of(projected, around.index, reach);
  const std::size_t blocks = (n + kGrain - 1) / kGrain;
  std::vector<std::vector<Pair>> of_block(blocks);
  std::vector<std::size_t> count(n);
  NearFinder* const find = near_finders()[0];
  parallel_for(blocks, 1, [&](std::size_t begin, std::size_t end) {
    std::vector<std::int32_t> found;
    for (std::size_t b = begin; b < end; ++b)
      for (std::size_t k = b * kGrain; k < std::min(n, (b + 1) * kGrain); ++k) {
        const std::size_t i = static_cast<std::size_t>(around.index[k]);
        const std::array at{projected.x[i], projected.y[i], projected.z[i]};
        std::size_t number = 0;
        visit_ranges_near(
            cells, at[0], at[1], at[2],
            [&](std::int32_t first, std::int32_t last, std::uint32_t tag) {
              const std::size_t most = number + static_cast<std::size_t>(last - first) + kNearRoom;
              if (found.size() < most) found.resize(2 * most);
              number += find(cells, first, last, tag, at, reach * reach, found.data() + number);
              return true;
            });
        for (std::size_t f = 0; f < number; ++f) {
          const std::size_t j = static_cast<std::size_t>(found[f]);
          if (j == k) continue;
          const double d =
              length(projected.eye(static_cast<std::size_t>(around.index[j])) - projected.eye(i));
          of_block[b].push_back({found[f], static_cast<float>(d),
                                 static_cast<float>(dot(around.normal[k], around.normal[j]))});
          ++count[k];
        }
      }
  });
  Pairs pairs;
  pairs.start.push_back(0);
  for (const std::size_t c : count) pairs.start.push_back(pairs.start.back() + c);
  pairs.pair.reserve(pairs.start.back());
  for (const auto& block : of_block)
    pairs.pair.insert(pairs.pair.end(), block.begin(), block.end());
  return pairs;
}

// A wave with level ends: 0 at whole x, 1 halfway.
double wave(double x) {
  const double t = x - std::floor(x);
  const double p = 4 * t * (1 - t);
  return p * p * (3 - 2 * p);
}

}  // namespace

MergedGroups merge_surface(const View& view, const Projected& projected, const Visible& rim,
                           const SurfaceParticles& around, const MergeParams&) {
  static const double kMax = env("G_MAX", 3.6), kMin = env("G_MIN", 2.0), kLow = env("G_LOW", .6),
                      kHigh = env("G_HIGH", .95), kWave = env("G_WAVE", 3.6), kW = env("G_W", .05),
                      kCalm = env("G_CALM", 5), kSoft = env("G_SOFT", .85), kEps = env("G_EPS", .05),
                      kNlow = env("G_NLOW", .8), kNhigh = env("G_NHIGH", .95);
  const std::size_t n = around.index.size();
  const Pairs pairs = pairs_within(projected, around, static_cast<float>(std::max(kMax, kCalm)));
  std::vector<double> extent(n), rank(n), strength(n), owned(n, 0.0);
  std::vector<char> near(n, 0);
  std::vector<std::int32_t> place = places_in(around.index, rim.index);
  for (std::size_t r = 0; r < place.size(); ++r) {
    near[place[r]] = 1;
    owned[place[r]] = rim.owned[r];
  }
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      double all = 1e-9, agree = 1e-9;
      for (std::size_t p = pairs.start[k]; p < pairs.start[k + 1]; ++p) {
        const Pair& pair = pairs.pair[p];
        const double d = pair.distance / kCalm;
        if (d >= 1) continue;
        const double w = around.weight[pair.other] * (1 - d * d) * (1 - d * d);
        all += w;
        agree += w * smooth_step(0.72, 0.95, pair.same);
      }
      const double calm = smooth_step(kLow, kHigh, agree / all);
      extent[k] = kMin + (kMax - kMin) * calm;
      const Vec3d world = world_direction(
          view, projected.eye(static_cast<std::size_t>(around.index[k])) - view.shift);
      // along three directions that no lattice of particles has
      const Vec3d a{0.7071, 0.5412, 0.4551}, b{-0.6533, 0.7511, 0.0951}, c{-0.2903, -0.3645, 0.8848};
      rank[k] = wave(dot(a, world) / kWave) + wave(dot(b, world) / kWave) + wave(dot(c, world) / kWave);
      strength[k] = smooth_step(0.5, 0.8, around.weight[k]);
    }
  });
  // how much each pair's other one takes in
  std::vector<float> takes(pairs.pair.size());
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      for (std::size_t p = pairs.start[k]; p < pairs.start[k + 1]; ++p) {
        const Pair& pair = pairs.pair[p];
        const double reach = std::min(extent[k], extent[pair.other]);
        takes[p] = static_cast<float>((1 - smooth_step(kSoft, 1, pair.distance / reach)) *
                                      smooth_step(-kW, kW, rank[pair.other] - rank[k]) *
                                      smooth_step(kNlow, kNhigh, pair.same) *
                                      strength[pair.other]);
      }
  });
  std::vector<double> share(n, 1.0), next(n);
  int rounds = 0;
  for (; rounds < 40; ++rounds) {
    parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        double left = 1;
        for (std::size_t p = pairs.start[k]; p < pairs.start[k + 1]; ++p)
          left *= 1 - share[pairs.pair[p].other] * takes[p];
        next[k] = left;
      }
    });
    double most = 0;
    for (std::size_t k = 0; k < n; ++k) most = std::max(most, std::abs(next[k] - share[k]));
    share.swap(next);
    if (most < 1e-3) break;
  }
  MergedGroups groups;
  for (std::size_t k = 0; k < n; ++k) {
    if (!near[k] || share[k] <= kEps) continue;
    double most = owned[k];
    for (std::size_t p = pairs.start[k]; p < pairs.start[k + 1]; ++p) {
      const Pair& pair = pairs.pair[p];
      if (owned[pair.other] <= most) continue;
      most = std::max(most, owned[pair.other] *
                                (1 - smooth_step(kSoft, 1, pair.distance / extent[k])) *
                                smooth_step(kNlow, kNhigh, pair.same));
    }
    groups.seed.index.push_back(around.index[k]);
    groups.seed.owned.push_back(static_cast<float>(most));
    groups.share.push_back((share[k] - kEps) / (1 - kEps));
    groups.extent.push_back(extent[k]);
  }
  if (std::getenv("G_SAY")) {
    double mean = 0;
    for (double e : groups.extent) mean += e;
    std::fprintf(stderr, "around %zu rim %zu pairs %zu rounds %d seeds %zu extent %.2f\n", n,
                 rim.index.size(), pairs.pair.size(), rounds, groups.share.size(),
                 mean / static_cast<double>(groups.share.size()));
  }
  return groups;
}

}  // namespace meniscus
