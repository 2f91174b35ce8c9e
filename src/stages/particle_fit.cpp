#include "stages/particle_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "parallel.hpp"
#include "stages/sheet.hpp"

namespace meniscus {
namespace {

constexpr char kFiles[] = "fit.cl particle_fit.cl";

// The most slots that 32-bit indices reach.
constexpr std::size_t kMostSlots = std::size_t{1} << 28;

constexpr float kEdgeReach = 4;          // particle radii
constexpr float kHeight = 0.6f;          // h_0 of fit_particles, particle radii
constexpr float kHeightGrowth = 0.075f;  // h_1, 1 / particle radii

// Where supports are narrowed: what residual noise alone explains (particle radii, and against the
// frame's least), and over which fits residuals are averaged.
constexpr double kNoise = 0.14, kOverLeast = 1.5;
constexpr SheetWeights kSheet{6, 0.8f, 0.95f};

constexpr std::size_t kRecord = 4;   // values of a particle's records, see particle_fit.cl
constexpr std::size_t kLanes = 16;   // fits of a batch, whatever the device's WIDTH
constexpr std::size_t kBlock = 256;  // fits that a processor takes at a time: whole batches

// The lists of fits [begin, end) by themselves.
FitLists list_block(const Projected& projected, const std::vector<std::int32_t>& centre,
                    const std::vector<std::int32_t>& place, const Cells& cells, float reach,
                    std::size_t begin, std::size_t end) {
  const cl_int nobody = static_cast<cl_int>(cells.item.size());
  std::vector<std::int32_t> near;  // 1 for those of a range that are
  std::vector<cl_int> all;
  std::vector<std::size_t> start{0};
  for (std::size_t k = begin; k < end; ++k) {
    const std::int32_t i = centre[k];
    const float x = projected.x[i], y = projected.y[i], z = projected.z[i];
    std::size_t count = start.back();
    visit_ranges_near(
        cells, x, y, z, [&](std::int32_t first, std::int32_t last, std::uint32_t tag) {
          const std::size_t most = static_cast<std::size_t>(last - first);
          if (near.size() < most) near.resize(most);
          if (all.size() < count + most) all.resize(2 * (count + most));
          // A loop that becomes vectors, and one without branches, which would be foretold badly.
          for (std::int32_t p = first; p < last; ++p) {
            const float dx = cells.x[p] - x, dy = cells.y[p] - y, dz = cells.z[p] - z;
            near[p - first] =
                (dx * dx + dy * dy + dz * dz < reach * reach) & same_row(cells.tag[p], tag);
          }
          for (std::int32_t p = first; p < last; ++p) {
            all[count] = cells.item[p];
            count += static_cast<std::size_t>(near[p - first]);
          }
          return true;
        });
    start.push_back(count);
  }
  FitLists lists;
  // Fits with about as many neighbours share a batch; the order touches no result.
  const auto size_of = [&](std::int32_t k) {
    const std::size_t l = static_cast<std::size_t>(k) - begin;
    return start[l + 1] - start[l];
  };
  lists.fit.resize(end - begin);
  std::iota(lists.fit.begin(), lists.fit.end(), static_cast<std::int32_t>(begin));
  std::sort(lists.fit.begin(), lists.fit.end(), [&](std::int32_t k, std::int32_t l) {
    return std::pair(size_of(k), k) < std::pair(size_of(l), l);
  });
  std::size_t slots = 0;
  for (std::size_t lane = 0; lane < lists.fit.size(); lane += kLanes) {
    const std::size_t longest = size_of(lists.fit[std::min(lane + kLanes, lists.fit.size()) - 1]);
    lists.first.push_back(static_cast<cl_int>(slots));
    lists.length.push_back(static_cast<cl_int>(longest));
    slots += kLanes * longest;
  }
  lists.neighbour.resize(slots, nobody);
  for (std::size_t l = 0; l < lists.fit.size(); ++l) {
    const std::size_t k = static_cast<std::size_t>(lists.fit[l]) - begin;
    cl_int* slot = lists.neighbour.data() + lists.first[l / kLanes] + l % kLanes;
    for (std::size_t p = start[k]; p < start[k + 1]; ++p, slot += kLanes) *slot = all[p];
  }
  for (const std::int32_t k : lists.fit)
    lists.particle.push_back(place[static_cast<std::size_t>(k)]);
  lists.fit.resize(kLanes * lists.first.size(), -1);
  lists.particle.resize(lists.fit.size(), nobody);
  return lists;
}

// The lists of blocks of fits.
std::vector<FitLists> list_blocks(const Projected& projected,
                                  const std::vector<std::int32_t>& centre,
                                  const std::vector<std::int32_t>& around, double reach) {
  const Cells cells = cells_of(projected, around, reach);
  const std::vector<std::int32_t> place = places_in(around, centre);
  const std::size_t n = centre.size();
  std::vector<FitLists> blocks((n + kBlock - 1) / kBlock);
  parallel_for(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t block = begin; block < end; ++block)
      blocks[block] = list_block(projected, centre, place, cells, static_cast<float>(reach),
                                 block * kBlock, std::min(n, (block + 1) * kBlock));
  });
  return blocks;
}

