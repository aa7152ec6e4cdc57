#include "waymark/app/detect/detect_pictures.hpp"

#include <filesystem>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"
#include "tests/support/draw_tag.hpp"
#include "waymark/app/calibrate_camera/calibrate_camera.hpp"
#include "waymark/app/common/json_line.hpp"
#include "waymark/app/evaluate/evaluate_detections.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/config/camera_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/samples/visibility.hpp"
#include "waymark/simulation/photograph.hpp"
#include "waymark/tags/apriltag_detector.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr TagId kTag{FamilyId::Tag36h11, 7};

TagFinder usual_finder() {
  return {.detector = std::move(make_apriltag_detector({}).value()), .refinement = RefinementOptions{}};
}

class DetectPictures : public ::testing::Test {
 protected:
  void SetUp() override {
    Image image(320, 240);
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x) image.row(y)[x] = 180;
    testing::paint_tag(image, kTag, corners_);
    ASSERT_TRUE(write_image(folder_ / "tag.png", image));
    ASSERT_TRUE(write_text_file(folder_ / "broken.png", "no picture"));
  }
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }

  testing::TagCorners corners_ = testing::square_corners({150.3, 120.7}, 80, 0.2);
  fs::path folder_ = testing::fresh_folder("jobs_detect");
  TagFinder finder_ = usual_finder();
};

TEST_F(DetectPictures, TagsAreWhereTheyWerePaintedAndWhatFailsIsCounted) {
  std::vector<PictureReport> seen;
  std::vector<std::string> notes;
  JobControl control;
  control.note = [&](const std::string& words) { notes.push_back(words); };
  const DetectJob job{.sources = {at("tag.png"), at("broken.png"), at("missing.png")},
                      .annotate_folder = at("annotated")};
  const auto summary =
      detect_pictures(job, finder_, control, [&](const PictureReport& report, const PoseList&) {
        seen.push_back(report);
        return true;
      });
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_EQ(summary->pictures, 1U);
  EXPECT_EQ(summary->tags, 1U);
  EXPECT_EQ(summary->failed, 2U);
  EXPECT_EQ(notes.size(), 2U);
  ASSERT_EQ(seen.size(), 3U);
  ASSERT_EQ(seen[0].detections.size(), 1U);
  EXPECT_EQ(seen[0].detections[0].tag, kTag);
  EXPECT_LT(testing::max_corner_error_px(seen[0].detections[0].corners_px, corners_), 0.1);
  EXPECT_TRUE(fs::exists(folder_ / "annotated" / "tag.png"));
}

TEST_F(DetectPictures, ThePoseIsThatOfThePicture) {
  const double focal_px = 300;
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = focal_px, .fy = focal_px, .cx = 160, .cy = 120}, 320, 240)
          .value();
  const DetectJob job{.sources = {at("tag.png")}, .poses = PoseSetup{camera, {.default_size_m = 0.16}}};
  nlohmann::ordered_json json;
  const auto summary =
      detect_pictures(job, finder_, {}, [&](const PictureReport& report, const PoseList& poses) {
        json = to_json(report, poses, false);
        return true;
      });
  ASSERT_TRUE(summary);
  EXPECT_NEAR(json["detections"][0]["pose"]["cam_t_tag_m"][2].get<double>(), 0.16 * focal_px / 80, 0.01);
}

/// Tags in a row from the middle of the image to its edge, through a lens with barrel distortion.
class DetectThroughALens : public ::testing::Test {
 protected:
  void SetUp() override {
    PhotographScene scene;
    for (int i = 0; i < 4; ++i)
      scene.tags.push_back({{FamilyId::Tag36h11, i},
                            SE3(SO3::exp({0.2, -0.1 * i, 0.3 * i}), {-0.36 + 0.24 * i, 0.11 - 0.06 * i, 0.5}),
                            0.12});
    Random random(5);
    Photograph picture = photograph(lens_, scene, {.background = "flat"}, random).value();
    ASSERT_TRUE(write_image(folder_ / "tags.png", picture.image));
    auto recorder = SampleRecorder::open(std::move(*create_file(folder_ / "tags.mcap")));
    ASSERT_TRUE(recorder);
    ASSERT_TRUE(recorder->add(
        CameraFrame{.stamp = SensorTime(std::chrono::seconds(1)), .image = std::move(picture.image)}));
    ASSERT_TRUE(recorder->close());
    truth_ = std::move(picture.tags);
  }

