// Loading what an OpenCL platform needs before this program's own libraries are.
#pragma once

namespace meniscus::cli {

/// Where an OpenCL platform needs a newer oneTBB than the one that the program was started with,
/// and has it beside it, starts the program anew with that one loaded first; two of them in a
/// process are refused by the dynamic linker. Returns where there is nothing to do, or it cannot be
/// done. To be called first of all.
void start_with_newer_tbb(char** argv);

}  // namespace meniscus::cli
