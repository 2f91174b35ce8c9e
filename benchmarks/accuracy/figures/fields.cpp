// The figures by name, with what each means.
#include "accuracy/figures.hpp"

namespace meniscus::accuracy {

const std::vector<FigureField>& figure_fields() {
  using F = Figures;
  using enum Better;
  static const std::vector<FigureField> fields{
      {"normal_rms", "s", &F::normal_rms, 4, low,
       "Distance of the surface from the truth along the true normal, RMS over pixels away from "
       "creases and outlines."},
      {"normal_p95", "s", &F::normal_p95, 4, low,
       "The same distance: 95 of 100 pixels are nearer than this."},
      {"normal_bias", "s", &F::normal_bias, 4, near_zero,
       "The same distance, mean with its sign: above 0 the surface lies too deep."},
      {"depth_rms", "s", &F::depth_rms, 4, low, "Error of the depth along the ray, RMS."},
      {"outliers", "%", &F::outliers, 2, low, "Pixels whose depth is wrong by more than s."},
      {"angle_median", "°", &F::angle_median, 2, low,
       "Angle between the map's normal and the true one, median."},
      {"angle_p95", "°", &F::angle_p95, 2, low, "The same angle: 95 of 100 pixels are below this."},
      {"slope_median", "°", &F::slope_median, 2, low,
       "Angle between the normal that the depths have by differences and the true one, median."},
      {"slope_p95", "°", &F::slope_p95, 2, low, "The same angle, 95th percentile."},
      {"jump_p999", "°", &F::jump_p999, 2, low,
       "Angle between the normals of neighbouring pixels beyond what the truth has there, 99.9th "
       "percentile: seams and specks in the shading."},
      {"rough", "°", &F::rough, 3, low,
       "The same angle beyond the truth's, mean: how rough the shading is."},
      {"torn", "%", &F::torn, 3, low,
       "Pixels away from outlines that show nothing, are wrong by more than s, or lie at a gap or "
       "a "
       "depth jump over s that the truth has not."},
      {"crease_rms", "s", &F::crease_rms, 3, low, "Error of the depth within 1.5 s of a crease."},
      {"crease_angle", "°", &F::crease_angle, 2, low,
       "Angle between the map's normal and the true one within 1.5 s of a crease, median."},
      {"crease_slope", "°", &F::crease_slope, 2, low,
       "The same angle by differences of the depths."},
      {"crease_jag", "s", &F::crease_jag, 3, low,
       "Jaggedness of crease lines: RMS deviation from the true line after its smooth part is "
       "taken out."},
      {"crease_lost", "%", &F::crease_lost, 1, low,
       "Share of the crease lines that the map does not have within 1.5 s."},
      {"outline_rms", "s", &F::outline_rms, 3, low,
       "Error of the depth within 1.5 s of an outline."},
      {"rim_angle", "°", &F::rim_angle, 2, low,
       "Angle between the map's normal and the true one within 1.5 s of an outline, median."},
      {"outline_miss", "s", &F::outline_miss, 3, low,
       "Mean distance between the outlines of the mask and the true ones, both ways."},
      {"outline_jag", "s", &F::outline_jag, 3, low,
       "Jaggedness of silhouettes: RMS deviation from the true line after its smooth part is taken "
       "out."},
      {"outline_lost", "%", &F::outline_lost, 1, low,
       "Share of the silhouettes that the map does not have within 1.5 s."},
      {"iou", "", &F::iou, 4, high,
       "Pixels covered in both the map and the truth over pixels covered in either."},
      {"holes", "", &F::holes, 1, low, "Enclosed gaps a scene that lie on the true surface."},
      {"specks", "/ Mpixel", &F::specks, 1, low,
       "Loose pieces of at most eight pixels per million pixels."},
      {"averted", "", &F::averted, 1, low,
       "Covered pixels a scene whose normal does not face the eye."},
      {"splash_covered", "%", &F::splash_covered, 1, high,
       "Pieces of splash with at least half of their pixels at the right depth."},
      {"splash_missing", "", &F::splash_missing, 1, low, "Pieces of splash that are not there."},
      {"splash_doubled", "", &F::splash_doubled, 1, low, "Pieces of splash that are there twice."},
      {"splash_closed", "%", &F::splash_closed, 1, high,
       "Pieces of splash that are in one piece and without a hole."},
      {"flicker", "s", &F::flicker, 4, low,
       "Change of the depth error when the camera moves by 0.3 pixels, RMS."},
      {"flicker_p999", "s", &F::flicker_p999, 4, low, "The same change, 99.9th percentile: pops."},
      {"jitter", "s", &F::jitter, 4, low,
       "Change of the depth error when each particle moves by 0.01 s, RMS."},
      {"jitter_p999", "s", &F::jitter_p999, 4, low, "The same change, 99.9th percentile."},
      {"moved", "s", &F::moved, 4, low,
       "Change of the depth error along points of the water when all of it moves by about 0.07 s, "
       "RMS."},
      {"moved_p999", "s", &F::moved_p999, 4, low, "The same change, 99.9th percentile: pops."},
      {"bent", "s", &F::bent, 4, low,
       "Change of the depth error along points of the water when it bends by up to 0.1 s, RMS."},
      {"bent_p999", "s", &F::bent_p999, 4, low, "The same change, 99.9th percentile: pops."},
      {"mesh_rms", "s", &F::mesh_rms, 4, low,
       "Distance of the mesh's vertices from the true surface, RMS, away from outlines."},
      {"mesh_p95", "s", &F::mesh_p95, 4, low, "The same distance, 95th percentile."},
      {"mesh_p999", "s", &F::mesh_p999, 4, low,
       "The same distance, 99.9th percentile: the farthest vertices."},
      {"mesh_outline", "s", &F::mesh_outline, 3, low,
       "Distance of the mesh's vertices from the true surface within 1.5 s of outlines, RMS."},
  };
  return fields;
}

}  // namespace meniscus::accuracy
