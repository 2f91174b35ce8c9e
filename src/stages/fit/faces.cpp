#include "stages/fit/faces.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.hpp"
#include "stages/frame/cells.hpp"

namespace meniscus {
namespace {

constexpr double kBevel = 0.01;     // e of a bevel
constexpr double kNoBevel = 0.03;   // least e of other fits
constexpr double kOnEdge = 0.3;     // e up to which a fit's particle may lie on other faces, too
constexpr double kOffEdge = 0.6;    // least e of fits within a face
constexpr double kLeastEdge = 0.1;  // e of a face,
constexpr double kFlat = 0.3;       // its spread, particle radii,
constexpr double kOff = 0.2;        // how far off a face a particle may be, too, particle radii
constexpr double kTowards = -0.1;   // least cosine of a face's normal and the fit's
constexpr double kSameFace = 0.7;   // cosine from which two fits are of one face
constexpr double kOther = 0.72;     // up to this one a face is another than the one a fit follows,
constexpr double kOwn = 0.8;        // from this one on it is the same

bool is_face(const ParticleFits& fits, std::size_t k) {
  return !(fits.residual[k] < 0) && fits.edge[k] >= kLeastEdge && fits.spread[k] < kFlat;
}

// A face on which a fit's particle lies: which fit follows it, how far it counts, and its quadric
// around that particle.
struct FaceBeside {
  std::size_t fit;
  double counts;
  QuadricLevel there;
};

// The fits of faces within kFaceReach of a place, the nearest first.
std::vector<std::size_t> faces_near(const ParticleFits& fits, const Cells& cells, const Vec3d& at) {
  std::vector<std::pair<double, std::size_t>> near;  // distance, fit
  visit_near(cells, static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.z),
             [&](std::int32_t p) {
               const auto k = static_cast<std::size_t>(cells.item[static_cast<std::size_t>(p)]);
               const double l = length(fits.position[k] - at);
               if (l < kFaceReach && is_face(fits, k)) near.emplace_back(l, k);
               return true;
             });
  std::sort(near.begin(), near.end());
  std::vector<std::size_t> faces;
  for (const auto& [l, k] : near) faces.push_back(k);
  return faces;
}

// How far fit b is one at an edge.
double on_edge(const ParticleFits& fits, std::size_t b) {
  return (1 - fits.roundness[b]) * (1 - smooth_step(kOnEdge, kOffEdge, fits.edge[b]));
}

std::vector<FaceBeside> faces_beside(const ParticleFits& fits, const Cells& cells, std::size_t b,
                                     double offset) {
  const double bevel = (1 - fits.roundness[b]) * (1 - smooth_step(kBevel, kNoBevel, fits.edge[b]));
  std::vector<FaceBeside> faces;
  std::vector<Vec3d> taken;  // their normals, those that count nothing among them
  for (const std::size_t k : faces_near(fits, cells, fits.position[b])) {
    const Vec3d& normal = fits.normal[k];
    const auto same = [&](const Vec3d& other) { return dot(normal, other) > kSameFace; };
    if (dot(normal, fits.normal[b]) < kTowards || std::any_of(taken.begin(), taken.end(), same))
      continue;
    const QuadricLevel there = level_at(fits.quadric[k], fits.position[b] - fits.position[k]);
    // Its foot lies offset + kOff from the particle at most.
    const double before = -there.value / length(there.gradient);
    if (!(std::abs(before - offset) < kOff)) continue;
    taken.push_back(normal);
    // Nothing stands in for the face that b follows itself, if it follows one.
    const double own = smooth_step(kOther, kOwn, dot(normal, fits.normal[b]));
    const double counts = on_edge(fits, b) + own * (bevel - on_edge(fits, b));
    if (counts > 0) faces.push_back({k, counts, there});
  }
  return faces;
}

// Appends a face at the place of fit b.
void add_face(const ParticleFits& fits, const FaceBeside& face, std::size_t b,
              ParticleFits& faces) {
  const auto& [k, counts, there] = face;
  const auto& [value, gradient] = there;
  const double slope = length(gradient);
  std::array<float, 10> quadric = fits.quadric[k];
  const std::array around{value, gradient.x, gradient.y, gradient.z};
  std::ranges::transform(around, quadric.begin(), [](double v) { return static_cast<float>(v); });
  faces.position.push_back(fits.position[b]);
  faces.normal.push_back(gradient / slope);
  faces.visible.push_back(fits.visible[b]);
  faces.surface.push_back(fits.surface[b]);
  faces.support.push_back(fits.support[k]);
  faces.roundness.push_back(fits.roundness[k]);
  faces.edge.push_back(fits.edge[k] * counts);
  faces.firmness.push_back(fits.firmness[k] * counts);
  faces.foot.push_back(fits.position[b] - gradient * (double{quadric[0]} / (slope * slope)));
  faces.quadric.push_back(quadric);
  faces.residual.push_back(fits.residual[k]);
}

}  // namespace

TrustedFits faces_beside_edges(const ParticleFits& fits, const std::vector<double>& trust,
                               double offset) {
  TrustedFits faces;
  if (!fits.extent.empty()) return faces;
  std::vector<std::size_t> at_edge;
  for (std::size_t b = 0; b < fits.size(); ++b)
    if (!(fits.residual[b] < 0) && on_edge(fits, b) > 0) at_edge.push_back(b);
  if (at_edge.empty()) return faces;
  const Cells cells = make_cells(fits.position, kFaceReach);
  std::vector<std::vector<FaceBeside>> beside(at_edge.size());
  constexpr std::size_t kGrain = 64;  // fits that are worth a thread
  parallel_for(at_edge.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      beside[k] = faces_beside(fits, cells, at_edge[k], offset);
  });
  for (std::size_t k = 0; k < at_edge.size(); ++k)
    for (const FaceBeside& face : beside[k]) {
      add_face(fits, face, at_edge[k], faces.fits);
      faces.trust.push_back(trust[face.fit]);
    }
  return faces;
}

}  // namespace meniscus
