#include "stages/view.hpp"

namespace meniscus {

View make_view(const Camera& camera, double radius, const std::array<double, 3>& origin) {
  View view;
  view.radius = radius;
  view.width = camera.width;
  view.height = camera.height;
  view.origin = {origin[0], origin[1], origin[2]};
  const auto& m = camera.view;
  const auto& p = camera.projection;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) view.rotation[r * 3 + c] = m[r * 4 + c];
  const auto eye_of_origin = [&](int r) {
    return (m[r * 4] * origin[0] + m[r * 4 + 1] * origin[1] + m[r * 4 + 2] * origin[2] +
            m[r * 4 + 3]) /
           radius;
  };
  view.shift = {eye_of_origin(0), eye_of_origin(1), eye_of_origin(2)};

  // Rows of the projection, applied to (e * radius, 1).
  const auto row = [&](int r) {
    return std::array<double, 4>{p[r * 4] * radius, p[r * 4 + 1] * radius, p[r * 4 + 2] * radius,
                                 p[r * 4 + 3]};
  };
  const auto p0 = row(0), p1 = row(1), p2 = row(2);
  auto p3 = row(3);
  view.orthographic = p[12] == 0 && p[13] == 0 && p[14] == 0;
  const double half_width = 0.5 * camera.width, half_height = 0.5 * camera.height;
  for (int k = 0; k < 4; ++k) {
    view.u_row[k] = half_width * (p3[k] + p0[k]);
    view.v_row[k] = half_height * (p3[k] - p1[k]);
    view.w_row[k] = p3[k];
  }
  view.u_scale = half_width * std::sqrt(p0[0] * p0[0] + p0[1] * p0[1] + p0[2] * p0[2]);
  view.v_scale = half_height * std::sqrt(p1[0] * p1[0] + p1[1] * p1[1] + p1[2] * p1[2]);

  // The near plane is clip z = -w: (p2 + p3) . (0, 0, -t, 1) = 0.
  const double slope = -(p2[2] + p3[2]), constant = p2[3] + p3[3];
  view.near_depth = slope != 0 ? -constant / slope : 0;
  if (!(view.near_depth > 1e-3)) view.near_depth = 1e-3;

  // u w = u_row.e, v w = v_row.e with e = (x, y, -t, 1): two linear equations for x and y whose
  // matrix does not depend on u, v or t, because rows 0 and 1 of w_row are zero.
  const double a = view.u_row[0], b = view.u_row[1], c = view.v_row[0], d = view.v_row[1];
  const double det = a * d - b * c;
  // right-hand sides, affine in u, v and t: u_rhs = u (w3 - w2 t) - (u3 - u2 t)
  const double w2 = view.w_row[2], w3 = view.w_row[3];
  const auto solve = [&](double ru, double rv) {
    return std::array<double, 2>{(d * ru - b * rv) / det, (a * rv - c * ru) / det};
  };
  const auto o_const = solve(-view.u_row[3], -view.v_row[3]);
  const auto o_u = solve(w3, 0), o_v = solve(0, w3);
  const auto d_const = solve(view.u_row[2], view.v_row[2]);
  const auto d_u = solve(-w2, 0), d_v = solve(0, -w2);
  view.ray = {o_const[0], o_u[0], o_v[0], o_const[1], o_u[1], o_v[1],
              d_const[0], d_u[0], d_v[0], d_const[1], d_u[1], d_v[1]};
  return view;
}

View make_world_view(double radius, const std::array<double, 3>& origin) {
  View view;
  view.radius = radius;
  view.origin = {origin[0], origin[1], origin[2]};
  view.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  return view;
}

View coarser(View view, double factor) {
  view.radius *= factor;
  view.shift = view.shift / factor;
  for (std::array<double, 4>* const row : {&view.u_row, &view.v_row, &view.w_row})
    for (std::size_t k = 0; k < 3; ++k) (*row)[k] *= factor;
  view.u_scale *= factor;
  view.v_scale *= factor;
  view.near_depth /= factor;
  for (std::size_t k = 0; k < 6; ++k) view.ray[k] /= factor;
  return view;
}

Vec3d eye_from_world(const View& view, const Vec3d& world) {
  const auto& m = view.rotation;
  const Vec3d x = (world - view.origin) / view.radius;
  return Vec3d{m[0] * x.x + m[1] * x.y + m[2] * x.z, m[3] * x.x + m[4] * x.y + m[5] * x.z,
               m[6] * x.x + m[7] * x.y + m[8] * x.z} +
         view.shift;
}

double depth_of_radius(const View& view, double pixels) {
  const double w = std::min(view.u_scale, view.v_scale) / pixels;
  if (view.orthographic) return view.w_row[3] <= w ? INFINITY : 0;
  return std::max((w - view.w_row[3]) / -view.w_row[2], 0.0);
}

}  // namespace meniscus
