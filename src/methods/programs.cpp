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
  programs.add("edges.cl", wide);
  programs.add("sheet.cl", wide);
  programs.add("implicit.cl", wide);
  if (params.motion) programs.add("motion.cl", width);
  return programs.all;
}

std::vector<ProgramName> programs_of(const Parameters& params, const Device::State& device) {
  if (params.method != Method::fit) return {};
  const std::string width = width_option(device.vector_width);
  const std::string wide = width_option(device.wide_width());
  const std::string one = width_option(1);
  Programs programs(device);
  programs.add("density.cl", wide);
  programs.add("visible.cl", width);
  programs.add("bins.cl", width);
  if (device.is_in_place()) programs.add("fill.cl", one);
  programs.add("roundness.cl", wide);
  programs.add("particle_fit.cl", wide);
  programs.add("edges.cl", wide);
  programs.add("sheet.cl", wide);
  const bool by_minima = device.discs == DiscForm::minima;
  programs.add(by_minima ? "minima.cl" : "region.cl", width);
  programs.add("list_samples.cl", width);
  programs.add("blend.cl", wide);
  programs.add("settle.cl", width);
  programs.add("settle.cl", wide);
  programs.add("interpolate.cl", width);
  if (!by_minima) programs.add("behind.cl", width);
  programs.add("specks.cl", width);
  if (params.fairing > 0) programs.add("fairing.cl", wide);
  if (params.aovs.group || params.aovs.residual) programs.add("choose_groups.cl", wide);
  if (params.mesh) {
    programs.add("blend.cl", one);
    programs.add("settle.cl", one);
  }
  if (params.motion) programs.add("motion.cl", width);
  if (params.layers > 0) programs.add("implicit.cl", wide);
  return programs.all;
}

}  // namespace meniscus
