#include "waymark/pose/homography.hpp"

#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <opencv2/calib3d.hpp>

#include "tests/support/golden_page.hpp"
#include "tests/support/tag_views.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using Points = std::vector<Eigen::Vector2d>;

const Points kSquare = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};

Eigen::Matrix3d random_homography(Random& random) {
  Eigen::Matrix3d H;
  for (double& entry : H.reshaped()) entry = random.normal();
  H.row(2) << 0.2 * random.normal(), 0.2 * random.normal(), 1 + random.uniform();
  return H / H.norm();
}

Points random_points(Random& random, std::size_t count, double scale = 1) {
  Points points(count);
  for (auto& p : points) p = scale * Eigen::Vector2d(random.uniform(-1, 1), random.uniform(-1, 1));
  return points;
}

Points images(const Eigen::Matrix3d& H, const Points& points) {
  Points b;
  for (const auto& p : points) b.push_back(apply_homography(H, p));
  return b;
}

TEST(Homography, ExactForExactPoints) {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Matrix3d H = random_homography(random);
    for (const Points& a : {kSquare, random_points(random, 12)}) {
      const auto found = homography_dlt(a, images(H, a));
      ASSERT_TRUE(found) << to_string(found.error());
      EXPECT_LT((*found - H).norm(), 1e-9) << "the sign and scale must be as documented";
    }
  }
}

// Hartley and Zisserman, section 4.4.4: with normalisation, the result does not depend on the units or the
// origin.
TEST(Homography, DoesNotDependOnUnitsAndOrigin) {
  Random random(2);
  for (int trial = 0; trial < 50; ++trial) {
    const Points a = random_points(random, 10);
    Points b = images(random_homography(random), a);
    for (auto& p : b) p += 0.01 * Eigen::Vector2d(random.normal(), random.normal());
    const Eigen::Matrix3d H = homography_dlt(a, b).value();
    Points far;
    for (const auto& p : b) far.emplace_back(1e4 * p + Eigen::Vector2d(3e5, -2e5));
    const Eigen::Matrix3d moved = homography_dlt(a, far).value();
    for (const auto& p : a) {
      const Eigen::Vector2d back = (apply_homography(moved, p) - Eigen::Vector2d(3e5, -2e5)) / 1e4;
      EXPECT_LT((back - apply_homography(H, p)).norm(), 1e-8);
    }
  }
}

// Martins and Ramos, equation 2.12: on the plane of the tag, projection is the homography (r1, r2, t) up to
// scale.
TEST(Homography, OfATagContainsItsPose) {
  Random random(3);
  const CameraModel camera = testing::plain_camera();
  for (int trial = 0; trial < 50; ++trial) {
    const SE3 cam_T_tag = testing::random_view(random);
    Points a, b;
    const auto seen = testing::see_tag(camera, cam_T_tag);
    for (std::size_t i = 0; i < 4; ++i) {
      a.emplace_back(testing::tag_corners().at(i).head<2>());
      b.push_back(camera.normalize(seen.value().corners_px.at(i)).value());
    }
    Eigen::Matrix3d expected;
    expected << cam_T_tag.rotation().matrix().leftCols<2>(), cam_T_tag.translation();
    EXPECT_LT((homography_dlt(a, b).value() - expected / expected.norm()).norm(), 1e-9);
  }
}

TEST(Homography, AgreesWithOpenCvOnNoisyPoints) {
  Random random(4);
  for (int trial = 0; trial < 50; ++trial) {
    const Points a = random_points(random, 9, 100);
    Eigen::Matrix3d H;
    H << 1.1, 0.2, 30, -0.1, 0.9, 40, 5e-4, -3e-4, 1;
    Points b = images(H, a);
    std::vector<cv::Point2d> cv_a, cv_b;
    for (std::size_t i = 0; i < a.size(); ++i) {
      b[i] += 0.3 * Eigen::Vector2d(random.normal(), random.normal());
      cv_a.emplace_back(a[i].x(), a[i].y());
      cv_b.emplace_back(b[i].x(), b[i].y());
    }
    const cv::Mat cv_H = cv::findHomography(cv_a, cv_b, 0);
    const Eigen::Matrix3d ours = homography_dlt(a, b).value();
    // OpenCV finishes by minimising the pixel error, so the two results differ by more than rounding but by
    // less than the noise.
    for (const auto& p : a) {
      const cv::Matx31d q = cv::Matx33d(cv_H) * cv::Matx31d(p.x(), p.y(), 1);
      EXPECT_LT((apply_homography(ours, p) - Eigen::Vector2d(q(0) / q(2), q(1) / q(2))).norm(), 0.1);
    }
  }
}

struct BadInput {
  const char* why;
  Points a, b;
  const char* text;
};

TEST(Homography, RejectsInvalidInput) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Points three(kSquare.begin(), kSquare.begin() + 3);
  const Points line = {{0, 0}, {1, 1}, {2, 2}, {0, 1}};
  const Points repeated = {{-1, -1}, {1, -1}, {1, 1}, {1, 1}};
  const Points one_place(4, Eigen::Vector2d(3, 4));
  const BadInput inputs[] = {
      {"too few", three, three, "3 pairs"},
      {"unequal", kSquare, three, "4 points"},
      {"not finite", kSquare, {{-1, -1}, {1, nan}, {1, 1}, {-1, 1}}, "finite"},
      {"collinear source", line, kSquare, "homography"},
      {"collinear target", kSquare, line, "homography"},
      {"repeated source", repeated, kSquare, "homography"},
      {"repeated target", kSquare, repeated, "homography"},
      {"one place", one_place, kSquare, "homography"},
      {"onto one place", kSquare, one_place, "homography"},
  };
  for (const BadInput& input : inputs) {
    const auto H = homography_dlt(input.a, input.b);
    ASSERT_FALSE(H) << input.why;
    EXPECT_EQ(H.error().code, ErrorCode::InvalidArgument) << input.why;
    EXPECT_THAT(H.error().message, HasSubstr(input.text)) << input.why;
    testing::expect_on_page("pose", H.error());
  }
}

TEST(Homography, HugeAndTinyNumbersGiveNoNan) {
  for (const double scale : {1e-300, 1e-160, 1e-20, 1e20, 1e150, 1e300}) {
    Points b;
    for (const auto& p : kSquare) b.emplace_back(scale * p);
    const auto H = homography_dlt(kSquare, b);
    EXPECT_TRUE(!H || H->allFinite()) << scale;
  }
}

}  // namespace
}  // namespace waymark
