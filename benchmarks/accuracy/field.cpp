#include "accuracy/field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "accuracy/parallel.hpp"

namespace meniscus::accuracy {
namespace {

/// Four neighbouring nodes along an axis, their weights, and the slopes of the weights (1/s).
struct Taps {
  std::array<int, 4> node;
  std::array<double, 4> weight, slope;
};

Taps taps_at(double place, int count) {
  const int first = std::clamp(static_cast<int>(std::floor(place)), 0, count - 2);
  const double t = place - first;
  Taps taps;
  for (int k = 0; k < 4; ++k) taps.node[k] = std::clamp(first - 1 + k, 0, count - 1);
  taps.weight = {t * (-1 + t * (2 - t)) / 2, (2 + t * t * (3 * t - 5)) / 2,
                 t * (1 + t * (4 - 3 * t)) / 2, t * t * (t - 1) / 2};
  taps.slope = {(-1 + t * (4 - 3 * t)) / 2, t * (9 * t - 10) / 2, (1 + t * (8 - 9 * t)) / 2,
                t * (3 * t - 2) / 2};
  for (double& slope : taps.slope) slope /= kGridStep;
  return taps;
}

/// The point of the grid's box that is nearest to p.
Vec3d inside_of(const Field& f, const Vec3d& p) {
  const Vec3d high = f.node(f.count[0] - 1, f.count[1] - 1, f.count[2] - 1);
  return {std::clamp(p.x, f.low.x, high.x), std::clamp(p.y, f.low.y, high.y),
          std::clamp(p.z, f.low.z, high.z)};
}

/// Foot of the perpendicular from p on the zero of f, searched for from `start`, a point of the
/// zero: the foot on the tangent plane there, taken back to the zero, again and again as long as it
/// comes nearer.
Vec3d foot_of(const Field& f, const Vec3d& p, const Vec3d& start) {
  constexpr int kRounds = 5;
  constexpr double kGain = 1e-4;   // s; less is not worth another round
  constexpr double kSlope = 1e-6;  // of f, squared
  Vec3d foot = start;
  for (int round = 0; round < kRounds; ++round) {
    const Vec3d normal = normalized(f.level(foot).gradient);
    Vec3d next = p - dot(normal, p - foot) * normal;
    const Level at = f.level(next);
    next = next - at.value / std::max(dot(at.gradient, at.gradient), kSlope) * at.gradient;
    const double gain = length(p - foot) - length(p - next);
    if (gain < 0) break;
    foot = next;
    if (gain < kGain) break;
  }
  return foot;
}

}  // namespace

double Field::operator()(const Vec3d& p) const {
  const Vec3d q = inside_of(*this, p), place = (q - low) / kGridStep;
  const Taps x = taps_at(place.x, count[0]), y = taps_at(place.y, count[1]),
             z = taps_at(place.z, count[2]);
  double sum = 0;
  for (int c = 0; c < 4; ++c)
    for (int b = 0; b < 4; ++b) {
      const float* const row = &value[index(0, y.node[b], z.node[c])];
      double along = 0;
      for (int a = 0; a < 4; ++a) along += x.weight[a] * row[x.node[a]];
      sum += z.weight[c] * y.weight[b] * along;
    }
  return q == p ? sum : sum + length(p - q);
}

Level Field::level(const Vec3d& p) const {
  const Vec3d place = (inside_of(*this, p) - low) / kGridStep;
  const Taps x = taps_at(place.x, count[0]), y = taps_at(place.y, count[1]),
             z = taps_at(place.z, count[2]);
  Level result{0, {}};
  for (int c = 0; c < 4; ++c)
    for (int b = 0; b < 4; ++b) {
      const float* const row = &value[index(0, y.node[b], z.node[c])];
      double along = 0, slope = 0;
      for (int a = 0; a < 4; ++a) {
        along += x.weight[a] * row[x.node[a]];
        slope += x.slope[a] * row[x.node[a]];
      }
      result.value += z.weight[c] * y.weight[b] * along;
      result.gradient += Vec3d{z.weight[c] * y.weight[b] * slope, z.weight[c] * y.slope[b] * along,
                               z.slope[c] * y.weight[b] * along};
    }
  return result;
}

Field sampled(const std::function<double(const Vec3d&)>& f, const Vec3d& low, const Vec3d& high) {
  const Vec3d extent = high - low;
  Field field{low, {}, {}};
  const std::array<double, 3> sides{extent.x, extent.y, extent.z};
  for (int k = 0; k < 3; ++k)
    field.count[k] = static_cast<int>(std::ceil(sides[k] / kGridStep)) + 1;
  const auto [nx, ny, nz] = field.count;
  field.value.resize(static_cast<std::size_t>(nx) * ny * nz);
  for_each_index(field.count[2], [&](int k) {
    for (int j = 0; j < field.count[1]; ++j)
      for (int i = 0; i < field.count[0]; ++i)
        field.value[field.index(i, j, k)] = static_cast<float>(f(field.node(i, j, k)));
  });
  return field;
}

Field distances(const Field& f) {
  constexpr double kExact = 2;  // s; beyond, the nearest foot of a neighbour will do
  constexpr float kFar = std::numeric_limits<float>::infinity();
  const auto [nx, ny, nz] = f.count;
  const std::array<int, 3> count{nx, ny, nz};
  const std::size_t nodes = f.value.size();
  const std::array<std::ptrdiff_t, 3> stride{1, nx, static_cast<std::ptrdiff_t>(nx) * ny};
  std::vector<Vec3> foot(nodes);
  std::vector<float> distance(nodes, kFar);  // without sign
  const auto offer = [&](std::size_t here, const Vec3d& p, const Vec3& candidate) {
    const auto d = static_cast<float>(length(Vec3d(candidate) - p));
    if (d >= distance[here]) return;
    distance[here] = d;
    foot[here] = candidate;
  };
  const auto for_each_node = [&](const auto& visit) {
    for_each_index(count[2], [&](int k) {
      for (int j = 0; j < count[1]; ++j)
        for (int i = 0; i < count[0]; ++i) visit(std::array{i, j, k}, f.index(i, j, k));
    });
  };

  // Nodes beside the zero: from where the edge to a neighbour crosses it.
  for_each_node([&](const std::array<int, 3>& at, std::size_t here) {
    const Vec3d p = f.node(at[0], at[1], at[2]);
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        if (at[axis] + step < 0 || at[axis] + step >= count[axis]) continue;
        const double a = f.value[here], b = f.value[here + step * stride[axis]];
        if ((a < 0) == (b < 0)) continue;
        std::array<int, 3> other = at;
        other[axis] += step;
        const Vec3d crossing = p + a / (a - b) * (f.node(other[0], other[1], other[2]) - p);
        offer(here, p, static_cast<Vec3>(foot_of(f, p, crossing)));
      }
  });
  // All others: from their neighbours' feet, in eight sweeps (Danielsson 1980).
  for (int sweep = 0; sweep < 8; ++sweep) {
    const std::array<int, 3> step{sweep & 1 ? -1 : 1, sweep & 2 ? -1 : 1, sweep & 4 ? -1 : 1};
    const auto first = [&](int axis) { return step[axis] > 0 ? 0 : count[axis] - 1; };
    const auto inside = [&](int axis, int at) { return at >= 0 && at < count[axis]; };
    for (int k = first(2); inside(2, k); k += step[2])
      for (int j = first(1); inside(1, j); j += step[1])
        for (int i = first(0); inside(0, i); i += step[0]) {
          const std::size_t here = f.index(i, j, k);
          const std::array<int, 3> at{i, j, k};
          for (int axis = 0; axis < 3; ++axis) {
            if (!inside(axis, at[axis] - step[axis])) continue;
            const std::size_t before = here - step[axis] * stride[axis];
            if (distance[before] < kBand) offer(here, f.node(i, j, k), foot[before]);
          }
        }
  }

