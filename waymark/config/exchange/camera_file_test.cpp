#include "waymark/config/exchange/camera_file.hpp"

#include <string>
#include <variant>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/support/camera_texts.hpp"
#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "tests/support/line_cuts.hpp"
#include "tests/support/random_camera.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

using testing::camera_error;
using testing::exchanged;
using ::testing::HasSubstr;
using testing::kCamchain;
using testing::kCameraInfo;
using ::testing::SizeIs;
using ::testing::StartsWith;

std::string info_error(const std::string& from, const std::string& to) {
  return camera_error(exchanged(kCameraInfo, from, to));
}

TEST(CameraInfo, AddsHalfAPixelOnReading) {
  const auto named = parse_camera(kCameraInfo, "c.yaml");
  ASSERT_TRUE(named) << to_string(named.error());
  EXPECT_EQ(named->name, "dabai");
  EXPECT_EQ(named->camera.width_px(), 640);
  EXPECT_EQ(named->camera.height_px(), 480);
  const PinholeRadtan expected{.fx = 442.17,
                               .fy = 443.88,
                               .cx = 323.5,
                               .cy = 247.0,
                               .k = {0.045, -0.077, 0.001, -0.002, 0.0},
                               .coefficients = 5};
  EXPECT_EQ(named->camera.projection(), CameraModel::Projection(expected));
}

TEST(CameraInfo, SubtractsHalfAPixelOnWriting) {
  const PinholeRadtan model{.fx = 500, .fy = 501.25, .cx = 320, .cy = 240.1};
  const auto camera = CameraModel::make(model, 640, 480);
  ASSERT_TRUE(camera);
  EXPECT_EQ(
      to_camera_info_yaml({.name = "left eye", .camera = *camera}),
      "image_width: 640\nimage_height: 480\ncamera_name: \"left eye\"\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [500.0, 0.0, 319.5, 0.0, 501.25, 239.6, 0.0, 0.0, 1.0]\n"
      "distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 0\n  data: []\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n"
      "  data: [500.0, 0.0, 319.5, 0.0, 0.0, 501.25, 239.6, 0.0, 0.0, 0.0, 1.0, 0.0]\n");
}

TEST(CameraFile, CutsAtLineEndsAreRejectedOrLoseNothing) {
  const NamedCamera named = *parse_camera(kCameraInfo, "c.yaml");
  for (const std::string& text :
       {to_camera_info_yaml(named), to_camchain_yaml({named}).value(), to_opencv_yaml(named)}) {
    const auto whole = parse_camera(text, "c.yaml");
    ASSERT_TRUE(whole) << to_string(whole.error());
    for (const std::string& cut : testing::cuts_at_line_ends(text)) {
      const auto read = parse_camera(cut, "c.yaml");
      EXPECT_TRUE(!read || read->camera == whole->camera) << cut;
    }
  }
}

TEST(CameraInfo, ReadsEveryModel) {
  const auto rational = parse_camera(
      exchanged(exchanged(exchanged(kCameraInfo, "plumb_bob", "rational_polynomial"), "cols: 5", "cols: 8"),
                "-0.002, 0.0]", "-0.002, 0.1, 0.2, 0.3, 0.4]"),
      "c.yaml");
  ASSERT_TRUE(rational) << to_string(rational.error());
  EXPECT_EQ(std::get<PinholeRadtan>(rational->camera.projection()).k,
            (std::array{0.045, -0.077, 0.001, -0.002, 0.1, 0.2, 0.3, 0.4}));
  for (const char* name : {"equidistant", "fisheye"}) {
    const auto fisheye =
        parse_camera(exchanged(exchanged(exchanged(kCameraInfo, "plumb_bob", name), "cols: 5", "cols: 4"),
                               "-0.002, 0.0]", "-0.002]"),
                     "c.yaml");
    ASSERT_TRUE(fisheye) << to_string(fisheye.error());
    EXPECT_EQ(std::get<Equidistant>(fisheye->camera.projection()).k,
              (std::array{0.045, -0.077, 0.001, -0.002}));
  }
}

