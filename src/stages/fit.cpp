#include "stages/fit.hpp"

#include <algorithm>
#include <numeric>

namespace meniscus {
namespace {

constexpr std::size_t kLanes = 8;        // groups of a batch, whatever the device's WIDTH
constexpr std::size_t kFewPoints = 8;    // below: Hermite rows
constexpr std::size_t kLeastPoints = 3;  // below: no fit
constexpr double kHermiteLambda = 0.05;  // weight of grad f = n against f = 0
constexpr double kHermiteRidge = 1e-2;

}  // namespace

Quadrics fit_quadrics(Device& device, const std::vector<FitProblem>& problems,
                      const FitParams& params) {
  const std::size_t n = problems.size();
  Quadrics quadrics{std::vector<std::array<float, 10>>(n), std::vector<float>(n, -1.0f)};
  if (n == 0) return quadrics;

  // Problems of like size share a batch; the order does not touch the result of any of them.
  std::vector<std::int32_t> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
    return problems[a].points.size() < problems[b].points.size();
  });
  const std::size_t batches = (n + kLanes - 1) / kLanes, lanes = batches * kLanes;
  std::vector<cl_int> first(batches), length(batches);
  std::size_t slots = 0;
  for (std::size_t b = 0; b < batches; ++b) {
    const std::size_t longest = problems[order[std::min(n, (b + 1) * kLanes) - 1]].points.size();
    first[b] = static_cast<cl_int>(slots);
    length[b] = static_cast<cl_int>(longest);
    slots += longest * kLanes;
  }
  require(slots < (std::size_t{1} << 28),
          "fit: too many points for 32-bit indices (use a smaller "
          "--group-cap, or fewer --rings)");
  std::vector<float> points(7 * slots, 0.0f), scale(lanes, 1.0f), hermite(lanes, 0.0f);
  for (std::size_t l = 0; l < n; ++l) {
    const FitProblem& problem = problems[order[l]];
    scale[l] = static_cast<float>(problem.scale);
    hermite[l] = problem.points.size() < kFewPoints ? 1.0f : 0.0f;
    std::size_t slot = static_cast<std::size_t>(first[l / kLanes]) + l % kLanes;
    for (const FitPoint& point : problem.points) {
      const Vec3d q = (point.position - problem.centre) / problem.scale;
      const double row[7] = {q.x,         q.y, q.z, point.normal.x, point.normal.y, point.normal.z,
                             point.weight};
      for (std::size_t r = 0; r < 7; ++r) points[r * slots + slot] = static_cast<float>(row[r]);
      slot += kLanes;
    }
  }

  const auto quadric = allocate<float>(device, 10 * lanes);
  const auto quality = allocate<float>(device, 2 * lanes);
  const cl_float8 options{{static_cast<float>(params.off_surface), static_cast<float>(params.tau),
                           static_cast<float>(params.offset), static_cast<float>(params.ridge),
                           static_cast<float>(kHermiteRidge), static_cast<float>(kHermiteLambda),
                           static_cast<float>(params.robust_passes), 0.0f}};
  const int width = device.state().vector_width;
  // Few items of much work: small work-groups spread them over the compute units.
  launch(device, "fit.cl", "fit_groups", {lanes / static_cast<std::size_t>(width), 1, 8, 1},
         width_option(width), upload(device, points), upload(device, first), upload(device, length),
         upload(device, scale), upload(device, hermite), quadric, quality,
         static_cast<cl_int>(slots), static_cast<cl_int>(lanes), options);
  const std::vector<float> c = download(device, quadric), q = download(device, quality);
  for (std::size_t l = 0; l < n; ++l) {
    const std::size_t g = static_cast<std::size_t>(order[l]);
    for (std::size_t k = 0; k < 10; ++k) quadrics.coefficient[g][k] = c[k * lanes + l];
    if (problems[g].points.size() >= kLeastPoints) quadrics.residual[g] = q[l];
  }
  return quadrics;
}

std::vector<FitProblem> group_problems(const Triangulation& mesh, const Groups& groups,
                                       const std::vector<Vec3d>& vertex_normal) {
  std::vector<FitProblem> problems(groups.size());
  for (std::size_t g = 0; g < groups.size(); ++g) {
    FitProblem& problem = problems[g];
    problem.centre = groups.centre[g];
    double farthest = 1;
    for (std::int32_t k = groups.start[g]; k < groups.start[g + 1]; ++k)
      farthest = std::max(farthest, length(mesh.position[groups.point[k]] - problem.centre));
    problem.scale = 1.05 * farthest;
    for (std::int32_t k = groups.start[g]; k < groups.start[g + 1]; ++k) {
      const std::int32_t v = groups.point[k];
      const double t = 1.5 * length(mesh.position[v] - problem.centre) / problem.scale;
      const double weight = t < 0.5 ? 0.75 - t * t : 0.5 * (1.5 - t) * (1.5 - t);
      if (t < 1.5) problem.points.push_back({mesh.position[v], vertex_normal[v], weight});
    }
  }
  return problems;
}

}  // namespace meniscus
