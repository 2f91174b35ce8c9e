// OpenCL installations that are broken: a clear line each.
#include <gmock/gmock.h>

#include <filesystem>

#include "program/cli/program.hpp"

namespace meniscus::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class BrokenInstallation : public Program {
 protected:
  BrokenInstallation() { fs::create_directory(path("vendors")); }

  static Conditions vendors(const std::string& place) {
    return {.environment = {{"OCL_ICD_VENDORS", place}}};
  }

  // Whether PoCL is there; then it alone is a vendor.
  bool has_pocl() const {
    for (const auto& entry : fs::directory_iterator("/etc/OpenCL/vendors"))
      if (entry.path().filename() == "pocl.icd")
        return fs::copy_file(entry, path("vendors/pocl.icd"));
    return false;
  }

  void expect_no_platform(const std::string& place, const std::vector<std::string>& parts) const {
    std::vector<std::string> all{"no OpenCL platform was found", "install one"};
    all.insert(all.end(), parts.begin(), parts.end());
    expect_error(run({"devices"}, vendors(place)), 1, all);
    write_particles("in.ply", block(3));
    expect_error(run({"extract", "in.ply", "-o", "a.png"}, vendors(place)), 1, all);
    EXPECT_FALSE(exists("a.png"));
  }
};

TEST_F(BrokenInstallation, AFolderWithoutVendors) {
  expect_no_platform(path("vendors"), {path("vendors") + ": has no .icd file"});
}

TEST_F(BrokenInstallation, NoFolder) {
  expect_no_platform(path("nowhere") + "/", {path("nowhere")});
}

TEST_F(BrokenInstallation, AVendorWhoseLibraryIsNotThere) {
  write("vendors/gone.icd", "/opt/gone/libgone.so\n");
  expect_no_platform(path("vendors"), {path("vendors/gone.icd") +
                                       ": /opt/gone/libgone.so: cannot open shared object "
                                       "file: No such file or directory"});
}

TEST_F(BrokenInstallation, AVendorWhoseLibraryIsNone) {
  write("text.so", "this is no library, however long this file may be made");
  write("vendors/text.icd", path("text.so") + "\n");
  write("vendors/nothing.icd", "");
  expect_no_platform(path("vendors"), {path("vendors/nothing.icd") + ": names no library",
                                       path("vendors/text.icd") + ": " + path("text.so") + ": "});
  expect_no_platform(path("text.so"), {"OCL_ICD_VENDORS: " + path("text.so") + ": "});
}

TEST_F(BrokenInstallation, ALibraryThatIsNoPlatform) {
  expect_no_platform("libz.so.1", {"libz.so.1"});
}

TEST_F(BrokenInstallation, ABrokenVendorBesideAGoodOneIsShownAndDoesNoHarm) {
  if (!has_pocl()) GTEST_SKIP() << "PoCL is not installed system-wide";
  write("vendors/gone.icd", "libgone.so\n");
  const Outcome devices = run_well({"devices"}, vendors(path("vendors")));
  EXPECT_THAT(devices.out, HasSubstr("! " + path("vendors/gone.icd") + ": libgone.so: cannot"));
  EXPECT_THAT(devices.out, Not(HasSubstr("! " + path("vendors/pocl.icd"))));
  EXPECT_THAT(devices.out, HasSubstr("The default is 0"));
  write_particles("in.ply", block(3));
  const Outcome outcome = run_well({"extract", "in.ply", "-o", "a.png"}, vendors(path("vendors")));
}

TEST_F(BrokenInstallation, APlatformWithoutDevicesIsNamed) {
  if (!has_pocl()) GTEST_SKIP() << "PoCL is not installed system-wide";
  Conditions no_device = vendors(path("vendors"));
  no_device.environment.emplace_back("POCL_DEVICES", "none");
  for (const char* command : {"devices", "verify"})
    expect_error(run({command}, no_device), 1,
                 {"no usable OpenCL device was found; platform Portable Computing Language has no "
                  "device"});
}

TEST_F(BrokenInstallation, ANewerTbbThatCannotBeLoadedIsTriedOnce) {
  write("libtbb.so.12", "oneTBB: INTERFACE VERSION\t999999\n");
  write("vendors/vendor.icd", path("libvendor.so") + "\n");
  const Outcome outcome = run({"devices"}, vendors(path("vendors")));
  expect_error(outcome, 1,
               {path("vendors/vendor.icd") + ": " + path("libvendor.so") + ": cannot",
                "start the program with LD_PRELOAD=" + path("libtbb.so.12")});
}

TEST_F(BrokenInstallation, UnwritableCachesAreNoError) {
  write_particles("in.ply", block(3));
  const Conditions nowhere{{{"HOME", "/nonexistent"},
                            {"XDG_CACHE_HOME", ""},
                            {"POCL_CACHE_DIR", ""},
                            {"MENISCUS_CACHE_DIR", "/proc/nowhere"}}};
  run_well({"extract", "in.ply", "-o", "a.png"}, nowhere);
}

}  // namespace
}  // namespace meniscus::test
