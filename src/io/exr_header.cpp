#include "io/exr_header.hpp"

#include <ImfDoubleAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>

#include <array>

#include "io/seal.hpp"
#include "meniscus/camera.hpp"
#include "meniscus/extract.hpp"

namespace meniscus {
namespace {

using Matrix = std::array<double, 16>;  // row-major, for column vectors

Matrix multiply(const Matrix& a, const Matrix& b) {
  Matrix product{};
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      for (int k = 0; k < 4; ++k) product[r * 4 + c] += a[r * 4 + k] * b[k * 4 + c];
  return product;
}

// OpenEXR's standard matrices act on row vectors, x * M.
Imath::M44f for_row_vectors(const Matrix& m) {
  Imath::M44f result;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) result[c][r] = static_cast<float>(m[r * 4 + c]);
  return result;
}

Imath::M44d as_given(const Matrix& m) {
  Imath::M44d result;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) result[r][c] = m[r * 4 + c];
  return result;
}

}  // namespace

Imf::Header make_exr_header(const Surface& surface, const Parameters& parameters,
                            Imf::Compression compression, const std::string& job,
                            const std::string& comments) {
  const Camera& camera = surface.camera;
  Imf::Header header(camera.width, camera.height, static_cast<float>(pixel_aspect_ratio(camera)));
  header.compression() = compression;

  // OpenEXR's camera space is left-handed with +z forward; its NDC runs from (0, 0) at the upper
  // left corner to (1, 1) at the lower right one.
  const Matrix forward = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1};
  const Matrix ndc = {.5, 0, 0, .5, 0, -.5, 0, .5, 0, 0, 1, 0, 0, 0, 0, 1};
  const Matrix clip = multiply(camera.projection, camera.view);
  Imf::addWorldToCamera(header, for_row_vectors(multiply(forward, camera.view)));
  Imf::addWorldToNDC(header, for_row_vectors(multiply(ndc, clip)));
  Imf::addComments(header, comments);
  header.insert("software", Imf::StringAttribute("Meniscus " + version()));
  check_job(job);
  header.insert("meniscus.hash", Imf::StringAttribute(kNoHash));
  if (!job.empty()) header.insert("meniscus.job", Imf::StringAttribute(job));
  header.insert("meniscus.method", Imf::StringAttribute(to_string(parameters.method)));
  header.insert("meniscus.parameters", Imf::StringAttribute(describe(parameters)));
  header.insert("meniscus.particleRadius", Imf::DoubleAttribute(surface.particle_radius));
  if (surface.disorder > 0)
    header.insert("meniscus.disorder", Imf::DoubleAttribute(surface.disorder));
  header.insert("meniscus.view", Imf::M44dAttribute(as_given(camera.view)));
  header.insert("meniscus.projection", Imf::M44dAttribute(as_given(camera.projection)));
  return header;
}

}  // namespace meniscus
