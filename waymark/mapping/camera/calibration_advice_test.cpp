// What is said when pictures of a board are spoilt in one way or another, and when views are missing.
#include "waymark/mapping/camera/calibration_advice.hpp"

#include <cmath>
#include <functional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

/// What happens to the corner at a place of the board in a picture before it is seen.
struct Spoilt {
  std::function<Eigen::Vector3d(const Eigen::Vector2d& place_m)> place = [](const Eigen::Vector2d& p) {
    return Eigen::Vector3d(p.x(), p.y(), 0);
  };
  std::function<Eigen::Vector2d(int picture, const Eigen::Vector2d& px)> seen =
      [](int, const Eigen::Vector2d& px) { return px; };
  double max_tilt_deg = 40;
};

std::vector<std::string> advice(const Spoilt& spoilt, std::uint64_t seed) {
  const CameraModel camera =
      CameraModel::make(
          PinholeRadtan{.fx = 512, .fy = 509, .cx = 326, .cy = 236, .k = {-0.28, 0.09}, .coefficients = 4},
          kWidth, kHeight)
          .value();
  const CalibrationBoard board{.kind = BoardKind::Chessboard, .columns = 10, .rows = 7, .size_m = 0.03};
  const auto places = board_corners(board);
  Random random(seed);
  std::vector<TargetPicture> pictures;
  for (int i = 0; i < 16; ++i) {
    const double tilt = to_radians(spoilt.max_tilt_deg);
    const SO3 turn =
        SO3::exp({tilt * random.uniform(-1, 1), tilt * random.uniform(-1, 1), random.uniform(-1.5, 1.5)});
    const double depth = random.uniform(0.3, 0.6);
    const SE3 cam_T_board(turn,
                          {depth * random.uniform(-0.3, 0.3), depth * random.uniform(-0.2, 0.2), depth});
    std::vector<BoardCorner> corners;
    for (std::size_t k = 0; k < places.size(); ++k) {
      const auto px = camera.project(cam_T_board * spoilt.place(places[k]));
      if (px && camera.contains(*px))
        corners.push_back(
            {static_cast<int>(k),
             spoilt.seen(i, *px) + kNoisePx * Eigen::Vector2d(random.normal(), random.normal())});
    }
    pictures.push_back(target_marks(corners, places));
  }
  const auto found = calibrate_camera(pictures, kWidth, kHeight, LensModel::Radtan4);
  EXPECT_TRUE(found) << to_string(found.error());
  return found ? found->advice : std::vector<std::string>();
}

const std::vector<std::string>& all_causes() {
  static const std::vector<std::string> words = {"rolling shutter", "focus has moved", "not flat",
                                                 "sizes are not"};
  return words;
}

void expect_named(const Spoilt& spoilt, const std::string& cause) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto said = advice(spoilt, seed);
    for (const std::string& words : all_causes()) {
      if (words == cause) {
        EXPECT_THAT(said, Contains(HasSubstr(words))) << "seed " << seed;
      } else {
        EXPECT_THAT(said, Not(Contains(HasSubstr(words)))) << "seed " << seed;
      }
    }
  }
}

TEST(CalibrationCauses, GoodPicturesHaveNone) { expect_named({}, ""); }

TEST(CalibrationCauses, ABentBoardIsNamed) {
  // A sheet that bulges by 2 mm in its middle.
  expect_named({.place =
                    [](const Eigen::Vector2d& p) {
                      return Eigen::Vector3d(p.x(), p.y(), 0.002 * (1 - p.squaredNorm() / (0.15 * 0.15)));
                    }},
               "not flat");
}

TEST(CalibrationCauses, ARollingShutterIsNamed) {
  expect_named({.seen =
                    [](int picture, const Eigen::Vector2d& px) {
                      const Eigen::Vector2d moved_px(3 * std::cos(2.4 * picture),
                                                     3 * std::sin(2.4 * picture));
                      return Eigen::Vector2d(px + (px.y() / kHeight - 0.5) * moved_px);
                    }},
               "rolling shutter");
}

TEST(CalibrationCauses, AFocusThatMovedHalfwayIsNamed) {
  expect_named({.seen =
                    [](int picture, const Eigen::Vector2d& px) {
                      const Eigen::Vector2d centre(326, 236);
                      return Eigen::Vector2d(centre + (picture < 8 ? 1 : 1.03) * (px - centre));
                    }},
               "focus has moved");
}

TEST(CalibrationCauses, ABoardPrintedTooLongIsNamed) {
  expect_named({.place = [](const Eigen::Vector2d& p) { return Eigen::Vector3d(1.01 * p.x(), p.y(), 0); }},
               "sizes are not");
}

TEST(CalibrationCauses, TooFewTiltsAreNamed) {
  EXPECT_THAT(advice({.max_tilt_deg = 8}, 1), Contains(HasSubstr("tilted by more than 20")));
}

/// A calibration of which nothing is to be said.
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

TEST(CalibrationAdvice, OfAGoodCalibrationThereIsNone) {
  EXPECT_THAT(internal::calibration_advice(good()), IsEmpty());
}

TEST(CalibrationAdvice, NamesEachThingThatIsMissing) {
  CameraCalibration few = good();
  few.views.resize(9);
  few.views.push_back({});  // of no use
  EXPECT_THAT(internal::calibration_advice(few), Contains(HasSubstr("9 pictures are few")));
  CameraCalibration frontal = good();
  for (std::size_t i = 3; i < frontal.views.size(); ++i) frontal.views[i].tilt_deg = 19;
  EXPECT_THAT(internal::calibration_advice(frontal), Contains(HasSubstr("3 pictures show the board tilted")));
  CameraCalibration corner = good();
  corner.regions[0].corners = 19;
  corner.regions[8] = {};
  EXPECT_THAT(internal::calibration_advice(corner), Contains(HasSubstr("image: top left, bottom right.")));
  CameraCalibration bent = good();
  bent.regions[2].noise_scale = 2.5;
  EXPECT_THAT(internal::calibration_advice(bent),
              Contains(HasSubstr("The top right of the image fits 2.5 times worse")));
  CameraCalibration blurred = good();  // corners that are as uncertain as they say
  blurred.regions[2].rms_px = 0.25;
  EXPECT_THAT(internal::calibration_advice(blurred), IsEmpty());
  CameraCalibration vague = good();
  vague.covariance(0, 0) = 25;
  EXPECT_THAT(internal::calibration_advice(vague), Contains(HasSubstr("known to 1.0 % only")));
  CameraCalibration fitted = good();
  fitted.held_out_rms_px = 0.2;
  EXPECT_THAT(internal::calibration_advice(fitted), Contains(HasSubstr("fit 2.00 times worse")));
}

}  // namespace
}  // namespace waymark
