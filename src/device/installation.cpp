#include "device/installation.hpp"

#include <dlfcn.h>
#include <tbb/version.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

namespace meniscus {
namespace {

namespace fs = std::filesystem;

constexpr const char* kVendors = "/etc/OpenCL/vendors";
constexpr const char* kTbb = "libtbb.so.12";

// What OCL_ICD_VENDORS or, in its absence, its older name says, as ocl-icd reads them.
std::string vendors() {
  for (const char* name : {"OCL_ICD_VENDORS", "OPENCL_VENDOR_PATH"})
    if (const char* value = std::getenv(name); value && *value) return value;
  return kVendors;
}

VendorLibrary read_icd(const fs::path& path) {
  VendorLibrary vendor{path.string(), ""};
  std::ifstream file(path);
  std::getline(file, vendor.library);
  while (!vendor.library.empty() && std::isspace(static_cast<unsigned char>(vendor.library.back())))
    vendor.library.pop_back();
  return vendor;
}

// Of the oneTBB in a file; 0: the file is none.
int tbb_version(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(file), {});
  const std::string key = "oneTBB: INTERFACE VERSION\t";
  const std::size_t found = bytes.find(key);
  return found == std::string::npos ? 0 : std::atoi(bytes.c_str() + found + key.size());
}

// A newer oneTBB beside a vendor's library; empty: there is none.
std::string newer_tbb_beside(const VendorLibrary& vendor) {
  const fs::path beside = fs::path(vendor.library).parent_path() / kTbb;
  std::error_code error;
  if (!fs::path(vendor.library).is_absolute() || !fs::exists(beside, error)) return "";
  return tbb_version(beside) > TBB_runtime_interface_version() ? beside.string() : "";
}

// Why a library gives no platform; empty: it may well give one.
std::string problem_of(const VendorLibrary& vendor) {
  if (vendor.library.empty()) return "names no library";
  // The loader keeps those libraries that gave it a platform.
  void* loaded = dlopen(vendor.library.c_str(), RTLD_LAZY | RTLD_NOLOAD);
  const bool kept = loaded != nullptr;
  if (!kept) loaded = dlopen(vendor.library.c_str(), RTLD_LAZY);
  if (loaded) {
    const bool is_driver = dlsym(loaded, "clGetExtensionFunctionAddress") != nullptr;
    dlclose(loaded);
    if (!is_driver) return vendor.library + " is no OpenCL driver";
    return kept ? "" : vendor.library + " has no OpenCL platform";
  }
  const char* const reason = dlerror();
  std::string problem = reason ? reason : vendor.library + " cannot be loaded";
  if (const std::string tbb = newer_tbb_beside(vendor); !tbb.empty())
    problem +=
        ": it needs a newer oneTBB than this process has loaded: start the program with "
        "LD_PRELOAD=" +
        tbb;
  return problem;
}

}  // namespace

std::vector<VendorLibrary> vendor_libraries() {
  const fs::path from = vendors();
  std::error_code error;
  if (fs::is_directory(from, error)) {
    std::vector<VendorLibrary> libraries;
    for (fs::directory_iterator entry(from, error), end; !error && entry != end;
         entry.increment(error))
      if (entry->path().extension() == ".icd") libraries.push_back(read_icd(entry->path()));
    std::sort(libraries.begin(), libraries.end(),
              [](const auto& a, const auto& b) { return a.icd < b.icd; });
    return libraries;
  }
  if (from == kVendors) return {};  // there is no such folder
  if (from.extension() != ".icd") return {{"", from.string()}};
  const fs::path among = fs::path(kVendors) / from;
  return {read_icd(from.has_parent_path() || !fs::exists(among, error) ? from : among)};
}

std::vector<std::string> installation_problems() {
  const std::vector<VendorLibrary> libraries = vendor_libraries();
  if (libraries.empty()) return {vendors() + ": has no .icd file, which would name a platform"};
  std::vector<std::string> problems;
  for (const VendorLibrary& vendor : libraries)
    if (const std::string problem = problem_of(vendor); !problem.empty())
      problems.push_back((vendor.icd.empty() ? "OCL_ICD_VENDORS" : vendor.icd) + ": " + problem);
  return problems;
}

std::string newer_tbb() {
  for (const VendorLibrary& vendor : vendor_libraries())
    if (const std::string tbb = newer_tbb_beside(vendor); !tbb.empty()) return tbb;
  return "";
}

}  // namespace meniscus