  Field result{f.low, f.count, std::vector<float>(nodes)};
  for_each_node([&](const std::array<int, 3>& at, std::size_t here) {
    double d = std::min<double>(distance[here], kBand);
    if (d < kExact) {
      const Vec3d p = f.node(at[0], at[1], at[2]);
      d = length(p - foot_of(f, p, Vec3d(foot[here])));
    }
    result.value[here] = static_cast<float>(std::copysign(d, f.value[here]));
  });
  return result;
}

Field blurred(const Field& f, double sigma) {
  std::vector<double> weights;
  double sum = 0;
  const int reach = static_cast<int>(std::ceil(3 * sigma / kGridStep));
  for (int k = -reach; k <= reach; ++k) {
    const double x = k * kGridStep / sigma;
    weights.push_back(std::exp(-x * x / 2));
    sum += weights.back();
  }
  Field result = f;
  for (int axis = 0; axis < 3; ++axis) {
    const Field before = result;
    for_each_index(f.count[2], [&](int k) {
      for (int j = 0; j < f.count[1]; ++j)
        for (int i = 0; i < f.count[0]; ++i) {
          double mean = 0;
          for (int step = -reach; step <= reach; ++step) {
            std::array<int, 3> at{i, j, k};
            at[axis] = std::clamp(at[axis] + step, 0, f.count[axis] - 1);
            mean += weights[step + reach] * before.value[f.index(at[0], at[1], at[2])];
          }
          result.value[f.index(i, j, k)] = static_cast<float>(mean / sum);
        }
    });
  }
  return result;
}

Field opened(const Field& distance, double radius) {
  const auto shifted = [](Field f, double by) {
    for (float& value : f.value) value += static_cast<float>(by);
    return f;
  };
  return distances(shifted(distances(shifted(distance, radius)), -radius));
}

}  // namespace meniscus::accuracy
