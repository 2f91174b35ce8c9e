// project_particles: particles around the screen and far from it, some at the largest coordinates.
#include "stages/project.hpp"

#include "verify/reference/project.hpp"
#include "verify/references/cases.hpp"
#include "verify/references/inputs.hpp"
#include "verify/references/worst.hpp"

namespace meniscus::verify {

ReferenceErrors project_case(Device& device, int size) {
  constexpr double kRadius = 0.15, kMargin = 2.5;
  constexpr std::array<double, 3> kOrigin{0.5, -0.25, 0.125};  // exact in float
  const char* const names[] = {"x", "y", "z", "u", "v", "ku", "kv"};
  std::vector<Worst> worst;
  for (const char* name : names) worst.emplace_back("project_particles", name);
  Worst kept("project_particles", "kept");
  for (const Camera& camera :
       {perspective_camera(101, 77), off_centre_camera(37, 120), orthographic_camera(90, 61)}) {
    const View view = make_view(camera, kRadius, kOrigin);
    Random random(static_cast<unsigned>(size));
    WorldParticles particles;
    std::vector<reference::ProjectedParticle> expected;
    while (particles.x.size() < static_cast<std::size_t>(size)) {
      // Every eighth one is denormally near to a plane or extremely far away.
      const double far = particles.x.size() % 16 == 7    ? 1e6
                         : particles.x.size() % 16 == 15 ? 1e-42
                                                         : 1;
      const auto x = static_cast<float>(far * random(-9, 9)), y = static_cast<float>(random(-9, 9)),
                 z = static_cast<float>(random(-9, 14)), scale = static_cast<float>(random(0.5, 2));
      const auto p = reference::project(camera, kRadius, kOrigin, {x, y, z}, scale, kEpsilon);
      const reference::Fate fate = reference::fate_of(p, camera, view.near_depth, kMargin);
      if (fate == reference::Fate::undecided) continue;
      particles.x.push_back(x);
      particles.y.push_back(y);
      particles.z.push_back(z);
      particles.scale.push_back(scale);
      if (fate == reference::Fate::kept) expected.push_back(p);
    }
    const Projected found = project_particles(device, view, particles, kMargin);
    kept.see(static_cast<double>(found.size()), static_cast<double>(expected.size()), 0);
    if (found.size() != expected.size()) continue;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const auto& e = expected[i];
      const double found_one[] = {found.x[i], found.y[i],  found.z[i], found.u[i],
                                  found.v[i], found.ku[i], found.kv[i]};
      const double exact[] = {e.eye[0], e.eye[1], e.eye[2], e.u, e.v, e.ku, e.kv};
      const double bound[] = {e.eye_error[0], e.eye_error[1],   e.eye_error[2],  e.u_error,
                              e.v_error,      e.ku * e.k_error, e.kv * e.k_error};
      // A coordinate may be the small difference of large ones: the particle's distance counts.
      for (int k = 0; k < 7; ++k)
        worst[k].see(found_one[k], exact[k], bound[k], k < 3 ? e.eye[2] : exact[k]);
    }
  }
  ReferenceErrors errors{kept.error()};
  for (const Worst& each : worst) errors.push_back(each.error());
  return errors;
}

}  // namespace meniscus::verify
