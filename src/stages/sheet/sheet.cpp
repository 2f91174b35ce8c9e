#include "stages/sheet/sheet.hpp"

#include <algorithm>

#include "device/kernels.hpp"
#include "device/together.hpp"
#include "stages/frame/density.hpp"

namespace meniscus {

void average_sheet(Device& device, const SheetFits& fits, const SheetWeights& weights,
                   const Buffer<float>& mean) {
  const std::size_t n = fits.share.size;
  if (n == 0) return;
  const int width = device.state().wide_width();
  launch(device, kernels::average_on_sheets, width, range_of_blocks(n, width), mean, fits.cells,
         fits.normal, fits.share, fits.value,
         records::SheetMeans{static_cast<cl_int>(n), static_cast<cl_int>(fits.value.size / n),
                             weights});
}

}  // namespace meniscus