TEST(CameraInfo, ReportsInvalidParameters) {
  EXPECT_TRUE((info_error("442.17", "-442.17")).starts_with("c.yaml:7 (camera_matrix.data): "));
  EXPECT_NE((info_error("442.17", "-442.17")).find("-442.17"), std::string::npos);
  testing::expect_on_page("config", info_error("442.17", "-442.17"));
  EXPECT_THAT(info_error("443.88", "0"), ::testing::AllOf(StartsWith("c.yaml:7 (camera_matrix.data): fy: "),
                                                          ::testing::HasSubstr(" 0")));
  EXPECT_TRUE((info_error("442.17", ".nan")).starts_with("c.yaml:7 (camera_matrix.data[0]): "));
  testing::expect_on_page("config", info_error("442.17", ".nan"));
  EXPECT_EQ(info_error("0.000000,", "0.5,"), "") << "a small skew is valid";
  EXPECT_TRUE((info_error("0.000000,", "90.5,")).starts_with("c.yaml:7 (camera_matrix.data): skew: "));
  testing::expect_on_page("config", info_error("0.000000,", "90.5,"));
  EXPECT_TRUE(
      (info_error("246.5, 0, 0, 1]", "246.5, 0, 0, 2]")).starts_with("c.yaml:7 (camera_matrix.data): "));
  EXPECT_NE((info_error("246.5, 0, 0, 1]", "246.5, 0, 0, 2]")).find("[fx, skew, cx]"), std::string::npos);
  testing::expect_on_page("config", info_error("246.5, 0, 0, 1]", "246.5, 0, 0, 2]"));
  EXPECT_TRUE((info_error("246.5, 0, 0, 1]", "246.5, 0, 0]")).starts_with("c.yaml:7 (camera_matrix.data): "));
  EXPECT_NE((info_error("246.5, 0, 0, 1]", "246.5, 0, 0]")).find("8 numbers"), std::string::npos);
  testing::expect_on_page("config", info_error("246.5, 0, 0, 1]", "246.5, 0, 0]"));
  EXPECT_TRUE((info_error("image_width: 640\n", "")).starts_with("c.yaml:1 (image_width): "));
  testing::expect_on_page("config", info_error("image_width: 640\n", ""));
  EXPECT_EQ(info_error("image_height: 480", "image_height: 0"),
            "c.yaml:2 (image_height): 0 is outside [1, 1000000]");
  EXPECT_EQ(info_error("rows: 3", "rows: 2"), "c.yaml:5 (camera_matrix.rows): 2 is outside [3, 3]");
  EXPECT_TRUE(
      (info_error("distortion_model", "distortion_modle")).starts_with("c.yaml:8 (distortion_modle): "));
  testing::expect_on_page("config", info_error("distortion_model", "distortion_modle"));
}

TEST(CameraInfo, ReportsInvalidDistortion) {
  EXPECT_TRUE((info_error("plumb_bob", "plum_bob")).starts_with("c.yaml:8 (distortion_model): "));
  testing::expect_on_page("config", info_error("plumb_bob", "plum_bob"));
  EXPECT_EQ(info_error("plumb_bob", "rational_polynomial"), "") << "k4 to k6 are zero, as in OpenCV";
  EXPECT_TRUE(
      (info_error("plumb_bob", "equidistant")).starts_with("c.yaml:12 (distortion_coefficients.data): "));
  EXPECT_NE((info_error("plumb_bob", "equidistant")).find("5 distortion"), std::string::npos);
  testing::expect_on_page("config", info_error("plumb_bob", "equidistant"));
  EXPECT_TRUE((info_error("cols: 5", "cols: 4")).starts_with("c.yaml:12 (distortion_coefficients.data): "));
  EXPECT_NE((info_error("cols: 5", "cols: 4")).find("5 numbers"), std::string::npos);
  testing::expect_on_page("config", info_error("cols: 5", "cols: 4"));
  EXPECT_THAT(
      info_error("0.045, -0.077", "-2.0, -0.077"),
      StartsWith("c.yaml:12 (distortion_coefficients.data): the distortion folds or tears the image "));
}

TEST(CameraInfo, DetectsAProjectionOfAnotherResolution) {
  EXPECT_TRUE((info_error("[445.0, 0, 322.1, 0, 0, 446.2, 246.9,", "[884.34, 0, 646.5, 0, 0, 887.76, 493.5,"))
                  .starts_with("c.yaml:20 (projection_matrix.data): "));
  EXPECT_NE((info_error("[445.0, 0, 322.1, 0, 0, 446.2, 246.9,", "[884.34, 0, 646.5, 0, 0, 887.76, 493.5,"))
                .find("1280"),
            std::string::npos);
  testing::expect_on_page("config", info_error("[445.0, 0, 322.1, 0, 0, 446.2, 246.9,",
                                               "[884.34, 0, 646.5, 0, 0, 887.76, 493.5,"));
  EXPECT_EQ(info_error("[445.0, 0, 322.1, 0, 0, 446.2, 246.9, 0, 0, 0, 1, 0]",
                       "[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]"),
            "")
      << "not set";
  EXPECT_EQ(info_error("[445.0, 0, 322.1, 0, 0, 446.2, 246.9,", "[380.0, 0, 325.0, 0, 0, 410.0, 240.0,"), "")
      << "cropped after undistortion";
  EXPECT_EQ(info_error("[445.0, 0, 322.1, 0, 0, 446.2, 246.9,", "[670.0, 0, 325.0, 0, 0, 668.0, 240.0,"), "")
      << "magnified about the centre";
  EXPECT_TRUE((info_error("rows: 3\n  cols: 4\n  data: [445.0, ", "rows: 3\n  cols: 4\n  data: ["))
                  .starts_with("c.yaml:20 (projection_matrix.data): "));
  EXPECT_NE((info_error("rows: 3\n  cols: 4\n  data: [445.0, ", "rows: 3\n  cols: 4\n  data: [")).find("11"),
            std::string::npos);
  testing::expect_on_page(
      "config", info_error("rows: 3\n  cols: 4\n  data: [445.0, ", "rows: 3\n  cols: 4\n  data: ["));
}

