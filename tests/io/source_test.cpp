// Particles that are left on disk, against those that are read at once.
#include "meniscus/source.hpp"

#include <gmock/gmock.h>

#include "io/io_test_support.hpp"
#include "io/rows.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

using testing::HasSubstr;

using Source = InputTest;

/// A PLY of five vertices with an element before them and columns of several types between.
std::string mixed_ply(std::endian order) {
  std::string bytes = std::string("ply\nformat binary_") +
                      (order == std::endian::little ? "little" : "big") +
                      "_endian 1.0\ncomment time 1.5 particle_radius 0.25\nelement camera 1\n"
                      "property double focal\nelement vertex 5\nproperty uchar flag\n"
                      "property double z\nproperty float x\nproperty short y\n"
                      "property float radius\nproperty int id\nproperty float vz\n"
                      "property double vx\nproperty float vy\nend_header\n";
  bytes += stored(50.0, order);
  for (int i = 0; i < 5; ++i)
    bytes += stored(static_cast<unsigned char>(i), order) + stored(0.1 + i, order) +
             stored(1.5f * static_cast<float>(i), order) +
             stored(static_cast<std::int16_t>(-7 * i), order) +
             stored(0.5f + static_cast<float>(i), order) + stored(std::int32_t{i}, order) +
             stored(3.5f, order) + stored(0.25 * i, order) + stored(-2.0f, order);
  return bytes;
}

Particles all_of(const ParticleSource& source, std::size_t at_once) {
  Particles all;
  for (std::int64_t first = 0; first < source.size(); first += static_cast<std::int64_t>(at_once)) {
    const std::size_t n = std::min(at_once, static_cast<std::size_t>(source.size() - first));
    const std::size_t had = all.size();
    const auto add = [&](std::vector<float>& values) {
      values.resize(had + n);
      return values.data() + had;
    };
    ParticleArrays to{.x = add(all.x), .y = add(all.y), .z = add(all.z)};
    if (source.has_velocity()) to.vx = add(all.vx), to.vy = add(all.vy), to.vz = add(all.vz);
    if (source.has_radius()) to.radius = add(all.radius);
    source.read(first, n, to);
  }
  return all;
}

TEST_F(Source, RowsAreWhatReadingAtOnceGives) {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    const std::string path = write("mixed.ply", mixed_ply(order));
    const Particles expected = read_particles(path);
    const auto rows = open_rows(path, ReadOptions{});
    ASSERT_TRUE(rows);
    EXPECT_EQ(rows->size(), 5);
    EXPECT_EQ(rows->particle_radius(), 0.25);
    EXPECT_TRUE(rows->has_radius());
    EXPECT_TRUE(rows->has_velocity());
    for (const std::size_t at_once : {1, 2, 5}) {
      const Particles found = all_of(*rows, at_once);
      EXPECT_EQ(found.x, expected.x);
      EXPECT_EQ(found.y, expected.y);
      EXPECT_EQ(found.z, expected.z);
      EXPECT_EQ(found.vx, expected.vx);
      EXPECT_EQ(found.vy, expected.vy);
      EXPECT_EQ(found.vz, expected.vz);
      EXPECT_EQ(found.radius, expected.radius);
    }
    EXPECT_EQ(expected.vx, (std::vector<float>{0, 0.25f, 0.5f, 0.75f, 1}));
    const auto given = open_rows(path, ReadOptions{.particle_radius = 0.125});
    EXPECT_EQ(given->particle_radius(), 0.125);
    EXPECT_FALSE(given->has_radius());
  }
}

TEST_F(Source, ReadsOnlyWhatIsWanted) {
  const std::string path = write("mixed.ply", mixed_ply(std::endian::little));
  const Particles all = read_particles(path);
  for (const auto& source : {open_rows(path, ReadOptions{}), source_of(all)}) {
    std::vector<float> vz(3), y(3);
    source->read(1, 3, {.y = y.data(), .vz = vz.data()});
    EXPECT_EQ(y, (std::vector<float>{-7, -14, -21}));
    EXPECT_EQ(vz, (std::vector<float>{3.5f, 3.5f, 3.5f}));
  }
  Particles still = all;
  still.vx.clear(), still.vy.clear(), still.vz.clear();
  std::vector<float> vx{1, 2, 3};
  EXPECT_FALSE(source_of(still)->has_velocity());
  source_of(still)->read(0, 3, {.vx = vx.data()});
  EXPECT_EQ(vx, (std::vector<float>{1, 2, 3})) << "what is not there is not written";
}

