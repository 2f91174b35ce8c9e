#include <cmath>
#include <memory>

#include "kernels/cases.hpp"
#include "kernels/native/native.hpp"
#include "stages/fit.hpp"
#include "stages/surface.hpp"

namespace meniscus::bench {
namespace {

struct Problems {
  FitBatches batches;
  std::vector<float> points, scale, quadric, quality;
  double count = 0, used = 0;  // fits; points of all of them
  DeviceFits device;
  native::Fits input{};
};

// A fit around each visible particle to the visible ones around it.
std::shared_ptr<Problems> problems_of(Frame& frame) {
  const Visible& visible = frame.visible();
  const Projected& projected = frame.projected();
  const std::vector<Vec3d>& normals = frame.normals();
  const double reach = frame.params.fit.support;
  const Cells cells = cells_of(projected, visible.index, reach);
  std::vector<std::vector<std::int32_t>> near;
  std::vector<std::size_t> sizes;
  for (std::size_t k = 0; k < visible.index.size(); ++k) {
    const Vec3d centre = projected.eye(static_cast<std::size_t>(visible.index[k]));
    near.emplace_back();
    visit_near(cells, static_cast<float>(centre.x), static_cast<float>(centre.y),
               static_cast<float>(centre.z), [&](std::int32_t p) {
                 const Vec3d apart = Vec3d{cells.x[p], cells.y[p], cells.z[p]} - centre;
                 if (length(apart) < reach) near.back().push_back(p);
                 return true;
               });
    sizes.push_back(near.back().size());
  }
  const auto problems = std::make_shared<Problems>();
  FitBatches& batches = problems->batches = make_batches(sizes);
  problems->count = static_cast<double>(sizes.size());
  const std::size_t slots = batches.slots, lanes = batches.lanes;
  problems->points.assign(7 * slots, 0.0f);
  problems->scale.assign(lanes, static_cast<float>(reach));
  problems->quadric.assign(10 * lanes, 0.0f);
  problems->quality.assign(2 * lanes, -1.0f);
  // The cells' item is a place in visible.index, as are the normals.
  for (std::size_t l = 0; l < sizes.size(); ++l) {
    const std::size_t k = static_cast<std::size_t>(batches.order[l]);
    const Vec3d centre = projected.eye(static_cast<std::size_t>(visible.index[k]));
    std::size_t slot = batches.first_slot(l);
    for (const std::int32_t p : near[k]) {
      const Vec3d q = (Vec3d{cells.x[p], cells.y[p], cells.z[p]} - centre) / reach;
      const Vec3d n = normals[static_cast<std::size_t>(cells.item[p])];
      const double agree = std::max(0.0, dot(n, normals[k]));
      const double row[7] = {q.x, q.y, q.z, n.x, n.y, n.z, (1 - dot(q, q)) * agree};
      for (std::size_t r = 0; r < 7; ++r)
        problems->points[r * slots + slot] = static_cast<float>(row[r]);
      slot += 8;
    }
    problems->used += static_cast<double>(near[k].size());
  }
  Device& device = frame.device;
  problems->device = {upload(device, problems->points),
                      upload(device, batches.first),
                      upload(device, batches.length),
                      upload(device, problems->scale),
                      filled<float>(device, 10 * lanes, 0.0f),
                      filled<float>(device, 2 * lanes, -1.0f),
                      lanes,
                      slots};
  const FitParams& params = frame.params.fit;
  problems->input = {problems->points.data(),
                     batches.first.data(),
                     batches.length.data(),
                     problems->scale.data(),
                     problems->quadric.data(),
                     problems->quality.data(),
                     slots,
                     lanes,
                     static_cast<float>(params.off_surface),
                     static_cast<float>(params.tau),
                     static_cast<float>(params.ridge)};
  return problems;
}

}  // namespace

Case prepare_fit(Frame& frame) {
  const auto problems = problems_of(frame);
  Case result;
  result.unit = "fits";
  result.items = problems->count;
  // Seven values a point; a scale read, ten coefficients and two qualities written a fit.
  result.bytes = 28 * problems->used + 52 * problems->count;
  // A point: its two off-surface points 9; three times the moments: weights 9, products 6, sums and
  // products of degree 0 to 2: 10, of degree 3: 20, of degree 4: 30; the right-hand side twice:
  // weight 1, products 9, sums 10; the residual: quadric 18, distance 3, exponential 21, weight 3,
  // sums 4. A fit: ridge 21, Cholesky 415, substitution 200, slope 6, scale 14.
  result.operations = (9 + 3 * 75 + 2 * 20 + 49) * problems->used + 656 * problems->count;
  result.launch = [&frame, problems] {
    fit_batches(frame.device, problems->device, frame.params.fit);
  };
  result.native = [problems](Workers& workers) {
    workers.run(problems->batches.length.size(), 4, [&](std::size_t begin, std::size_t end) {
      native::fit_groups(problems->input, begin, end);
    });
  };
  result.differing = [&frame, problems] {
    return count_differing(problems->quadric, download(frame.device, problems->device.quadric)) +
           count_differing(problems->quality, download(frame.device, problems->device.quality));
  };
  return result;
}

}  // namespace meniscus::bench
