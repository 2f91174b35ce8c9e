// Where the surface goes on the screen.
#pragma once

#include "meniscus/export.hpp"
#include "meniscus/types.hpp"

namespace meniscus MENISCUS_API {

/// How far what each pixel shows moves until the next frame: its point, moved on by its velocity
/// for 1 / frames_per_second, as the next frame's camera sees it, less the pixel's own centre. To
/// the right and down, in pixels of this image (`next` may have another size).
///
///   surface            with velocity
///   next               camera of the next frame; surface.camera where it stands still
///   frames_per_second  > 0, finite
///
/// Zero where there is no surface. Finite everywhere: a point that ends up behind the next camera's
/// near plane is put onto that plane first, straight along the camera's axis, so that its motion
/// leads out of the image on the side where it passes; and no component exceeds 10^6.
/// Throws InvalidArgument when the surface has no velocity, or for a bad camera or rate.
ScreenMotion screen_motion(const Surface& surface, const Camera& next, double frames_per_second);

}  // namespace MENISCUS_API
