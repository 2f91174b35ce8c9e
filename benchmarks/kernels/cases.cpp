#include "kernels/cases.hpp"

#include <algorithm>
#include <bit>

namespace meniscus::bench {

const std::vector<KernelBench>& kernel_benches() {
  static const std::vector<KernelBench> benches{
      {"project_particles", prepare_project},
      {"draw_triangles", prepare_triangles},
      {"fit_groups", prepare_fit},
      {"filter_bilateral", prepare_bilateral},
      {"filter_narrow_range", prepare_narrow_range},
      {"flow_step", prepare_flow},
  };
  return benches;
}

std::size_t count_differing(const std::vector<float>& a, const std::vector<float>& b) {
  if (a.size() != b.size()) return std::max(a.size(), b.size());
  std::size_t count = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    count += std::bit_cast<std::uint32_t>(a[k]) != std::bit_cast<std::uint32_t>(b[k]);
  return count;
}

}  // namespace meniscus::bench
