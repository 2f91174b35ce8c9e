// stream: what of a large frame can matter to what is seen, in passes over its particles.
#pragma once

#include "prepare/fill.hpp"
#include "prepare/survey.hpp"

namespace meniscus {

/// How close particles lie on the screen: the upper quartile of their spacing over the sample's
/// particles in view (pixels), and about how many are in view.
struct OnScreen {
  double spacing = 0, particles = 0;
};

OnScreen measure_spacing(const View& view, const Survey& survey);

/// How many times as far apart the representatives lie as the particles: a power of the fourth root
/// of two, so that it stays the same while a camera moves a little; 1: as they are.
double thinning(const OnScreen& screen, const Parameters& params);

/// Everything in view, or where that is much what lies near the front; in the first process. What
/// cannot be used of velocities and attributes is left out. Throws as fill_frame().
Particles keep_near(const Filling& filling, const ParticleSource& source, const View& view,
                    const OnScreen& screen);

/// Gives the frame, whose view is in radii of the representatives, these and its spray; in the
/// first process. Throws as fill_frame().
void thin_frame(const Filling& filling, const ParticleSource& source, const OnScreen& screen,
                FilledFrame& frame);

}  // namespace meniscus
