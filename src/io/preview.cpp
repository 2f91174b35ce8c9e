#include "io/preview.hpp"

#include <array>
#include <cmath>
#include <utility>

#include "io/picture.hpp"
#include "meniscus/error.hpp"

namespace meniscus {
namespace {

// 0 to 1. What is no number, as maps of a damaged file or of another program may hold, is 0.
float share(float x) { return x > 0 ? std::min(x, 1.0f) : 0.0f; }

constexpr Color kDark = {0.012f, 0.014f, 0.018f};  // background of the technical views

Picture draw_normal(const Scene& scene) {
  Picture picture(scene.normal.size(), kDark);
  const auto linear = [](float srgb) {  // so that the file holds n / 2 + 1/2
    return srgb <= 0.04045f ? srgb / 12.92f : std::pow((srgb + 0.055f) / 1.055f, 2.4f);
  };
  for (std::size_t k = 0; k < picture.size(); ++k) {
    const Vec3& n = scene.normal[k];
    if (scene.covered(k))
      picture[k] = {linear(n.x / 2 + .5f), linear(n.y / 2 + .5f), linear(n.z / 2 + .5f)};
  }
  return picture;
}

// Near to far: a ramp whose lightness falls evenly (linear light, after viridis).
Color ramp(float s) {
  static constexpr std::array<Color, 7> kStops = {{{0.9832f, 0.8000f, 0.0185f},
                                                   {0.2623f, 0.6376f, 0.1170f},
                                                   {0.0331f, 0.4508f, 0.2086f},
                                                   {0.0137f, 0.2789f, 0.2705f},
                                                   {0.0331f, 0.1441f, 0.2705f},
                                                   {0.0578f, 0.0452f, 0.2232f},
                                                   {0.0578f, 0.0000f, 0.0887f}}};
  const float x = share(s) * (kStops.size() - 1);
  const auto k = std::min(static_cast<std::size_t>(x), kStops.size() - 2);
  return mix(kStops[k], kStops[k + 1], x - static_cast<float>(k));
}

Picture draw_depth(const Scene& scene) {
  std::vector<float> depths;
  for (std::size_t k = 0; k < scene.normal.size(); ++k)
    if (scene.covered(k) && std::isfinite(scene.depth(k))) depths.push_back(scene.depth(k));
  Picture picture(scene.normal.size(), kDark);
  if (depths.empty()) return picture;
  // The range leaves out one hundredth at either end, so that a stray drop does not flatten it.
  const auto percentile = [&](std::size_t percent) {
    const auto place =
        depths.begin() + static_cast<std::ptrdiff_t>((depths.size() - 1) * percent / 100);
    std::nth_element(depths.begin(), place, depths.end());
    return *place;
  };
  const float near = percentile(1), far = percentile(99);
  for (std::size_t k = 0; k < picture.size(); ++k)
    if (scene.covered(k)) picture[k] = ramp((scene.depth(k) - near) / std::max(far - near, 1e-6f));
  return picture;
}

// A colour of even lightness and chroma for a group: its hue from a hash of the number (Oklab).
Color group_color(std::uint32_t group) {
  std::uint32_t h = group * 2654435761u;
  h ^= h >> 15;
  h *= 2246822519u;
  h ^= h >> 13;
  const float hue = static_cast<float>(h & 0xffff) / 65536.0f * 6.2831853f;
  const float lightness = 0.66f + 0.14f * static_cast<float>(h >> 24) / 255.0f;
  const float a = 0.115f * std::cos(hue), b = 0.115f * std::sin(hue);
  const auto cube = [](float x) { return x * x * x; };
  const float l = cube(lightness + 0.3963377774f * a + 0.2158037573f * b);
  const float m = cube(lightness - 0.1055613458f * a - 0.0638541728f * b);
  const float s = cube(lightness - 0.0894841775f * a - 1.2914855480f * b);
  return {std::max(0.0f, 4.0767416621f * l - 3.3077115913f * m + 0.2309699292f * s),
          std::max(0.0f, -1.2684380046f * l + 2.6097574011f * m - 0.3413193965f * s),
          std::max(0.0f, -0.0041960863f * l - 0.7034186147f * m + 1.7076147010f * s)};
}

Picture draw_groups(const Scene& scene) {
  Picture picture(scene.normal.size(), kDark);
  for (int row = 0; row < scene.height; ++row)
    for (int column = 0; column < scene.width; ++column) {
      const std::size_t k = scene.at(column, row);
      if (!scene.covered(k)) continue;
      const std::uint32_t group = scene.surface.group[k];
      const bool splash = scene.surface.kind[k] == Kind::splash || group == 0;
      const Color base = splash ? Color{0.8f, 0.82f, 0.85f} : group_color(group);
      const Vec3& n = scene.normal[k];  // a lamp above the viewer's left shoulder
      picture[k] = base * (0.62f + 0.16f * n.z + 0.26f * n.y - 0.14f * n.x);
    }
  return picture;
}

// sRGB bytes of 2^16 steps of linear light: in the darks, where sRGB is steepest, a step is 1/20 of
// a byte.
std::vector<std::uint8_t> srgb_table() {
  std::vector<std::uint8_t> table(1 << 16);
  for (std::size_t k = 0; k < table.size(); ++k) {
    const double x = static_cast<double>(k) / static_cast<double>(table.size() - 1);
    const double s = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
    table[k] = static_cast<std::uint8_t>(s * 255 + 0.5);
  }
  return table;
}

void check_maps(const Surface& surface, Preview preview) {
  const Camera& camera = surface.camera;
  require(camera.width > 0 && camera.height > 0, "write_png: the surface's camera has no pixels");
  const auto pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  const auto check_map = [&](const char* name, std::size_t size) {
    require(size == pixels, std::string("write_png: map ") + name + " has " + std::to_string(size) +
                                " pixels, wanted " + std::to_string(pixels) +
                                " (extract with it among Parameters::aovs, and Parameters::image "
                                "set)");
  };
  check_map("Z", surface.depth.size());
  check_map("N", surface.normal.size());
  const Layers& layers = surface.layers;
  if (preview == Preview::glass) {
    require(layers.most > 0,
            "write_png: preview glass wants layers, and the surface has none (set layers when "
            "you extract it)");
    check_map("thickness", layers.thickness.size());
    check_map("layers", layers.count.size());
    check_map("N.back", layers.back_normal.size());
    const std::size_t all = pixels * static_cast<std::size_t>(layers.most);
    require(layers.entry.size() == all && layers.exit.size() == all,
            "write_png: the layers' depths do not fit the camera");
  }
  for (const WhitewaterMaps& maps : surface.whitewater) {
    check_map("coverage", maps.coverage.size());
    if (maps.type == WhitewaterType::bubble) check_map("behind", maps.behind.size());
  }
  if (preview != Preview::groups) return;
  check_map("id", surface.group.size());
  check_map("kind", surface.kind.size());
}

}  // namespace

std::vector<std::uint8_t> draw_preview(const Surface& surface, Preview preview,
                                       const std::function<void(double)>& reached) {
  check_maps(surface, preview);
  const Scene scene(surface);
  constexpr double kScene = 0.1, kColours = 0.75;  // of the time, about, when they are there
  reached(kScene);
  const auto draw = [&] {
    switch (preview) {
      case Preview::lit:
        return draw_lit(scene,
                        [&](double share) { reached(kScene + (kColours - kScene) * share); });
      case Preview::normal:
        return draw_normal(scene);
      case Preview::depth:
        return draw_depth(scene);
      case Preview::groups:
        return draw_groups(scene);
      case Preview::glass:
        return draw_glass(scene,
                          [&](double share) { reached(kScene + (kColours - kScene) * share); });
    }
    throw InvalidArgument("write_png: unknown preview");
  };
  Picture colours = draw();
  reached(kColours);
  Picture picture = smooth_borders(scene, std::move(colours));
  if (preview == Preview::lit || preview == Preview::glass)
    picture = draw_whitewater_over(scene, std::move(picture));
  const std::vector<std::uint8_t> srgb = srgb_table();
  std::vector<std::uint8_t> bytes(3 * picture.size());
  const auto byte_of = [&](float channel) {
    return srgb[static_cast<std::size_t>(share(channel) * 65535 + 0.5f)];
  };
  parallel_pixels(scene, [&](int, int, std::size_t k) {
    bytes[3 * k] = byte_of(picture[k].x);
    bytes[3 * k + 1] = byte_of(picture[k].y);
    bytes[3 * k + 2] = byte_of(picture[k].z);
  });
  reached(1);
  return bytes;
}

}  // namespace meniscus