using Blocks = std::span<const FitLists>;

std::size_t slots_of(Blocks blocks) {
  std::size_t slots = 0;
  for (const FitLists& block : blocks) slots += block.neighbour.size();
  return slots;
}

// Calls make(part) for as many blocks at a time as make at most so many slots, or for one.
template <class Make>
void in_parts(Blocks blocks, std::size_t most_slots, const Make& make) {
  while (!blocks.empty()) {
    std::size_t count = 1, slots = blocks[0].neighbour.size();
    for (; count < blocks.size(); ++count) {
      slots += blocks[count].neighbour.size();
      if (slots > most_slots) break;
    }
    make(blocks.first(count));
    blocks = blocks.subspan(count);
  }
}

// Some blocks' lists as one; the neighbours go to `neighbour`, which has room for their slots.
FitLists joined(Blocks blocks, cl_int* neighbour) {
  FitLists all;
  std::vector<std::size_t> from;  // first slot of each block
  std::size_t slots = 0;
  for (auto block = blocks.begin(); block != blocks.end(); ++block) {
    all.fit.insert(all.fit.end(), block->fit.begin(), block->fit.end());
    all.particle.insert(all.particle.end(), block->particle.begin(), block->particle.end());
    all.length.insert(all.length.end(), block->length.begin(), block->length.end());
    for (const cl_int first : block->first) all.first.push_back(static_cast<cl_int>(slots) + first);
    from.push_back(slots);
    slots += block->neighbour.size();
  }
  parallel_for(from.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      const std::vector<cl_int>& own = blocks[k].neighbour;
      std::copy(own.begin(), own.end(), neighbour + from[k]);
    }
  });
  return all;
}

std::size_t most_slots(Device& device) {
  return std::min(most_values<float>(device), kMostSlots - 1);
}

// Lists on the device, and the fits of their lanes.
struct Lanes {
  const FitLists& lists;
  const Buffer<cl_int>&particle, &neighbour, &first, &length;
  Buffer<float> support;   // [lanes] rho, particle radii
  Buffer<float> quadric;   // [10][lanes] through the particles
  Buffer<float> residual;  // [lanes] particle radii; negative: no fit
  Buffer<float> weight;    // [slots] of the last pass
};

// The supports of the lanes' fits.
Buffer<float> supports(Device& device, const FitLists& lists, const std::vector<float>& rho) {
  std::vector<float> support(lists.fit.size(), 1.0f);
  for (std::size_t l = 0; l < lists.fit.size(); ++l)
    if (lists.fit[l] >= 0) support[l] = rho[static_cast<std::size_t>(lists.fit[l])];
  return upload(device, support);
}

// The residual of each fit; negative: no fit.
std::vector<float> residuals(Device& device, const std::vector<Lanes>& parts, std::size_t fits) {
  std::vector<float> residual(fits);
  for (const Lanes& part : parts) {
    const HostView of_lane(device, part.residual);
    for (std::size_t l = 0; l < part.lists.fit.size(); ++l)
      if (part.lists.fit[l] >= 0)
        residual[static_cast<std::size_t>(part.lists.fit[l])] = of_lane[l];
  }
  return residual;
}

