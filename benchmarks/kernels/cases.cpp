#include "kernels/cases.hpp"

namespace meniscus::bench {

const std::vector<KernelBench>& kernel_benches() {
  static const std::vector<KernelBench> benches{
      {"count_owned", prepare_owned},
      // Whole stages, both ways to draw discs.
      {"owners_by_bins", prepare_owners_by_bins},
      {"owners_by_minima", prepare_owners_by_minima},
      {"fronts_by_bins", prepare_fronts_by_bins},
      {"fronts_by_minima", prepare_fronts_by_minima},
      {"spheres_by_bins", prepare_spheres_by_bins},
      {"spheres_by_minima", prepare_spheres_by_minima},
      {"measure_gradients", prepare_gradients},
      {"measure_evidence", prepare_evidence},
      {"fit_particles", prepare_fit},
      {"measure_edges", prepare_edges},
      {"average_on_sheets", prepare_averages},
      {"draw_triangles", prepare_triangles},
      {"splat_depth", prepare_splat},
      {"blend_groups", prepare_blend},
      {"settle_samples", prepare_settle},
      {"follow_field", prepare_follow},
      {"draw_splash", prepare_splash},
      {"compare_corners", prepare_compare},
      {"interpolate_samples", prepare_interpolate},
      {"close_specks", prepare_specks},
      {"fair_normals", prepare_fairing},
      {"motion_of_samples", prepare_motion},
      {"cast_spheres", prepare_cast_spheres},
      {"smooth_columns", prepare_smooth_columns},
      {"smooth_rows", prepare_smooth_rows},
      {"depth_normals", prepare_normals},
      {"shape_kernels", prepare_shape_kernels},
      {"cast_field", prepare_cast_field},
      {"filter_bilateral", prepare_bilateral},
      {"filter_narrow_range", prepare_narrow_range},
      {"flow_step", prepare_flow},
  };
  return benches;
}

}  // namespace meniscus::bench
