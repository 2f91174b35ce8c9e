// OpenVDB's way from particles to a mesh: spheres as a level set (tools::ParticlesToLevelSet),
// widened, smoothed by mean curvature and narrowed again (tools::LevelSetFilter), as a mesh
// (tools::VolumeToMesh).
//   openvdb_mesh POSITIONS MESH.ply RADIUS [VOXEL SPHERE DILATE ROUNDS LEVEL]
// POSITIONS: rows of three floats. Lengths but RADIUS are in particle radii. The settings were
// searched by hand (meniscus-accuracy closed --scene sphere,waves,box,capsules,sheet --seeds 1):
// spheres of 1.5 to 2.5, widened by 0 to 1, 0 to 40 rounds, levels .5 to 1.4.
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/LevelSetFilter.h>
#include <openvdb/tools/ParticlesToLevelSet.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <vector>

namespace {

using Position = std::array<float, 3>;

struct Spheres {
  using PosType = openvdb::Vec3R;
  std::vector<Position> at;
  std::size_t size() const { return at.size(); }
  void getPos(std::size_t n, openvdb::Vec3R& xyz) const { xyz = {at[n][0], at[n][1], at[n][2]}; }
};

std::vector<Position> read_positions(const char* path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<Position> positions;
  for (Position p; file.read(reinterpret_cast<char*>(p.data()), sizeof p);) positions.push_back(p);
  return positions;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(
        stderr,
        "usage: openvdb_mesh POSITIONS MESH.ply RADIUS [VOXEL SPHERE DILATE ROUNDS LEVEL]\n");
    return 2;
  }
  const auto number = [&](int k, double otherwise) {
    return argc > k ? std::strtod(argv[k], nullptr) : otherwise;
  };
  const double r = number(3, 1), voxel = number(4, 0.5) * r, sphere = number(5, 2) * r,
               dilate = number(6, 1) * r, level = number(8, 0.75) * r;
  const int rounds = static_cast<int>(number(7, 20));

  openvdb::initialize();
  const Spheres spheres{read_positions(argv[1])};
  const double band = 3 + (dilate + level) / voxel;
  openvdb::FloatGrid::Ptr grid = openvdb::createLevelSet<openvdb::FloatGrid>(voxel, band);
  openvdb::tools::ParticlesToLevelSet<openvdb::FloatGrid> raster(*grid);
  raster.rasterizeSpheres(spheres, sphere);
  raster.finalize(true);
  openvdb::tools::LevelSetFilter<openvdb::FloatGrid> filter(*grid);
  if (dilate > 0) filter.offset(static_cast<float>(-dilate));
  for (int k = 0; k < rounds; ++k) filter.meanCurvature();
  if (dilate + level != 0) filter.offset(static_cast<float>(dilate + level));

  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(*grid, points, triangles, quads, 0.0, 0.0);

  std::ofstream out(argv[2], std::ios::binary);
  out << "ply\nformat binary_little_endian 1.0\nelement vertex " << points.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty "
         "float "
         "ny\nproperty float nz\nelement face "
      << triangles.size() + 2 * quads.size()
      << "\nproperty list uchar int vertex_indices\nend_header\n";
  const openvdb::tools::GridSampler<openvdb::FloatGrid, openvdb::tools::BoxSampler> sampler(*grid);
  for (const openvdb::Vec3s& p : points) {
    const openvdb::Vec3R at(p);
    openvdb::Vec3R n;
    for (int axis = 0; axis < 3; ++axis) {
      openvdb::Vec3R step(0.0);
      step[axis] = voxel;
      n[axis] = sampler.wsSample(at + step) - sampler.wsSample(at - step);
    }
    n.normalize();
    const float row[6] = {p.x(), p.y(), p.z(), float(n.x()), float(n.y()), float(n.z())};
    out.write(reinterpret_cast<const char*>(row), sizeof row);
  }
  // OpenVDB's faces turn clockwise seen from outside.
  const auto face = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const std::uint32_t corner[3] = {a, c, b};
    out.put(3);
    out.write(reinterpret_cast<const char*>(corner), sizeof corner);
  };
  for (const openvdb::Vec3I& t : triangles) face(t[0], t[1], t[2]);
  for (const openvdb::Vec4I& q : quads) {
    face(q[0], q[1], q[2]);
    face(q[0], q[2], q[3]);
  }
  out.close();
  return out ? 0 : 1;
}
