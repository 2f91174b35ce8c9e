#include "stages/mesh/mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>

#include "meniscus/error.hpp"
#include "stages/mesh/silhouettes.hpp"

namespace meniscus {
namespace {

// Cuts keep this distance from the nodes, in cells, so that no triangle is a needle's point.
constexpr double kCutMargin = 0.02;

// (u, v) in pixels and q, a depth in which planes are affine over the screen: 1/w in perspective,
// the depth itself in an orthographic view. Blends of such points of a plane stay on it.
struct ScreenPoint {
  double u = 0, v = 0, q = 0;
};

ScreenPoint towards(const ScreenPoint& from, const ScreenPoint& a, const ScreenPoint& b,
                    double share) {
  return {from.u + share * (0.5 * (a.u + b.u) - from.u),
          from.v + share * (0.5 * (a.v + b.v) - from.v),
          from.q + share * (0.5 * (a.q + b.q) - from.q)};
}

struct Vertex {
  ScreenPoint at;
  Vec3 normal;     // eye axes; zero where unknown
  int edge = -1;   // the silhouette edge it lies on
  int layer = -1;  // the node whose layer continues to it, for all on an edge but the front one
  int link[2] = {-1, -1};  // its neighbours along the silhouette
};

// Takes out of the normals at a triangle's vertices what points behind it.
void turn_towards(const std::vector<Vec3d>& position, const std::array<std::uint32_t, 3>& triangle,
                  std::vector<Vec3d>& normals) {
  const auto& [a, b, c] = triangle;
  const Vec3d facing =
      normalized(cross(position[b] - position[a], position[c] - position[a]), {0, 0, 0});
  for (const std::uint32_t vertex : triangle) {
    const double behind = dot(normals[vertex], facing);
    const Vec3d turned = normals[vertex] - behind * facing;
    if (behind < 0 && length(turned) > 0) normals[vertex] = normalized(turned);
  }
}

// Makes the mesh in steps; the constructor lists them.
class Mesher {
 public:
  Mesher(const View& view, const SurfaceMap& nodes, const std::vector<SilhouetteEdge>& edges,
         const MeshParams& params)
      : view_(view), nodes_(nodes), edges_(edges), z_max_(params.z_max) {
    index_edges();
    add_nodes();
    add_edge_vertices();
    for (int j = 0; j + 1 < nodes.grid.ny; ++j)
      for (int i = 0; i + 1 < nodes.grid.nx; ++i) mesh_cell(cell_at(i, j));
    smooth_silhouette(params.silhouette_rounds);
  }

  Mesh unprojected() const;

 private:
  struct Cell {
    std::array<int, 4> corner;  // node indices, counter-clockwise seen from the camera
    std::array<int, 4> cut;     // silhouette edge between corner k and k + 1, or -1
    bool odd;                   // every other cell: its sheets are cut along the other diagonal
  };

  // Corners of a cell between two cuts, all of one layer.
  struct Run {
    int first, last;  // corners; the cut after `last` has its number
    float depth;      // of the deepest one
  };

  bool has_surface(int node) const { return std::isfinite(nodes_.depth[node]); }
  double q_of(double depth) const;
  double depth_of(double q) const;
  ScreenPoint node_point(int node) const;
  double slope(int node, int axis) const;
  double layer_q(int node, double u, double v) const;
  int side(int edge, int node) const {
    return edges_[edge].front == node ? front_vertex_[edge] : back_vertex_[edge];
  }

