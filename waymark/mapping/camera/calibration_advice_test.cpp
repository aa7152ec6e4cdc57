// Advice for images of a board with various defects, and for missing views.
#include "waymark/mapping/camera/calibration_advice.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/base/random.hpp"
#include "waymark/mapping/camera/camera_calibration.hpp"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr double kNoisePx = 0.1;

/// A defect: changes to the position of a corner on the board or in an image.
struct Defect {
  std::function<Eigen::Vector3d(const Eigen::Vector2d& place_m)> place = [](const Eigen::Vector2d& p) {
    return Eigen::Vector3d(p.x(), p.y(), 0);
  };
  std::function<Eigen::Vector2d(int image, const Eigen::Vector2d& px)> seen =
      [](int, const Eigen::Vector2d& px) { return px; };
  double max_tilt_deg = 40;
};

std::vector<std::string> advice(const Defect& defect, std::uint64_t seed) {
  const CameraModel camera =
      CameraModel::make(
          PinholeRadtan{.fx = 512, .fy = 509, .cx = 326, .cy = 236, .k = {-0.28, 0.09}, .coefficients = 4},
          kWidth, kHeight)
          .value();
  const CalibrationBoard board{.kind = BoardKind::Chessboard, .columns = 10, .rows = 7, .size_m = 0.03};
  const auto places = board_corners(board);
  Random random(seed);
  std::vector<TargetMarks> images;
  for (int i = 0; i < 16; ++i) {
    const double tilt = to_radians(defect.max_tilt_deg);
    const SO3 turn =
        SO3::exp({tilt * random.uniform(-1, 1), tilt * random.uniform(-1, 1), random.uniform(-1.5, 1.5)});
    const double depth = random.uniform(0.3, 0.6);
    const SE3 cam_T_board(turn,
                          {depth * random.uniform(-0.3, 0.3), depth * random.uniform(-0.2, 0.2), depth});
    std::vector<BoardCorner> corners;
    for (std::size_t k = 0; k < places.size(); ++k) {
      const auto px = camera.project(cam_T_board * defect.place(places[k]));
      if (px && camera.contains(*px))
        corners.push_back(
            {static_cast<int>(k),
             defect.seen(i, *px) + kNoisePx * Eigen::Vector2d(random.normal(), random.normal())});
    }
    images.push_back(target_marks(corners, places));
  }
  const auto found = calibrate_camera(images, kWidth, kHeight, LensModel::Radtan4);
  EXPECT_TRUE(found) << to_string(found.error());
  return found ? found->advice : std::vector<std::string>();
}

/// One keyword from each cause's message.
const std::vector<std::string>& all_causes() {
  static const std::vector<std::string> words = {"shutter", "focus", "flat", "longer"};
  return words;
}

/// Expects that only the cause with this keyword is reported, or no cause if it is empty.
void expect_cause(const Defect& defect, const std::string& cause) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto sentences = advice(defect, seed);
    for (const std::string& word : all_causes()) {
      if (word == cause) {
        EXPECT_THAT(sentences, Contains(HasSubstr(word))) << "seed " << seed;
      } else {
        EXPECT_THAT(sentences, Not(Contains(HasSubstr(word)))) << "seed " << seed;
      }
    }
    for (const std::string& sentence : sentences) {
      if (seed == 1 && !cause.empty() && sentence.find(cause) != std::string::npos)
        testing::expect_on_page("calibrate", sentence);
    }
  }
}

TEST(CalibrationCauses, GoodImagesHaveNone) { expect_cause({}, ""); }

TEST(CalibrationCauses, ReportsABentBoard) {
  // A sheet that bulges by 2 mm in the middle.
  expect_cause({.place =
                    [](const Eigen::Vector2d& p) {
                      return Eigen::Vector3d(p.x(), p.y(), 0.002 * (1 - p.squaredNorm() / (0.15 * 0.15)));
                    }},
               "flat");
}

