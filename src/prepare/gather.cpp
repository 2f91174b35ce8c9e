#include "prepare/gather.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "base/parallel.hpp"
#include "base/team.hpp"
#include "device/kernels.hpp"
#include "stages/frame/project.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kBytesPerParticle = 16;  // x, y, z and a place in the list

records::FrontCells cells_of(const FrontMap& map) {
  return {map.nx,    map.ny,      static_cast<float>(1 / map.cell), static_cast<float>(map.border),
          map.block, map.blocks_x};
}

// The buffers that every chunk passes through.
struct ChunkBuffers {
  Buffer<float> x, y, z;
  ChunkBuffers(Device& device, std::size_t chunk)
      : x(allocate<float>(device, chunk)),
        y(allocate<float>(device, chunk)),
        z(allocate<float>(device, chunk)) {}
  void fill(Device& device, const ParticleChunk& chunk) {
    const std::size_t bytes = chunk.count * sizeof(float);
    device.state().write_bytes(x.memory, chunk.x.data(), bytes);
    device.state().write_bytes(y.memory, chunk.y.data(), bytes);
    device.state().write_bytes(z.memory, chunk.z.data(), bytes);
  }
};

FrontMap sized_map(const View& view, double cell, double border, double margin) {
  FrontMap map;
  map.cell = cell;
  map.border = static_cast<int>(std::ceil(border / cell));
  map.nx = static_cast<int>(std::ceil(view.width / cell)) + 2 * map.border;
  map.ny = static_cast<int>(std::ceil(view.height / cell)) + 2 * map.border;
  map.margin = margin;
  return map;
}

// Calls work(row) for the rows [first, end) of a map.
template <class Work>
void for_rows(int first, int end, const Work& work) {
  constexpr std::size_t kRows = 16;  // that are worth a thread
  parallel_for(static_cast<std::size_t>(std::max(0, end - first)), kRows,
               [&](std::size_t from, std::size_t to) {
                 for (std::size_t row = from; row < to; ++row) work(first + static_cast<int>(row));
               });
}

// Fills empty cells among full ones with the farthest of these: particles of one layer leave cells
// empty by chance, which are no gaps. A cell counts as such with five full neighbours of eight.
std::vector<float> without_pores(const FrontMap& map, std::vector<float> front) {
  constexpr int kRounds = 2, kEnough = 5;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<float> filled = front;
    for_rows(1, map.ny - 1, [&](int j) {
      for (int i = 1; i + 1 < map.nx; ++i) {
        const std::size_t here = static_cast<std::size_t>(j) * map.nx + i;
        if (front[here] < kNoSurface) continue;
        int full = 0;
        float farthest = 0;
        for (int dj = -1; dj <= 1; ++dj)
          for (int di = -1; di <= 1; ++di) {
            const float depth = front[here + static_cast<std::ptrdiff_t>(dj) * map.nx + di];
            if (!(depth < kNoSurface)) continue;
            ++full;
            farthest = std::max(farthest, depth);
          }
        if (full >= kEnough) filled[here] = farthest;
      }
    });
    front.swap(filled);
  }
  return front;
}

// Moves cells that stand out alone or in pairs back among their neighbours: loose particles before
// a layer, which would hide it. (They stay in front of what is returned, and are of the front.)
std::vector<float> without_specks(const FrontMap& map, const std::vector<float>& front) {
  constexpr std::size_t kPair = 2;
  std::vector<float> result = front;
  for_rows(1, map.ny - 1, [&](int j) {
    for (int i = 1; i + 1 < map.nx; ++i) {
      const std::size_t here = static_cast<std::size_t>(j) * map.nx + i;
      if (!(front[here] < kNoSurface)) continue;
      std::array<float, 9> around{};
      std::size_t n = 0;
      for (int dj = -1; dj <= 1; ++dj)
        for (int di = -1; di <= 1; ++di)
          around[n++] = front[here + static_cast<std::ptrdiff_t>(dj) * map.nx + di];
      std::nth_element(around.begin(), around.begin() + kPair, around.end());
      if (around[kPair] < kNoSurface) result[here] = std::max(front[here], around[kPair]);
    }
  });
  return result;
}

