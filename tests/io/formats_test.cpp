// The same particles in every format. scripts/format_samples.py made the files, with VTK, meshio,
// NumPy, h5py and writers of its own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <filesystem>
#include <set>

#include "io/io_test_support.hpp"
#include "io/readers.hpp"
#include "io/rows.hpp"
#include "meniscus/source.hpp"
#include "program/batch/pattern.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

std::string sample(const std::string& name) { return test_data("formats/" + name); }

const ReadOptions kAll{.attributes = {"temperature", "force"}, .timestep = -1};

Particles reference() { return read_particles(sample("reference.csv"), kAll); }

void expect_same(const Particles& found, const Particles& wanted, const std::string& name,
                 bool ids = true, bool attributes = true) {
  EXPECT_EQ(found.x, wanted.x) << name;
  EXPECT_EQ(found.y, wanted.y) << name;
  EXPECT_EQ(found.z, wanted.z) << name;
  EXPECT_EQ(found.vx, wanted.vx) << name;
  EXPECT_EQ(found.vy, wanted.vy) << name;
  EXPECT_EQ(found.vz, wanted.vz) << name;
  if (ids) {
    EXPECT_EQ(found.id, wanted.id) << name;
  }
  if (!attributes) return;
  ASSERT_EQ(found.attributes.size(), wanted.attributes.size()) << name;
  for (std::size_t k = 0; k < wanted.attributes.size(); ++k) {
    EXPECT_EQ(found.attributes[k].name, wanted.attributes[k].name) << name;
    EXPECT_EQ(found.attributes[k].values, wanted.attributes[k].values) << name;
  }
}

TEST(Formats, HoldTheSameParticles) {
  const Particles wanted = reference();
  ASSERT_EQ(wanted.size(), 37u);
  ASSERT_EQ(wanted.attributes.size(), 4u);
  EXPECT_EQ(wanted.attributes[1].name, "force.X");
  std::set<std::string> endings;
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(sample(""))) {
    const std::string name = entry.path().filename().string();
    // Files that hold one kind of value, or need to be told what of them is meant.
    const bool beside = name.starts_with("fluidparticles") && name != "fluidparticles000001.ffp3";
    if (beside || name == "series.pvd" || name == "lammps_steps.lammpstrj") continue;
    const bool bare =
        name.starts_with("numpy_") && name.ends_with(".npy") && name != "numpy_record.npy";
    const Particles found = read_particles(entry.path().string(), bare ? ReadOptions{} : kAll);
    expect_same(found, wanted, name, !bare, !bare);
    const bool timed =
        name.starts_with("vtk_") || name.starts_with("Part") || name == "lammps_timed.dump";
    EXPECT_EQ(found.time, timed ? 0.25 : 0) << name;
    endings.insert(particle_ending(name));
    ++files;
  }
  EXPECT_GE(files, 41);
  EXPECT_THAT(endings, testing::IsSupersetOf({".bgeo", ".bgeo.sc", ".vtp", ".vtu", ".vtk", ".npy",
                                              ".npz", ".h5", ".hdf5", ".bi4", ".ffp3", ".lammpstrj",
                                              ".dump", ".csv"}));
}

