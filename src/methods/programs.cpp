#include "methods/programs.hpp"

#include <algorithm>

namespace meniscus {
namespace {

// Programs, each once, as the device builds them.
class Programs {
 public:
  explicit Programs(const Device::State& device) : device_(device) {}

  void add(const char* file, const std::string& options) {
    const ProgramName name{device_.built_with(file), options};
    const auto same = [&](const ProgramName& p) {
      return p.file == name.file && p.options == options;
    };
    if (std::none_of(all.begin(), all.end(), same)) all.push_back(name);
  }

  std::vector<ProgramName> all;

 private:
  const Device::State& device_;
};

}  // namespace

std::vector<ProgramName> closed_programs(const Parameters& params, const Device::State& device) {
  const std::string width = width_option(device.vector_width);
  const std::string wide = width_option(device.wide_width());
  Programs programs(device);
  programs.add("density.cl", wide);
  programs.add("roundness.cl", wide);
  programs.add("particle_fit.cl", wide);
  programs.add("sheet.cl", width);
  programs.add("implicit.cl", wide);
  if (device.is_in_place()) programs.add("fill.cl", width_option(1));
  if (params.motion) programs.add("motion.cl", width);
  return programs.all;
}

std::vector<ProgramName> programs_of(const Parameters& params, const Device::State& device) {
  if (params.method != Method::fit) return {};
  const std::string width = width_option(device.vector_width);
  const std::string wide = width_option(device.wide_width());
  const std::string one = width_option(1);
  Programs programs(device);
  const auto add = [&](const char* file, const std::string& options) {
    programs.add(file, options);
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
  return programs.all;
}

}  // namespace meniscus
