#include "meniscus/parameters.hpp"

#include <cmath>
#include <cstdio>

#include "meniscus/error.hpp"
#include "parameter_list.hpp"

namespace meniscus {

std::string to_string(Method method) {
  switch (method) {
    case Method::fit:
      return "fit";
    case Method::stable:
      return "stable";
    case Method::paper:
      return "paper";
    case Method::ssm:
      return "ssm";
  }
  return "unknown";
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