  void index_edges();
  void add_nodes();
  void add_edge_vertices();
  int add_layer_vertex(int edge, int node);
  Cell cell_at(int i, int j) const;
  void mesh_cell(const Cell& cell);
  void tear_cell(const Cell& cell);
  int join_opposite(const Cell& cell);
  std::vector<Run> runs_of(const Cell& cell, int joined) const;
  void mesh_run(const Cell& cell, const Run& run, bool fills_middle);
  // Of corner k of a cell, counted around it; where the cut after corner k is on `corner`'s side.
  float depth(const Cell& cell, int k) const { return nodes_.depth[cell.corner[k % 4]]; }
  int vertex(const Cell& cell, int k) const { return vertex_of_node_[cell.corner[k % 4]]; }
  int cut_vertex(const Cell& cell, int k, int corner) const {
    return side(cell.cut[k % 4], cell.corner[corner % 4]);
  }
  void close_sheet(std::span<const int> polygon, std::size_t apex);
  void link(int a, int b);
  void smooth_silhouette(int rounds);
  void follow_front();
  void restore_folds(const std::vector<ScreenPoint>& before);
  std::vector<std::array<std::uint32_t, 3>> wound_triangles() const;
  std::vector<Vec3d> eye_normals(const std::vector<Vec3d>& eye,
                                 const std::vector<std::array<std::uint32_t, 3>>& triangles) const;