TEST(Formats, StreamTheSameParticles) {
  const Particles wanted = reference();
  for (const char* name :
       {"vtk_raw.vtp", "vtk_raw_zlib.vtp", "vtk_raw_zlib_big.vtp", "vtk_raw_double.vtp",
        "vtk_raw.vtu", "numpy_record.npy", "numpy_stored.npz", "h5py_plain.h5", "h5py_packed.hdf5",
        "Part_wide_0001.bi4", "Part_big_0001.bi4", "fluidparticles000001.ffp3"}) {
    const auto source = open_rows(sample(name), kAll);
    ASSERT_TRUE(source) << name;
    EXPECT_EQ(source->in_memory(), nullptr) << name;
    ASSERT_EQ(source->size(), 37) << name;
    EXPECT_TRUE(source->has_velocity()) << name;
    ASSERT_EQ(source->attributes().size(), 4u) << name;
    for (const auto& range : {std::pair<std::int64_t, std::size_t>{0, 37}, {11, 20}}) {
      const std::int64_t first = range.first;  // clang 14 captures no structured bindings
      const std::size_t count = range.second;
      const auto part = [&](const std::vector<float>& values) {
        return std::vector<float>(values.begin() + first,
                                  values.begin() + first + static_cast<std::ptrdiff_t>(count));
      };
      std::vector<std::vector<float>> got(10, std::vector<float>(count, -1));
      ParticleArrays to{got[0].data(), got[1].data(), got[2].data(),
                        got[3].data(), got[4].data(), got[5].data()};
      for (std::size_t k = 0; k < 4; ++k) to.attributes.push_back(got[6 + k].data());
      source->read(first, count, to);
      EXPECT_EQ(got[0], part(wanted.x)) << name;
      EXPECT_EQ(got[1], part(wanted.y)) << name;
      EXPECT_EQ(got[2], part(wanted.z)) << name;
      EXPECT_EQ(got[3], part(wanted.vx)) << name;
      EXPECT_EQ(got[4], part(wanted.vy)) << name;
      EXPECT_EQ(got[5], part(wanted.vz)) << name;
      for (std::size_t k = 0; k < 4; ++k)
        EXPECT_EQ(got[6 + k], part(wanted.attributes[k].values)) << name;
    }
  }
  // What must be unpacked or decoded as a whole is read into memory.
  for (const char* name :
       {"vtk_inline.vtp", "vtk_base64.vtp", "numpy_deflated.npz", "lammps.lammpstrj"})
    EXPECT_FALSE(open_rows(sample(name), kAll)) << name;
}

using FormatsOnDisk = InputTest;

TEST_F(FormatsOnDisk, CutAnywhereAreErrorsOrWhole) {
  const Particles wanted = reference();
  for (const char* name :
       {"vtk_raw_zlib.vtp", "vtk_base64_zlib.vtp", "vtk_inline.vtp", "numpy_six.npy",
        "numpy_stored.npz", "numpy_deflated.npz", "Part_wide_0001.bi4", "fluidparticles000001.ffp3",
        "lammps.lammpstrj", "lammps_timed.dump", "pysph.hdf5", "houdini.bgeo", "houdini.bgeo.sc"}) {
    const std::string bytes = content(sample(name));
    // All that can be left out is what follows the values: closing tags, a second group.
    cut_everywhere(
        name, bytes,
        [&](const Particles& p, std::size_t) {
          return p.x == wanted.x && p.y == wanted.y && p.z == wanted.z;
        },
        kCuts);
  }
}

TEST_F(FormatsOnDisk, WithFlippedBitsAreErrorsOrFit) {
  for (const char* name : {"vtk_raw_zlib.vtp", "vtk_base64.vtp", "numpy_record.npy",
                           "numpy_deflated.npz", "Part_wide_0001.bi4", "lammps.lammpstrj",
                           "h5py_plain.h5", "h5py_packed.hdf5", "houdini.bgeo", "houdini.bgeo.sc"})
    flip_bits(name, content(sample(name)));
}

