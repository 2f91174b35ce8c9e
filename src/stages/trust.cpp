#include "stages/trust.hpp"

#include <algorithm>

namespace meniscus {
namespace {

double smooth_step(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// Weighted RMS distance of all points from the surface that lies `offset` outside them.
double spread(const FitProblem& problem, const std::array<float, 10>& quadric, double offset) {
  double sum = 0, weight = 0;
  for (const FitPoint& point : problem.points) {
    const double f =
        std::clamp(evaluate(quadric, point.position - problem.centre) + offset, -2.0, 2.0);
    sum += point.weight * f * f;
    weight += point.weight;
  }
  return weight > 0 ? std::sqrt(sum / weight) : 2;
}

}  // namespace

double evaluate(const std::array<float, 10>& c, const Vec3d& x) {
  return c[0] + (c[1] + c[4] * x.x + c[7] * x.y) * x.x + (c[2] + c[5] * x.y + c[8] * x.z) * x.y +
         (c[3] + c[6] * x.z + c[9] * x.x) * x.z;
}

Vec3d gradient(const std::array<float, 10>& c, const Vec3d& x) {
  return {c[1] + 2 * c[4] * x.x + c[7] * x.y + c[9] * x.z,
          c[2] + 2 * c[5] * x.y + c[7] * x.x + c[8] * x.z,
          c[3] + 2 * c[6] * x.z + c[8] * x.y + c[9] * x.x};
}

std::vector<double> measure_trust(Device& device, const Triangulation& mesh, const Groups& groups,
                                  const std::vector<FitProblem>& problems, const Quadrics& quadrics,
                                  const DeviceCells& cells, double offset) {
  std::vector<Vec3d> feet;
  std::vector<std::size_t> first_foot(groups.size() + 1, 0);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    first_foot[g] = feet.size();
    if (quadrics.residual[g] < 0) continue;
    for (std::int32_t k = groups.start[g]; k < groups.start[g] + groups.members[g]; ++k) {
      const Vec3d& position = mesh.position[groups.point[k]];
      const Vec3d x = position - groups.centre[g];
      const Vec3d slope = gradient(quadrics.coefficient[g], x);
      const double squared = std::max(dot(slope, slope), 1e-6);
      feet.push_back(position - slope * (evaluate(quadrics.coefficient[g], x) / squared));
    }
  }
  first_foot[groups.size()] = feet.size();
  const std::vector<float> density = measure_density(device, cells, feet);

  std::vector<double> trust(groups.size(), 0.0);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const std::size_t count = first_foot[g + 1] - first_foot[g];
    if (count == 0) continue;
    double sum = 0;
    for (std::size_t k = first_foot[g]; k < first_foot[g + 1]; ++k) sum += density[k];
    trust[g] = smooth_step(0.24, 0.33, sum / static_cast<double>(count)) *
               smooth_step(5, 12, static_cast<double>(problems[g].points.size())) *
               (1 - smooth_step(0.45, 0.75, spread(problems[g], quadrics.coefficient[g], offset)));
  }
  return trust;
}

}  // namespace meniscus