// The normals in records at some places.
std::vector<Vec3d> normals_of(Device& device, const Buffer<float>& records,
                              const std::vector<std::int32_t>& place) {
  const HostView record(device, records);
  std::vector<Vec3d> normals;
  normals.reserve(place.size());
  for (const std::int32_t i : place) {
    const float* const n = record.data() + kRecord * static_cast<std::size_t>(i);
    normals.push_back({n[0], n[1], n[2]});
  }
  return normals;
}

// The fits' supports for the last pass, see fit_particles.
std::vector<float> narrow_supports(Device& device, const std::vector<Vec3d>& position,
                                   const std::vector<Vec3d>& normal,
                                   const std::vector<float>& residual, const FitParams& params) {
  const std::size_t fits = position.size();
  std::vector<float> rho(fits, static_cast<float>(params.support));
  std::vector<float> fitted(fits), sorted;
  for (std::size_t k = 0; k < fits; ++k) {
    fitted[k] = residual[k] > 0 ? 1 : 0;
    if (residual[k] > 0) sorted.push_back(residual[k]);
  }
  if (sorted.empty()) return rho;
  const auto least = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 20);
  std::nth_element(sorted.begin(), least, sorted.end());
  const double noise = std::max(kOverLeast * *least, kNoise);
  const std::vector<float> mean =  // of one value: the second is not needed
      average_on_sheets(device, position, normal, fitted, {residual, residual}, kSheet)[0];
  for (std::size_t k = 0; k < fits; ++k) {
    if (!(mean[k] > 0)) continue;
    const double share = noise / mean[k];
    rho[k] =
        static_cast<float>(params.support * std::clamp(share * share, params.least_support, 1.0));
  }
  return rho;
}

}  // namespace

FitRecords fit_records(const Projected& projected, const SurfaceParticles& around) {
  const std::size_t n = around.index.size();
  FitRecords records{std::vector<float>(kRecord * (n + 1)), std::vector<float>(kRecord * (n + 1))};
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = static_cast<std::size_t>(around.index[k]);
    float* const place = &records.place[kRecord * k];
    float* const normal = &records.normal[kRecord * k];
    place[0] = projected.x[i];
    place[1] = projected.y[i];
    place[2] = projected.z[i];
    place[3] = static_cast<float>(around.weight[k]);
    normal[0] = static_cast<float>(around.normal[k].x);
    normal[1] = static_cast<float>(around.normal[k].y);
    normal[2] = static_cast<float>(around.normal[k].z);
  }
  return records;
}

std::vector<FitLists> list_neighbours(const Projected& projected,
                                      const std::vector<std::int32_t>& centre,
                                      const std::vector<std::int32_t>& around, double reach,
                                      std::size_t most_slots) {
  std::vector<FitLists> parts;
  in_parts(list_blocks(projected, centre, around, reach), most_slots, [&](Blocks blocks) {
    std::vector<cl_int> neighbour(slots_of(blocks));
    parts.push_back(joined(blocks, neighbour.data()));
    parts.back().neighbour = std::move(neighbour);
  });
  return parts;
}

FitNeighbours find_neighbours(Device& device, const Projected& projected,
                              const std::vector<std::int32_t>& centre,
                              const std::vector<std::int32_t>& around, const FitParams& params) {
  FitNeighbours neighbours;
  const std::vector<FitLists> blocks = list_blocks(projected, centre, around, params.support);
  in_parts(blocks, most_slots(device), [&](Blocks part) {
    const std::size_t slots = slots_of(part);
    require(slots < kMostSlots,
            "fit: too many points for 32-bit indices (use a smaller --support)");
    Upload<cl_int> neighbour(device, slots);
    FitLists lists = joined(part, neighbour.data());
    const auto particle = upload(device, lists.particle), first = upload(device, lists.first),
               length = upload(device, lists.length);
    neighbours.parts.push_back({std::move(lists), particle, neighbour.done(), first, length});
  });
  return neighbours;
}

