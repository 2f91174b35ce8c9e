#include "methods/programs.hpp"

namespace meniscus {

std::vector<ProgramName> programs_of(const Parameters& params, const Device::State& device) {
  if (params.method != Method::fit) return {};
  const std::string width = width_option(device.vector_width);
  const std::string wide = width_option(device.wide_width());
  const std::string settle = "cells.cl field.cl samples.cl settle.cl";
  std::vector<ProgramName> programs{{"project.cl", width},
                                    {"cells.cl field.cl density.cl", wide},
                                    {"cells.cl field.cl density.cl", ""},
                                    {"visible.cl", width},
                                    {"bins.cl", width},
                                    {"bins.cl", ""}};
  if (device.is_in_place()) programs.push_back({"fill.cl", ""});
  for (const ProgramName& program :
       std::vector<ProgramName>{{"fit.cl particle_fit.cl roundness.cl", wide},
                                {"fit.cl particle_fit.cl", wide},
                                {"cells.cl sheet.cl", width},
                                {"region.cl", ""},
                                {"region.cl", width},
                                {"list_samples.cl", ""},
                                {"samples.cl hits.cl blend.cl", wide},
                                {settle, width},
                                {"list_samples.cl", width},
                                {settle, wide},
                                {"interpolate.cl", width},
                                {"samples.cl behind.cl", ""},
                                {"samples.cl behind.cl", width},
                                {"specks.cl", width}})
    programs.push_back(program);
  if (params.aovs.group || params.aovs.residual)
    programs.push_back({"hits.cl choose_groups.cl", wide});
  if (params.mesh) {
    programs.push_back({"samples.cl hits.cl blend.cl", width_option(1)});
    programs.push_back({settle, ""});
  }
  if (params.motion) programs.push_back({"cells.cl motion.cl", width});
  return programs;
}

}  // namespace meniscus