TEST_F(FormatsOnDisk, SayWhatIsWrong) {
  const std::string vtp = content(sample("vtk_raw.vtp"));
  const auto with = [](std::string bytes, const std::string& from, const std::string& to) {
    bytes.replace(bytes.find(from), from.size(), to);
    return bytes;
  };
  EXPECT_THAT(error_of("lz4.vtp", with(content(sample("vtk_raw_zlib.vtp")), "vtkZLibDataCompressor",
                                       "vtkLZ4DataCompressor")),
              testing::HasSubstr("wanted vtkZLibDataCompressor"));
  EXPECT_THAT(error_of("image.vtp", with(vtp, "type=\"PolyData\"", "type=\"ImageData\"")),
              testing::HasSubstr("wanted PolyData or UnstructuredGrid"));
  EXPECT_THAT(error_of("many.vtp", with(vtp, "NumberOfPoints=\"37\"", "NumberOfPoints=\"38\"")),
              testing::HasSubstr("Points"));
  EXPECT_THAT(error_of("huge.vtp", with(vtp, "NumberOfPoints=\"37\"",
                                        "NumberOfPoints=\"9000000000000000000\"")),
              testing::HasSubstr("wanted 9000000000000000000"));
  EXPECT_THAT(error_of("objects.npy", with(content(sample("numpy_six.npy")), "'<f4'", "'|O' ")),
              testing::HasSubstr("pickled"));
  EXPECT_THAT(error_of("half.npy", with(content(sample("numpy_record.npy")), "'velocity', '<f8'",
                                        "'velocity', '<f2'")),
              testing::HasSubstr("has type \"<f2\" for velocity"));
  EXPECT_THAT(error_of("steps.lammpstrj", content(sample("lammps_steps.lammpstrj"))),
              testing::HasSubstr("holds 3 timesteps: 1000, 0, 2000 (give timestep"));
  EXPECT_THAT(error_of("v.ffp3", content(sample("fluidparticlestemperature000001.ffp3"))),
              testing::HasSubstr("has 4 bytes a particle, wanted 12"));
  EXPECT_THAT(text_of_thrown<InputError>([&] {
                read_particles(sample("vtk_raw.vtp"), ReadOptions{.attributes = {"pressure"}});
              }),
              testing::HasSubstr("has no attribute \"pressure\", it has velocity, "
                                 "id, temperature, force"));
}

// Velocities are the only vectors that can be read: they were taken for positions.
TEST(Formats, VelocitiesAreNeverTakenForPositions) {
  const auto error_of = [](const char* name) -> std::string {
    try {
      read_particles(test_data("formats_refused/" + std::string(name)));
      return "no error";
    } catch (const InputError& error) {
      return error.what();
    }
  };
  EXPECT_THAT(error_of("numpy_velocity.npz"), testing::HasSubstr("no array is named as positions"));
  EXPECT_THAT(error_of("h5py_half.h5"),
              testing::HasSubstr("position has numbers of 16 bits, wanted 32 or 64"));
  EXPECT_THAT(error_of("h5py_compound.h5"),
              testing::HasSubstr("particles has a compound type, which is not read"));
  // Chunks that were never written: what h5py makes of them were particles at the origin.
  EXPECT_THAT(error_of("h5py_partly.h5"),
              testing::HasSubstr("position: holds no values for rows from 20 on"));
}

// An archive of NumPy's with one array of zeros that states more rows, and another one behind it.
TEST_F(FormatsOnDisk, StoredMembersEndWhereTheyEnd) {
  const auto little = [](auto value) { return stored(value, std::endian::little); };
  std::string archive, directory;
  for (const auto& [name, stated] : {std::pair{"positions.npy", 100}, {"others.npy", 50}}) {
    const std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" +
                               std::to_string(stated) + ", 3), }\n";
    const std::string data = std::string("\x93NUMPY\x01\x00", 8) +
                             little(static_cast<std::uint16_t>(header.size())) + header +
                             std::string(4 * 50 * 3, '\0');
    const std::string about =
        little(std::uint16_t{0}) + little(std::uint16_t{0}) + little(std::uint32_t{0}) +
        little(static_cast<std::uint32_t>(
            crc32_z(0, reinterpret_cast<const Bytef*>(data.data()), data.size()))) +
        little(static_cast<std::uint32_t>(data.size())) +
        little(static_cast<std::uint32_t>(data.size())) +
        little(static_cast<std::uint16_t>(std::string(name).size())) + little(std::uint16_t{0});
    directory += std::string("PK\x01\x02\x14\x00\x14\x00", 8) + about + std::string(10, '\0') +
                 little(static_cast<std::uint32_t>(archive.size())) + name;
    archive += std::string("PK\x03\x04\x14\x00", 6) + about + name + data;
  }
  const std::string end = std::string("PK\x05\x06\x00\x00\x00\x00\x02\x00\x02\x00", 12) +
                          little(static_cast<std::uint32_t>(directory.size())) +
                          little(static_cast<std::uint32_t>(archive.size())) + std::string(2, '\0');
  EXPECT_THAT(error_of("a.npz", archive + directory + end),
              testing::HasSubstr("wanted 100 x 3 values of positions"));
}