  /// Root mean square distance of the detected corners from the true ones.
  double rms_px(const std::string& name, const std::optional<PoseSetup>& poses) {
    double sum = 0;
    int corners = 0;
    const DetectJob job{.sources = {(folder_ / name).string()}, .poses = poses};
    const auto summary = detect_pictures(job, finder_, {}, [&](const PictureReport& report, const PoseList&) {
      for (const TagDetection& seen : report.detections) {
        for (std::size_t k = 0; k < 4; ++k, ++corners)
          sum += (seen.corners_px[k] - truth_.at(static_cast<std::size_t>(seen.tag.number)).corners_px[k])
                     .squaredNorm();
      }
      return true;
    });
    EXPECT_TRUE(summary);
    EXPECT_EQ(corners, 16);
    return std::sqrt(sum / corners);
  }

  CameraModel lens_ =
      CameraModel::make(
          PinholeRadtan{
              .fx = 620, .fy = 620, .cx = 640, .cy = 360, .k = {-0.24, 0.05, 0, 0}, .coefficients = 4},
          1280, 720)
          .value();
  PoseSetup poses_{lens_, {.default_size_m = 0.12}};
  fs::path folder_ = testing::fresh_folder("jobs_detect_lens");
  TagFinder finder_ = usual_finder();
  std::vector<TagTruth> truth_{};
};

TEST_F(DetectThroughALens, CornersAreRefinedWithTheLensThatIsGiven) {
  for (const char* const name : {"tags.png", "tags.mcap"}) {
    const double with_px = rms_px(name, poses_);
    const double without_px = rms_px(name, std::nullopt);
    std::printf("%s: corners %.4f px from the truth with the lens, %.4f px without\n", name, with_px,
                without_px);
    EXPECT_LT(with_px, 0.05) << name;
    EXPECT_LT(3 * with_px, without_px) << name;
  }
}

TEST_F(DetectThroughALens, ALensOfAnotherImageSizeIsNotApplied) {
  const PoseSetup half{scaled_camera(lens_, 640, 360).value(), poses_.sizes};
  EXPECT_EQ(rms_px("tags.png", half), rms_px("tags.png", std::nullopt));
}

TEST_F(DetectPictures, OriginalsAreNotWrittenOver) {
  const DetectJob job{.sources = {at("tag.png")}, .annotate_folder = folder_.string()};
  const auto summary =
      detect_pictures(job, finder_, {}, [](const PictureReport&, const PoseList&) { return true; });
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().place.source, folder_.string());
}

TEST_F(DetectPictures, CancellingAndEnoughEndBetweenTwoPictures) {
  const std::vector<Input> inputs = find_inputs({at("tag.png"), at("broken.png")}, false);
  int pictures = 0;
  const auto count = [&](bool go_on) {
    return [&pictures, go_on](std::size_t, PictureReport&, const ImageView&) {
      ++pictures;
      return go_on;
    };
  };
  EXPECT_FALSE(detect_all(inputs, finder_, nullptr, {}, count(false)).stopped);
  EXPECT_EQ(pictures, 1) << "who has seen enough gets no more";
  JobControl control;
  control.cancelled = [&] { return pictures >= 2; };
  EXPECT_TRUE(detect_all(inputs, finder_, nullptr, control, count(true)).stopped);
  EXPECT_EQ(pictures, 2);
}

