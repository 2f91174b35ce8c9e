#include "stages/extras/motion.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/parallel.hpp"
#include "device/kernels.hpp"
#include "prepare/velocities.hpp"
#include "stages/sample/surface_buffers.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kGrain = std::size_t{1} << 14;

// The mean at points that lie far from every particle. They are few. Cells of twice the size take
// those that were not settled before, until a particle is found for each.
std::vector<Vec3> motion_far_off(const MovingParticles& moving, const std::vector<Vec3d>& points) {
  std::vector<Vec3> result(points.size());
  std::vector<std::size_t> left(points.size());
  for (std::size_t k = 0; k < left.size(); ++k) left[k] = k;
  for (float side = 2 * records::kMotionSupport; !left.empty(); side *= 2) {
    const Cells cells = make_cells(moving.cells.x, moving.cells.y, moving.cells.z, side);
    std::vector<char> settled(left.size(), 0);
    constexpr std::size_t kFew = 16;  // points that are worth a thread
    parallel_for(left.size(), kFew, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        const Vec3d& point = points[left[k]];
        const auto each_near = [&](const auto& take) {
          visit_near(cells, static_cast<float>(point.x), static_cast<float>(point.y),
                     static_cast<float>(point.z), [&](std::int32_t p) {
                       const Vec3d apart = Vec3d{cells.x[p], cells.y[p], cells.z[p]} - point;
                       take(static_cast<std::size_t>(cells.item[p]), dot(apart, apart));
                       return true;
                     });
        };
        double nearest = INFINITY;
        each_near([&](std::size_t, double squared) { nearest = std::min(nearest, squared); });
        const double support = std::max<double>(records::kMotionSupport, 4.0 / 3 * std::sqrt(nearest));
        if (!(support <= side)) continue;
        Vec3d sum;
        double weight = 0;
        each_near([&](std::size_t p, double squared) {
          const double inner = std::max(0.0, 1 - squared / (support * support));
          const double w = (inner * inner) * (inner * inner);
          sum += Vec3d(moving.velocity[p]) * w;
          weight += w;
        });
        result[left[k]] = static_cast<Vec3>(sum / weight);
        settled[k] = 1;
      }
    });
    std::size_t kept = 0;
    for (std::size_t k = 0; k < left.size(); ++k)
      if (!settled[k]) left[kept++] = left[k];
    left.resize(kept);
  }
  return result;
}

// What kernels write for points that they leave to the host.
bool is_far(const Vec3& motion) { return std::isinf(motion.x); }

// Takes what the kernel stored at `points` of `wanted` and settles the rest.
template <class Wanted, class Point>
std::vector<Vec3> collect(Device& device, const MovingParticles& moving,
                          const Buffer<float>& stored, std::size_t n, const Wanted& wanted,
                          const Point& point) {
  std::vector<Vec3> result(n);
  std::atomic<bool> any_far{false};
  {
    const HostView values(device, stored);
    parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
      bool far = false;
      for (std::size_t k = begin; k < end; ++k) {
        if (!wanted(k)) continue;
        result[k] = {values[k], values[n + k], values[2 * n + k]};
        far |= is_far(result[k]);
      }
      if (far) any_far = true;
    });
  }
  if (!any_far) return result;
  std::vector<std::size_t> far;
  std::vector<Vec3d> points;
  for (std::size_t k = 0; k < n; ++k)
    if (is_far(result[k])) {
      far.push_back(k);
      points.push_back(point(k));
    }
  const std::vector<Vec3> settled = motion_far_off(moving, points);
  for (std::size_t k = 0; k < far.size(); ++k) result[far[k]] = settled[k];
  return result;
}

// Work-items for n samples or points: one takes a bin's (COUNT of motion.cl), or one.
constexpr std::size_t kBin = records::BIN;
std::size_t points_of_item(std::size_t width) { return width == 1 ? 1 : kBin * width; }
// Items of many points differ much in cost: few a work-group.
Range items_of(std::size_t items, std::size_t width) {
  return width == 1 ? Range{items} : Range{items, 1, 8, 1};
}

}  // namespace

