#include "accuracy/closed.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "accuracy/figures/statistics.hpp"
#include "accuracy/parallel.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kCrease = 0.3;         // s, so far around it counts as one
constexpr double kCreaseCosine = 0.77;  // 40 degrees between normals so far apart

double square(double x) { return x * x; }

/// Whether the truth has a crease near a point: its normals around differ. Scenes that count as
/// smooth are so where cameras look; waves have walls and a floor, too.
bool near_crease(const Scene& scene, const Vec3d& at) {
  const Vec3d own = outward(scene.distance, at);
  const Vec3d side = std::abs(own.x) < 0.7 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
  const Vec3d u = normalized(cross(own, side)), v = cross(own, u);
  for (int k = 0; k < 8; ++k) {
    const double angle = k * 45 * kDegree;
    const Vec3d there = at + (u * std::cos(angle) + v * std::sin(angle)) * kCrease;
    if (dot(outward(scene.distance, there), own) < kCreaseCosine) return true;
  }
  return false;
}

/// The angle between a normal and the truth's where the truth is nearest to a point, degrees.
double angle_off(const Scene& scene, const Vec3d& normal, const Vec3d& at) {
  const Vec3d foot = at - outward(scene.distance, at) * scene.distance(at);
  return angle_between(normal, outward(scene.distance, foot));
}

struct Weighed {
  double value, weight;
};

double percentile_of(std::vector<Weighed> values, double share) {
  std::sort(values.begin(), values.end(),
            [](const Weighed& a, const Weighed& b) { return a.value < b.value; });
  double all = 0, sum = 0;
  for (const Weighed& v : values) all += v.weight;
  for (const Weighed& v : values)
    if ((sum += v.weight) >= share * all) return v.value;
  return kNone;
}

/// Sets that are joined.
struct Joined {
  std::vector<std::uint32_t> parent;
  explicit Joined(std::size_t n) : parent(n) { std::iota(parent.begin(), parent.end(), 0u); }
  std::uint32_t of(std::uint32_t k) {
    while (parent[k] != k) k = parent[k] = parent[parent[k]];
    return k;
  }
  void join(std::uint32_t a, std::uint32_t b) { parent[of(a)] = of(b); }
};

void count_edges(const Mesh& mesh, ClosedFigures& figures) {
  // Half edges from the lower to the higher vertex, and back.
  std::vector<std::array<std::uint32_t, 3>> half;  // low, high, 0 forward or 1 back
  for (const auto& t : mesh.triangle)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      half.push_back(a < b ? std::array{a, b, 0u} : std::array{b, a, 1u});
    }
  std::sort(half.begin(), half.end());
  for (std::size_t k = 0; k < half.size();) {
    std::size_t end = k, back = 0;
    for (; end < half.size() && half[end][0] == half[k][0] && half[end][1] == half[k][1]; ++end)
      back += half[end][2];
    if (end - k == 1)
      ++figures.open_edges;
    else if (end - k != 2 || back != 1)
      ++figures.bad_edges;
    k = end;
  }
}

/// Around a vertex each triangle goes from one neighbour to another: one ring, or there are more
/// fans than one.
void count_fans(const Mesh& mesh, ClosedFigures& figures) {
  std::vector<std::array<std::uint32_t, 3>> spoke;  // vertex, from, to
  for (const auto& t : mesh.triangle)
    for (int k = 0; k < 3; ++k) spoke.push_back({t[k], t[(k + 1) % 3], t[(k + 2) % 3]});
  std::sort(spoke.begin(), spoke.end());
  for (std::size_t k = 0; k < spoke.size();) {
    std::size_t end = k;
    while (end < spoke.size() && spoke[end][0] == spoke[k][0]) ++end;
    std::size_t steps = 0, at = k;
    do {
      const std::uint32_t next = spoke[at][2];
      const auto found = std::find_if(spoke.begin() + static_cast<std::ptrdiff_t>(k),
                                      spoke.begin() + static_cast<std::ptrdiff_t>(end),
                                      [&](const auto& s) { return s[1] == next; });
      at = static_cast<std::size_t>(found - spoke.begin());
      ++steps;
    } while (at < end && at != k && steps <= end - k);
    figures.bad_vertices += at != k || steps != end - k;
    k = end;
  }
}

void measure_pieces(const Mesh& mesh, ClosedFigures& figures) {
  Joined joined(mesh.position.size());
  for (const auto& t : mesh.triangle) {
    joined.join(t[0], t[1]);
    joined.join(t[0], t[2]);
  }
  std::vector<double> volume(mesh.position.size(), 0.0);
  std::vector<char> used(mesh.position.size(), 0);
  for (const auto& t : mesh.triangle) {
    const std::uint32_t piece = joined.of(t[0]);
    used[piece] = 1;
    volume[piece] += dot(Vec3d(mesh.position[t[0]]),
                         cross(Vec3d(mesh.position[t[1]]), Vec3d(mesh.position[t[2]])));
  }
  for (std::size_t k = 0; k < used.size(); ++k) {
    figures.pieces += used[k];
    figures.bubbles += used[k] && volume[k] < 0;
    figures.volume += volume[k] / 6;
  }
}

