#include "stages/sheet/surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.hpp"
#include "stages/frame/near_lists.hpp"

namespace meniscus {
namespace {

constexpr double kLeastVisibility = 1e-4;  // v of a particle that is barely seen
constexpr double kSureSlope = 0.35;        // 1/s, of a field whose slope alone gives normals

}  // namespace

double visibility(double owned) {
  return std::max(kLeastVisibility, smooth_step(kLeastFitted, kFullyVisible, owned));
}

Visible more_visible(const Visible& visible, double least_owned) {
  Visible more;
  for (std::size_t k = 0; k < visible.index.size(); ++k) {
    if (visible.owned[k] < least_owned) continue;
    more.index.push_back(visible.index[k]);
    more.owned.push_back(visible.owned[k]);
    if (!visible.influence.empty()) more.influence.push_back(visible.influence[k]);
  }
  return more;
}

std::vector<std::int32_t> places_in(const std::vector<std::int32_t>& index,
                                    const std::vector<std::int32_t>& particles) {
  std::vector<std::int32_t> places;
  places.reserve(particles.size());
  auto place = index.begin();
  for (const std::int32_t i : particles) {
    while (*place != i) ++place;
    places.push_back(static_cast<std::int32_t>(place - index.begin()));
  }
  return places;
}

NormalSources normal_sources(const Projected& projected, const Visible& seen,
                             const Triangulation& mesh, std::vector<std::int32_t> particle) {
  std::vector<std::int32_t> vertex(seen.index.size(), -1);  // of each, where it has kept triangles
  const std::vector<std::int32_t> place = places_in(seen.index, mesh.particle);
  for (std::size_t v = 0; v < place.size(); ++v)
    if (mesh.fan_start[v] < mesh.fan_start[v + 1]) vertex[place[v]] = static_cast<std::int32_t>(v);
  NormalSources sources;
  sources.particle = std::move(particle);
  sources.start.push_back(0);
  constexpr double kReach = 4;
  Cells cells;  // made for the first who looks
  for (const std::int32_t k : sources.particle) {
    if (vertex[k] >= 0) {
      sources.vertex.push_back(vertex[k]);
      sources.share.push_back(1);
    } else {
      if (cells.item.empty()) cells = cells_of(projected, seen.index, kReach);
      const std::size_t i = static_cast<std::size_t>(seen.index[k]);
      visit_near(cells, projected.x[i], projected.y[i], projected.z[i], [&](std::int32_t p) {
        const Vec3d at{cells.x[p], cells.y[p], cells.z[p]};
        const double share = 1 - length(at - projected.eye(i)) / kReach;
        if (share > 0 && vertex[cells.item[p]] >= 0) {
          sources.vertex.push_back(vertex[cells.item[p]]);
          sources.share.push_back(share);
        }
        return true;
      });
    }
    sources.start.push_back(static_cast<std::int32_t>(sources.vertex.size()));
  }
  return sources;
}

std::vector<Vec3d> first_normals(const View& view, const Projected& projected, const Visible& seen,
                                 const Triangulation& mesh, const std::vector<Vec3d>& normals,
                                 const NormalSources& sources) {
  std::vector<Vec3d> result(seen.index.size());
  for (std::size_t k = 0; k < sources.particle.size(); ++k) {
    Vec3d mean;
    for (std::int32_t s = sources.start[k]; s < sources.start[k + 1]; ++s) {
      const std::int32_t v = sources.vertex[s];
      Vec3d sum;
      for (std::int32_t f = mesh.fan_start[v]; f < mesh.fan_start[v + 1]; ++f)
        sum += normals[mesh.fan[f]] * mesh.area[mesh.fan[f]];
      mean += normalized(sum, {0, 0, 0}) * sources.share[s];
    }
    const std::size_t i = static_cast<std::size_t>(seen.index[sources.particle[k]]);
    result[sources.particle[k]] =
        normalized(mean, normalized(-ray_direction(view, projected.u[i], projected.v[i])));
  }
  return result;
}

FieldSurface find_surface(const Visible& seen, const Cells& cells, std::span<const float> gradients,
                          double disorder) {
  const double low = between(0.22, 0.3, disorder), high = between(0.42, 0.5, disorder);
  const std::size_t n = cells.item.size();
  const auto descent_at = [&](std::size_t p) {
    return -Vec3d{gradients[p], gradients[n + p], gradients[2 * n + p]};
  };
  const auto openness = [&](std::size_t p, double steep) {
    const double sparse = 1.5 * std::max(0.0, 0.97 - double{gradients[3 * n + p]});
    return smooth_step(low, high, std::sqrt(steep * steep + sparse * sparse));
  };
  constexpr std::int32_t kInside = -1, kSeen = -2;
  std::vector<std::int32_t> position(n, kInside);  // in bucket order, of those that are taken
  for (const std::int32_t i : seen.index) position[i] = kSeen;
  constexpr std::size_t kGrain = 4096;  // particles that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    // Those that may be taken, without branches, which would be mispredicted.
    std::vector<std::uint32_t> maybe(end - begin);
    std::size_t number = 0;
    for (std::size_t p = begin; p < end; ++p) {
      const float x = gradients[p], y = gradients[n + p], z = gradients[2 * n + p];
      maybe[number] = static_cast<std::uint32_t>(p);
      // Below 0.0025 nothing is steep; the margin is for rounding.
      number += (x * x + y * y + z * z > 0.002f) | (position[cells.item[p]] == kSeen);
    }
    for (const std::size_t p : std::span(maybe).first(number)) {
      std::int32_t& own = position[cells.item[p]];
      if (own != kSeen) {
        const double steep = 2 * length(descent_at(p));  // 1/s
        if (!(steep > 0.1 && openness(p, steep) > 0.01)) continue;
      }
      own = static_cast<std::int32_t>(p);
    }
  });
  FieldSurface surface;
  surface.index.resize(n);
  std::size_t taken = 0;
  for (std::size_t i = 0; i < n; ++i) {
    surface.index[taken] = static_cast<std::int32_t>(i);
    taken += position[i] >= 0;
  }
  surface.index.resize(taken);
  surface.weight.resize(surface.index.size());
  surface.descent.resize(surface.index.size());
  parallel_for(surface.index.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t p = static_cast<std::size_t>(position[surface.index[k]]);
      surface.descent[k] = descent_at(p);
      surface.weight[k] = std::max(openness(p, 2 * length(surface.descent[k])), kLeastVisibility);
    }
  });
  return surface;
}