// The front with its slopes and its thickness in depth. Of the slopes to the two sides the flatter
// is taken, and none where they disagree: it does not lead over an edge.
std::vector<cl_float4> layer_of(const View& view, const FrontMap& map,
                                const std::vector<float>& front, double thickness) {
  const auto flatter = [](float before, float here, float after) {
    const float a = here - before, b = after - here;  // not finite beside a gap
    if (!std::isfinite(a) || !std::isfinite(b))
      return std::isfinite(a) ? a : std::isfinite(b) ? b : 0.0f;
    if ((a > 0) != (b > 0)) return 0.0f;
    return std::abs(a) < std::abs(b) ? a : b;
  };
  std::vector<cl_float4> layer(front.size());
  for_rows(0, map.ny, [&](int j) {
    for (int i = 0; i < map.nx; ++i) {
      const std::size_t here = static_cast<std::size_t>(j) * map.nx + i;
      const float depth = front[here];
      layer[here] = {{depth, 0, 0, 0}};
      if (!(depth < kNoSurface)) continue;
      const float u = flatter(i > 0 ? front[here - 1] : kNoSurface, depth,
                              i + 1 < map.nx ? front[here + 1] : kNoSurface);
      const float v = flatter(j > 0 ? front[here - map.nx] : kNoSurface, depth,
                              j + 1 < map.ny ? front[here + map.nx] : kNoSurface);
      // Radii that a cell spans at this depth, and from there how steep the layer is.
      const double w = view.w_row[3] - view.w_row[2] * depth;
      const double along_u = map.cell * w / view.u_scale, along_v = map.cell * w / view.v_scale;
      const double du = u / along_u, dv = v / along_v, steep = std::sqrt(1 + du * du + dv * dv);
      layer[here] = {{depth, u, v, static_cast<float>(thickness * steep)}};
    }
  });
  return layer;
}

// The largest value within `reach` of each along one axis of a map.
std::vector<float> widened(const std::vector<float>& values, int nx, int ny, int reach,
                           bool along_x) {
  std::vector<float> result(values.size());
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      float largest = 0;
      for (int d = -reach; d <= reach; ++d) {
        const int a = along_x ? std::clamp(i + d, 0, nx - 1) : i;
        const int b = along_x ? j : std::clamp(j + d, 0, ny - 1);
        largest = std::max(largest, values[static_cast<std::size_t>(b) * nx + a]);
      }
      result[static_cast<std::size_t>(j) * nx + i] = largest;
    }
  return result;
}

void set_limits(FrontMap& map, const std::vector<float>& front, const FrontSearch& search) {
  map.block = std::max(1, static_cast<int>(std::lround(search.block / map.cell)));
  map.blocks_x = (map.nx + map.block - 1) / map.block;
  map.blocks_y = (map.ny + map.block - 1) / map.block;
  std::vector<float> farthest(static_cast<std::size_t>(map.blocks_x) * map.blocks_y, 0.0f);
  parallel_for(static_cast<std::size_t>(map.blocks_y), 4, [&](std::size_t first, std::size_t last) {
    const int end = std::min(static_cast<int>(last) * map.block, map.ny);
    for (int j = static_cast<int>(first) * map.block; j < end; ++j)
      for (int i = 0; i < map.nx; ++i) {
        float& most =
            farthest[static_cast<std::size_t>(j / map.block) * map.blocks_x + i / map.block];
        most = std::max(most, front[static_cast<std::size_t>(j) * map.nx + i]);
      }
  });
  const int steps = static_cast<int>(std::ceil(search.around / (map.block * map.cell)));
  farthest = widened(farthest, map.blocks_x, map.blocks_y, steps, true);
  farthest = widened(farthest, map.blocks_x, map.blocks_y, steps, false);
  for (float& depth : farthest) depth += static_cast<float>(search.reach);
  map.limit = std::move(farthest);
}

}  // namespace

std::size_t map_size(const View& view, double cell, double border) {
  const FrontMap map = sized_map(view, cell, border, 0);
  return (sizeof(cl_uint) + sizeof(cl_float4) + sizeof(float)) * static_cast<std::size_t>(map.nx) *
         static_cast<std::size_t>(map.ny);
}