TEST(CameraFile, RejectsOtherFiles) {
  const std::string expected =
      "c.yaml:1: not a camera calibration. Give a ROS camera_info YAML (image_width, camera_matrix, …), a "
      "kalibr camchain (cam0: …) or a calibration of PhotonVision (JSON) or OpenCV (YAML).";
  for (const char* text : {"", "42", "[1, 2]", "options: {a: 1}"})
    EXPECT_EQ(camera_error(text), expected) << text;
  EXPECT_EQ(read_camera("/nowhere/c.yaml").error().code, ErrorCode::NotFound);
  EXPECT_EQ(read_cameras("/nowhere/c.yaml").error().code, ErrorCode::NotFound);
}

TEST(CameraFile, ReadsFiles) {
  const auto path = testing::fresh_folder("camera") / "camera.yaml";
  ASSERT_TRUE(write_text_file(path, kCamchain));
  EXPECT_EQ(read_camera(path, "cam1").value(), parse_camera(kCamchain, "c.yaml", "cam1").value());
  ASSERT_THAT(*read_cameras(path), SizeIs(2));
  EXPECT_THAT(to_string(read_camera(path).error()), StartsWith(path.string() + ":1: "));
}

TEST(CameraFile, CamchainsDoNotSupportTheRationalModel) {
  const PinholeRadtan model{.fx = 500, .fy = 500, .cx = 320, .cy = 240, .coefficients = 8};
  const auto text = to_camchain_yaml({{.name = "cam0", .camera = *CameraModel::make(model, 640, 480)}});
  ASSERT_FALSE(text);
  EXPECT_EQ(to_string(text.error()),
            "camchains do not support the rational model of camera 'cam0'. Write camera_info YAML instead.");
}

TEST(CameraFile, RoundTripsKeepTheDigitsOfTheFile) {
  for (const char* centre : {"323.1", "255.7", "511.9999", "0.1", "1023.123456789"}) {
    const auto named = parse_camera(exchanged(kCameraInfo, "323.0", centre), "c.yaml");
    ASSERT_TRUE(named) << to_string(named.error());
    EXPECT_THAT(to_camera_info_yaml(*named), HasSubstr("[442.17, 0.0, " + std::string(centre) + ", 0.0, "));
  }
}

RC_GTEST_PROP(CameraFileProperty, CameraInfoRoundTripsExactly, ()) {
  const NamedCamera named{.name = *rc::gen::string<std::string>(), .camera = testing::any_camera()};
  const auto back = parse_camera(to_camera_info_yaml(named), "c.yaml");
  RC_ASSERT(back.has_value());
  RC_ASSERT(*back == named);
}

RC_GTEST_PROP(CameraFileProperty, CamchainsRoundTripExactly, ()) {
  std::vector<NamedCamera> cameras;
  for (int i = 0; i < 3; ++i) {
    const CameraModel camera = testing::any_camera();
    const auto* radtan = std::get_if<PinholeRadtan>(&camera.projection());
    const bool rational = radtan != nullptr && radtan->coefficients == 8;
    RC_PRE(!rational);
    cameras.push_back({.name = "cam" + std::to_string(i), .camera = camera});
  }
  cameras[1].topic = "/a b";
  cameras[1].imu_minus_cam_time_s = testing::fraction();
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  const double angle = testing::fraction();
  T.topLeftCorner<2, 2>() << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  T(0, 3) = testing::fraction();
  cameras[2].cam_T_imu = T;
  cameras[1].cam_T_previous = T;
  const auto text = to_camchain_yaml(cameras);
  RC_ASSERT(text.has_value());
  const auto back = parse_cameras(*text, "c.yaml");
  RC_ASSERT(back.has_value());
  RC_ASSERT(*back == cameras);
}

TEST(CameraFileRealData, ReadsEveryCalibrationOfTagSlam) {
  WAYMARK_REAL_DATA(folder, "tagslam");
  int cameras = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const auto path = entry.path() / "cameras.yaml";
    if (!std::filesystem::exists(path)) continue;
    const auto read = read_cameras(path);
    ASSERT_TRUE(read) << to_string(read.error());
    for (const NamedCamera& named : *read) {
      ++cameras;
      const Eigen::Vector2d middle(named.camera.width_px() / 2.0, named.camera.height_px() / 2.0);
      EXPECT_TRUE(named.camera.unproject(middle)) << path << " " << named.name;
    }
  }
  EXPECT_EQ(cameras, 32);
}

}  // namespace
}  // namespace waymark
