// Spray: lone particles and small clusters, and the surface that the design gives them.
#pragma once

#include <functional>
#include <vector>

#include "stages/vec.hpp"

namespace meniscus::accuracy {

/// One piece of spray: centres of its one to six particles, s.
using Piece = std::vector<Vec3d>;

/// Pieces of 1 to 6 particles hovering about a solid, well inside [-18, 18]^3: 0.8 to 1.2 s from
/// particle to particle within a piece, at least 3 s from the solid and 4 s from other pieces, out
/// of the reach of their fields. `distance` is the solid's.
std::vector<Piece> make_splash(const std::function<double(const Vec3d&)>& distance);

/// C(x) = sum of W(|x - x_j|) over the piece, the cubic spline of smoothing length s times s^3
/// (Monaghan 1992); 0 from 2 s on.
double density(const Piece& piece, const Vec3d& x);

/// The piece's surface is where C is W(s/2) = 0.229, so that a lone particle is a sphere of radius
/// s/2. Returns a length (s) that never reaches beyond it, negative inside.
double piece_distance(const Piece& piece, const Vec3d& x);

}  // namespace meniscus::accuracy
