// Interpolation between the samples of a lattice in double precision, from interpolate.hpp and
// docs/method.md, "interpolate".
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "stages/stage_data.hpp"
#include "stages/view.hpp"
#include "verify/reference/epsilon.hpp"

namespace meniscus::reference {

/// What is known of a lattice's samples, and of what may show between them.
struct Lattice {
  SampleGrid grid;
  int every = 1;  // the lattice has every second of these
  std::vector<float> depth;
  std::vector<Vec3> normal;
  std::vector<Kind> kind;
  std::vector<float> open;               // finite: it is not known yet what shows
  std::vector<float> reference, splash;  // finite: there may be surface, splash
};

struct InterpolateParams {
  double tolerance = 0;      // of corners to planes, particle radii
  double agreeing = 0;       // the least cosine between normals across a cell
  double spread = 0;         // of the depths by the corners' planes
  bool trust_empty = false;  // nothing fits between the lattice's samples
};

enum class CellKind { empty, open, rough, smooth };  // in ascending order

/// What interpolation makes of one sample.
struct BetweenSample {
  bool sure = true;  // rounding decides about nothing
  bool shown = false;
  double depth = 0, error = 0;
  Vec3d normal;
  int corner = 0;                             // the sample whose kind it has
  bool opened = false;                        // left open, with its reference
  bool wanted = false, wants_splash = false;  // to be evaluated
};

class Interpolation {
 public:
  Interpolation(const View& view, const Lattice& lattice, const InterpolateParams& params)
      : view_(view), lattice_(lattice), params_(params), side_(2 * lattice.every) {}

  /// Sample (i, j), one of every `every`th row and column and none of the lattice's own.
  BetweenSample at(int i, int j) const {
    BetweenSample out;
    const int a = i / side_, b = j / side_;
    const bool right = i % side_ != 0, down = j % side_ != 0;
    out.corner = index(a * side_, b * side_);
    Cell cell = cell_of(a, b);
    // One between two of the lattice's lies between two cells.
    if (!down && b > 0) cell = larger(cell, cell_of(a, b - 1));
    if (!right && a > 0) cell = larger(cell, cell_of(a - 1, b));
    out.sure = cell.sure;
    std::vector<int> corners{out.corner};
    if (cell.kind == CellKind::smooth) {
      const int i1 = std::min((a + 1) * side_, lattice_.grid.nx - 1);
      const int j1 = std::min((b + 1) * side_, lattice_.grid.ny - 1);
      if (right) corners.push_back(index(i1, b * side_));
      if (down) corners.push_back(index(a * side_, j1));
      if (right && down) corners.push_back(index(i1, j1));
      interpolate(i, j, corners, &out);
    }
    if (out.shown || cell.kind == CellKind::empty) return out;
    const int s = index(i, j);
    const bool front = lattice_.reference[s] < kNoSurface;
    out.opened = cell.kind == CellKind::open && front;
    out.wanted = front && !out.opened;
    out.wants_splash = !out.opened && lattice_.splash[s] < kNoSurface;
    return out;
  }

 private:
  struct Cell {
    CellKind kind = CellKind::rough;
    bool sure = true;
  };
  static Cell larger(const Cell& a, const Cell& b) {
    return {std::max(a.kind, b.kind), a.sure && b.sure};
  }

  int index(int i, int j) const { return j * lattice_.grid.nx + i; }
  double u(int i) const { return lattice_.grid.first + double{lattice_.grid.step} * i; }
  Vec3d normal(int s) const { return Vec3d(lattice_.normal[s]); }
  Vec3d point(int s) const {
    return point_at(view_, u(s % lattice_.grid.nx), u(s / lattice_.grid.nx), lattice_.depth[s]);
  }

  Cell cell_of(int a, int b) const {
    Cell cell;
    const int i = a * side_, j = b * side_;
    // One that ends outside the image has no corner there.
    const bool inside = i + side_ < lattice_.grid.nx && j + side_ < lattice_.grid.ny;
    if (!inside) {
      // ... but is empty like others where nothing is expected at all; there, nothing is asked for.
      return cell;
    }
    const std::array<int, 4> corner{index(i, j), index(i + side_, j), index(i, j + side_),
                                    index(i + side_, j + side_)};
    int covered = 0, opened = 0;
    for (const int s : corner) {
      covered += lattice_.depth[s] < kNoSurface;
      opened += lattice_.open[s] < kNoSurface;
    }
    if (covered == 0 && params_.trust_empty) {
      cell.kind = opened > 0 ? CellKind::open : CellKind::empty;
      return cell;
    }
    if (covered < 4) return cell;
    bool smooth = true;
    const auto holds = [&](double margin, double error) {  // positive: it does
      smooth = smooth && margin > 0;
      cell.sure = cell.sure && std::abs(margin) > error;
    };
    for (const int p : corner)
      for (const int q : corner) {
        // The product of a unit normal and a difference of points, each below 64 radii with six
        // roundings.
        const double off = std::abs(dot(normal(p), point(q) - point(p)));
        if (p != q) holds(params_.tolerance - off, 3 * 8 * 64 * kEpsilon);
        smooth = smooth && lattice_.kind[p] == lattice_.kind[q];
      }
    for (const auto& [p, q] : {std::pair{0, 3}, std::pair{1, 2}})
      holds(dot(normal(corner[p]), normal(corner[q])) - params_.agreeing, 8 * kEpsilon);
    if (smooth) cell.kind = CellKind::smooth;
    return cell;
  }

  // The mean of two answers: between the corners along a plane, and by the planes that touch there.
  void interpolate(int i, int j, const std::vector<int>& corners, BetweenSample* out) const {
    const Vec3d from = point_at(view_, u(i), u(j), 0), ray = ray_direction(view_, u(i), u(j));
    const auto n = static_cast<double>(corners.size());
    double linear = 0, planes = 0, low = INFINITY, high = 0, steepest = -1;
    out->shown = true;
    for (const int s : corners) {
      const double slope = dot(normal(s), ray), t = dot(normal(s), point(s) - from) / slope;
      // A depth over the screen is no plane's in perspective; its inverse is.
      linear += view_.orthographic ? lattice_.depth[s] : 1.0 / lattice_.depth[s];
      planes += t;
      low = std::min(low, t);
      high = std::max(high, t);
      steepest = std::max(steepest, slope);
      out->normal += normal(s);
    }
    // A plane's depth is the quotient of a product as in cell_of and a slope of 0.1 or more.
    const double error = 3 * 8 * 64 * kEpsilon / std::max(-steepest, 0.1);
    out->shown = steepest < -0.1 && high - low < params_.spread;
    out->sure = out->sure && std::abs(steepest + 0.1) > 8 * kEpsilon &&
                (steepest > -0.1 || std::abs(high - low - params_.spread) > 2 * error);
    out->depth = ((view_.orthographic ? linear / n : n / linear) + planes / n) / 2;
    out->error = error + 16 * kEpsilon * out->depth;
    out->normal = normalized(out->normal);
  }

  const View& view_;
  const Lattice& lattice_;
  InterpolateParams params_;
  int side_;
};

}  // namespace meniscus::reference
