#include "accuracy/commands.hpp"

#include <charconv>

#include "api/parameter_list.hpp"
#include "io/png.hpp"
#include "io/preview.hpp"

namespace meniscus::accuracy {
namespace {

constexpr char kPaperBest[] = "paper-best";
constexpr char kPaperBestIs[] =
    "paper+merge-cosine=0.8+merge-distance=1+paper-offset=1+blend-d-max=3+paper-b=0.6+reach=5+max-"
    "edge=4+owned=0.08";

/// Applies name=value; the names are those of parameter_list.
void apply(const std::string& setting, Parameters& parameters) {
  const auto equals = setting.find('=');
  const std::string name = setting.substr(0, equals);
  for (const ParameterEntry& entry : parameter_list(parameters)) {
    if (entry.name != name || equals == std::string::npos) continue;
    const char* const end = setting.data() + setting.size();
    const auto read = [&](auto* value) {
      const auto [at, error] = std::from_chars(setting.data() + equals + 1, end, *value);
      return error == std::errc() && at == end;
    };
    if (std::visit(read, entry.value)) return;
    break;
  }
  throw InvalidArgument("a setting is " + setting +
                        ", must be name=value with a name from meniscus extract --help");
}

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> words(1);
  for (const char c : text)
    if (c == at)
      words.emplace_back();
    else
      words.back() += c;
  return words;
}

}  // namespace

std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const MethodEntry& entry : method_list()) {
    names.push_back(entry.name);
    if (entry.method == Method::paper) names.push_back(kPaperBest);
  }
  return names;
}

std::vector<Contender> contenders_of(const CommonOptions& options, Device& device) {
  std::vector<Contender> contenders;
  for (const std::string& name : options.methods) {
    if (name == "splashsurf") {
      contenders.push_back(splashsurf(options.splashsurf));
      continue;
    }
    const bool best = name.substr(0, name.find('+')) == kPaperBest;
    const std::vector<std::string> words =
        split(best ? kPaperBestIs + name.substr(std::string(kPaperBest).size()) : name, '+');
    Parameters parameters;
    parameters.method = method_named(words[0]);
    parameters.mesh = options.mesh;
    for (const std::string& setting : options.settings) apply(setting, parameters);
    for (std::size_t k = 1; k < words.size(); ++k) apply(words[k], parameters);
    check(parameters);
    contenders.push_back(library_method(device, parameters));
    contenders.back().name = name;
  }
  return contenders;
}

Bytes picture_of(const Surface& surface, Preview preview) {
  return meniscus::encode_png(
      {surface.camera.width, surface.camera.height, draw_preview(surface, preview)});
}

void write_results(const CommonOptions& options, const std::string& json, const Report& report) {
  const auto write = [](const std::string& path, const std::string& text) {
    if (!path.empty()) write_file(path, text.data(), text.size());
  };
  write(options.json, json);
  if (!options.html.empty()) write(options.html, html(report));
  write(options.markdown, markdown(report));
}

}  // namespace meniscus::accuracy
