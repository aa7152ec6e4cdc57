// What one tag's pose does with corners it cannot use.
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "tests/support/tag_views.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using testing::kTagSize;
using testing::see_tag;
using testing::some_covariance;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

TEST(TagPose, SaysWhatIsWrong) {
  const CameraModel camera = testing::distorting_camera();
  const TagDetection good = see_tag(camera, SE3(SO3::exp({0.5, 0, 0}), {0, 0, 1.0}), kTagSize, 7).value();
  ASSERT_TRUE(estimate_tag_pose(good, kTagSize, camera));
  struct Case {
    TagDetection seen;
    double size_m;
    const char* words;
  };
  std::vector<Case> cases;
  for (const double size : {0.0, -1.0, kNan, kInf}) cases.push_back({good, size, "not the size of a tag"});
  const auto with_corners = [&](auto&& change) {
    TagDetection seen = good;
    change(seen.corners_px);
    return seen;
  };
  cases.push_back(
      {with_corners([](auto& c) { c[1].x() = kNan; }), 1, "corner TR is not at a finite position"});
  cases.push_back(
      {with_corners([](auto& c) { c[3].y() = -kInf; }), 1, "corner BL is not at a finite position"});
  cases.push_back({with_corners([](auto& c) {
                     c[2] = {1e6, 2e6};
                   }),
                   1, "corner BR at (1000000.0, 2000000.0) px"});
  cases.push_back({with_corners([](auto& c) { c[2] = c[1]; }), 1, "in one place"});
  cases.push_back({with_corners([](auto& c) { c.fill({320, 240}); }), 1, "in one place"});
  cases.push_back({with_corners([](auto& c) { std::swap(c[0], c[1]); }), 1, "order TL, TR, BR, BL"});
  cases.push_back({with_corners([](auto& c) { std::swap(c[1], c[3]); }), 1, "against the clock"});
  TagDetection no_covariance = good;
  no_covariance.corner_covariance_px2 = -CornerCovariance::Identity();
  cases.push_back({no_covariance, 1, "positive definite"});
  for (const Case& c : cases) {
    const auto pose = estimate_tag_pose(c.seen, c.size_m, camera);
    ASSERT_FALSE(pose) << c.words;
    EXPECT_THAT(to_string(pose.error()), HasSubstr(c.words));
    EXPECT_THAT(to_string(pose.error()), HasSubstr("tag36h11:7")) << "the error names the tag";
    EXPECT_FALSE(pose.error().hint.empty());
  }
  EXPECT_FALSE(estimate_tag_pose(good, 1, camera, {.corner_sigma_px = 0}));
  EXPECT_FALSE(estimate_tag_pose(good, 1, camera, {.corner_sigma_px = kNan}));
  EXPECT_FALSE(estimate_tag_pose(good, 1, camera, {.max_iterations = 0}));
  // Three corners on a line, without a lens that bends it.
  TagDetection line = good;
  line.corners_px = {{{100, 100}, {200, 100}, {300, 100}, {100, 200}}};
  EXPECT_THAT(to_string(estimate_tag_pose(line, 1, testing::plain_camera()).error()), HasSubstr("one line"));
}

TEST(TagPose, GarbageGivesAnErrorOrFiniteNumbers) {
  Random random(9);
  const double odd[] = {0, kNan, kInf, -kInf, 1e300, -1e-300, 320, 240, 1e9};
  int poses = 0;
  for (const CameraModel& camera :
       {testing::plain_camera(), testing::distorting_camera(), testing::fisheye_camera()}) {
    for (int trial = 0; trial < 5000; ++trial) {
      TagDetection seen;
      const double scale = std::pow(10, random.uniform(-6, 4));
      for (auto& corner : seen.corners_px) {
        corner = Eigen::Vector2d(320, 240) + scale * Eigen::Vector2d(random.normal(), random.normal());
        if (random.index(20) == 0)
          corner[static_cast<int>(random.index(2))] = odd[random.index(std::size(odd))];
      }
      if (random.index(4) == 0)
        seen.corner_covariance_px2 = some_covariance(random) * std::pow(10, random.uniform(-20, 20));
      const auto pose = estimate_tag_pose(seen, std::pow(10, random.uniform(-6, 6)), camera);
      if (!pose) continue;
      ++poses;
      for (const TagPoseSolution* s : {&pose->best, pose->other ? &*pose->other : &pose->best}) {
        EXPECT_TRUE(s->cam_T_tag.matrix().allFinite());
        EXPECT_TRUE(s->covariance.allFinite());
        EXPECT_TRUE(std::isfinite(s->chi2) && std::isfinite(s->rms_px));
      }
      EXPECT_TRUE(std::isfinite(pose->ambiguity_ratio()) && std::isfinite(pose->likelihood_ratio()));
    }
  }
  EXPECT_GT(poses, 100);
}

}  // namespace
}  // namespace waymark