std::size_t chunk_size(std::size_t memory, std::size_t map_bytes) {
  const std::size_t least = map_bytes + chunk_within(0, kBytesPerParticle) * kBytesPerParticle;
  if (memory < least)
    throw InvalidArgument(Notice{.code = Code::memory_too_small,
                                 .text = setting("memory") + " is " + std::to_string(memory) +
                                         " bytes, must be at least " + std::to_string(least) +
                                         " for an image of this size",
                                 .subject = "memory",
                                 .found = static_cast<double>(memory),
                                 .wanted = static_cast<double>(least)});
  return chunk_within(memory - map_bytes, kBytesPerParticle);
}

FrontMap empty_map(Device& device, const View& view, double margin) {
  FrontMap map = sized_map(view, std::max(view.width, view.height), 0, margin);
  map.layer = upload(device, std::vector<cl_float4>(static_cast<std::size_t>(map.nx) * map.ny,
                                                    cl_float4{{kNoSurface, 0, 0, 0}}));
  map.block = std::max(map.nx, map.ny);
  map.limit = {kNoSurface};
  return map;
}

FrontMap find_fronts(Device& device, const View& view, const ParticleSource& source,
                     std::size_t chunk, const FrontSearch& search) {
  FrontMap map = sized_map(view, search.cell, search.border, search.margin);
  const std::size_t size = static_cast<std::size_t>(map.nx) * map.ny;
  const auto fronts = filled<cl_uint>(device, size, std::bit_cast<cl_uint>(kNoSurface));
  const records::Projection to = projection_of(view, map.margin);
  const records::FrontCells cells = cells_of(map);
  ChunkBuffers buffers(device, chunk);
  const std::size_t width = static_cast<std::size_t>(device.state().vector_width);
  for_each_chunk(source, chunk, {}, [&](const ParticleChunk& now) {
    buffers.fill(device, now);
    launch(device, kernels::find_fronts, device.state().vector_width,
           {(now.count + width - 1) / width}, buffers, fronts, static_cast<cl_int>(now.count), to,
           cells);
  });

  std::vector<cl_uint> bits = download(device, fronts);
  source.team().minimum(bits);  // positive floats order as their bits do
  std::vector<float> front(size);
  for (std::size_t k = 0; k < size; ++k) front[k] = std::bit_cast<float>(bits[k]);
  front = without_pores(map, std::move(front));
  map.layer = upload(device, layer_of(view, map, without_specks(map, front), search.thickness));
  set_limits(map, front, search);
  return map;
}

void select_near(
    Device& device, const View& view, const ParticleSource& source, std::size_t chunk,
    const FrontMap& map, const ChunkValues& also,
    const std::function<void(const ParticleChunk&, const std::vector<cl_uint>&)>& take) {
  const records::Projection to = projection_of(view, map.margin);
  const records::FrontCells cells = cells_of(map);
  ChunkBuffers buffers(device, chunk);
  const std::size_t width = static_cast<std::size_t>(device.state().vector_width);
  const Buffer<cl_uint> selected = allocate<cl_uint>(device, chunk);
  const Buffer<float> limit = upload(device, map.limit);
  // A chunk's particles are taken while the device looks at the next one's.
  ParticleChunk before;
  std::vector<cl_uint> places;
  for_each_chunk(source, chunk, also, [&](ParticleChunk& now) {
    buffers.fill(device, now);
    const Buffer<cl_int> count = filled<cl_int>(device, 1, 0);
    launch(device, kernels::select_near, device.state().vector_width,
           {(now.count + width - 1) / width}, buffers, map.layer, limit, selected, count,
           static_cast<cl_int>(now.count), to, cells);
    device.state().flush();
    if (!places.empty()) take(before, places);
    places.resize(static_cast<std::size_t>(download(device, count)[0]));
    if (!places.empty())
      device.state().read_bytes(selected.memory, places.data(), places.size() * sizeof(cl_uint));
    std::swap(now, before);
  });
  if (!places.empty()) take(before, places);
}

}  // namespace meniscus