  const View& view_;
  const SurfaceMap& nodes_;
  const std::vector<SilhouetteEdge>& edges_;
  const double z_max_;
  std::vector<int> edge_right_, edge_down_;      // [ny*nx] silhouette edge to that neighbour, or -1
  std::vector<int> vertex_of_node_;              // [ny*nx]
  std::vector<int> front_vertex_, back_vertex_;  // [edges]
  std::vector<Vertex> vertices_;
  std::vector<std::array<int, 3>> triangles_;
};

double Mesher::q_of(double depth) const {
  return view_.orthographic ? depth : 1 / (view_.w_row[3] - view_.w_row[2] * depth);
}

double Mesher::depth_of(double q) const {
  return view_.orthographic ? q : (view_.w_row[3] - 1 / q) / view_.w_row[2];
}

ScreenPoint Mesher::node_point(int node) const {
  const SampleGrid& grid = nodes_.grid;
  return {grid.first + double{grid.step} * (node % grid.nx),
          grid.first + double{grid.step} * (node / grid.nx), q_of(nodes_.depth[node])};
}

void Mesher::index_edges() {
  const int nx = nodes_.grid.nx;
  const int size = static_cast<int>(nodes_.grid.size());
  edge_right_.assign(size, -1);
  edge_down_.assign(size, -1);
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const auto& edge = edges_[e];
    const std::string where = "mesh: silhouette edge " + std::to_string(e);
    const int first = std::min(edge.front, edge.back), last = std::max(edge.front, edge.back);
    const bool right = last == first + 1 && last % nx != 0;
    require(first >= 0 && last < size && (right || last == first + nx),
            where + " joins nodes " + std::to_string(edge.front) + " and " +
                std::to_string(edge.back) + ", which are not neighbours");
    require(has_surface(edge.front),
            where + " has no surface at its front node " + std::to_string(edge.front));
    require(edge.cut >= 0 && edge.cut <= 1,
            where + " has its cut at " + std::to_string(edge.cut) + ", must be in [0, 1]");
    int& slot = right ? edge_right_[first] : edge_down_[first];
    require(slot < 0, where + " is given twice");
    slot = static_cast<int>(e);
  }
  for (int node = 0; node < size; ++node) {
    const bool missing_right =
        (node + 1) % nx != 0 && edge_right_[node] < 0 && has_surface(node) != has_surface(node + 1);
    const bool missing_down =
        node + nx < size && edge_down_[node] < 0 && has_surface(node) != has_surface(node + nx);
    if (missing_right || missing_down)
      throw InvalidArgument("mesh: node " + std::to_string(node) + " and the next one " +
                            (missing_right ? "right" : "down") +
                            " are surface and none but no silhouette edge lies between them");
  }
}

void Mesher::add_nodes() {
  vertex_of_node_.assign(nodes_.grid.size(), -1);
  vertices_.reserve(nodes_.grid.size() + 3 * edges_.size());
  triangles_.reserve(2 * nodes_.grid.size());
  for (int node = 0; node < static_cast<int>(nodes_.grid.size()); ++node) {
    if (!has_surface(node)) continue;
    vertex_of_node_[node] = static_cast<int>(vertices_.size());
    Vertex vertex;
    vertex.at = node_point(node);
    if (!nodes_.normal.empty()) vertex.normal = nodes_.normal[node];
    vertices_.push_back(vertex);
  }
}

// How q changes from one node to the next along an axis (0: u, 1: v), from the neighbours that
// belong to the same layer.
double Mesher::slope(int node, int axis) const {
  const int nx = nodes_.grid.nx;
  const int step = axis == 0 ? 1 : nx;
  const int position = axis == 0 ? node % nx : node / nx;
  const int count = axis == 0 ? nx : nodes_.grid.ny;
  const auto& cut = axis == 0 ? edge_right_ : edge_down_;
  const double here = q_of(nodes_.depth[node]);
  double sum = 0;
  int sides = 0;
  if (position > 0 && cut[node - step] < 0) sum += here - q_of(nodes_.depth[node - step]), ++sides;
  if (position + 1 < count && cut[node] < 0) sum += q_of(nodes_.depth[node + step]) - here, ++sides;
  return sides ? sum / sides : 0;
}

// The layer of a node, continued as a plane to (u, v). Its depth changes by at most z_max per
// cell and never more than that in all, so that a layer does not pass the one it lies behind.
double Mesher::layer_q(int node, double u, double v) const {
  const ScreenPoint at = node_point(node);
  const double du = (u - at.u) / nodes_.grid.step, dv = (v - at.v) / nodes_.grid.step;
  const double q = at.q + du * slope(node, 0) + dv * slope(node, 1);
  const double depth = nodes_.depth[node];
  const double limit = z_max_ * std::min(1.0, std::abs(du) + std::abs(dv));
  const double least = std::max(depth - limit, 0.5 * depth), most = depth + limit;
  if (!view_.orthographic && !(q > 0)) return q_of(most);
  const double continued = depth_of(q);
  return continued < least ? q_of(least) : continued > most ? q_of(most) : q;
}

int Mesher::add_layer_vertex(int edge, int node) {
  Vertex vertex;
  const ScreenPoint& front = vertices_[front_vertex_[edge]].at;
  vertex.at = {front.u, front.v, layer_q(node, front.u, front.v)};
  vertex.edge = edge;
  vertex.layer = node;
  if (!nodes_.normal.empty()) vertex.normal = nodes_.normal[node];
  vertices_.push_back(vertex);
  return static_cast<int>(vertices_.size()) - 1;
}

void Mesher::add_edge_vertices() {
  for (const SilhouetteEdge& edge : edges_) {
    const double cut = std::clamp(double{edge.cut}, kCutMargin, 1 - kCutMargin);
    const ScreenPoint a = node_point(edge.front);
    const int nx = nodes_.grid.nx;
    const double step = nodes_.grid.step;
    Vertex front;
    front.at.u = a.u + cut * step * (edge.back % nx - edge.front % nx);
    front.at.v = a.v + cut * step * (edge.back / nx - edge.front / nx);
    front.edge = static_cast<int>(front_vertex_.size());
    if (std::abs(edge.surface.depth - nodes_.depth[edge.front]) <= z_max_) {
      front.at.q = q_of(edge.surface.depth);
      front.normal = edge.surface.normal;
    } else {
      front.at.q = layer_q(edge.front, front.at.u, front.at.v);
      if (!nodes_.normal.empty()) front.normal = nodes_.normal[edge.front];
    }
    front_vertex_.push_back(static_cast<int>(vertices_.size()));
    vertices_.push_back(front);
    back_vertex_.push_back(has_surface(edge.back) ? add_layer_vertex(front.edge, edge.back) : -1);
  }
}

void Mesher::link(int a, int b) {
  const auto add = [&](int from, int to) {
    Vertex& vertex = vertices_[from];
    vertex.link[vertex.link[0] < 0 ? 0 : 1] = to;
  };
  add(a, b);
  add(b, a);
}

// Cuts a convex polygon into a fan around one of its vertices.
void Mesher::close_sheet(std::span<const int> polygon, std::size_t apex) {
  const std::size_t n = polygon.size();
  for (std::size_t k = 1; k + 1 < n; ++k)
    triangles_.push_back({polygon[apex], polygon[(apex + k) % n], polygon[(apex + k + 1) % n]});
}

// The four corners hang together all around but for one jump: a tear that ends in this cell. It
// ends at a vertex of its own in the middle, so that several tears never meet in one vertex.
void Mesher::tear_cell(const Cell& cell) {
  const int k = static_cast<int>(
      std::find_if(cell.cut.begin(), cell.cut.end(), [](int e) { return e >= 0; }) -
      cell.cut.begin());
  Vertex middle;
  std::vector<int> polygon{0, side(cell.cut[k], cell.corner[(k + 1) % 4])};
  for (int m = 1; m <= 4; ++m) {
    const int vertex = vertex_of_node_[cell.corner[(k + m) % 4]];
    polygon.push_back(vertex);
    const ScreenPoint& at = vertices_[vertex].at;
    middle.at = {middle.at.u + 0.25 * at.u, middle.at.v + 0.25 * at.v, middle.at.q + 0.25 * at.q};
  }
  polygon.push_back(side(cell.cut[k], cell.corner[k]));
  polygon[0] = static_cast<int>(vertices_.size());
  vertices_.push_back(middle);
  close_sheet(polygon, 0);
  link(polygon[0], polygon[1]);
  link(polygon.back(), polygon[0]);
}

Mesher::Cell Mesher::cell_at(int i, int j) const {
  const int nx = nodes_.grid.nx, node = j * nx + i;
  return {{node, node + nx, node + nx + 1, node + 1},
          {edge_down_[node], edge_right_[node + nx], edge_down_[node + 1], edge_right_[node]},
          ((i + j) & 1) != 0};
}

void Mesher::mesh_cell(const Cell& cell) {
  const auto cuts = 4 - std::count(cell.cut.begin(), cell.cut.end(), -1);
  if (cuts == 0) {
    if (has_surface(cell.corner[0]))
      close_sheet(std::array{vertex(cell, 0), vertex(cell, 1), vertex(cell, 2), vertex(cell, 3)},
                  cell.odd ? 1 : 0);
    return;
  }
  if (cuts == 1) return tear_cell(cell);
  const int joined = cuts == 4 ? join_opposite(cell) : -1;
  const std::vector<Run> runs = runs_of(cell, joined);
  // With three or four cuts the middle of the cell goes to the deepest layer, which hides nothing.
  const auto deepest = std::max_element(
      runs.begin(), runs.end(), [](const Run& a, const Run& b) { return a.depth < b.depth; });
  for (auto run = runs.begin(); run != runs.end(); ++run)
    mesh_run(cell, *run, cuts > 2 && joined < 0 && run == deepest);
}

// Joins two opposite corners of one layer in a cell of four cuts, the nearer pair if both are of
// one. Returns the first corner of the pair; -1: no pair is of one layer.
int Mesher::join_opposite(const Cell& cell) {
  int joined = -1;
  for (int d = 0; d < 2; ++d)
    if (std::abs(depth(cell, d) - depth(cell, d + 2)) <= z_max_ &&
        (joined < 0 ||
         std::min(depth(cell, 1), depth(cell, 3)) < std::min(depth(cell, 0), depth(cell, 2))))
      joined = d;
  if (joined < 0) return joined;
  const int d = joined;
  const std::vector<int> polygon{cut_vertex(cell, d + 3, d), vertex(cell, d),
                                 cut_vertex(cell, d, d),     cut_vertex(cell, d + 1, d + 2),
                                 vertex(cell, d + 2),        cut_vertex(cell, d + 2, d + 2)};
  close_sheet(polygon, cell.odd ? 4 : 1);
  link(polygon[2], polygon[3]);
  link(polygon[5], polygon[0]);
  return joined;
}

// The runs of corners with surface that were not joined with the opposite ones.
std::vector<Mesher::Run> Mesher::runs_of(const Cell& cell, int joined) const {
  std::vector<Run> runs;
  for (int k = 0; k < 4; ++k) {
    if (cell.cut[k] < 0) continue;
    Run run{k + 1, k + 1, depth(cell, k + 1)};
    while (cell.cut[run.last % 4] < 0) run.depth = std::max(run.depth, depth(cell, ++run.last));
    const bool in_joined = joined >= 0 && (run.first - joined) % 2 == 0;
    if (std::isfinite(run.depth) && !in_joined) runs.push_back(run);
  }
  return runs;
}

// Closes the sheet of a run between the cuts at its ends; one that fills the middle of the cell
// goes on to all its other cuts.
void Mesher::mesh_run(const Cell& cell, const Run& run, bool fills_middle) {
  std::vector<int> polygon{cut_vertex(cell, run.first + 3, run.first)};
  for (int k = run.first; k <= run.last; ++k) polygon.push_back(vertex(cell, k));
  const std::size_t last_corner = polygon.size() - 1;
  polygon.push_back(cut_vertex(cell, run.last, run.last));
  if (fills_middle)
    for (int k = run.last + 1; k < run.first + 3; ++k)
      if (cell.cut[k % 4] >= 0)
        polygon.push_back(add_layer_vertex(cell.cut[k % 4], cell.corner[run.first % 4]));
  close_sheet(polygon, cell.odd ? last_corner : 1);
  for (std::size_t k = last_corner + 1; k < polygon.size(); ++k)
    link(polygon[k], polygon[(k + 1) % polygon.size()]);
}

// Vertices behind the front one of their edge stay under it, on their own layer.
void Mesher::follow_front() {
  for (Vertex& vertex : vertices_) {
    if (vertex.layer < 0) continue;
    const ScreenPoint& front = vertices_[front_vertex_[vertex.edge]].at;
    vertex.at = {front.u, front.v, layer_q(vertex.layer, front.u, front.v)};
  }
}

// Smooths the silhouette along itself, not towards the nodes as Mueller et al. do: that would pull
// the layers on its two sides apart. A round is a step half way to the mean of the two neighbours
// and then the same step backwards; what alternates from vertex to vertex vanishes, and what is
// long stays: a wave with Laplacian eigenvalue k is damped by 1 - k^2 / 4 (Taubin 1995).
void Mesher::smooth_silhouette(int rounds) {
  std::vector<ScreenPoint> before, next(edges_.size());
  for (const int front : front_vertex_) before.push_back(vertices_[front].at);
  for (int round = 0; round < rounds; ++round)
    for (const double share : {0.5, -0.5}) {
      for (std::size_t e = 0; e < edges_.size(); ++e) {
        const Vertex& front = vertices_[front_vertex_[e]];
        const auto& [a, b] = front.link;
        next[e] = b < 0 ? front.at : towards(front.at, vertices_[a].at, vertices_[b].at, share);
      }
      for (std::size_t e = 0; e < edges_.size(); ++e) vertices_[front_vertex_[e]].at = next[e];
      follow_front();
    }
  if (rounds > 0) restore_folds(before);
}

// Puts back the cuts that smoothing moved off their layer or over a triangle's other side.
void Mesher::restore_folds(const std::vector<ScreenPoint>& before) {
  std::vector<char> restored(edges_.size(), 0);
  const auto restore = [&](int edge) {
    if (edge < 0 || restored[edge]) return false;
    restored[edge] = 1;
    vertices_[front_vertex_[edge]].at = before[edge];
    return true;
  };
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const double q = vertices_[front_vertex_[e]].at.q;
    const bool valid = view_.orthographic || q > 0;
    if (!valid || !(std::abs(depth_of(q) - nodes_.depth[edges_[e].front]) <= z_max_))
      restore(static_cast<int>(e));
  }
  for (bool changed = true; changed;) {
    changed = false;
    follow_front();
    for (const auto& triangle : triangles_) {
      const ScreenPoint &a = vertices_[triangle[0]].at, &b = vertices_[triangle[1]].at,
                        &c = vertices_[triangle[2]].at;
      // v runs down: counter-clockwise to the eye is a negative area.
      if ((b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u) < 0) continue;
      for (const int vertex : triangle) changed |= restore(vertices_[vertex].edge);
    }
  }
}

