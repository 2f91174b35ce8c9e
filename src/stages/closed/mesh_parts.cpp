#include "stages/closed/mesh_parts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "meniscus/error.hpp"

namespace meniscus {
namespace {

constexpr const char* kApart = "mesh_parts: two parts differ in what lies between them";
constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();

// Every vertex of a cell, in the order of the mesh.
template <class Visit>
void each_vertex(const DualMesh& mesh, Visit&& visit) {
  for (const SurfaceCell& cell : mesh.cells)
    for (std::uint32_t piece = 0; piece < cell.pieces; ++piece)
      visit(cell, cell.first + piece, 4u * cell.bit + piece);
}

// The blocks of all parts in the order of the whole mesh, and where each one's vertices begin.
struct Row {
  std::uint32_t round;
  std::uint64_t key;
  std::size_t part, place;  // among the part's blocks
  std::uint32_t first = 0;  // vertex
  bool operator<(const Row& other) const {
    return std::tie(round, key) < std::tie(other.round, other.key);
  }
};

// Where what each block of a part has begins.
struct Starts {
  std::vector<std::size_t> vertex, between, triangle;
};
Starts starts_of(const MeshPart& part) {
  Starts starts{{0}, {0}, {0}};
  for (const MeshPart::Block& block : part.blocks) {
    starts.vertex.push_back(starts.vertex.back() + block.vertices);
    starts.between.push_back(starts.between.back() + block.between);
    starts.triangle.push_back(starts.triangle.back() + block.triangles);
  }
  return starts;
}

// Joins the parts of a mesh, step by step.
class Joining {
 public:
  explicit Joining(std::vector<MeshPart> parts) : parts_(std::move(parts)) {
    for (const MeshPart& part : parts_) starts_.push_back(starts_of(part));
    order_blocks();
  }

  JoinedMesh joined() {
    place_vertices();
    take_vertices();
    take_triangles(places_of_others());
    return std::move(joined_);
  }

 private:
  void order_blocks() {
    for (std::size_t p = 0; p < parts_.size(); ++p)
      for (std::size_t b = 0; b < parts_[p].blocks.size(); ++b)
        rows_.push_back({parts_[p].blocks[b].round, parts_[p].blocks[b].key, p, b});
    std::sort(rows_.begin(), rows_.end());
    for (Row& row : rows_) {
      const MeshPart::Block& block = parts_[row.part].blocks[row.place];
      row.first = static_cast<std::uint32_t>(vertices_);
      vertices_ += block.vertices;
      triangles_ += block.triangles;
      require(vertices_ < kNowhere && triangles_ < kNowhere,
              "the mesh has more than 2^32 vertices or triangles (use a larger " + setting("cell") +
                  ")");
    }
  }

  // Vertices of cells go where their blocks are, those between behind them.
  void place_vertices() {
    for (const MeshPart& part : parts_) joined_.place.emplace_back(part.position.size(), kNowhere);
    std::map<std::tuple<std::uint64_t, std::uint32_t, std::uint32_t>, std::uint32_t> between;
    for (const Row& row : rows_) {
      const Starts& start = starts_[row.part];
      std::vector<std::uint32_t>& place = joined_.place[row.part];
      for (std::size_t v = start.vertex[row.place]; v < start.vertex[row.place + 1]; ++v)
        place[v] = row.first + static_cast<std::uint32_t>(v - start.vertex[row.place]);
      for (std::size_t k = start.between[row.place]; k < start.between[row.place + 1]; ++k) {
        const MeshPart::Name& name = parts_[row.part].between[k];
        const auto next = static_cast<std::uint32_t>(vertices_ + between.size());
        place[start.vertex.back() + k] =
            between.try_emplace({name.block, name.vertex, name.axis}, next).first->second;
      }
    }
    vertices_ += between.size();
  }

  void take_vertices() {
    DualMesh& mesh = joined_.mesh;
    mesh.position.resize(vertices_);
    mesh.normal.resize(vertices_);
    mesh.sharp.resize(vertices_);
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      for (std::size_t v = 0; v < parts_[p].position.size(); ++v) {
        mesh.position[joined_.place[p][v]] = parts_[p].position[v];
        mesh.normal[joined_.place[p][v]] = Vec3d(parts_[p].normal[v]);
      }
      parts_[p].position = {};
      parts_[p].normal = {};
    }
  }

  // [parts][others] where the vertices of other parts are.
  std::vector<std::vector<std::uint32_t>> places_of_others() const {
    std::vector<const Row*> by_key;
    for (const Row& row : rows_) by_key.push_back(&row);
    std::sort(by_key.begin(), by_key.end(),
              [](const Row* a, const Row* b) { return a->key < b->key; });
    const auto place_of = [&](const MeshPart::Name& name) {
      const auto found =
          std::lower_bound(by_key.begin(), by_key.end(), name.block,
                           [](const Row* row, std::uint64_t key) { return row->key < key; });
      require(found != by_key.end() && (*found)->key == name.block, kApart);
      const Row& row = **found;
      const auto first = parts_[row.part].vertex.begin() +
                         static_cast<std::ptrdiff_t>(starts_[row.part].vertex[row.place]);
      const auto last = first + parts_[row.part].blocks[row.place].vertices;
      const auto vertex = std::lower_bound(first, last, name.vertex);
      require(vertex != last && *vertex == name.vertex, kApart);
      return row.first + static_cast<std::uint32_t>(vertex - first);
    };
    std::vector<std::vector<std::uint32_t>> others(parts_.size());
    for (std::size_t p = 0; p < parts_.size(); ++p)
      for (const MeshPart::Name& name : parts_[p].others) others[p].push_back(place_of(name));
    return others;
  }

