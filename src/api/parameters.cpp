#include "meniscus/parameters.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>

#include "api/parameter_list.hpp"
#include "base/comma_separated.hpp"
#include "base/enumerated.hpp"
#include "base/printed.hpp"
#include "meniscus/error.hpp"

namespace meniscus {
namespace {

struct AovEntry {
  const char* name;  // its channels in EXR files
  bool Aovs::*made;
};

constexpr AovEntry kAovs[] = {{"N", &Aovs::normal},          {"P", &Aovs::position},
                              {"id", &Aovs::group},          {"kind", &Aovs::kind},
                              {"residual", &Aovs::residual}, {"V", &Aovs::velocity}};

// The method's entry; none: method_list() lacks it.
const MethodEntry* find(Method method) {
  for (const MethodEntry& entry : method_list())
    if (entry.method == method) return &entry;
  return nullptr;
}

void check_layers(const Parameters& parameters) {
  const int layers = parameters.layers;
  if (layers < 0 || layers > kMostLayers)
    throw InvalidArgument(Notice{
        .code = Code::parameter_out_of_range,
        .text = setting("layers") +
                printed(" is %d, must be 1 to %d, or 0 for the front alone", layers, kMostLayers),
        .subject = "layers",
        .found = static_cast<double>(layers),
        .wanted = layers < 0 ? 0.0 : kMostLayers});
  if (layers > 0 && !has_layers(parameters.method))
    throw InvalidArgument("method " + to_string(parameters.method) +
                          " has one layer, the front: layers are found by methods " +
                          enumerated(methods_with_layers(), "and") + " (leave " +
                          setting("layers") + " out, or choose one of these)");
}

}  // namespace

const std::vector<MethodEntry>& method_list() {
  static const std::vector<MethodEntry> all{
      {.method = Method::fit,
       .name = "fit",
       .what = "a fit around every particle of the surface, sharp creases",
       .layers = true},
      {.method = Method::groups,
       .name = "groups",
       .what = "a fit around each group of particles, merged by normals and places",
       .layers = true},
      {.method = Method::stable,
       .name = "stable",
       .what = "a fit around every particle that is seen, and no other",
       .layers = true},
      {.method = Method::paper, .name = "paper", .what = "the paper as printed"},
      {.method = Method::ssm, .name = "ssm", .what = "Screen Space Meshes", .spheres = true},
      {.method = Method::spheres,
       .name = "spheres",
       .what = "the particles as spheres",
       .spheres = true},
      {.method = Method::bilateral,
       .name = "bilateral",
       .what = "bilateral filter on the spheres' depth",
       .spheres = true},
      {.method = Method::narrow_range,
       .name = "narrow-range",
       .what = "narrow-range filter on the spheres' depth",
       .spheres = true},
      {.method = Method::curvature_flow,
       .name = "curvature-flow",
       .what = "mean curvature flow of the spheres' depth",
       .spheres = true},
      {.method = Method::anisotropic,
       .name = "anisotropic",
       .what = "level set of anisotropic kernels"},
  };
  return all;
}

std::string to_string(Method method) {
  const MethodEntry* const entry = find(method);
  return entry ? entry->name : "unknown";
}

bool has_layers(Method method) {
  const MethodEntry* const entry = find(method);
  return entry && entry->layers;
}

std::vector<std::string> methods_with_layers() {
  std::vector<std::string> names;
  for (const MethodEntry& entry : method_list())
    if (entry.layers) names.push_back(entry.name);
  return names;
}

bool draws_spheres(Method method) {
  const MethodEntry* const entry = find(method);
  return entry && entry->spheres;
}

Method method_named(const std::string& name) {
  for (const MethodEntry& entry : method_list())
    if (entry.name == name) return entry.method;
  throw InvalidArgument(Notice{.code = Code::unknown_method,
                               .text = setting("method") + " is " + name + ", must be one of " +
                                       comma_separated(method_list(), &MethodEntry::name),
                               .subject = name});
}

Aovs aovs_named(const std::string& list) {
  Aovs aovs;
  std::string names;
  for (const AovEntry& entry : kAovs) {
    aovs.*entry.made = false;
    names += std::string(", ") + entry.name;
  }
  std::istringstream words(list);
  for (std::string word; std::getline(words, word, ',');) {
    const auto* const entry =
        std::find_if(std::begin(kAovs), std::end(kAovs),
                     [&](const AovEntry& candidate) { return candidate.name == word; });
    if (entry == std::end(kAovs)) {
      names.erase(0, 2);
      throw InvalidArgument(Notice{.code = Code::unknown_map,
                                   .text = setting("aov") + " has \"" + word +
                                           "\", must be a list of maps beside depth: " + names +
                                           ", e.g. " + setting("aov") + " N,id",
                                   .subject = word});
    }
    aovs.*entry->made = true;
  }
  return aovs;
}

std::string to_string(const Aovs& aovs) {
  std::string names;
  for (const AovEntry& entry : kAovs) {
    if (!(aovs.*entry.made)) continue;
    if (!names.empty()) names += ',';
    names += entry.name;
  }
  return names;
}

std::string describe(const Parameters& parameters) {
  std::string text = "method=" + to_string(parameters.method) + "\n";
  const std::string aovs = to_string(parameters.aovs);
  if (aovs != to_string(Aovs{})) text += "aov=" + aovs + "\n";
  if (parameters.layers > 0) text += printed("layers=%d\n", parameters.layers);
  Parameters copy = parameters;
  for (const ParameterEntry& entry : parameter_list(copy))
    text += printed("%s=%.9g\n", entry.name.c_str(), entry.get());
  return text;
}

void check(const Parameters& parameters) {
  require(find(parameters.method) != nullptr,
          setting("method") + " is number " + std::to_string(static_cast<int>(parameters.method)) +
              ", must be one of the " + std::to_string(method_list().size()) + " of method_list()");
  Parameters copy = parameters;
  for (const ParameterEntry& entry : parameter_list(copy)) {
    const double value = entry.get();
    if (std::isfinite(value) && (entry.above ? value > entry.least : value >= entry.least) &&
        value <= entry.most)
      continue;
    throw InvalidArgument(
        Notice{.code = Code::parameter_out_of_range,
               .text = setting(entry.name) + printed(" is %g, must be %s %g and at most %g", value,
                                                     entry.above ? "more than" : "at least",
                                                     entry.least, entry.most),
               .subject = entry.name,
               .found = value,
               .wanted = value > entry.most ? entry.most : entry.least});
  }
  const double radius = parameters.particle_radius;
  if (!(radius >= 0) || !std::isfinite(radius))
    throw InvalidArgument(
        Notice{.code = Code::parameter_out_of_range,
               .text = setting("particle-radius") +
                       printed(" is %g, must be > 0 and finite, or 0 for the file's", radius),
               .subject = "particle-radius",
               .found = radius,
               .wanted = 0});
  check_layers(parameters);
}

}  // namespace meniscus