// The triangles, counter-clockwise in eye space.
std::vector<std::array<std::uint32_t, 3>> Mesher::wound_triangles() const {
  // Right and down on the screen are right and down in eye space, unless the camera mirrors.
  const bool mirrored = view_.u_row[0] * view_.v_row[1] - view_.u_row[1] * view_.v_row[0] > 0;
  std::vector<std::array<std::uint32_t, 3>> wound;
  wound.reserve(triangles_.size());
  for (const auto& [a, b, c] : triangles_) {
    const std::array<int, 3> t = mirrored ? std::array{a, c, b} : std::array{a, b, c};
    wound.push_back({static_cast<std::uint32_t>(t[0]), static_cast<std::uint32_t>(t[1]),
                     static_cast<std::uint32_t>(t[2])});
  }
  return wound;
}

// The vertices' normals in eye space: those that are known, else those of the triangles around.
std::vector<Vec3d> Mesher::eye_normals(
    const std::vector<Vec3d>& eye,
    const std::vector<std::array<std::uint32_t, 3>>& triangles) const {
  std::vector<Vec3d> area(vertices_.size());
  std::vector<char> bridging(vertices_.size(), 0);
  for (const auto& triangle : triangles) {
    const auto& [a, b, c] = triangle;
    const Vec3d normal = cross(eye[b] - eye[a], eye[c] - eye[a]);
    for (const std::uint32_t vertex : triangle) area[vertex] += normal;
    // A steep triangle that bridges a step of the depth map is seen by neither side's normal.
    for (const std::uint32_t vertex : triangle)
      if (dot(Vec3d(vertices_[vertex].normal), normal) < 0) bridging[vertex] = 1;
  }
  std::vector<Vec3d> normals;
  normals.reserve(vertices_.size());
  for (std::size_t k = 0; k < vertices_.size(); ++k) {
    const Vec3d known(vertices_[k].normal);
    normals.push_back(normalized(length(known) > 0.5 && !bridging[k] ? known : area[k]));
  }
  // Where large triangles outvote such a steep one, what points behind it is taken out, which may
  // turn a normal behind another triangle again. All others agree with their vertices.
  std::vector<std::array<std::uint32_t, 3>> steep;
  for (const auto& triangle : triangles)
    if (bridging[triangle[0]] || bridging[triangle[1]] || bridging[triangle[2]])
      steep.push_back(triangle);
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round)
    for (const auto& triangle : steep) turn_towards(eye, triangle, normals);
  return normals;
}