/// Calls work(k) for k below n, many of them by a thread.
template <class Work>
void for_each_below(std::size_t n, const Work& work) {
  constexpr std::size_t kBlock = 256;
  for_each_index(static_cast<int>((n + kBlock - 1) / kBlock), [&](int block) {
    const std::size_t begin = static_cast<std::size_t>(block) * kBlock;
    for (std::size_t k = begin; k < std::min(n, begin + kBlock); ++k) work(k);
  });
}

/// A place of the mesh, for a quarter of its triangle's area.
struct Sample {
  double distance, angle, area;
  bool crease;
};

/// Four for each triangle: the middles of its four quarters.
std::vector<Sample> samples_of(const Scene& scene, const Mesh& mesh) {
  constexpr std::array<std::array<double, 3>, 4> kShares{{{1.0 / 3, 1.0 / 3, 1.0 / 3},
                                                          {2.0 / 3, 1.0 / 6, 1.0 / 6},
                                                          {1.0 / 6, 2.0 / 3, 1.0 / 6},
                                                          {1.0 / 6, 1.0 / 6, 2.0 / 3}}};
  std::vector<Sample> samples(4 * mesh.triangle.size());
  for_each_below(mesh.triangle.size(), [&](std::size_t t) {
    const auto& v = mesh.triangle[t];
    const Vec3d a(mesh.position[v[0]]), b(mesh.position[v[1]]), c(mesh.position[v[2]]);
    const double whole = 0.5 * length(cross(b - a, c - a));
    const auto within = [&](const std::vector<Vec3>& values, std::size_t k) {
      return Vec3d(values[v[0]]) * kShares[k][0] + Vec3d(values[v[1]]) * kShares[k][1] +
             Vec3d(values[v[2]]) * kShares[k][2];
    };
    for (std::size_t k = 0; k < 4; ++k) {
      const Vec3d at = within(mesh.position, k);
      samples[4 * t + k] = {std::abs(scene.distance(at)),
                            angle_off(scene, within(mesh.normal, k), at), whole / 4,
                            near_crease(scene, at)};
    }
  });
  return samples;
}

void measure_distances(const std::vector<Sample>& samples, ClosedFigures& figures) {
  double sum = 0, weight = 0, creases = 0, crease_weight = 0;
  std::vector<Weighed> distances, within;
  for (const Sample& s : samples) {
    (s.crease ? creases : sum) += s.area * square(s.distance);
    (s.crease ? crease_weight : weight) += s.area;
    if (s.crease) continue;
    distances.push_back({s.distance, s.area});
    within.push_back({s.angle, s.area});
    figures.distance_most = std::max(figures.distance_most, s.distance);
  }
  figures.distance_rms = std::sqrt(sum / weight);
  figures.distance_999 = percentile_of(std::move(distances), 0.999);
  figures.within_median = percentile_of(within, 0.5);
  figures.within_95 = percentile_of(std::move(within), 0.95);
  figures.crease_rms = crease_weight > 0 ? std::sqrt(creases / crease_weight) : kNone;
}

/// Of the vertices, each of which counts as a third of its triangles.
void measure_normals(const Scene& scene, const Mesh& mesh, const std::vector<Sample>& samples,
                     ClosedFigures& figures) {
  std::vector<double> area(mesh.position.size(), 0.0);
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
    for (const std::uint32_t v : mesh.triangle[t])
      for (std::size_t k = 0; k < 4; ++k) area[v] += samples[4 * t + k].area / 3;
  std::vector<Weighed> angles(mesh.position.size());
  for_each_below(angles.size(), [&](std::size_t v) {
    const Vec3d at(mesh.position[v]);
    const bool crease = near_crease(scene, at);
    angles[v] = {angle_off(scene, Vec3d(mesh.normal[v]), at), crease ? 0.0 : area[v]};
  });
  figures.normal_median = percentile_of(angles, 0.5);
  figures.normal_95 = percentile_of(std::move(angles), 0.95);
}

}  // namespace

ClosedFigures check_topology(const Mesh& mesh) {
  ClosedFigures figures;
  figures.triangles = static_cast<std::int64_t>(mesh.triangle.size());
  count_edges(mesh, figures);
  count_fans(mesh, figures);
  measure_pieces(mesh, figures);
  return figures;
}

ClosedFigures measure_closed(const Scene& scene, double true_volume, const Mesh& mesh) {
  ClosedFigures figures = check_topology(mesh);
  figures.volume = figures.volume / true_volume - 1;
  const std::vector<Sample> samples = samples_of(scene, mesh);
  measure_distances(samples, figures);
  measure_normals(scene, mesh, samples, figures);
  return figures;
}

}  // namespace meniscus::accuracy