MovingParticles upload_moving(Device& device, const Projected& projected,
                              const std::vector<Vec3>& velocity) {
  std::vector<float> x, y, z;
  std::vector<Vec3> known;
  for (std::size_t i = 0; i < projected.size(); ++i) {
    const Vec3& own = velocity[projected.index[i]];
    if (!is_known(own)) continue;
    x.push_back(projected.x[i]);
    y.push_back(projected.y[i]);
    z.push_back(projected.z[i]);
    known.push_back(own);
  }
  MovingParticles moving;
  moving.cells = make_cells(x, y, z, records::kMotionSupport);
  const std::size_t n = known.size();
  std::vector<float> rows(3 * n);
  for (std::size_t p = 0; p < n; ++p) {
    const Vec3& own = known[static_cast<std::size_t>(moving.cells.item[p])];
    moving.velocity.push_back(own);
    rows[p] = own.x;
    rows[n + p] = own.y;
    rows[2 * n + p] = own.z;
  }
  moving.on_device = upload_cells(device, moving.cells);
  moving.device_velocity = upload(device, rows);
  return moving;
}

std::vector<Vec3> motion_of_samples(Device& device, const View& view, const MovingParticles& moving,
                                    const SampleGrid& grid, const std::vector<float>& depth) {
  const std::size_t n = grid.size();
  require(depth.size() == n, "motion_of_samples: depth has " + std::to_string(depth.size()) +
                                 " samples, wanted " + std::to_string(n));
  if (moving.velocity.empty()) return std::vector<Vec3>(n);
  const Buffer<float> depths = upload(device, depth);
  const auto motion = allocate<float>(device, 3 * n);
  const std::size_t width = static_cast<std::size_t>(device.state().vector_width);
  const std::size_t nx = static_cast<std::size_t>(grid.nx), ny = static_cast<std::size_t>(grid.ny);
  const std::size_t bins_x = (nx + kBin - 1) / kBin, bins_y = (ny + kBin - 1) / kBin;
  launch(device, kernels::motion_of_samples, device.state().vector_width,
         items_of(bins_x * bins_y * kBin * kBin / points_of_item(width), width), depths, motion,
         cells_with(moving.on_device, moving.device_velocity),
         static_cast<cl_int>(moving.velocity.size()),
         cl_int2{{static_cast<cl_int>(bins_x), static_cast<cl_int>(bins_y)}},
         screen_of(view, grid));
  return collect(
      device, moving, motion, n, [&](std::size_t s) { return depth[s] < kNoSurface; },
      [&](std::size_t s) {
        return point_at(view, grid.first + double{grid.step} * static_cast<double>(s % nx),
                        grid.first + double{grid.step} * static_cast<double>(s / nx), depth[s]);
      });
}

std::vector<Vec3> motion_of_points(Device& device, const MovingParticles& moving,
                                   const std::vector<Vec3d>& points) {
  const std::size_t n = points.size();
  if (n == 0 || moving.velocity.empty()) return std::vector<Vec3>(n);
  // In the order of cells, so that a work-item's points lie close together.
  const Cells order = make_cells(points, records::kMotionSupport / 2);
  const auto motion = allocate<float>(device, 3 * n);
  const std::size_t width = static_cast<std::size_t>(device.state().vector_width);
  const std::size_t each = points_of_item(width);
  launch(device, kernels::motion_of_points, device.state().vector_width,
         items_of((n + each - 1) / each, width), upload_points(device, order), motion,
         cells_with(moving.on_device, moving.device_velocity),
         static_cast<cl_int>(moving.velocity.size()), static_cast<cl_int>(n));
  const std::vector<Vec3> in_order = collect(
      device, moving, motion, n, [](std::size_t) { return true; },
      [&](std::size_t p) { return points[static_cast<std::size_t>(order.item[p])]; });
  std::vector<Vec3> result(n);
  for (std::size_t p = 0; p < n; ++p) result[static_cast<std::size_t>(order.item[p])] = in_order[p];
  return result;
}

}  // namespace meniscus