TEST_F(Source, LeavesToTheReaderWhatIsNotOnlyRows) {
  const std::string good = mixed_ply(std::endian::little);
  EXPECT_FALSE(open_rows(write("cut.ply", good.substr(0, good.size() - 1)), {}));
  EXPECT_FALSE(open_rows(write("long.ply", good + "x"), {}));
  EXPECT_FALSE(open_rows(write("ascii.ply",
                               "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                               "property float y\nproperty float z\nend_header\n1 2 3\n"),
                         {}));
  EXPECT_FALSE(open_rows(write("list.ply",
                               "ply\nformat binary_little_endian 1.0\nelement vertex 0\n"
                               "property float x\nproperty float y\nproperty float z\n"
                               "element face 0\nproperty list uchar int v\nend_header\n"),
                         {}));
  EXPECT_FALSE(open_rows(write("no.ply", "not a ply"), {}));
  EXPECT_FALSE(open_rows(write("rows.xyz", good), {}));
  EXPECT_FALSE(open_rows(write("gone.ply", "") + "x", {}));
}

TEST_F(Source, SaysWhereAFileEndedThatGrewShorter) {
  const std::string good = mixed_ply(std::endian::little);
  const auto rows = open_rows(write("shrunk.ply", good), {});
  write("shrunk.ply", good.substr(0, good.size() - 30));
  const std::string text = text_of_thrown<InputError>([&] { all_of(*rows, 5); });
  EXPECT_THAT(text, HasSubstr("byte " + std::to_string(good.size() - 30)));
  EXPECT_THAT(text, HasSubstr("ends here"));
}

TEST_F(Source, SmallFilesAndOtherFormatsAreInMemory) {
  EXPECT_TRUE(open_particles(write("mixed.ply", mixed_ply(std::endian::little)))->in_memory());
  const auto rows = open_particles(write("rows.xyz", "1 2 3\n4 5 6\n"), 0.5);
  ASSERT_TRUE(rows->in_memory());
  const Column& x = rows->in_memory()->x;
  EXPECT_EQ((std::vector<float>{x[0], x[1]}), (std::vector<float>{1, 4}));
  EXPECT_EQ(rows->particle_radius(), 0.5);
}

Particles three() {
  Particles particles;
  particles.x = particles.y = particles.z = {0, 1, 2};
  return particles;
}

void expect_refused(const Particles& particles, const std::string& why) {
  EXPECT_THAT(text_of_thrown<InvalidArgument>([&] { check(particles); }), HasSubstr(why));
}

TEST(ParticleCheck, NamesTheArrayThatDoesNotFit) {
  Particles particles = three();
  particles.y.pop_back();
  expect_refused(particles, "particles: x, y and z have 3, 2 and 3 values for 3 particles");
  EXPECT_THROW(source_of(particles), InvalidArgument);
  particles = three();
  particles.vx = {1, 2, 3};
  expect_refused(particles, "particles: vx, vy and vz have 3, 0 and 0 values for 3 particles");
  particles = three();
  particles.vx = particles.vy = particles.vz = {1};
  expect_refused(particles, "particles: vx, vy and vz have 1, 1 and 1 values for 3 particles");
  particles = three();
  particles.density = {1};
  expect_refused(particles, "particles: density has 1 values for 3 particles");
  particles = three();
  particles.radius = {1, 1};
  expect_refused(particles, "particles: radius has 2 values for 3 particles");
  particles = three();
  particles.id = {1, 2, 3, 4};
  expect_refused(particles, "particles: id has 4 values for 3 particles");
}

TEST(ParticleCheck, RefusesRadiiThatAreNone) {
  for (const float radius : {0.0f, -1.0f, NAN, INFINITY}) {
    Particles particles = three();
    particles.radius = {1, radius, 1};
    expect_refused(particles, "particles: radius of particle 1 is ");
  }
  for (const double radius : {-1.0, static_cast<double>(NAN), static_cast<double>(INFINITY)}) {
    Particles particles = three();
    particles.particle_radius = radius;
    expect_refused(particles, "particles: particle_radius is ");
  }
}

TEST(ParticleCheck, LeavesWhatIsNotFiniteToTheParameters) {
  Particles particles = three();
  particles.x[1] = NAN;
  particles.vx = particles.vy = particles.vz = {0, INFINITY, 0};
  particles.radius = {1, 2, 3};
  check(particles);
  check(Particles{});
}

TEST_F(Source, NeedsARadiusOrNone) {
  const std::string path = write("a.xyz", "0 0 0\n");
  for (const double radius : {-1.0, static_cast<double>(NAN)}) {
    EXPECT_THROW(read_particles(path, radius), InvalidArgument);
    EXPECT_THROW(open_particles(path, radius), InvalidArgument);
  }
  EXPECT_EQ(read_particles(path, 2).particle_radius, 2);
}

// Bytes that unpack a large block for each read.
class PackedBytes : public Bytes {
 public:
  explicit PackedBytes(std::uint64_t size) : size_(size) {}
  std::uint64_t size() const override { return size_; }
  std::uint64_t block() const override { return kBlock; }
  const std::string& name() const override { return name_; }
  void read(std::uint64_t at, char* to, std::size_t size) const override {
    unpacked += (at + size - 1) / kBlock - at / kBlock + 1;
    std::memset(to, 0, size);
  }
  mutable std::uint64_t unpacked = 0;  // blocks
  static constexpr std::uint64_t kBlock = 4000000;

 private:
  std::uint64_t size_;
  std::string name_ = "packed";
};

TEST(LayoutSource, UnpacksEachBlockOnce) {
  const std::int64_t count = 2000000;
  const auto bytes = std::make_shared<PackedBytes>(12 * count);
  Layout layout;
  layout.count = count;
  for (const Field field : {Field::x, Field::y, Field::z})
    layout.columns.push_back({field, 0, "", Scalar::float32, std::endian::little, bytes,
                              4 * static_cast<std::uint64_t>(field), 12});
  std::vector<float> x(count), y(count), z(count);
  source_of(bytes, layout)->read(0, x.size(), {.x = x.data(), .y = y.data(), .z = z.data()});
  const std::uint64_t blocks = bytes->size() / PackedBytes::kBlock;
  // A row that lies in two blocks needs both.
  EXPECT_LE(bytes->unpacked, 2 * blocks);
}

}  // namespace
}  // namespace meniscus
