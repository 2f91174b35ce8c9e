// Making input files in tests: bytes in both orders, temporary files, cuts and flips.
#pragma once

#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <fstream>
#include <functional>
#include <random>
#include <string>

#include "cost.hpp"
#include "io/readers.hpp"
#include "io/temporary_folder.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"

namespace meniscus {

// How often the bits of a file are flipped. Under sanitizers, where it takes four times as long, a
// fourth: the fuzzers go on with it.
inline constexpr int kFlips = kSlower > 1 ? 2500 : 10000;
// And at every how many bytes the files of other programs are cut.
inline constexpr std::size_t kCuts = kSlower > 1 ? 4 : 1;

/// A value as it lies in a file of the given byte order.
template <class T>
std::string stored(T value, std::endian order) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  if (order != std::endian::native) bytes.assign(bytes.rbegin(), bytes.rend());
  return bytes;
}

/// A folder of its own for each test, removed at its end.
class InputTest : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& bytes) const {
    const std::string path = folder_ / name;
    std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<long>(bytes.size()));
    return path;
  }

  Particles read(const std::string& name, const std::string& bytes,
                 double particle_radius = 0) const {
    return read_particles(write(name, bytes), particle_radius);
  }

  /// The message of the InputError that reading throws, without the folder.
  std::string error_of(const std::string& name, const std::string& bytes) const {
    const std::string path = write(name, bytes);
    try {
      if (name.ends_with(".json"))
        read_camera(path);
      else
        read_particles(path);
    } catch (const InputError& error) {
      const std::string text = error.what();
      EXPECT_TRUE(text.starts_with(path + ": ")) << text;
      EXPECT_EQ(text.find('\n'), std::string::npos) << text;
      return text.starts_with(path) ? text.substr(path.size() - name.size()) : text;
    }
    return "no error";
  }

  /// Reads beginnings of `bytes` from memory, each `step` longer than the one before: each must
  /// throw InputError, or give particles that `fine` accepts for that length. Returns how many gave
  /// particles.
  int cut_everywhere(const std::string& name, const std::string& bytes,
                     const std::function<bool(const Particles&, std::size_t)>& fine,
                     std::size_t step = 1) const {
    int read_without_error = 0;
    for (std::size_t length = 1; length < bytes.size(); length += step) {
      try {
        const Particles particles = particles_of({name, bytes.substr(0, length)}, 0);
        ++read_without_error;
        EXPECT_TRUE(fine(particles, length))
            << name << " cut after byte " << length << " of " << bytes.size();
      } catch (const InputError&) {
      }
    }
    return read_without_error;
  }

  /// Flips one to three random bits, kFlips times: InputError or particles whose arrays fit
  /// together.
  void flip_bits(const std::string& name, const std::string& bytes) const {
    std::mt19937 random(7);
    int errors = 0;
    for (int round = 0; round < kFlips; ++round) {
      std::string damaged = bytes;
      for (unsigned flips = 1 + random() % 3; flips > 0; --flips) {
        const std::size_t bit = random() % (8 * bytes.size());
        damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
      }
      try {
        const Particles p = particles_of({name, damaged}, 0);
        const auto fits = [&](std::size_t n) { return n == 0 || n == p.size(); };
        EXPECT_TRUE(p.y.size() == p.size() && p.z.size() == p.size() && fits(p.vx.size()) &&
                    p.vy.size() == p.vx.size() && p.vz.size() == p.vx.size() &&
                    fits(p.density.size()) && fits(p.radius.size()) && fits(p.id.size()));
        EXPECT_LE(p.size(), bytes.size());
      } catch (const InputError&) {
        ++errors;
      }
    }
    EXPECT_GT(errors, 0);  // the damage does reach what the reader checks
  }

 private:
  TemporaryFolder folder_;
};

inline bool same(const Particles& a, const Particles& b) {
  return a.x == b.x && a.y == b.y && a.z == b.z && a.vx == b.vx && a.vy == b.vy && a.vz == b.vz &&
         a.density == b.density && a.radius == b.radius && a.id == b.id &&
         a.particle_radius == b.particle_radius && a.time == b.time;
}

inline std::string test_data(const std::string& name) {
  return std::string(MENISCUS_TEST_DATA) + "/" + name;
}

inline std::string content(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace meniscus
