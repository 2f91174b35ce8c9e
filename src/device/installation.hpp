// What is installed for OpenCL, as its loader finds it: for messages, and for what must be known
// before the first OpenCL call.
#pragma once

#include <string>
#include <vector>

namespace meniscus {

/// A vendor's library that the loader is told to load.
struct VendorLibrary {
  std::string icd;      // the file that names it; empty: OCL_ICD_VENDORS does
  std::string library;  // as it is named: a path, or a name that the dynamic linker looks up
};

/// The libraries that the loader looks for: those of the .icd files in /etc/OpenCL/vendors, or in
/// the folder, .icd file or library that OCL_ICD_VENDORS names. Makes no OpenCL call.
std::vector<VendorLibrary> vendor_libraries();

/// Why vendors' libraries give no platform, one line for each that does not, and one where none is
/// named at all. To be called after the first OpenCL call.
std::vector<std::string> installation_problems();

/// The oneTBB that this process must load first for a vendor's library to load: Intel's comes with
/// one beside it, and fails where an older one has been loaded before, as by this library. Empty:
/// none. Makes no OpenCL call.
std::string newer_tbb();

/// How many work-items Intel's CPU runtime makes vectors of: an environment variable that it reads
/// before it first builds. list_devices sets it to 1 where it is not set.
inline constexpr const char* kIntelVectorizer = "CL_CONFIG_CPU_VECTORIZER_MODE";

}  // namespace meniscus
