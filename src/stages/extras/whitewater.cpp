#include "stages/extras/whitewater.hpp"

#include <bit>
#include <cmath>
#include <limits>

#include "base/exact_math.hpp"
#include "base/parallel.hpp"
#include "device/kernels.hpp"
#include "stages/frame/project.hpp"

namespace meniscus {
namespace {

std::size_t pixels_of(const View& view) { return pixel_grid(view).size(); }

std::size_t rows_of(bool moves, bool lies_behind) {
  return 2 + (moves ? 3u : 0u) + (lies_behind ? 1u : 0u);
}

// Steps of velocity per world unit per second: a power of two, so that a particle radius per second
// is one or two. It cancels.
double speed_steps(const View& view) {
  int exponent = 0;
  std::frexp(view.radius, &exponent);
  return std::ldexp(1.0, 1 - exponent);
}

// Rows of sums, which take two words a pixel.
class Rows {
 public:
  Rows(const cl_uint* words, std::size_t pixels) : words_(words), pixels_(pixels) {}
  double at(std::size_t row, std::size_t pixel) const {
    const cl_uint* const low = words_ + 2 * row * pixels_ + pixel;
    const std::uint64_t bits = std::uint64_t{low[pixels_]} << 32 | low[0];
    return static_cast<double>(static_cast<std::int64_t>(bits)) * 0x1p-32;
  }
  bool any(std::size_t pixel) const { return (words_[pixel] | words_[pixels_ + pixel]) != 0; }

 private:
  const cl_uint* words_;
  std::size_t pixels_;
};

}  // namespace

ShownDepths shown_depths(Device& device, const View& view, WhitewaterType type,
                         const std::vector<float>& depth, const std::vector<float>& exit,
                         double tolerance) {
  const std::size_t pixels = depth.size();
  const bool within = type == WhitewaterType::bubble;
  Upload<float> from(device, pixels), to(device, pixels);
  for (std::size_t s = 0; s < pixels; ++s) {
    const double front = depth[s] / view.radius;
    from[s] = within ? static_cast<float>(front - tolerance) : 0;
    to[s] = !within        ? static_cast<float>(front + tolerance)
            : exit.empty() ? std::numeric_limits<float>::max()
                           : static_cast<float>(exit[s] / view.radius);
  }
  return {from.done(), to.done(), within ? static_cast<float>(tolerance) : 0};
}

WhitewaterSums no_whitewater(Device& device, const View& view, bool moves, bool lies_behind) {
  const std::size_t rows = rows_of(moves, lies_behind), pixels = pixels_of(view);
  require(2 * rows * pixels < (std::size_t{1} << 31),
          "whitewater: an image of " + std::to_string(pixels) + " pixels is too large");
  return {moves, lies_behind, filled<cl_uint>(device, 2 * rows * pixels, 0),
          filled<cl_uint>(device, pixels, std::bit_cast<cl_uint>(kNoSurface))};
}

void draw_whitewater(Device& device, const View& view, const WhitewaterParticles& particles,
                     std::size_t count, const ShownDepths& shown, const WhitewaterSums& sums) {
  const records::Whitewater how{static_cast<int>(count),
                                view.width,
                                view.height,
                                sums.moves ? 1 : 0,
                                sums.lies_behind ? 1 : 0,
                                static_cast<float>(1 / view.radius),
                                static_cast<float>(speed_steps(view)),
                                shown.slack};
  launch(device, kernels::draw_whitewater, 1, {count}, particles, particles.radius, particles,
         shown, sums.sum, sums.depth, projection_of(view, 0), how);
}

WhitewaterMaps finish_whitewater(Device& device, const View& view, WhitewaterType type,
                                 const WhitewaterSums& sums) {
  const std::size_t pixels = pixels_of(view);
  const HostView words(device, sums.sum), nearest(device, sums.depth);
  const Rows rows(words.data(), pixels);
  const double speed = speed_steps(view);
  WhitewaterMaps maps{.type = type};
  maps.coverage.resize(pixels);
  maps.density.resize(pixels);
  maps.depth.resize(pixels, kNoSurface);
  if (sums.moves) maps.velocity.resize(pixels);
  if (sums.lies_behind) maps.behind.resize(pixels);
  constexpr std::size_t kGrain = 16384;  // pixels that are worth a thread
  parallel_for(pixels, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      if (!rows.any(s)) continue;
      const double density = rows.at(0, s);
      maps.density[s] = static_cast<float>(density);
      // 1 - 2^-x
      maps.coverage[s] = static_cast<float>(1 - exp_negative(-0.6931471805599453 * rows.at(1, s)));
      maps.depth[s] = world_depth(view, std::bit_cast<float>(nearest[s]));
      const auto mean = [&](std::size_t row, double scale) {
        return static_cast<float>(rows.at(row, s) / density * scale);
      };
      if (sums.moves)
        maps.velocity[s] = {mean(2, 1 / speed), mean(3, 1 / speed), mean(4, 1 / speed)};
      if (sums.lies_behind) maps.behind[s] = mean(sums.moves ? 5 : 2, view.radius);
    }
  });
  return maps;
}

}  // namespace meniscus