ParticleFits fit_particles(Device& device, const Projected& projected, const Visible& seen,
                           const SurfaceParticles& around, const FitNeighbours& neighbours,
                           const FitParams& params) {
  const std::size_t count = seen.index.size();
  ParticleFits fits;
  if (count == 0) return fits;
  const FitRecords records = fit_records(projected, around);
  const auto places = upload(device, records.place);
  Buffer<float> normals = upload(device, records.normal), turned = upload(device, records.normal);
  std::vector<float> rho(count, static_cast<float>(params.support));
  std::vector<Lanes> parts;
  for (const FitNeighbours::Part& part : neighbours.parts) {
    const std::size_t lanes = part.lists.fit.size();
    parts.push_back({part.lists, part.particle, part.neighbour, part.first, part.length,
                     supports(device, part.lists, rho), allocate<float>(device, 10 * lanes),
                     allocate<float>(device, lanes), allocate<float>(device, part.neighbour.size)});
  }
  const float falloff = static_cast<float>(2 / (params.normal_sigma * params.normal_sigma));
  const cl_float4 weighing{{falloff, static_cast<float>(params.tau), kHeight, kHeightGrowth}};
  const cl_float2 fitting{
      {static_cast<float>(params.off_surface), static_cast<float>(params.ridge)}};
  const int width = device.state().wide_width();
  // Few items of much work: small work-groups spread them over the compute units.
  const auto items = [width](const Lanes& part) {
    return Range{part.residual.size / static_cast<std::size_t>(width), 1, 8, 1};
  };
  std::vector<std::int32_t> place;
  for (int pass = 0; pass < params.passes; ++pass) {
    const int left = params.passes - 1 - pass;
    if (pass > 0 && left == 0 && params.least_support < 1) {
      rho = narrow_supports(device, fits.position, normals_of(device, normals, place),
                            residuals(device, parts, count), params);
      for (Lanes& part : parts) part.support = supports(device, part.lists, rho);
    }
    for (const Lanes& part : parts)
      launch(device, kFiles, "fit_particles", items(part), width_option(width), places, normals,
             part.particle, part.neighbour, part.first, part.length, part.support, part.quadric,
             part.residual, part.weight, turned, static_cast<cl_int>(part.residual.size),
             static_cast<cl_int>(around.index.size()), cl_int{pass}, cl_int{left}, weighing,
             fitting);
    std::swap(normals, turned);
    if (pass > 0) continue;
    // While the device is at the first pass.
    place = places_in(around.index, seen.index);
    fits.position.reserve(count);
    for (const std::int32_t i : seen.index)
      fits.position.push_back(projected.eye(static_cast<std::size_t>(i)));
    for (std::size_t k = 0; k < count; ++k) {
      fits.visible.push_back(visibility(seen.owned[k]));
      fits.surface.push_back(around.weight[static_cast<std::size_t>(place[k])]);
    }
    fits.foot = fits.position;
    fits.edge.resize(count);
    fits.spread.resize(count);
    fits.supporters.resize(count);
    fits.quadric.resize(count);
  }
  std::vector<Buffer<float>> rows;
  for (const Lanes& part : parts) {
    const std::size_t lanes = part.residual.size;
    rows.push_back(allocate<float>(device, 3 * lanes));
    launch(device, kFiles, "measure_edges", items(part), width_option(width), places, normals,
           part.particle, part.neighbour, part.first, part.length, part.support, part.quadric,
           part.weight, part.residual, rows.back(), static_cast<cl_int>(lanes), falloff,
           static_cast<float>(params.tau), kEdgeReach);
  }
  fits.normal = normals_of(device, normals, place);
  fits.support.assign(rho.begin(), rho.end());
  fits.residual = residuals(device, parts, count);
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const std::size_t lanes = parts[part].residual.size;
    const HostView c(device, parts[part].quadric), row(device, rows[part]);
    constexpr std::size_t kGrain = 1024;  // lanes that are worth a thread
    parallel_for(lanes, kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t l = begin; l < end; ++l) {
        if (parts[part].lists.fit[l] < 0) continue;
        const std::size_t k = static_cast<std::size_t>(parts[part].lists.fit[l]);
        fits.edge[k] = row[l];
        fits.spread[k] = row[lanes + l];
        fits.supporters[k] = row[2 * lanes + l];
        std::array<float, 10>& quadric = fits.quadric[k];
        for (std::size_t r = 0; r < 10; ++r) quadric[r] = c[r * lanes + l];
        if (fits.residual[k] < 0) continue;
        const double behind = std::clamp(-double{quadric[0]}, -1.0, 1.0);
        fits.foot[k] += fits.normal[k] * (params.offset + behind);
        quadric[0] -= static_cast<float>(params.offset);
      }
    });
  }
  return fits;
}

}  // namespace meniscus
