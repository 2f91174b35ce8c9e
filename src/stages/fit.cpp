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

FitBatches make_batches(const std::vector<std::size_t>& points) {
  const std::size_t n = points.size();
  FitBatches batches;
  // Problems of like size share a batch; the order does not touch the result of any of them.
  batches.order.resize(n);
  std::iota(batches.order.begin(), batches.order.end(), 0);
  std::stable_sort(batches.order.begin(), batches.order.end(),
                   [&](std::int32_t a, std::int32_t b) { return points[a] < points[b]; });
  const std::size_t count = (n + kLanes - 1) / kLanes;
  batches.lanes = count * kLanes;
  for (std::size_t b = 0; b < count; ++b) {
    const std::size_t longest = points[batches.order[std::min(n, (b + 1) * kLanes) - 1]];
    batches.first.push_back(static_cast<cl_int>(batches.slots));
    batches.length.push_back(static_cast<cl_int>(longest));
    batches.slots += longest * kLanes;
    require(batches.slots < (std::size_t{1} << 28),
            "fit: too many points for 32-bit indices (use a smaller "
            "--group-cap, --support or fewer --rings)");
  }
  return batches;
}

void fit_batches(Device& device, const DeviceFits& fits, const FitParams& params) {
  const cl_float8 options{{static_cast<float>(params.off_surface), static_cast<float>(params.tau),
                           static_cast<float>(params.offset), static_cast<float>(params.ridge),
                           static_cast<float>(kHermiteRidge), static_cast<float>(kHermiteLambda),
                           static_cast<float>(params.robust_passes), 0.0f}};
  const int width = device.state().vector_width;
  // Few items of much work: small work-groups spread them over the compute units.
  launch(device, "fit.cl", "fit_groups", {fits.lanes / static_cast<std::size_t>(width), 1, 8, 1},
         width_option(width), fits.points, fits.first, fits.length, fits.scale, fits.hermite,
         fits.quadric, fits.quality, static_cast<cl_int>(fits.slots),
         static_cast<cl_int>(fits.lanes), options);
}

Quadrics fit_quadrics(Device& device, const std::vector<FitProblem>& problems,
                      const FitParams& params) {
  const std::size_t n = problems.size();
  Quadrics quadrics{std::vector<std::array<float, 10>>(n), std::vector<float>(n, -1.0f)};
  if (n == 0) return quadrics;

  std::vector<std::size_t> sizes;
  for (const FitProblem& problem : problems) sizes.push_back(problem.points.size());
  const FitBatches batches = make_batches(sizes);
  const std::size_t lanes = batches.lanes, slots = batches.slots;
  std::vector<float> points(7 * slots, 0.0f), scale(lanes, 1.0f), hermite(lanes, 0.0f);
  for (std::size_t l = 0; l < n; ++l) {
    const FitProblem& problem = problems[batches.order[l]];
    scale[l] = static_cast<float>(problem.scale);
    hermite[l] = problem.points.size() < kFewPoints ? 1.0f : 0.0f;
    std::size_t slot = batches.first_slot(l);
    for (const FitPoint& point : problem.points) {
      const Vec3d q = (point.position - problem.centre) / problem.scale;
      const double row[7] = {q.x,         q.y, q.z, point.normal.x, point.normal.y, point.normal.z,
                             point.weight};
      for (std::size_t r = 0; r < 7; ++r) points[r * slots + slot] = static_cast<float>(row[r]);
      slot += kLanes;
    }
  }

  const DeviceFits fits{upload(device, points),
                        upload(device, batches.first),
                        upload(device, batches.length),
                        upload(device, scale),
                        upload(device, hermite),
                        allocate<float>(device, 10 * lanes),
                        allocate<float>(device, 2 * lanes),
                        lanes,
                        slots};
  fit_batches(device, fits, params);
  const std::vector<float> c = download(device, fits.quadric), q = download(device, fits.quality);
  for (std::size_t l = 0; l < n; ++l) {
    const std::size_t g = static_cast<std::size_t>(batches.order[l]);
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
