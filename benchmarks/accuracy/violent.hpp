// Solids like violent water: drops, ligaments, sheets and their rims, on bulk water and off it.
#pragma once

#include <functional>
#include <vector>

#include "accuracy/field.hpp"
#include "accuracy/scene.hpp"

namespace meniscus::accuracy {

/// For tuning: jet (two jets that break into ligaments and drops), holes (a sheet with holes and
/// drops over a pool) and breaker (a breaking wave). For reporting: crown (a splash crown),
/// collision (two jets that meet in a sheet with fingers), and solids made of the water of
/// simulated frames: impact (a cube of water in a pool), wall and gate (breaking dams).
///
/// All are grids (field.hpp): a function of the parts' distances, opened with a ball and blurred,
/// so that nothing is thinner than 1.7 s and nothing has a crease. They are made when a distance is
/// first asked for.
std::vector<Scene> make_violent_scenes();

/// Distances of the solid in which `make` is negative, rounded as above.
std::function<double(const Vec3d&)> rounded(std::function<Field()> make);

/// The three from frames, see make_violent_scenes.
std::vector<Scene> make_frame_scenes();

}  // namespace meniscus::accuracy
