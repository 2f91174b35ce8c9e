#include "kernels/cases.hpp"
#include "kernels/fit_problems.hpp"
#include "stages/fit.hpp"

namespace meniscus::bench {

Case prepare_fit(Frame& frame) {
  const auto problems = fit_problems(frame);
  Workers alone(1);
  weigh(*problems, alone);
  const FitBatches& batches = problems->batches;
  Device& device = frame.device;
  const auto fits = std::make_shared<DeviceFits>(
      DeviceFits{upload(device, problems->points), upload(device, batches.first),
                 upload(device, batches.length), upload(device, problems->scale),
                 filled<float>(device, 10 * batches.lanes, 0.0f),
                 filled<float>(device, 2 * batches.lanes, -1.0f), batches.lanes, batches.slots});
  Case result;
  result.unit = "fits";
  result.items = problems->fits;
  // Seven values a point; a scale read, ten coefficients and two qualities written a fit.
  result.bytes = 28 * problems->neighbours + 52 * problems->fits;
  // A point: d 3, products of two coordinates 6, e 12, o 15, weighted 26; moments of degree 0 to 2:
  // 13, of degree 3: 40, of degree 4: 90; the right-hand side 19; the residual: quadric 18,
  // distance 3, exponential 21, weight 3, sums 4. A fit: ridge 21, Cholesky 415, substitution 200,
  // slope 7, scale 14.
  result.operations = (224 + 49) * problems->neighbours + 657 * problems->fits;
  result.launch = [&frame, fits] { fit_batches(frame.device, *fits, frame.params.fit); };
  result.native = [problems](Workers& workers) { fit(*problems, workers); };
  result.differing = [&frame, problems, fits] {
    return count_differing(problems->quadric, download(frame.device, fits->quadric)) +
           count_differing(problems->quality, download(frame.device, fits->quality));
  };
  return result;
}

}  // namespace meniscus::bench
