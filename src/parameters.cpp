#include "meniscus/parameters.hpp"

#include <cmath>
#include <cstdio>

#include "meniscus/error.hpp"
#include "parameter_list.hpp"

namespace meniscus {

const std::vector<MethodEntry>& method_list() {
  static const std::vector<MethodEntry> all{
      {Method::fit, "fit", "merged groups and sharp creases"},
      {Method::stable, "stable", "one fit a particle, for animation"},
      {Method::paper, "paper", "the paper as printed"},
      {Method::ssm, "ssm", "Screen Space Meshes"},
      {Method::spheres, "spheres", "the particles as spheres"},
      {Method::bilateral, "bilateral", "bilateral filter on the spheres' depth"},
      {Method::narrow_range, "narrow-range", "narrow-range filter on the spheres' depth"},
      {Method::curvature_flow, "curvature-flow", "mean curvature flow of the spheres' depth"},
      {Method::anisotropic, "anisotropic", "level set of anisotropic kernels"},
  };
  return all;
}

std::string to_string(Method method) {
  for (const MethodEntry& entry : method_list())
    if (entry.method == method) return entry.name;
  return "unknown";
}

Method method_named(const std::string& name) {
  std::string names;
  for (const MethodEntry& entry : method_list()) {
    if (entry.name == name) return entry.method;
    names += (names.empty() ? "" : ", ") + entry.name;
  }
  throw InvalidArgument("--method is " + name + ", must be one of " + names);
}

std::string describe(const Parameters& parameters) {
  std::string text = "method=" + to_string(parameters.method) + "\n";
  Parameters copy = parameters;
  for (const ParameterEntry& entry : parameter_list(copy)) {
    char line[96];
    std::snprintf(line, sizeof line, "%s=%.9g\n", entry.name.c_str(), entry.get());
    text += line;
  }
  return text;
}

void check(const Parameters& parameters) {
  Parameters copy = parameters;
  for (const ParameterEntry& entry : parameter_list(copy)) {
    const double value = entry.get();
    char line[256];
    std::snprintf(line, sizeof line, "--%s is %g, must be %s %g and at most %g", entry.name.c_str(),
                  value, entry.above ? "more than" : "at least", entry.least, entry.most);
    require(std::isfinite(value) && (entry.above ? value > entry.least : value >= entry.least) &&
                value <= entry.most,
            line);
  }
  require(parameters.particle_radius >= 0 && std::isfinite(parameters.particle_radius),
          "--particle-radius must be > 0");
}

}  // namespace meniscus
