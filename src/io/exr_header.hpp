// What all EXR files of surfaces have in common.
#pragma once

#include <ImfCompression.h>
#include <ImfHeader.h>
#include <ImfIO.h>

#include <exception>
#include <string>

#include "io/output_file.hpp"
#include "io/seal.hpp"
#include "meniscus/error.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

/// Lets OpenEXR write through OutputFile.
class ExrStream : public Imf::OStream {
 public:
  explicit ExrStream(OutputFile& file) : OStream(file.path().c_str()), file_(file) {}
  void write(const char bytes[], int size) override {
    file_.write(bytes, static_cast<std::size_t>(size));
  }
  std::uint64_t tellp() override { return file_.position(); }
  void seekp(std::uint64_t position) override { file_.seek(position); }

 private:
  OutputFile& file_;
};

/// Calls write() and seals the file; what OpenEXR throws becomes OutputError. OpenEXR's destructors
/// write its tables of offsets and swallow errors, which sealing reports.
template <class Write>
void write_with_openexr(OutputFile& file, const Write& write) {
  try {
    write();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw OutputError(file.path() + ": cannot be written: OpenEXR: " + error.what());
  }
  seal(file, OutputFormat::exr);
}

/// A header with the surface's camera, in OpenEXR's words and in ours, what it was made with, and
/// the seal; without channels.
Imf::Header make_exr_header(const Surface& surface, const Parameters& parameters,
                            Imf::Compression compression, const std::string& job,
                            const std::string& comments);

}  // namespace meniscus