TEST_F(DetectPictures, AreScoredAgainstTheTruth) {
  std::string truth = "image,id,x0,y0,x1,y1,x2,y2,x3,y3\ntag.png,7";
  for (const Eigen::Vector2d& corner : corners_) truth += fmt::format(",{},{}", corner.x(), corner.y());
  ASSERT_TRUE(write_text_file(folder_ / "truth.csv", truth + "\n"));
  EvaluateDetectionsJob job{.truth = at("truth.csv"), .sources = {at("tag.png")}};
  const auto report = evaluate_detections(job, finder_, {});
  ASSERT_TRUE(report) << to_string(report.error());
  ASSERT_TRUE(report->scores);
  EXPECT_EQ(report->scores->correct, 1U);
  EXPECT_LT(report->scores->corners->rmse_px, 0.1);
  EXPECT_EQ(to_json(*report->scores)["recall"], 1.0);
  job.sources = {at("broken.png")};
  const auto broken = evaluate_detections(job, finder_, {});
  ASSERT_TRUE(broken);
  EXPECT_FALSE(broken->scores);
  EXPECT_EQ(broken->failed, 1U);
  job.truth = at("nowhere.csv");
  EXPECT_FALSE(evaluate_detections(job, finder_, {}));
}

/// Six by five tags of 4 cm, projected without noise, as `waymark detect --json` writes them.
std::string board_detections(const CameraModel& camera, int pictures) {
  const TargetDescription board{.columns = 6, .rows = 5, .tag_size_m = 0.04};
  const TagMap tags = CalibrationTarget::make(board)->tags();
  std::string lines;
  for (int i = 0; i < pictures; ++i) {
    const SO3 tilt =
        SO3::exp({to_radians(30) * std::cos(2.0 * i), to_radians(30) * std::sin(2.0 * i), 0.1 * i});
    const SE3 cam_T_board(tilt, {0.03 * (i % 3 - 1), 0.02 * (i % 2), 0.35 + 0.02 * i});
    PictureReport report{
        .image = fmt::format("{}.png", i), .width_px = 640, .height_px = 480, .detected = true};
    for (const auto& [id, tag] : tags.tags) {
      TagDetection detection{.tag = id};
      bool whole = true;
      const auto corners = tag_corners(tag.size_m);
      for (std::size_t k = 0; k < 4; ++k) {
        const auto px = camera.project(cam_T_board * (tag.map_T_tag * corners[k]));
        whole = whole && px && camera.contains(*px);
        if (px) detection.corners_px[k] = *px;
      }
      detection.corner_covariance_px2 = CornerCovariance::Identity() * 0.01;
      if (whole) report.detections.push_back(detection);
    }
    lines += json_line(to_json(report, true));
  }
  return lines;
}

TEST_F(DetectPictures, ACameraIsCalibratedFromWhatWasDetected) {
  const CameraModel truth =
      CameraModel::make(PinholeRadtan{.fx = 512, .fy = 509, .cx = 326, .cy = 236}, 640, 480).value();
  ASSERT_TRUE(write_text_file(folder_ / "tags.jsonl", board_detections(truth, 10)));
  const CalibrateCameraJob job{.detections = at("tags.jsonl"),
                               .target = {.columns = 6, .rows = 5, .tag_size_m = 0.04},
                               .lens = "none",
                               .output = at("calibration.yaml"),
                               .camera_info = at("camera.yaml")};
  const auto target = CalibrationTarget::make(job.target);
  ASSERT_TRUE(target);
  ASSERT_TRUE(check_outputs(job));
  const auto report = calibrate_camera(job, *target, finder_, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->pictures.size(), 10U);
  ASSERT_EQ(report->found.names[0], "fx_px");
  EXPECT_NEAR(report->found.parameters[0], 512, 0.01);
  EXPECT_FALSE(fs::exists(job.output)) << "nothing is written yet";
  ASSERT_TRUE(write_camera_calibration(job, *report));
  const auto read = read_camera(job.camera_info, "");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->camera.width_px(), 640);
  EXPECT_EQ(to_json(*report)["pictures"].size(), 10U);
}

TEST(CalibrationTarget, ABoardThatCannotBeIsRefused) {
  EXPECT_FALSE(CalibrationTarget::make({}));
  EXPECT_FALSE(CalibrationTarget::make({.columns = 6, .rows = 5}));
  EXPECT_FALSE(CalibrationTarget::make({.columns = 6, .rows = 5, .tag_size_m = 0.04, .map = "map.yaml"}));
  const auto ids = CalibrationTarget::make({.columns = 60, .rows = 50, .tag_size_m = 0.04});
  ASSERT_FALSE(ids);
  EXPECT_THAT(ids.error().message, HasSubstr("tags 0 to 2999"));
}

}  // namespace
}  // namespace waymark
