#include "methods/programs.hpp"

#include <algorithm>

namespace meniscus {

std::vector<ProgramName> closed_programs(const Parameters& params, const Device::State& device) {
  const std::string width = width_option(device.vector_width);
  const std::string wide = width_option(device.wide_width());
  std::vector<ProgramName> programs{{"density.cl", wide},
                                    {"roundness.cl", wide},
                                    {"particle_fit.cl", wide},
                                    {"sheet.cl", width},
                                    {"implicit.cl", wide}};
  if (device.is_in_place()) programs.push_back({"fill.cl", width_option(1)});
  if (params.motion) programs.push_back({"motion.cl", width});
  return programs;
}

std::vector<ProgramName> programs_of(const Parameters& params, const Device::State& device) {
  if (params.method != Method::fit) return {};
  const std::string width = width_option(device.vector_width);
  const std::string wide = width_option(device.wide_width());
  const std::string one = width_option(1);
  std::vector<ProgramName> programs;
  const auto add = [&](const char* file, const std::string& options) {
    const auto same = [&](const ProgramName& p) { return p.file == file && p.options == options; };
    if (std::none_of(programs.begin(), programs.end(), same)) programs.push_back({file, options});
  };
  add("project.cl", width);
  add("density.cl", wide);
  add("visible.cl", width);
  add("bins.cl", width);
  if (device.is_in_place()) add("fill.cl", one);
  add("roundness.cl", wide);
  add("particle_fit.cl", wide);
  add("sheet.cl", width);
  add("region.cl", width);
  add("list_samples.cl", width);
  add("blend.cl", wide);
  add("settle.cl", width);
  add("settle.cl", wide);
  add("interpolate.cl", width);
  add("behind.cl", width);
  add("specks.cl", width);
  if (params.fairing > 0) add("fairing.cl", wide);
  if (params.aovs.group || params.aovs.residual) add("choose_groups.cl", wide);
  if (params.mesh) {
    add("blend.cl", one);
    add("settle.cl", one);
  }
  if (params.motion) add("motion.cl", width);
  if (params.layers > 0) add("implicit.cl", wide);
  return programs;
}

}  // namespace meniscus