TEST_F(FormatsOnDisk, StoredMembersMatchTheirChecksums) {
  std::string npz = content(sample("numpy_stored.npz"));
  const std::size_t value = npz.find("'shape': (37, 3)") + 200;  // of the first array
  npz[value] = static_cast<char>(npz[value] ^ 1);
  EXPECT_THAT(error_of("a.npz", npz), testing::HasSubstr("do not match their checksum"));
}

TEST_F(FormatsOnDisk, DataSetsThatStateTooLittleRoomAreRefused) {
  std::string h5 = content(sample("h5py_plain.h5"));
  const std::string room = stored(std::uint64_t{37 * 3 * 4}, std::endian::little);
  for (std::size_t at = 0; (at = h5.find("\x03\x01", at)) != std::string::npos; ++at)
    if (h5.compare(at + 10, 8, room) == 0)
      h5.replace(at + 10, 8, stored(std::uint64_t{400}, std::endian::little));
  EXPECT_THAT(error_of("a.h5", h5), testing::HasSubstr("has room for 400 bytes, wanted 444"));
}

TEST_F(FormatsOnDisk, TransposedArraysAndTablesOfFramesAreRefused) {
  const auto npy = [&](int rows, int across, const std::string& also = "") {
    std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" +
                         std::to_string(rows) + ", " + also + std::to_string(across) + "), }\n";
    return std::string("\x93NUMPY\x01\x00", 8) +
           stored(static_cast<std::uint16_t>(header.size()), std::endian::little) + header +
           std::string(static_cast<std::size_t>(4 * rows * across), '\0');
  };
  EXPECT_THAT(error_of("a.npy", npy(3, 4913)),
              testing::HasSubstr("has shape (3, 4913), wanted (n, 3): transposed?"));
  EXPECT_THAT(error_of("a.npy", npy(2, 300000)), testing::HasSubstr("transposed?"));
  EXPECT_THAT(error_of("a.npy", npy(6, 4913)), testing::HasSubstr("transposed?"));
  // One frame in a list of frames was taken for one particle of many numbers.
  EXPECT_THAT(error_of("a.npy", npy(1, 3, "1000, ")),
              testing::HasSubstr("has shape (1, 1000, 3), wanted (n, 3)"));
  EXPECT_EQ(read("a.npy", npy(5, 3, "1, ")).size(), 5u);
  EXPECT_EQ(read("a.npy", npy(3, 3)).size(), 3u);
  EXPECT_EQ(read("a.npy", npy(2, 3)).size(), 2u);
  EXPECT_EQ(read("a.npy", npy(3, 6)).vx.size(), 3u);
}

TEST_F(FormatsOnDisk, ArraysOfTextAndBitsAreNoAttributes) {
  for (const char* type : {"String", "Bit"}) {
    std::string vtp = content(sample("vtk_ascii.vtp"));
    const std::string number = "type=\"Float32\" Name=\"temperature\"";
    ASSERT_NE(vtp.find(number), std::string::npos);
    vtp.replace(vtp.find(number), number.size(),
                "type=\"" + std::string(type) + "\" Name=\"temperature\"");
    const std::string path = write("a.vtp", vtp);
    EXPECT_EQ(read_particles(path).size(), 37u);
    EXPECT_THROW(read_particles(path, ReadOptions{.attributes = {"temperature"}}), InputError);
  }
}

TEST_F(FormatsOnDisk, AttributesWithLongNamesAreFound) {
  const std::string name(50, 'n');
  const std::string ply =
      write("a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
            "property float z\nproperty float " +
                name + "\nend_header\n1 2 3 7\n");
  const std::string vtk =
      write("a.vtk",
            "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 1 float\n"
            "1 2 3\nPOINT_DATA 1\nSCALARS " +
                name + " float 1\nLOOKUP_TABLE default\n7\n");
  for (const std::string& path : {ply, vtk}) {
    const Particles p = read_particles(path, ReadOptions{.attributes = {name}});
    ASSERT_EQ(p.attributes.size(), 1u);
    EXPECT_EQ(p.attributes[0].name, name);
    EXPECT_THAT(p.attributes[0].values, testing::ElementsAre(7));
  }
}

