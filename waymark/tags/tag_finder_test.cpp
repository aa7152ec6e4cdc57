#include "waymark/tags/tag_finder.hpp"

#include <cstddef>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/facing_tag.hpp"

namespace waymark {
namespace {

using testing::detection_at;
using testing::Print;
using testing::render;
using testing::worst_error;

// A caller cannot omit the lens by accident.
static_assert(!std::is_default_constructible_v<ImageLens>);
static_assert(!std::is_convertible_v<const CameraModel*, ImageLens>);
static_assert(!std::is_convertible_v<std::nullptr_t, ImageLens>);
static_assert(!std::is_constructible_v<ImageLens, const CameraModel*>);
static_assert(!std::is_invocable_v<decltype(&find_tags), const ImageView&, const TagFinder&>);

/// Returns the given detections or a given error.
class ScriptedDetector final : public Detector {
 public:
  explicit ScriptedDetector(Result<std::vector<TagDetection>> answer) : answer_(std::move(answer)) {}
  using Detector::detect;
  [[nodiscard]] Result<std::vector<TagDetection>> detect(const ImageView& /*image*/) const override {
    return answer_;
  }

 private:
  Result<std::vector<TagDetection>> answer_;
};

TEST(TagFinder, RefinesDetections) {
  Print print;
  print.noise = 2;
  Random random(19);
  TagDetection elsewhere = detection_at(print, 0, random);
  elsewhere.tag.number = 8;
  for (auto& corner : elsewhere.corners_px)
    corner.x() -= 30;  // at a position in the image where there is no tag
  const Image image = render(print);
  const auto finder = make_tag_finder(
      std::make_unique<ScriptedDetector>(std::vector{detection_at(print, 0.2, random), elsewhere}));
  ASSERT_TRUE(finder);
  const auto found = find_tags(image, *finder, ImageLens::unknown());
  ASSERT_TRUE(found);
  ASSERT_EQ(found->detections.size(), 2U);
  const TagDetection& first = found->detections[0];
  EXPECT_LT(worst_error(first.corners_px, print), 0.1);
  ASSERT_TRUE(first.corner_covariance_px2);
  EXPECT_LT(first.corner_covariance_px2->diagonal().maxCoeff(), 0.05 * 0.05);
  EXPECT_EQ(found->detections[1].corners_px, elsewhere.corners_px);
  EXPECT_EQ(found->detections[1].corner_covariance_px2,
            CornerCovariance(0.25 * CornerCovariance::Identity()));
  ASSERT_EQ(found->refinements.size(), 2U);
  EXPECT_EQ(found->refinements[0], RefinementOutcome::Refined);
  EXPECT_NE(found->refinements[1], RefinementOutcome::Refined);
}

TEST(TagFinder, KeepsTheDetectorsCornersWithoutRefinement) {
  Print print;
  Random random(20);
  const TagDetection seen = detection_at(print, 0.2, random);
  const TagFinder finder{.detector = std::make_unique<ScriptedDetector>(std::vector{seen})};
  const auto found = find_tags(render(print), finder, ImageLens::unknown());
  ASSERT_TRUE(found);
  EXPECT_EQ(found->detections.at(0).corners_px, seen.corners_px);
  EXPECT_FALSE(found->detections[0].corner_covariance_px2);
  EXPECT_TRUE(found->refinements.empty());
}

TEST(TagFinder, DropsAndCountsTagsOutsideTheDomainOfTheLens) {
  // The domain ends 304 px from the principal point.
  const auto camera = CameraModel::make(
      PinholeRadtan{.fx = 500, .fy = 500, .cx = 640, .cy = 360, .k = {-0.4}, .coefficients = 4}, 1280, 720);
  ASSERT_TRUE(camera);
  TagDetection inside{.tag = {FamilyId::Tag36h11, 1}};
  inside.corners_px = {Eigen::Vector2d(600, 320), Eigen::Vector2d(680, 320), Eigen::Vector2d(680, 400),
                       Eigen::Vector2d(600, 400)};
  TagDetection outside{.tag = {FamilyId::Tag36h11, 2}, .corners_px = inside.corners_px};
  for (Eigen::Vector2d& corner : outside.corners_px) corner.x() += 300;
  const TagFinder finder{.detector = std::make_unique<ScriptedDetector>(std::vector{inside, outside})};
  const auto found = find_tags(Image(1280, 720), finder, ImageLens::of(*camera));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->beyond_lens, 1U);
  ASSERT_EQ(found->detections.size(), 1U);
  EXPECT_EQ(found->detections[0].tag.number, 1);
  EXPECT_EQ(find_tags(Image(1280, 720), finder, ImageLens::unknown())->detections.size(), 2U)
      << "unknown lens";
}

TEST(TagFinder, PropagatesErrorsAndChecksItsOptions) {
  const auto failing = make_tag_finder(
      std::make_unique<ScriptedDetector>(fail(ErrorCode::LimitExceeded, "the image is too large")));
  ASSERT_TRUE(failing);
  const auto found = find_tags(Image(8, 8), *failing, ImageLens::unknown());
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::LimitExceeded);

  RefinementOptions options;
  options.blur_px = -1;
  const auto bad = make_tag_finder(std::make_unique<ScriptedDetector>(std::vector<TagDetection>{}), options);
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().place.key, "blur_px");
  EXPECT_FALSE(make_tag_finder(std::unique_ptr<Detector>()));
}

}  // namespace
}  // namespace waymark
