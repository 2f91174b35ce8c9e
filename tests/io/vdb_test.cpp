// Grids of points that OpenVDB itself writes.
#include <gmock/gmock.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointDataGrid.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "io/io_test_support.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

using openvdb::Vec3d;
using openvdb::Vec3f;
using testing::HasSubstr;

const ReadOptions kAll{.attributes = {"temperature", "force"}};

Particles reference() { return read_particles(test_data("formats/numpy_record.npy"), kAll); }

template <class T>
void add(openvdb::points::PointDataGrid& grid, const openvdb::tools::PointIndexGrid& index,
         const std::string& name, const std::vector<T>& values, openvdb::Index stride = 1) {
  openvdb::points::appendAttribute<T>(grid.tree(), name, openvdb::zeroVal<T>(), stride);
  const openvdb::points::PointAttributeVector<T> wrapped(values, stride);
  openvdb::points::populateAttribute<openvdb::points::PointDataTree, openvdb::tools::PointIndexTree,
                                     openvdb::points::PointAttributeVector<T>>(
      grid.tree(), index.tree(), name, wrapped, stride);
}

std::vector<Vec3f> vectors(const std::vector<float>& x, const std::vector<float>& y,
                           const std::vector<float>& z) {
  std::vector<Vec3f> all;
  for (std::size_t i = 0; i < x.size(); ++i) all.emplace_back(x[i], y[i], z[i]);
  return all;
}

/// The particles as a grid, with ids, radii i / 64, and the pair (i, -i).
openvdb::points::PointDataGrid::Ptr grid_of(const Particles& p, openvdb::math::Transform& to,
                                            const std::string& velocity = "v") {
  openvdb::initialize();
  const std::vector<Vec3f> positions = vectors(p.x, p.y, p.z);
  const openvdb::points::PointAttributeVector<Vec3f> wrapped(positions);
  const auto index =
      openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(wrapped, to);
  const auto grid =
      openvdb::points::createPointDataGrid<openvdb::points::NullCodec,
                                           openvdb::points::PointDataGrid>(*index, wrapped, to);
  add(*grid, *index, velocity, vectors(p.vx, p.vy, p.vz));
  add(*grid, *index, "temperature", p.attributes[0].values);
  add(*grid, *index, "force",
      vectors(p.attributes[1].values, p.attributes[2].values, p.attributes[3].values));
  add(*grid, *index, "id", p.id);
  std::vector<float> radii(p.size());
  std::vector<std::int32_t> pairs;
  for (std::size_t i = 0; i < p.size(); ++i) {
    radii[i] = static_cast<float>(i + 1) / 64;
    pairs.push_back(static_cast<std::int32_t>(i));
    pairs.push_back(-static_cast<std::int32_t>(i));
  }
  add(*grid, *index, "pscale", radii);
  add(*grid, *index, "pair", pairs, 2);
  grid->setName("fluid");
  return grid;
}

/// Where each particle of the reference is among those that were read.
std::vector<std::size_t> order_of(const Particles& found, const Particles& wanted) {
  std::vector<std::size_t> order;
  for (const std::int64_t id : wanted.id)
    order.push_back(static_cast<std::size_t>(std::find(found.id.begin(), found.id.end(), id) -
                                             found.id.begin()));
  EXPECT_EQ(std::set<std::size_t>(order.begin(), order.end()).size(), wanted.size());
  return order;
}

std::vector<float> in_order(const std::vector<float>& values,
                            const std::vector<std::size_t>& order) {
  std::vector<float> all;
  for (const std::size_t i : order) all.push_back(values.at(i));
  return all;
}

class Vdb : public InputTest {
 protected:
  std::string written(const std::string& name, const openvdb::GridPtrVec& grids,
                      std::uint32_t compression = openvdb::io::COMPRESS_ACTIVE_MASK |
                                                  openvdb::io::COMPRESS_BLOSC) const {
    const std::string path = write(name, "");
    openvdb::io::File file(path);
    file.setCompression(compression);
    file.write(grids);
    file.close();
    return path;
  }
  static std::string error(const std::string& path, const ReadOptions& options = {}) {
    return text_of_thrown<InputError>([&] { read_particles(path, options); });
  }
};