Mesh Mesher::unprojected() const {
  std::vector<Vec3d> eye;
  eye.reserve(vertices_.size());
  for (const Vertex& vertex : vertices_)
    eye.push_back(point_at(view_, vertex.at.u, vertex.at.v, depth_of(vertex.at.q)));
  Mesh mesh;
  mesh.triangle = wound_triangles();
  const std::vector<Vec3d> normals = eye_normals(eye, mesh.triangle);
  mesh.position.reserve(vertices_.size());
  mesh.normal.reserve(vertices_.size());
  for (std::size_t k = 0; k < vertices_.size(); ++k) {
    mesh.position.push_back(Vec3(world_from_eye(view_, eye[k])));
    mesh.normal.push_back(Vec3(world_direction(view_, normals[k])));
  }
  return mesh;
}

}  // namespace

Mesh make_mesh(const View& view, const SurfaceMap& nodes, const std::vector<SilhouetteEdge>& edges,
               const MeshParams& params) {
  check_nodes(nodes);
  require(params.z_max > 0, "mesh: z_max is " + std::to_string(params.z_max) + ", must be > 0");
  if (nodes.grid.nx < 2 || nodes.grid.ny < 2) return {};
  return Mesher(view, nodes, edges, params).unprojected();
}

}  // namespace meniscus
