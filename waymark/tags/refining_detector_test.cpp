#include "waymark/tags/refining_detector.hpp"

#include <array>
#include <memory>
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

/// Finds what it was told, or fails.
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

TEST(RefiningDetector, RefinesWhatIsFound) {
  Print print;
  print.noise = 2;
  Random random(19);
  TagDetection elsewhere = detection_at(print, 0, random);
  elsewhere.tag.number = 8;
  for (auto& corner : elsewhere.corners_px) corner.x() -= 30;  // in the picture, where no tag is
  const Image image = render(print);
  const auto detector = make_refining_detector(
      std::make_unique<ScriptedDetector>(std::vector{detection_at(print, 0.2, random), elsewhere}));
  ASSERT_TRUE(detector);
  const auto found = (*detector)->detect(image);
  ASSERT_TRUE(found);
  ASSERT_EQ(found->size(), 2U);
  EXPECT_LT(worst_error((*found)[0].corners_px, print), 0.1);
  ASSERT_TRUE((*found)[0].corner_covariance_px2);
  EXPECT_LT((*found)[0].corner_covariance_px2->diagonal().maxCoeff(), 0.05 * 0.05);
  EXPECT_EQ((*found)[1].corners_px, elsewhere.corners_px);
  EXPECT_EQ((*found)[1].corner_covariance_px2, CornerCovariance(0.25 * CornerCovariance::Identity()));
}

TEST(RefiningDetector, RefinesInRegionsOnTheWholeImage) {
  Print print;
  print.noise = 2;
  Random random(20);
  const Image image = render(print);
  TagDetection in_region = detection_at(print, 0.2, random);
  // A region of the left and upper 24 px less is handed to the scripted detector 16 px wider.
  const PixelRect region{24, 24, 96, 96};
  TagDetection relative = in_region;
  for (auto& corner : relative.corners_px) corner -= Eigen::Vector2d(8, 8);
  const auto detector = make_refining_detector(std::make_unique<ScriptedDetector>(std::vector{relative}));
  const auto found = (*detector)->detect(image, std::array{region});
  ASSERT_TRUE(found);
  ASSERT_EQ(found->size(), 1U);
  EXPECT_EQ(found->front().corners_px, refined(image, in_region).corners_px);
}

TEST(RefiningDetector, PassesErrorsOnAndChecksItsOptions) {
  const auto failing = make_refining_detector(
      std::make_unique<ScriptedDetector>(fail(ErrorCode::LimitExceeded, "the image is too large")));
  ASSERT_TRUE(failing);
  const auto found = (*failing)->detect(Image(8, 8));
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::LimitExceeded);

  RefinementOptions options;
  options.blur_px = -1;
  const auto bad =
      make_refining_detector(std::make_unique<ScriptedDetector>(std::vector<TagDetection>{}), options);
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().place.key, "blur_px");
  EXPECT_FALSE(make_refining_detector(nullptr));
}

}  // namespace
}  // namespace waymark