TEST_F(FormatsOnDisk, AreNotBelievedBeforeMemoryIsTaken) {
  // An archive of 1 MiB of packed zeros that states a thousand times as much.
  const std::string npz = content(sample("numpy_deflated.npz"));
  EXPECT_EQ(particles_of({"a.npz", npz}, 0).size(), 37u);
  std::string bomb = npz;
  for (std::size_t at = 0; (at = bomb.find("PK\x01\x02", at)) != std::string::npos; at += 4)
    bomb.replace(at + 24, 4, std::string("\x00\x00\x00\x70", 4));  // 1.8 GB each
  EXPECT_THAT(error_of("bomb.npz", bomb), testing::HasSubstr("can become"));
}

TEST(Formats, ChooseAmongSeveral) {
  const Particles wanted = reference();
  ReadOptions options = kAll;
  options.timestep = 0;
  expect_same(read_particles(sample("lammps_steps.lammpstrj"), options), wanted, "timestep 0");
  options.timestep = 2000;
  const Particles later = read_particles(sample("lammps_steps.lammpstrj"), options);
  EXPECT_FLOAT_EQ(later.x[0], wanted.x[0] + 2);
  options.timestep = 7;
  EXPECT_THROW(read_particles(sample("lammps_steps.lammpstrj"), options), InputError);
  options = kAll;
  options.dataset = "particles/fluid";
  expect_same(read_particles(sample("pysph.hdf5"), options), wanted, "fluid");
  options.dataset = "boundary";
  const Particles walls = read_particles(sample("pysph.hdf5"), options);
  EXPECT_EQ(walls.x[3], wanted.x[3] + 100);
  options.dataset = "nothing";
  EXPECT_THROW(read_particles(sample("pysph.hdf5"), options), InputError);
}

TEST(Formats, SeriesAndFoldersAreSequences) {
  const auto series = FramePattern::in(sample("series.pvd"));
  ASSERT_TRUE(series);
  const auto frames = series->existing();
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames.at(0).path, sample("vtk_raw.vtp"));  // by time
  EXPECT_EQ(frames.at(1).path, sample("vtk_raw_zlib.vtp"));
  EXPECT_THROW(sequence_in_folder(sample("")), InputError);  // several sequences
  EXPECT_EQ(sequence_in_folder(sample("series.pvd")), sample("series.pvd"));
}

TEST_F(FormatsOnDisk, FolderOfNumberedFilesIsOneSequence) {
  const std::string first = write("dam_007.vtp", content(sample("vtk_raw.vtp")));
  write("dam_012.vtp", content(sample("vtk_raw.vtp")));
  write("notes.txt", "no particles");
  write_mesh(write("surface_007.ply", ""), Mesh{});
  const std::string folder = std::filesystem::path(first).parent_path().string();
  EXPECT_EQ(sequence_in_folder(folder), folder + "/dam_{}.vtp");
  const auto pattern = FramePattern::in(sequence_in_folder(folder));
  ASSERT_TRUE(pattern);
  EXPECT_EQ(pattern->existing().size(), 2u);
  EXPECT_TRUE(pattern->existing().contains(12));
}

// What follows the frame's number may hold a number, too, such as that of a version.
TEST_F(FormatsOnDisk, TheFramesNumberIsTheOneThatDiffers) {
  const std::string bytes = content(sample("vtk_raw.vtp"));
  std::string first;
  for (const char* name : {"dam3.0001.v2.vtp", "dam3.0002.v2.vtp", "dam3.0010.v2.vtp"})
    first = write(name, bytes);
  const std::string folder = std::filesystem::path(first).parent_path().string();
  EXPECT_EQ(sequence_in_folder(folder), folder + "/dam3.{}.v2.vtp");
  for (int k = 0; k < 40; ++k)
    write("other" + std::to_string(k) + ".0001.v" + std::to_string(k) + ".vtp", bytes);
  const std::string text = text_of_thrown<InputError>([&] { sequence_in_folder(folder); });
  EXPECT_THAT(text, testing::HasSubstr("several sequences"));
  EXPECT_THAT(text, testing::EndsWith(" and 33 more"));
}

}  // namespace
}  // namespace meniscus
