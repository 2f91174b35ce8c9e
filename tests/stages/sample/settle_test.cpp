// What samples show, against plain loops in double precision, on every device.
#include "verify/stage_cases/settle.hpp"

#include "device/kernels.hpp"
#include "stages/sample/settle.hpp"
#include "stages/stage_test_support.hpp"
#include "verify/stage_cases/into_new.hpp"

namespace meniscus {
namespace {

class Settle : public OnDevice {
 protected:
  const FieldScene scene_{device_, 37, 21, false};
  const std::size_t n_ = scene_.grid.size();
};

// Its bounds are asked of all stages in References.EveryStageIsWithinItsBounds; here, that it
// decides about most samples, and that all that samples may show is among them.
TEST_P(Settle, TheReferenceDecidesAboutAllThatSamplesMayShow) {
  const Layer layer = random_layer(scene_, 37);
  for (const bool only_gaps : {false, true}) {
    std::size_t sure = 0, of_what[4] = {}, splash = 0, on_edge = 0, turned = 0;
    for (std::size_t s = 0; s < n_; ++s) {
      const reference::FieldOnRay ray = scene_.ray(s);
      const reference::Shown shown =
          reference::settled(ray, layer.sample(s), scene_.limits(only_gaps), only_gaps);
      if (!shown.sure) continue;
      ++sure;
      ++of_what[shown.what];
      if (shown.what != reference::Shown::mixture) continue;
      splash += shown.splash;
      on_edge += layer.sample(s).on_edge;
      turned += dot(shown.normal, ray.direction) > -0.0101 * ray.speed;
      EXPECT_LT(shown.normal_error, 0.3);
      EXPECT_LT(shown.depth_error, 0.01);
    }
    EXPECT_GT(sure, n_ * 9 / 10);
    EXPECT_GT(of_what[reference::Shown::as_before], n_ / 20);
    EXPECT_GT(of_what[reference::Shown::nothing], n_ / 20);
    EXPECT_GT(of_what[reference::Shown::field], n_ / 40);
    if (only_gaps) continue;
    EXPECT_GT(of_what[reference::Shown::mixture], n_ / 10);
    EXPECT_GT(splash, n_ / 40);
    EXPECT_GT(of_what[reference::Shown::mixture] - splash, n_ / 40);
    EXPECT_GT(on_edge, n_ / 40);
    EXPECT_GT(turned, 0u);
  }
}

TEST_P(Settle, LevelWeightsRunFromALoneParticleToTheInside) {
  std::size_t between = 0;
  for (const double weight : scene_.field.weight) between += weight < 0.99 && weight > 0.52;
  EXPECT_GT(between, 10u);
  EXPECT_EQ(scene_.field.weight.back(), 1) << "the lone particle";
}

// Fits that reach out into the air, farther before the reference than the field is followed behind
// them: a search that ends there leaves holes in rims.
TEST_P(Settle, ABlendFarBeforeTheReferenceHidesNoField) {
  Layer before(n_);
  std::vector<reference::Crossing> expected(n_);
  for (std::size_t s = 0; s < n_; ++s) {
    const reference::FieldOnRay ray = scene_.ray(s);
    expected[s] =
        reference::first_crossing(ray, scene_.kStart, scene_.kEnd, scene_.params.blob_density);
    const double at = expected[s].sure && expected[s].depth < kNoSurface ? expected[s].depth : 20;
    before.reference[s] = static_cast<float>(at - 0.5);
    before.depth[s] = static_cast<float>(at - 8);
    before.trust[s] = 0.5f;
    const Vec3d towards = normalized(-ray.direction);
    before.normal[s] = static_cast<float>(towards.x);
    before.normal[n_ + s] = static_cast<float>(towards.y);
    before.normal[2 * n_ + s] = static_cast<float>(towards.z);
  }
  const Layer after = settled(device_, scene_, before, false);
  const Layer at_points = settled_at_points(device_, scene_, before);
  std::size_t met = 0;
  for (std::size_t s = 0; s < n_; ++s) {
    if (!expected[s].sure || !(expected[s].depth < kNoSurface)) continue;
    ++met;
    EXPECT_NEAR(after.depth[s], expected[s].depth, expected[s].error) << "sample " << s;
    EXPECT_EQ(after.kind[s], static_cast<cl_uchar>(Kind::splash));
    EXPECT_NEAR(at_points.depth[s], expected[s].depth, expected[s].error) << "point " << s;
  }
  EXPECT_GT(met, n_ / 10);
}

// The spheres that tell what lies behind leave gaps between particles. Samples that looked through
// them showed what lay farther behind: holes in spray.
TEST_P(Settle, ASampleThatLooksAgainPassesOverNoField) {
  Layer before(n_);
  std::vector<reference::Crossing> expected(n_);
  for (std::size_t s = 0; s < n_; ++s) {
    expected[s] = reference::first_crossing(scene_.ray(s), scene_.kStart, scene_.kEnd,
                                            scene_.params.blob_density);
    const double at = expected[s].sure && expected[s].depth < kNoSurface ? expected[s].depth : 20;
    before.behind[s] = static_cast<float>(at - 7);
    before.reference[s] = static_cast<float>(at + 9);
  }
  const Layer after = settled(device_, scene_, before, false);
  std::size_t met = 0;
  for (std::size_t s = 0; s < n_; ++s) {
    if (!expected[s].sure || !(expected[s].depth < kNoSurface)) continue;
    ++met;
    EXPECT_NEAR(after.depth[s], expected[s].depth, expected[s].error) << "sample " << s;
    EXPECT_EQ(after.behind[s], kNoSurface) << "sample " << s;
  }
  EXPECT_GT(met, n_ / 10);
}

TEST_P(Settle, PointsGiveTheBitsOfSamples) {
  Layer before = random_layer(scene_, 3);
  before.triangle.assign(n_, kNoSurface);
  before.behind.assign(n_, kNoSurface);
  // The points are searched two radii behind, samples four: the kernel by itself takes the same.
  const SurfaceBuffers samples = upload(device_, scene_.grid, before);
  const auto reference = upload(device_, before.reference);
  const SampleLists lists = list_gaps(device_, scene_.grid, reference, 0).lists;
  const auto behind = filled<float>(device_, n_, kNoSurface);
  SampleLists left = lists;
  left.sample = allocate<cl_int>(device_, lists.sample.size);
  const records::Settling how{screen_of(scene_.view, scene_.grid),
                              {static_cast<float>(scene_.params.contour_density),
                               static_cast<float>(scene_.params.blob_density), 3, 2, 2,
                               static_cast<float>(scene_.kDisorder)},
                              0};
  launch(device_, kernels::settle_samples, 1, range_of(lists, 1), lists,
         upload(device_, before.triangle), reference, samples, behind, left.sample, scene_.cells,
         how);
  launch(device_, kernels::follow_field, 1, range_of(lists, 1), left, reference, samples, behind,
         scene_.cells, scene_.levelled.weight, how);
  const Layer expected = download(device_, before, samples);

  const Layer actual = settled_at_points(device_, scene_, before);
  std::size_t changed = 0;
  for (std::size_t s = 0; s < n_; ++s) {
    EXPECT_TRUE(actual.same_sample(expected, s)) << "point " << s;
    changed += !actual.same_sample(before, s);
  }
  EXPECT_GT(changed, 30u);
}

// A GPU does both at once. Where splash is drawn in front of what the field has filled, and where
// the field lies before all splash.
TEST_P(Settle, GapsAndSplashAtOnceGiveTheBitsOfOneAfterTheOther) {
  use_width(1);
  const Layer before = random_layer(scene_, 5);
  std::vector<float> from(n_), to(n_);
  for (std::size_t s = 0; s < n_; ++s) {
    from[s] = s % 3 == 0 ? kNoSurface : static_cast<float>(12 + s % 7);
    to[s] = static_cast<float>(20 + s % 11);
  }
  const Extent extent{upload(device_, from), upload(device_, to), any_blocks(device_, scene_.grid)};
  const auto reference = upload(device_, before.reference);
  const auto drawn = [&](const auto& draw) {
    const SurfaceBuffers surface = upload(device_, scene_.grid, before);
    draw(surface, list_gaps(device_, scene_.grid, reference, 0).lists);
    return download(device_, before, surface);
  };
  const auto triangles = upload(device_, before.triangle);
  const auto settle = [&](const SurfaceBuffers& surface, const SampleLists& lists) {
    settle_samples(device_, scene_.view, lists, scene_.settling(), triangles, reference, surface,
                   upload(device_, before.behind), true);
  };
  const Layer filled = drawn(settle);
  const Layer expected = drawn([&](const SurfaceBuffers& surface, const SampleLists& lists) {
    settle(surface, lists);
    draw_splash(device_, scene_.view, lists, scene_.levelled, extent, surface, scene_.params);
  });
  const Layer actual = drawn([&](const SurfaceBuffers& surface, const SampleLists& lists) {
    settle_gaps(device_, scene_.view, lists, scene_.settling(), triangles, reference, extent,
                surface, upload(device_, before.behind));
  });
  std::size_t gaps = 0, splash = 0;
  for (std::size_t s = 0; s < n_; ++s) {
    EXPECT_TRUE(actual.same_sample(expected, s)) << "sample " << s;
    gaps += !filled.same_sample(before, s) && expected.same_sample(filled, s);
    splash += !expected.same_sample(filled, s);
  }
  EXPECT_GT(gaps, 10u);
  EXPECT_GT(splash, 10u);
}

MENISCUS_ON_EVERY_DEVICE(Settle);

}  // namespace
}  // namespace meniscus
