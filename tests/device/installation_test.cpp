// What the OpenCL loader is told to load, read before the loader does.
#include "device/installation.hpp"

#include <gtest/gtest.h>
#include <tbb/version.h>

#include <cstdlib>
#include <fstream>

#include "io/temporary_folder.hpp"

namespace meniscus {
namespace {

class Installation : public testing::Test {
 protected:
  Installation() { setenv("OCL_ICD_VENDORS", folder_.path().c_str(), 1); }
  ~Installation() override { unsetenv("OCL_ICD_VENDORS"); }

  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }
  void write_tbb(int version) const {
    write("libtbb.so.12", "\x7f" "ELF oneTBB: INTERFACE VERSION\t" + std::to_string(version) + '\n');
  }

  TemporaryFolder folder_;
};

TEST_F(Installation, LibrariesAreThoseOfTheIcdFilesInOrder) {
  write("b.icd", "libb.so\n");
  write("a.icd", "/opt/a/liba.so");
  write("c.txt", "libc.so");
  const auto found = vendor_libraries();
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].icd, folder_ / "a.icd");
  EXPECT_EQ(found[0].library, "/opt/a/liba.so");
  EXPECT_EQ(found[1].library, "libb.so");

  setenv("OCL_ICD_VENDORS", (folder_ / "b.icd").c_str(), 1);
  ASSERT_EQ(vendor_libraries().size(), 1u);
  EXPECT_EQ(vendor_libraries()[0].library, "libb.so");

  setenv("OCL_ICD_VENDORS", "libdirect.so.1", 1);
  ASSERT_EQ(vendor_libraries().size(), 1u);
  EXPECT_EQ(vendor_libraries()[0].icd, "");
  EXPECT_EQ(vendor_libraries()[0].library, "libdirect.so.1");
}

TEST_F(Installation, ANewerTbbBesideALibraryIsFoundAndAnOlderOneLeft) {
  write("vendor.icd", folder_ / "libvendor.so");
  EXPECT_EQ(newer_tbb(), "");
  write_tbb(TBB_runtime_interface_version());
  EXPECT_EQ(newer_tbb(), "");
  write_tbb(TBB_runtime_interface_version() + 10);
  EXPECT_EQ(newer_tbb(), folder_ / "libtbb.so.12");
  write("libtbb.so.12", "no oneTBB at all");
  EXPECT_EQ(newer_tbb(), "");
}

}  // namespace
}  // namespace meniscus
