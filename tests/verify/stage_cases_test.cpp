// The stages' cases: that every device stays within the bounds, and that they notice errors.
#include "verify/stage_cases.hpp"

#include <gmock/gmock.h>

#include "stages/stage_test_support.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {
namespace {

using References = OnDevice;

TEST_P(References, EveryStageIsWithinItsBounds) {
  for (const StageCase& stage : stage_cases())
    for (const int size : stage.sizes)
      for (const int width : {1, 8}) {
        use_width(width);
        SCOPED_TRACE(std::string(stage.stage) + ", size " + std::to_string(size) + ", width " +
                     std::to_string(width));
        expect_within(stage.run(device_, size));
      }
}

// Which weigh less, and whose fits and field are compared more widely.
TEST_P(References, ImplicitOfIrregularParticlesIsWithinItsBounds) {
  for (const double disorder : {0.5, 1.0, 1.6})
    expect_within(implicit_errors(device_, 600, {.amount = disorder}));
}

// Whose lone particles count more.
TEST_P(References, WeightsOfIrregularParticlesAreWithinTheirBounds) {
  for (const double disorder : {0.3, 1.0, 1.6})
    expect_within(weight_errors(device_, 37, {.amount = disorder}));
}

TEST_P(References, NoticeAWrongFactorOfALoneParticle) {
  Device device(GetParam());
  device.state().kernel_text = [&](const std::string&, std::string text) {
    const std::string from = "#define AMONG_MANY 0.3f";
    const std::size_t at = text.find(from);
    return at == std::string::npos ? text : text.replace(at, from.size(), from + " * 1.001f");
  };
  const ReferenceError error = weight_errors(device, 37, {.amount = 2}).front();
  EXPECT_GT(error.ulp, error.allowed);
}

struct Fault {
  const char* stage;
  int size;
  const char *file, *from, *to;
};

// A factor that is off by little in the kernels of each stage.
const Fault kFaults[] = {
    {"bins", 61, "bins.cl", "!(nearest <= bound[bin])", "!(nearest < bound[bin])"},
    {"visible", 63, "visible.cl", "front = t - bulge * sqrt(",
     "front = t - 1.001f * bulge * sqrt("},
    {"minima", 63, "minima.cl", "d.s5 * sqrt(", "1.001f * d.s5 * sqrt("},
    {"minima", 63, "minima.cl", "inside & (back > ", "inside & (back < "},
    {"minima", 63, "minima.cl", "atomic_dec(owned + before)", "atomic_inc(owned + before)"},
    {"minima", 63, "visible.cl", "owned[k] = 0", "owned[k] = 1"},
    {"density", 65, "density.cl", "scatter_float(sum.c * NORM",
     "scatter_float(sum.c * (1.0001f * NORM)"},
    {"density", 65, "density.cl", "gradient_of(f.gy)", "gradient_of(f.gx)"},
    {"motion", 65, "motion.cl", "weight += w;", "weight += 1.001f * w;"},
    {"particle_fit", 11, "neighbours.cl", "*squares += w", "*squares += 1.05f * w"},
    {"particle_fit", 11, "particle_fit.cl", "0.75f - y * y", "0.78f - y * y"},
    {"particle_fit", 11, "neighbours.cl", "(-1.0f / (FIT_REACH", "(-1.01f / (FIT_REACH"},
    {"particle_fit", 11, "particle_fit.cl", "fma(firmly, smaller(along",
     "fma(1.01f * firmly, smaller(along"},
    {"particle_fit", 11, "particle_fit.cl", "f * ahead", "1.02f * f * ahead"},
    {"particle_fit", 11, "particle_fit.cl", "3.0f * firmly", "3.03f * firmly"},
    {"particle_fit", 11, "particle_fit.cl", "(0.0f, 1.0f, rise)", "(0.0f, 2.0f, rise)"},
    {"particle_fit", 11, "neighbours.cl", "(low, 1.0f, (u + firm)",
     "(low + 0.02f, 1.0f, (u + firm)"},
    {"particle_fit", 11, "particle_fit.cl", "INT_MAX, counted) / 20", "INT_MAX, counted) / 10"},
    {"particle_fit", 11, "particle_fit.cl", "for (int bit = 30; bit >= 0;",
     "for (int bit = 30; bit > 17;"},
    {"particle_fit", 11, "particle_fit.cl", "share = *noise / r", "share = 1.001f * *noise / r"},
    {"particle_fit", 11, "edges.cl", "smooth_step(0.38f, 0.55f", "smooth_step(0.1f, 0.55f"},
    {"roundness", 11, "roundness.cl", "squares / larger", "1.001f * squares / larger"},
    {"roundness", 11, "roundness.cl", "A.ff * va), value", "1.01f * A.ff * va), value"},
    {"roundness", 11, "sheet.cl", "(p * sqrt(p)", "(p * sqrt(1.001f * p)"},
    {"roundness", 11, "sheet.cl", "larger(square - noise,", "larger(square - 1.001f * noise,"},
    {"roundness", 11, "sheet.cl", "30.0f * missed", "30.5f * missed"},
    {"roundness", 11, "sheet.cl", "+ 0.01f) / sqrt", "+ 0.0102f) / sqrt"},
    {"roundness", 11, "sheet.cl", "SHARP 3.48f", "SHARP 3.46f"},
    {"roundness", 11, "sheet.cl", "1.5f * apart", "1.51f * apart"},
    {"roundness", 11, "sheet.cl", "(floatv)(0.12f +", "(floatv)(0.02f +"},
    {"roundness", 11, "sheet.cl", "20.0f * apart", "20.5f * apart"},
    {"roundness", 11, "sheet.cl", "one + 0.008f", "one + 0.0081f"},
    {"roundness", 11, "roundness.cl", "around.ny * own.ny", "around.ny * own.nx"},
    {"roundness", 11, "sheet.cl", "means.c, bends = smooth_step(0.005f, 0.02f",
     "means.c, bends = smooth_step(0.005f, 0.0201f"},
    {"roundness", 11, "prelude.cl", "1.0f / 3.0f", "1.0f / 4.0f"},
    {"trust", 11, "edges.cl", "clamp(-c[0], -1.0f", "clamp(c[0], -1.0f"},
    {"trust", 11, "edges.cl", "deep = foot - feet.deep", "deep = foot - 1.001f * feet.deep"},
    {"trust", 11, "edges.cl", "SELECT(none, firmness, fitted)", "SELECT(none, one, fitted)"},
    {"blend", 9, "hits.cl", "fabs(B) + sqrt(D)", "fabs(B) + 1.0001f * sqrt(D)"},
    {"blend", 23, "hits.cl", "#define GRAZE 0.3f", "#define GRAZE 0.303f"},
    {"blend", 23, "hits.cl", "#define OVER 0.06f", "#define OVER 0.08f"},
    {"blend", 23, "hits.cl", "#define LEAST_BEND 0.02f", "#define LEAST_BEND 0.3f"},
    {"blend", 23, "hidden.cl", "smooth_step(0.5f * ROUNDEST, ROUNDEST,",
     "smooth_step(0.9f * ROUNDEST, ROUNDEST,"},
    {"blend", 23, "hidden.cl", "(within > beyond)", "(within < beyond)"},
    {"blend", 23, "blend.cl", "edge |= (within > least) & (within > beyond)",
     "edge |= (within > least) & (within < beyond)"},
    {"blend", 23, "hidden.cl", "#define HOLDING_SURE 0.002f", "#define HOLDING_SURE 0.2f"},
    {"particle_fit", 37, "edges.cl", "(one - across);", "(one - 0.9f * across);"},
    {"blend", 23, "creases.cl", "smooth_step(0.95f, 0.98f, length)",
     "smooth_step(0.94f, 0.98f, length)"},
    {"blend", 37, "hidden.cl", "#define ROUND_LEEWAY 0.2f", "#define ROUND_LEEWAY 0.25f"},
    {"blend", 23, "hidden.cl", "strong_outside * r->w > CREDIBLE",
     "strong_outside * r->w < CREDIBLE"},
    {"implicit", 600, "implicit.cl", "clamp(4.0f * (c - contour", "clamp(4.2f * (c - contour"},
    {"implicit", 600, "implicit.cl", "rest * (1.0f - share)", "1.01f * rest * (1.0f - share)"},
    {"implicit", 600, "implicit.cl", "c = share * (vv * v)", "c = 1.0001f * share * (vv * v)"},
    {"interpolate", 67, "interpolate.cl", "0.5f * (linear + b.depth * share)",
     "0.50001f * (linear + b.depth * share)"},
    {"interpolate", 67, "interpolate.cl", "smooth & (farthest < cells.tolerance)",
     "smooth & (farthest < 1.1f * cells.tolerance)"},
    {"interpolate", 67, "interpolate.cl", "high - low < spread", "high - low < 1.01f * spread"},
    {"interpolate", 67, "interpolate.cl", "slope < -0.1f", "slope < -0.2f"},
    {"interpolate", 67, "interpolate.cl", "(turned > cells.agreeing)",
     "(turned > 0.9f * cells.agreeing)"},
    {"choose_groups", 61, "choose_groups.cl", "hit.weight > best", "hit.weight > 1.02f * best"},
    {"choose_groups", 61, "choose_groups.cl", "+ every, samples)", ", samples)"},
    {"sheet", 63, "sheet.cl", "fits.share[p] * larger", "1.0001f * larger"},
    {"region", 13, "region.cl", "inside & (d > 0.0f) & (d < map", "inside & (d > 0.0f) & (d > map"},
    {"region", 13, "region.cl", "(l1 >= -1e-5f)", "(l1 >= 1e-2f)"},
    {"behind", 300, "behind.cl", "(front > least)", "(front > 1.001f * least)"},
    {"settle", 37, "settle.cl", "clamp(20.0f * inside", "clamp(21.0f * inside"},
    {"settle", 37, "settle.cl", "#define NEARLY 0.1f", "#define NEARLY 0.2f"},
    {"settle", 37, "settle.cl", "carried.on_edge & (share > 0.5f)",
     "carried.on_edge & (share > 0.8f)"},
    {"settle", 37, "settle.cl", "0.1f * (1.0f - carried.trust)", "0.11f * (1.0f - carried.trust)"},
    {"settle", 37, "settle.cl", "2.0f * limits.before, reference",
     "2.01f * limits.before, reference"},
    {"settle", 37, "field.cl", "1.0f + 1.0f * disorder", "1.02f + 1.0f * disorder"},
    {"settle", 37, "field.cl", "0.6f - 0.6f * disorder", "0.65f - 0.6f * disorder"},
    {"settle", 37, "field.cl", "clamp(100.0f * (1.0f - trust)", "clamp(103.0f * (1.0f - trust)"},
    {"settle", 37, "settle.cl", "smaller(t, t0) - limits.before", "larger(t, t0) - limits.before"},
    {"settle", 37, "settle.cl", "lanes->used & (c.depth < on.end)",
     "lanes->used & (c.depth > on.end)"},
    {"settle", 37, "field.cl", "#define W1 (0.456322f", "#define W1 (0.4562f"},
    {"settle", 37, "density.cl", "(0.45f - level) *", "(0.46f - level) *"},
    {"specks", 71, "specks.cl", "STOREF(sum / number, new_depth)",
     "STOREF(1.0001f * sum / number, new_depth)"},
    {"specks", 71, "specks.cl", "around >= 17", "around >= 18"},
    {"specks", 71, "specks.cl", "< t - jump", "< t"},
    {"specks", 71, "specks.cl", "(agreement > 0.93f) &\n                     (along",
     "(agreement > 0.94f) &\n                     (along"},
    {"fairing", 71, "fairing.cl", "both * both * same", "both * near * same"},
    {"fairing", 71, "fairing.cl", "smooth_step(0.7f, 0.9f", "smooth_step(0.7f, 0.91f"},
    {"fairing", 71, "fairing.cl", "#define FAIR_APART 1.4f", "#define FAIR_APART 1.5f"},
    {"paper blend", 53, "paper.cl", "4.0f * A * C", "4.05f * A * C"},
    {"paper blend", 53, "paper.cl", "how.b_gain * like", "1.002f * how.b_gain * like"},
    {"paper", 40, "paper.cl", "total * (r < 3", "1.01f * total * (r < 3"},
    {"ssm", 21, "ssm.cl", "weight * ((n - tap) / (n + (tap + 1.0f)))",
     "weight * ((n - tap) / (n + (tap + 1.01f)))"},
    {"spheres", 21, "spheres.cl", "(b + sqrt(discriminant)) / r.a;",
     "(b + 1.001f * sqrt(discriminant)) / r.a;"},
    {"filter", 17, "filter.cl", "window.u = w * w * (0.5f", "window.u = w * w * (0.51f"},
    {"whitewater", 700, "whitewater.cl", "x * cut + (under_arc(height)",
     "x * cut + 1.01f * (under_arc(height)"},
    {"whitewater", 700, "whitewater.cl", "2.88539008f * series", "2.8f * series"},
    {"whitewater", 700, "whitewater.cl", "if (before + rest < before) ++carried;",
     "if (before + rest < before) carried += 2;"},
    {"whitewater", 700, "whitewater.cl", "disc.depth <= to[s]", "disc.depth <= 0.99f * to[s]"},
    {"whitewater", 700, "whitewater.cl", "share * disc.vy", "share * 1.001f * disc.vy"},
    {"whitewater", 700, "whitewater.cl", "from[s] + how.slack", "from[s]"},
    {"whitewater", 700, "whitewater.cl", "atomic_min(depth + s", "atomic_max(depth + s"},
};

TEST_P(References, NoticeAFactorThatIsOffByLittle) {
  for (const Fault& fault : kFaults) {
    Device device(GetParam());
    device.state().vector_width = 1;
    bool planted = false;
    device.state().kernel_text = [&](const std::string& file, std::string text) {
      const std::size_t at = file == fault.file ? text.find(fault.from) : std::string::npos;
      if (at == std::string::npos) return text;
      planted = true;
      return text.replace(at, std::string(fault.from).size(), fault.to);
    };
    bool noticed = false;
    for (const StageCase& stage : stage_cases())
      if (std::string(stage.stage) == fault.stage)
        for (const ReferenceError& error : stage.run(device, fault.size))
          noticed |= error.ulp > error.allowed;
    EXPECT_TRUE(planted) << fault.file << ": " << fault.from;
    EXPECT_TRUE(noticed) << fault.stage << ": " << fault.to;
  }
}

MENISCUS_ON_EVERY_DEVICE(References);

TEST(Worst, IsTheErrorThatUsesTheMostOfItsBound) {
  Worst worst("kernel", "output");
  worst.see(1, 1, 0);
  EXPECT_EQ(worst.error().ulp, 0);
  worst.see(1 + 0x1p-22, 1, 0x1p-20);
  EXPECT_EQ(worst.error().ulp, 2);
  EXPECT_EQ(worst.error().allowed, 8);
  worst.see(1 + 0x1p-21, 1, 1);  // more, but allowed more
  EXPECT_EQ(worst.error().ulp, 2);
  worst.see(4 + 0x1p-19, 4, 0x1p-19);
  EXPECT_EQ(worst.error().ulp, 4);
  EXPECT_EQ(worst.error().allowed, 4);
  worst.see(INFINITY, INFINITY, 0);
  EXPECT_EQ(worst.error().ulp, 4);
  worst.see(1, INFINITY, 0);
  EXPECT_EQ(worst.error().ulp, INFINITY);
  EXPECT_EQ(worst.error().allowed, 0);
}

}  // namespace
}  // namespace meniscus::verify