TEST_F(Vdb, HoldsTheParticlesOfTheNumpyFile) {
  const Particles wanted = reference();
  ASSERT_EQ(wanted.size(), 37u);
  // Coordinates are multiples of 1/1024, so that nothing is rounded on the way.
  for (const float x : wanted.x) ASSERT_EQ(x * 1024, std::trunc(x * 1024));
  const auto to = openvdb::math::Transform::createLinearTransform(.25);
  to->postTranslate(Vec3d(.5, -.25, 1.125));
  const auto grid = grid_of(wanted, *to);
  for (const std::uint32_t compression :
       {openvdb::io::COMPRESS_NONE + 0u, openvdb::io::COMPRESS_ZIP + 0u,
        (0u + openvdb::io::COMPRESS_ACTIVE_MASK) | openvdb::io::COMPRESS_BLOSC}) {
    ReadOptions options = kAll;
    options.attributes.push_back("Pair");
    const Particles found = read_particles(written("p.vdb", {grid}, compression), options);
    ASSERT_EQ(found.size(), wanted.size());
    const auto order = order_of(found, wanted);
    EXPECT_EQ(in_order(found.x, order), wanted.x);
    EXPECT_EQ(in_order(found.y, order), wanted.y);
    EXPECT_EQ(in_order(found.z, order), wanted.z);
    EXPECT_EQ(in_order(found.vx, order), wanted.vx);
    EXPECT_EQ(in_order(found.vy, order), wanted.vy);
    EXPECT_EQ(in_order(found.vz, order), wanted.vz);
    ASSERT_EQ(found.attributes.size(), 6u);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_EQ(found.attributes[k].name, wanted.attributes[k].name);
      EXPECT_EQ(in_order(found.attributes[k].values, order), wanted.attributes[k].values);
    }
    EXPECT_EQ(found.attributes[4].name, "Pair.0");
    for (std::size_t i = 0; i < order.size(); ++i) {
      EXPECT_EQ(found.radius[order[i]], static_cast<float>(i + 1) / 64);
      EXPECT_EQ(found.attributes[4].values[order[i]], static_cast<float>(i));
      EXPECT_EQ(found.attributes[5].values[order[i]], -static_cast<float>(i));
    }
  }
}

TEST_F(Vdb, FollowsTheTransform) {
  const Particles wanted = reference();
  const auto to = openvdb::math::Transform::createLinearTransform(.1);
  to->postRotate(.7, openvdb::math::Y_AXIS);
  to->postTranslate(Vec3d(10, 20, 30));
  const Particles found =
      read_particles(written("p.vdb", {grid_of(wanted, *to, "velocity")}), ReadOptions{});
  ASSERT_EQ(found.size(), wanted.size());
  EXPECT_FALSE(found.vx.empty());
  const auto order = order_of(found, wanted);
  for (std::size_t i = 0; i < order.size(); ++i) {
    // A place in a voxel is rounded to 2^-25 voxels in each direction of the grid, the rest to a
    // coordinate's float.
    const double most = std::sqrt(3.) * .1 * 0x1p-25 + 0x1p-23;
    EXPECT_NEAR(found.x[order[i]], wanted.x[i], most * std::max(1.f, std::abs(wanted.x[i])));
    EXPECT_NEAR(found.y[order[i]], wanted.y[i], most * std::max(1.f, std::abs(wanted.y[i])));
    EXPECT_NEAR(found.z[order[i]], wanted.z[i], most * std::max(1.f, std::abs(wanted.z[i])));
  }
}

TEST_F(Vdb, ChoosesAmongGrids) {
  const Particles wanted = reference();
  const auto to = openvdb::math::Transform::createLinearTransform(.25);
  const auto fluid = grid_of(wanted, *to), foam = grid_of(wanted, *to);
  foam->setName("foam");
  const auto density = openvdb::FloatGrid::create();
  density->setName("density");
  EXPECT_EQ(read_particles(written("one.vdb", {density, fluid}), ReadOptions{}).size(), 37u);
  const std::string both = written("both.vdb", {density, fluid, foam});
  EXPECT_EQ(read_particles(both, ReadOptions{.dataset = "foam"}).size(), 37u);
  EXPECT_THAT(error(both), HasSubstr("both.vdb: has several grids of points, wanted one (give "
                                     "dataset); its grids are \"density\" (float), \"fluid\""));
  EXPECT_THAT(error(both, {.dataset = "density"}),
              HasSubstr("has no grid of points called \"density\", wanted one; its grids are"));
  EXPECT_THAT(error(written("volume.vdb", {density})),
              HasSubstr("volume.vdb: has no grid of points, wanted one"));
  EXPECT_THAT(
      error(both, {.attributes = {"heat"}, .dataset = "foam"}),
      HasSubstr("has no attribute \"heat\", it has force, id, pair, pscale, temperature, v"));
}

TEST_F(Vdb, SaysWhatIsWrong) {
  EXPECT_THAT(error_of("x.vdb", "ply\nformat"),
              HasSubstr("x.vdb: byte 0: found \"ply\\x0aform\", wanted \" BDV\""));
  const auto to = openvdb::math::Transform::createLinearTransform(.25);
  Particles particles = reference();
  const auto grid = grid_of(particles, *to);
  const std::string bytes = content(written("p.vdb", {grid}));
  EXPECT_EQ(error_of("cut.vdb", bytes.substr(0, bytes.size() / 2)),
            "cut.vdb: the file ends before its grids do (truncated?)");
  // Every beginning is an error: the last byte belongs to the points.
  for (std::size_t length = 1; length < bytes.size(); length += 1 + bytes.size() / 50)
    EXPECT_THROW(particles_of({"cut.vdb", bytes.substr(0, length)}, 0), InputError) << length;
  EXPECT_THROW(particles_of({"cut.vdb", bytes.substr(0, bytes.size() - 1)}, 0), InputError);
}

}  // namespace
}  // namespace meniscus