TEST(CalibrationCauses, ReportsARollingShutter) {
  expect_cause({.seen =
                    [](int image, const Eigen::Vector2d& px) {
                      const Eigen::Vector2d moved_px(3 * std::cos(2.4 * image), 3 * std::sin(2.4 * image));
                      return Eigen::Vector2d(px + (px.y() / kHeight - 0.5) * moved_px);
                    }},
               "shutter");
}

TEST(CalibrationCauses, ReportsAFocusThatChangedHalfway) {
  expect_cause({.seen =
                    [](int image, const Eigen::Vector2d& px) {
                      const Eigen::Vector2d centre(326, 236);
                      return Eigen::Vector2d(centre + (image < 8 ? 1 : 1.03) * (px - centre));
                    }},
               "focus");
}

TEST(CalibrationCauses, ReportsABoardPrintedTooLong) {
  expect_cause({.place = [](const Eigen::Vector2d& p) { return Eigen::Vector3d(1.01 * p.x(), p.y(), 0); }},
               "longer");
}

TEST(CalibrationCauses, ReportsTooFewTilts) {
  EXPECT_THAT(advice({.max_tilt_deg = 8}, 1), Contains(HasSubstr("20 degrees")));
}

/// Expects a sentence that contains the text, and compares it with the golden page.
void expect_advice(const CameraCalibration& found, const std::string& text) {
  const auto sentences = internal::calibration_advice(found);
  const auto contains = [&](const std::string& sentence) { return sentence.find(text) != std::string::npos; };
  const auto sentence = std::ranges::find_if(sentences, contains);
  ASSERT_NE(sentence, sentences.end()) << text;
  testing::expect_on_page("calibrate", *sentence);
}

/// A calibration for which there is no advice.
CameraCalibration good() {
  const auto camera = CameraModel::make(
      PinholeRadtan{.fx = 512, .fy = 509, .cx = 326, .cy = 236, .k = {-0.25, 0.08}, .coefficients = 4},
      kWidth, kHeight);
  CameraCalibration found{.camera = camera.value(), .rms_px = 0.1, .held_out_rms_px = 0.1};
  found.parameters = Eigen::Vector4d(500, 500, 320, 240);
  found.covariance = Eigen::Matrix4d::Identity();
  found.views.assign(12, {.marks = 50, .tilt_deg = 30});
  for (ImageRegion& region : found.regions) region = {.corners = 60, .rms_px = 0.1, .noise_scale = 1};
  return found;
}

TEST(CalibrationAdvice, IsEmptyForAGoodCalibration) {
  EXPECT_THAT(internal::calibration_advice(good()), IsEmpty());
}

TEST(CalibrationAdvice, ReportsEachDefect) {
  CameraCalibration few = good();
  few.views.resize(9);
  few.views.push_back({});  // an unusable image
  expect_advice(few, "9 usable");
  CameraCalibration frontal = good();
  for (std::size_t i = 3; i < frontal.views.size(); ++i) frontal.views[i].tilt_deg = 19;
  expect_advice(frontal, "3 images");
  CameraCalibration corner = good();
  corner.regions[0].corners = 19;
  corner.regions[8] = {};
  expect_advice(corner, "top left, bottom right");
  CameraCalibration bent = good();
  bent.regions[2].noise_scale = 2.5;
  expect_advice(bent, "2.5 times");
  CameraCalibration blurred = good();  // the residuals are consistent with the corner covariances
  blurred.regions[2].rms_px = 0.25;
  EXPECT_THAT(internal::calibration_advice(blurred), IsEmpty());
  CameraCalibration vague = good();
  vague.covariance(0, 0) = 25;
  expect_advice(vague, "1.0 %");
  CameraCalibration fitted = good();
  fitted.held_out_rms_px = 0.2;
  expect_advice(fitted, "2.00 times");
}

}  // namespace
}  // namespace waymark
