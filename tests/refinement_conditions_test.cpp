// Refined corners under the effects of real cameras, one at a time and in combination, starting from AprilTag
// 3's corners. The renderer of the images shares no code with the refinement.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/camera_chain.hpp"
#include "tests/support/corner_table.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark {
namespace {

using testing::CameraChain;
using testing::CornerLine;

struct Outcome {
  CornerLine all;  ///< refined or not
  CornerLine refined_only;
  int refined = 0;
  int worse = 0;  ///< less accurate than the detector's corners

  [[nodiscard]] double share(int count) const {
    return count / std::max<double>(1.0, static_cast<double>(all.tags()));
  }
};

double squared_error(const std::array<Eigen::Vector2d, 4>& corners, const TrueTag& truth) {
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) sum += (corners[k] - truth.corners_px[k]).squaredNorm();
  return sum;
}

bool full() { return std::getenv("WAYMARK_FULL") != nullptr; }

Outcome measure(const std::string& name, const CameraChain& chain, int tags) {
  const auto detector = make_apriltag_detector({}).value();
  Outcome outcome;
  for (int i = 0; i < tags; ++i) {
    const auto photo = testing::photographed_tag(chain, 1000 + static_cast<std::uint64_t>(i));
    const auto detections = detector->detect(photo.image).value();
    for (const TagDetection& found : detections) {
      if (found.tag != photo.truth.tag) continue;
      const RefinedCorners result = refine_corners(photo.image, found);
      outcome.all.add(photo.truth.corners_px, found.corners_px, result.corners_px, result.covariance_px2);
      outcome.refined += result.refined() ? 1 : 0;
      if (result.refined())
        outcome.refined_only.add(photo.truth.corners_px, found.corners_px, result.corners_px,
                                 result.covariance_px2);
      outcome.worse +=
          squared_error(result.corners_px, photo.truth) > squared_error(found.corners_px, photo.truth) ? 1
                                                                                                       : 0;
    }
  }
  outcome.all.print(name);
  std::printf("  refined %.0f %%, worse than the detector's %.1f %%, %d corners far off\n",
              100 * outcome.share(outcome.refined), 100 * outcome.share(outcome.worse),
              outcome.refined_only.far_off());
  return outcome;
}

/// Effects outside the bounds; docs/concepts/corner_refinement.md has their figures.
const std::set<std::string>& known_limits() {
  static const std::set<std::string> limits = {"gloss", "corner covered"};
  return limits;
}

TEST(RefinementConditions, AreConsistentUnderEachEffectAlone) {
  const std::set<std::string> kShort = {"even light",  "gamma 2.2", "black +-10",
                                        "light +-6 %", "white 400", "paper over edge"};
  CornerLine::print_header();
  for (const auto& [name, chain] : testing::single_effects()) {
    if (known_limits().contains(name) || (!full() && !kShort.contains(name))) continue;
    const Outcome outcome = measure(name, chain, full() ? 300 : 16);
    ASSERT_GT(outcome.all.tags(), 5U) << name;
    EXPECT_GT(outcome.all.nees_tag(), full() ? 0.5 : 0.3) << name;
    EXPECT_LT(outcome.all.nees_tag(), full() ? 2.0 : 2.5)
        << name;  // 16 tags: the mean has a standard deviation of 13 %
    EXPECT_EQ(outcome.refined_only.far_off(), 0) << name;
    EXPECT_LE(outcome.all.rmse_px(), outcome.all.rmse_before_px()) << name;
  }
}

TEST(RefinementConditions, AreConsistentUnderManyEffectsAtOnce) {
  if (!full()) GTEST_SKIP() << "WAYMARK_FULL";
  CornerLine::print_header();
  Random random(77);
  int outside = 0;
  constexpr int combinations = 200;
  for (int i = 0; i < combinations; ++i) {
    const Outcome outcome = measure("combination " + std::to_string(i), testing::random_chain(random), 300);
    outside += outcome.all.nees_tag() < 0.4 || outcome.all.nees_tag() > 2.5 ? 1 : 0;
    EXPECT_LT(outcome.all.rmse_px(), outcome.all.rmse_before_px()) << i;
  }
  EXPECT_LE(outside, combinations / 10);
}

}  // namespace
}  // namespace waymark