std::vector<std::int32_t> without_descent(const Visible& seen, const FieldSurface& surface) {
  const std::vector<std::int32_t> place = places_in(surface.index, seen.index);
  std::vector<std::int32_t> without;
  for (std::size_t k = 0; k < place.size(); ++k)
    if (2 * length(surface.descent[place[k]]) < kSureSlope)
      without.push_back(static_cast<std::int32_t>(k));
  return without;
}

SurfaceParticles with_normals(FieldSurface surface, const Visible& seen,
                              const std::vector<Vec3d>& normals) {
  SurfaceParticles result{std::move(surface.index), std::move(surface.weight),
                          std::move(surface.descent)};
  constexpr std::size_t kGrain = 2048;  // particles that are worth a thread
  parallel_for(result.index.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::size_t next = static_cast<std::size_t>(
        std::lower_bound(seen.index.begin(), seen.index.end(), result.index[begin]) -
        seen.index.begin());
    for (std::size_t k = begin; k < end; ++k) {
      Vec3d& normal = result.normal[k];
      const double slope = length(normal);
      normal = normal * (1 / std::max(slope, 1e-12));
      if (next == seen.index.size() || seen.index[next] != result.index[k]) continue;
      const Vec3d& own = normals[next++];
      const double sure = smooth_step(0.15, kSureSlope, 2 * slope);
      normal = normalized(normal * sure + own * (1 - sure), own);
    }
  });
  return result;
}

Visible with_rim(const Projected& projected, const Visible& seen, const FieldSurface& around,
                 double reach) {
  const float within = static_cast<float>(reach);
  const Cells cells = cells_of(projected, seen.index, within);
  std::vector<float> seen_as;  // [seen] how far each is
  for (const float owned : seen.owned)
    seen_as.push_back(static_cast<float>(smooth_step(kLeastFitted, kFullyVisible, owned)));
  const std::size_t n = around.index.size();
  std::vector<float> influence(n, -1.0f);  // negative: of no seen one
  NearFinder* const find = near_finders()[0];
  constexpr std::size_t kGrain = 512;  // particles that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<std::int32_t> found;
    auto next = std::lower_bound(seen.index.begin(), seen.index.end(), around.index[begin]);
    for (std::size_t k = begin; k < end; ++k) {
      const std::int32_t i = around.index[k];
      while (next != seen.index.end() && *next < i) ++next;
      const bool is_seen = next != seen.index.end() && *next == i;
      if (is_seen) influence[k] = seen_as[static_cast<std::size_t>(next - seen.index.begin())];
      if (influence[k] >= 1 || (!is_seen && around.weight[k] < kLeastSurface)) continue;
      const Vec3d own = projected.eye(static_cast<std::size_t>(i));
      const std::array at{projected.x[i], projected.y[i], projected.z[i]};
      visit_ranges_near(
          cells, at[0], at[1], at[2],
          [&](std::int32_t first, std::int32_t last, std::uint32_t tag) {
            if (first == last) return true;  // mostly
            const std::size_t most = static_cast<std::size_t>(last - first) + kNearRoom;
            if (found.size() < most) found.resize(most);
            const std::size_t near =
                find(cells, first, last, tag, at, within * within, found.data());
            for (const std::int32_t other : std::span(found).first(near)) {
              const std::size_t s = static_cast<std::size_t>(other);
              if (!(seen_as[s] > influence[k])) continue;
              const double distance =
                  length(projected.eye(static_cast<std::size_t>(seen.index[s])) - own);
              const double fades = smooth_step(reach - kRimFade, reach, distance);
              influence[k] = std::max(influence[k], seen_as[s] * static_cast<float>(1 - fades));
            }
            return influence[k] < 1;
          },
          kNearRowsFirst);
    }
  });
  Visible result;
  std::size_t next = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const std::int32_t i = around.index[k];
    if (influence[k] < 0) continue;
    const bool is_seen = next < seen.index.size() && seen.index[next] == i;
    result.index.push_back(i);
    result.owned.push_back(is_seen ? seen.owned[next++] : 0);
    result.influence.push_back(influence[k]);
  }
  return result;
}

}  // namespace meniscus
