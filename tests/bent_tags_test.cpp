// Corners of tags on bottles, under a rolling shutter and on crumpled paper, compared with AprilTag 3 on the
// same images.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/bent_tags.hpp"
#include "tests/support/corner_table.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"
#include "waymark/tags/make_detector.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark {
namespace {

using testing::Bend;
using testing::BentTag;
using testing::BentTagOptions;
using testing::CornerLine;

/// The tags that both detectors find.
struct Compared {
  CornerLine own;      ///< before: the detector's corners; after: refined ones
  CornerLine library;  ///< before: AprilTag 3's corners; after: refined ones
  int tags = 0;
  int found = 0;
  int found_by_library = 0;
  int refined = 0;
  int unreliable = 0;
  int wrong = 0;  ///< off by more than 2 px and a tenth of the side, but not marked as unreliable

  [[nodiscard]] double share_refined() const { return refined / std::max(1.0, 1.0 * found); }
};

const TagDetection* find(const std::vector<TagDetection>& detections, const TagId& tag) {
  for (const TagDetection& detection : detections)
    if (detection.tag == tag) return &detection;
  return nullptr;
}

DetectorOptions options_of(const std::string& detector) {
  DetectorOptions options;
  options.detector = detector;
  options.max_hamming = 2;
  if (detector == "apriltag3") options.decode_sharpening = 0.25;  // its own setting
  return options;
}

void add(const BentTag& bent, const Detector& own, const Detector& library, Compared& sum) {
  const auto by_own = own.detect(bent.image).value();
  const auto by_library = library.detect(bent.image).value();
  const TagDetection* a = find(by_own, bent.truth.tag);
  const TagDetection* b = find(by_library, bent.truth.tag);
  ++sum.tags;
  sum.found += a != nullptr ? 1 : 0;
  sum.found_by_library += b != nullptr ? 1 : 0;
  if (a != nullptr) {
    const RefinedCorners refined = refine_corners(bent.image, *a);
    const bool reliable = refined.state == CornerState::Measured;
    sum.refined += refined.refined() ? 1 : 0;
    sum.unreliable += reliable ? 0 : 1;
    const double off_px = corner_distance_px(refined.corners_px, bent.truth.corners_px);
    sum.wrong += reliable && off_px > std::max(2.0, 0.1 * bent.truth.size_px) ? 1 : 0;
    if (b != nullptr && reliable)
      sum.own.add(bent.truth.corners_px, a->corners_px, refined.corners_px, refined.covariance_px2);
  }
  if (a != nullptr && b != nullptr) {
    const RefinedCorners refined = refine_corners(bent.image, *b);
    sum.library.add(bent.truth.corners_px, b->corners_px, refined.corners_px, refined.covariance_px2);
  }
}

/// `first_seed` differs between the seeds on which constants were chosen (1 to 999) and those tested.
Compared compare(const BentTagOptions& options, std::uint64_t first_seed, int tags) {
  const auto own = make_detector(options_of("waymark")).value();
  const auto library = make_detector(options_of("apriltag3")).value();
  Compared sum;
  for (int i = 0; i < tags; ++i)
    add(testing::bent_tag(options, first_seed + static_cast<std::uint64_t>(i)), *own, *library, sum);
  std::printf(
      "%-9s %5.2f, %3.0f px, blur %.1f: found %3d (AprilTag 3 %3d) of %3d, refined %3.0f %%, unreliable %d, "
      "wrong %d; "
      "corners %.3f px, refined %.3f (promised %.3f, NEES/8 %.2f, %d far off); AprilTag 3 %.3f, refined %.3f "
      "(NEES/8 "
      "%.2f)\n",
      std::string(testing::to_string(options.bend)).c_str(), options.amount, options.size_px, options.blur_px,
      sum.found, sum.found_by_library, sum.tags, 100 * sum.share_refined(), sum.unreliable, sum.wrong,
      sum.own.rmse_before_px(), sum.own.rmse_px(), sum.own.promised_px(), sum.own.nees_tag(),
      sum.own.far_off(), sum.library.rmse_before_px(), sum.library.rmse_px(), sum.library.nees_tag());
  return sum;
}

std::uint64_t first_seed() {
  const char* const given = std::getenv("WAYMARK_BENT_SEED");
  constexpr std::uint64_t kTested = 1000;
  return given != nullptr ? std::strtoull(given, nullptr, 10) : kTested;
}

class BentTags : public ::testing::TestWithParam<BentTagOptions> {};
INSTANTIATE_TEST_SUITE_P(
    Bends, BentTags,
    ::testing::Values(BentTagOptions{Bend::Cylinder, 30, 60}, BentTagOptions{Bend::Cylinder, 50, 40},
                      BentTagOptions{Bend::Cylinder, 50, 100}, BentTagOptions{Bend::Cylinder, 50, 100, 1.4},
                      BentTagOptions{Bend::Cylinder, 70, 60}, BentTagOptions{Bend::Cylinder, 70, 160},
                      BentTagOptions{Bend::Wobble, 0.03, 40}, BentTagOptions{Bend::Wobble, 0.03, 100},
                      BentTagOptions{Bend::Wobble, 0.03, 100, 1.4}, BentTagOptions{Bend::Wobble, 0.05, 60},
                      BentTagOptions{Bend::Crumpled, 0.03, 40}, BentTagOptions{Bend::Crumpled, 0.03, 100},
                      BentTagOptions{Bend::Crumpled, 0.05, 60},
                      BentTagOptions{Bend::Crumpled, 0.05, 100, 1.4}),
    [](const auto& of) {
      const BentTagOptions& options = of.param;
      return std::string(testing::to_string(options.bend)) + std::to_string(of.index);
    });

TEST_P(BentTags, HaveBetterCornersThanAprilTag3s) {
  const Compared sum = compare(GetParam(), first_seed(), 40);
  EXPECT_GE(sum.found, sum.found_by_library);
  EXPECT_LE(sum.unreliable, 0.15 * sum.found);
  EXPECT_LE(sum.own.rmse_before_px(), 1.02 * sum.library.rmse_before_px());
  EXPECT_LE(sum.own.rmse_px(), 0.5 * sum.library.rmse_before_px());
  EXPECT_EQ(sum.wrong, 0);
  EXPECT_LE(sum.own.far_off(), 1);
  EXPECT_LT(sum.own.nees_tag(), 2);
  EXPECT_GT(sum.own.nees_tag(), 0.4);
}

TEST(FlatTags, AreNotTakenForBentOnes) {
  for (const double size_px : {40.0, 100.0}) {
    const Compared sum = compare({Bend::Flat, 0, size_px}, first_seed(), 40);
    EXPECT_EQ(sum.found, sum.tags);
    EXPECT_EQ(sum.refined, sum.found);
    EXPECT_LT(sum.own.rmse_px(), 0.05);
    EXPECT_LT(sum.own.nees_tag(), 1.5);
  }
}

}  // namespace
}  // namespace waymark