  void take_triangles(const std::vector<std::vector<std::uint32_t>>& others) {
    joined_.mesh.triangle.resize(triangles_);
    std::size_t next = 0;
    for (const Row& row : rows_) {
      const Starts& start = starts_[row.part];
      const std::vector<std::uint32_t>& place = joined_.place[row.part];
      for (std::size_t t = start.triangle[row.place]; t < start.triangle[row.place + 1]; ++t) {
        auto& made = joined_.mesh.triangle[next++];
        for (std::size_t c = 0; c < 3; ++c) {
          const std::uint32_t v = parts_[row.part].triangle[t][c];
          made[c] = v < place.size() ? place[v] : others[row.part][v - place.size()];
        }
      }
    }
  }

  std::vector<MeshPart> parts_;
  std::vector<Starts> starts_;  // [parts]
  std::vector<Row> rows_;
  std::uint64_t vertices_ = 0, triangles_ = 0;  // of the whole mesh
  JoinedMesh joined_;
};

}  // namespace

CornerBox corners_of(const BlockBox& blocks, int more) {
  CornerBox corners;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (blocks.low[axis] != -BlockBox::kAll)
      corners.low[axis] = std::int64_t{kBlockSide} * blocks.low[axis] - more;
    if (blocks.high[axis] != BlockBox::kAll)
      corners.high[axis] = std::int64_t{kBlockSide} * blocks.high[axis] + more;
  }
  return corners;
}

SpaceBox space_of(const BlockBox& blocks, double cell, int more) {
  const CornerBox corners = corners_of(blocks, more);
  const auto at = [cell](std::int64_t corner) {
    return std::abs(corner) < CornerBox::kAll ? cell * static_cast<double>(corner)
                                              : std::copysign(SpaceBox::kFar, corner);
  };
  SpaceBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.low[axis] = at(corners.low[axis]);
    box.high[axis] = at(corners.high[axis]);
  }
  return box;
}

MeshPart part_of(const SpaceGrid& grid, const DualMesh& mesh, const std::vector<std::size_t>& added,
                 const BlockBox& own) {
  MeshPart part;
  const auto is_own = [&](std::int32_t block) {
    return own.holds(grid.blocks[static_cast<std::size_t>(block)].at);
  };
  const auto name_of = [&](const SurfaceCell& cell, std::uint32_t vertex) {
    return MeshPart::Name{key_of(grid.blocks[static_cast<std::size_t>(cell.block)].at), vertex, 0};
  };
  std::vector<std::uint32_t> vertices(grid.blocks.size()), between(grid.blocks.size());
  std::vector<std::uint32_t> place(mesh.position.size(), kNowhere);  // in the part
  const auto take = [&](std::size_t v) {
    place[v] = static_cast<std::uint32_t>(part.position.size());
    part.position.push_back(mesh.position[v]);
    part.normal.push_back(static_cast<Vec3>(mesh.normal[v]));
  };
  each_vertex(mesh, [&](const SurfaceCell& cell, std::uint32_t v, std::uint32_t name) {
    if (!is_own(cell.block)) return;
    ++vertices[static_cast<std::size_t>(cell.block)];
    part.vertex.push_back(static_cast<std::uint8_t>(name));
    take(v);
  });
  const std::size_t of_cells = mesh.position.size() - mesh.between.size();
  for (std::size_t k = 0; k < mesh.between.size(); ++k) {
    const VertexBetween& one = mesh.between[k];
    const SurfaceCell& cell = mesh.cells[one.cell];
    MeshPart::Name name = name_of(cell, 4u * cell.bit);
    name.axis = static_cast<std::uint32_t>(one.axis);
    part.between.push_back(name);
    ++between[static_cast<std::size_t>(one.block)];
    take(of_cells + k);
  }
  // Vertices of others that its triangles have, in the order of the mesh.
  for (const auto& t : mesh.triangle)
    for (const std::uint32_t v : t)
      if (place[v] == kNowhere) place[v] = kNowhere - 1;
  std::uint32_t next = static_cast<std::uint32_t>(part.position.size());
  each_vertex(mesh, [&](const SurfaceCell& cell, std::uint32_t v, std::uint32_t name) {
    if (place[v] != kNowhere - 1) return;
    part.others.push_back(name_of(cell, name));
    place[v] = next++;
  });
  part.triangle = mesh.triangle;
  for (auto& t : part.triangle)
    for (std::uint32_t& v : t) v = place[v];
  std::uint32_t round = 0;
  for (std::size_t b = 0; b < grid.blocks.size(); ++b) {
    while (b >= added[round]) ++round;
    if (vertices[b] + between[b] + mesh.triangles_of[b] > 0)
      part.blocks.push_back(
          {key_of(grid.blocks[b].at), round, vertices[b], between[b], mesh.triangles_of[b]});
  }
  return part;
}

JoinedMesh join_parts(std::vector<MeshPart> parts) { return Joining(std::move(parts)).joined(); }

}  // namespace meniscus
