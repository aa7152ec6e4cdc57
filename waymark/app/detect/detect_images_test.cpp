// Detection in images and videos with drawn tags: tables, scores, annotated output, and conversion to a
// recording.
#include "waymark/app/detect/detect_images.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"
#include "tests/support/draw_tag.hpp"
#include "waymark/app/calibrate_camera/calibrate_camera.hpp"
#include "waymark/app/common/camera_tags.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/evaluate/evaluate_detections.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/media/video_writer.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/samples/visibility.hpp"
#include "waymark/simulation/render/photograph.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr TagId kTag{FamilyId::Tag36h11, 7};

TagFinder default_finder() {
  return {.detector = std::move(make_apriltag_detector({}).value()), .refinement = RefinementOptions{}};
}

class DetectImages : public ::testing::Test {
 protected:
  void SetUp() override {
    Image image(320, 240);
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x) image.row(y)[x] = 180;
    testing::paint_tag(image, kTag, corners_);
    ASSERT_TRUE(write_image(folder_ / "tag.png", image));
    ASSERT_TRUE(write_text_file(folder_ / "broken.png", "no image"));
  }
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }

  testing::TagCorners corners_ = testing::square_corners({150.3, 120.7}, 80, 0.2);
  fs::path folder_ = testing::fresh_folder("jobs_detect");
  TagFinder finder_ = default_finder();
};

TEST_F(DetectImages, FindsPaintedTagsAndCountsFailures) {
  std::vector<ImageReport> seen;
  std::vector<std::string> notes;
  JobControl control;
  control.note = [&](const std::string& words) { notes.push_back(words); };
  const DetectJob job{.sources = {at("tag.png"), at("broken.png"), at("missing.png")},
                      .annotate_folder = at("annotated")};
  const auto summary = detect_images(job, finder_, control, [&](const ImageReport& report, const PoseList&) {
    seen.push_back(report);
    return true;
  });
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_EQ(summary->images, 1U);
  EXPECT_EQ(summary->tags, 1U);
  EXPECT_EQ(summary->failed, 2U);
  EXPECT_EQ(notes.size(), 2U);
  ASSERT_EQ(seen.size(), 3U);
  ASSERT_EQ(seen[0].detections.size(), 1U);
  EXPECT_EQ(seen[0].detections[0].tag, kTag);
  EXPECT_LT(testing::max_corner_error_px(seen[0].detections[0].corners_px, corners_), 0.1);
  EXPECT_TRUE(fs::exists(folder_ / "annotated" / "tag.png"));
}

TEST_F(DetectImages, EstimatesTheDistanceOfATag) {
  const double focal_px = 300;
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = focal_px, .fy = focal_px, .cx = 160, .cy = 120}, 320, 240)
          .value();
  const DetectJob job{.sources = {at("tag.png")}, .poses = PoseSetup{camera, {.default_size_m = 0.16}}};
  nlohmann::ordered_json json;
  const auto summary = detect_images(job, finder_, {}, [&](const ImageReport& report, const PoseList& poses) {
    json = to_json(fields(ImageLine{report, poses}));
    return true;
  });
  ASSERT_TRUE(summary);
  EXPECT_NEAR(json["detections"][0]["pose"]["cam_t_tag_m"][2].get<double>(), 0.16 * focal_px / 80, 0.01);
}

/// A row of tags from the middle of the image to its edge, seen through a lens with barrel distortion.
class DetectThroughALens : public ::testing::Test {
 protected:
  void SetUp() override {
    PhotographScene scene;
    for (int i = 0; i < 4; ++i)
      scene.tags.push_back({{FamilyId::Tag36h11, i},
                            SE3(SO3::exp({0.2, -0.1 * i, 0.3 * i}), {-0.36 + 0.24 * i, 0.11 - 0.06 * i, 0.5}),
                            0.12});
    Random random(5);
    Photograph photo = photograph(lens_, scene, {.background = "flat"}, random).value();
    ASSERT_TRUE(write_image(folder_ / "tags.png", photo.image));
    record("tags.mcap", photo.image, std::nullopt);
    record("calibrated.mcap", photo.image, lens_);
    truth_ = std::move(photo.tags);
  }

  void record(const std::string& name, const Image& image, const std::optional<CameraModel>& calibration) {
    auto recorder = SampleRecorder::open(std::move(*create_file(folder_ / name)));
    ASSERT_TRUE(recorder);
    const SensorTime stamp(std::chrono::seconds(1));
    if (calibration) {
      ASSERT_TRUE(recorder->add_camera(stamp, *calibration, SE3()));
    }
    ASSERT_TRUE(recorder->add(CameraFrame{.stamp = stamp, .image = image}));
    ASSERT_TRUE(recorder->close());
  }

  /// RMS error of the detected corners.
  double rms_px(const std::string& name, const std::optional<PoseSetup>& poses) {
    double sum = 0;
    int corners = 0;
    const DetectJob job{.sources = {(folder_ / name).string()}, .poses = poses};
    const auto summary = detect_images(job, finder_, {}, [&](const ImageReport& report, const PoseList&) {
      lens_used_ = to_json(fields(ImageLine{report}))["lens"];
      for (const TagDetection& seen : report.detections) {
        for (std::size_t k = 0; k < 4; ++k, ++corners)
          sum += (seen.corners_px[k] - truth_.at(static_cast<std::size_t>(seen.tag.number)).corners_px[k])
                     .squaredNorm();
      }
      return true;
    });
    EXPECT_TRUE(summary);
    EXPECT_EQ(corners, 16);
    without_lens_ = summary->without_lens;
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
  TagFinder finder_ = default_finder();
  std::vector<TagTruth> truth_{};
  std::string lens_used_{};       ///< key "lens" of the last report
  std::size_t without_lens_ = 0;  ///< of the last summary
};

TEST_F(DetectThroughALens, RefinesCornersWithTheGivenLens) {
  for (const char* const name : {"tags.png", "tags.mcap"}) {
    const double with_px = rms_px(name, poses_);
    EXPECT_EQ(lens_used_, "camera");
    EXPECT_EQ(without_lens_, 0U);
    const double without_px = rms_px(name, std::nullopt);
    EXPECT_EQ(lens_used_, "unknown");
    EXPECT_EQ(without_lens_, 4U);
    std::printf("%s: corner error %.4f px with the lens, %.4f px without\n", name, with_px, without_px);
    EXPECT_LT(with_px, 0.025) << name;
    EXPECT_LT(with_px, without_px) << name << ": curved sides are followed without a lens, too";
  }
}

TEST_F(DetectThroughALens, UsesTheCalibrationOfARecording) {
  EXPECT_EQ(rms_px("calibrated.mcap", std::nullopt), rms_px("tags.mcap", poses_));
  rms_px("calibrated.mcap", std::nullopt);
  EXPECT_EQ(lens_used_, "recording");
  EXPECT_EQ(without_lens_, 0U);
  rms_px("calibrated.mcap", poses_);
  EXPECT_EQ(lens_used_, "camera") << "takes precedence";
}

TEST_F(DetectThroughALens, IgnoresALensForAnotherImageSize) {
  const PoseSetup half{scaled_camera(lens_, 640, 360).value(), poses_.sizes};
  EXPECT_EQ(rms_px("tags.png", half), rms_px("tags.png", std::nullopt));
  rms_px("tags.png", half);
  EXPECT_EQ(lens_used_, "unknown");
}

TEST_F(DetectImages, TheLastReportHasTheCauseIfNoImageContainsATag) {
  Image dark(64, 48);
  ASSERT_TRUE(write_image(folder_ / "dark.png", dark));
  ASSERT_TRUE(write_image(folder_ / "black.png", dark));
  const auto causes_of = [&](const std::vector<std::string>& sources) {
    std::vector<std::string> causes;
    const auto summary =
        detect_images({.sources = sources}, finder_, {}, [&](const ImageReport& report, const PoseList&) {
          const auto& reason = report.no_tag_reason;
          causes.push_back(report.image + (reason ? fmt::format(" {}", to_string(reason->cause)) : ""));
          return true;
        });
    EXPECT_TRUE(summary);
    return causes;
  };
  const std::string image = at("dark.png");
  const std::string last = at("black.png");
  EXPECT_THAT(causes_of({image, last}), ::testing::ElementsAre(image, last + " dark"));
  EXPECT_THAT(causes_of({image, at("tag.png"), last}), ::testing::ElementsAre(image, at("tag.png"), last));
}

TEST_F(DetectImages, RefusesToOverwriteInputs) {
  const DetectJob job{.sources = {at("tag.png")}, .annotate_folder = folder_.string()};
  const auto summary =
      detect_images(job, finder_, {}, [](const ImageReport&, const PoseList&) { return true; });
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().place.key, folder_.string());
}

/// A second run changes nothing. Other images with the same names are renamed, not lost.
TEST_F(DetectImages, KeepsImagesThatAnnotatedOnesWouldReplace) {
  const DetectJob job{.sources = {at("tag.png")}, .annotate_folder = at("annotated")};
  const auto run = [&] {
    EXPECT_TRUE(detect_images(job, finder_, {}, [](const ImageReport&, const PoseList&) { return true; }));
  };
  fs::create_directories(at("annotated"));
  fs::copy_file(at("tag.png"), at("annotated/tag.png"));
  run();
  run();
  EXPECT_EQ(read_image(at("annotated/tag.1.png")).value(), read_image(at("tag.png")).value());
  EXPECT_FALSE(fs::exists(at("annotated/tag.2.png")));
}

TEST_F(DetectImages, StopsBetweenTwoImages) {
  const std::vector<Input> inputs = find_inputs({at("tag.png"), at("broken.png")}, false);
  int images = 0;
  const auto count = [&](bool go_on) {
    return [&images, go_on](std::size_t, ImageReport&, const ImageView&) {
      ++images;
      return go_on;
    };
  };
  const LensChoice unknown{.camera = ImageLens::unknown(), .use_recorded = false};
  EXPECT_FALSE(detect_all(inputs, finder_, unknown, {}, count(false)).stopped);
  EXPECT_EQ(images, 1) << "the callback returned false";
  JobControl control;
  control.cancelled = [&] { return images >= 2; };
  EXPECT_TRUE(detect_all(inputs, finder_, unknown, control, count(true)).stopped);
  EXPECT_EQ(images, 2);
}

TEST_F(DetectImages, ScoresDetectionsWithGroundTruth) {
  std::string truth = "image,id,x0,y0,x1,y1,x2,y2,x3,y3\ntag.png,7";
  for (const Eigen::Vector2d& corner : corners_) truth += fmt::format(",{},{}", corner.x(), corner.y());
  ASSERT_TRUE(write_text_file(folder_ / "truth.csv", truth + "\n"));
  EvaluateDetectionsJob job{.truth = at("truth.csv"), .sources = {at("tag.png")}};
  const auto report = evaluate_detections(job, finder_, {});
  ASSERT_TRUE(report) << to_string(report.error());
  ASSERT_TRUE(report->scores);
  EXPECT_EQ(report->scores->correct, 1U);
  EXPECT_LT(report->scores->corners->rmse_px, 0.1);
  EXPECT_EQ(to_json(fields(*report->scores))["recall"], 1.0);
  job.sources = {at("broken.png")};
  const auto broken = evaluate_detections(job, finder_, {});
  ASSERT_TRUE(broken);
  EXPECT_FALSE(broken->scores);
  EXPECT_EQ(broken->failed, 1U);
  job.truth = at("nowhere.csv");
  EXPECT_FALSE(evaluate_detections(job, finder_, {}));
}

/// The JSON output of `waymark detect` for a board of 6 x 5 tags of 4 cm, projected without noise.
std::string board_detections(const CameraModel& camera, int images) {
  const TargetOptions board{.columns = 6, .rows = 5, .tag_size_m = 0.04};
  const TagMap tags = CalibrationTarget::make(board)->tags();
  std::string lines;
  for (int i = 0; i < images; ++i) {
    const SO3 tilt =
        SO3::exp({to_radians(30) * std::cos(2.0 * i), to_radians(30) * std::sin(2.0 * i), 0.1 * i});
    const SE3 cam_T_board(tilt, {0.03 * (i % 3 - 1), 0.02 * (i % 2), 0.35 + 0.02 * i});
    ImageReport report{
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
    lines += json_line(fields(ImageLine{.report = report, .with_covariance = true}));
  }
  return lines;
}

TEST_F(DetectImages, DetectionsCalibrateACamera) {
  const CameraModel truth =
      CameraModel::make(PinholeRadtan{.fx = 512, .fy = 509, .cx = 326, .cy = 236}, 640, 480).value();
  ASSERT_TRUE(write_text_file(folder_ / "tags.jsonl", board_detections(truth, 10)));
  const CalibrateCameraJob job{
      .detections = at("tags.jsonl"),
      .target = {.columns = 6, .rows = 5, .tag_size_m = 0.04},
      .fit = {.lens = "none", .output = at("calibration.yaml"), .camera_info = at("camera.yaml")}};
  const auto target = CalibrationTarget::make(job.target);
  ASSERT_TRUE(target);
  ASSERT_TRUE(check_outputs(job.fit));
  const auto report = calibrate_camera(job, *target, finder_, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->images.size(), 10U);
  ASSERT_EQ(report->found.names[0], "fx_px");
  EXPECT_NEAR(report->found.parameters[0], 512, 0.01);
  EXPECT_FALSE(fs::exists(job.fit.output)) << "nothing is written yet";
  ASSERT_TRUE(write_camera_calibration(job.fit, *report));
  const auto read = read_camera(job.fit.camera_info, "");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->camera.width_px(), 640);
  EXPECT_EQ(to_json(fields(*report))["images"].size(), 10U);
}

TagDetection square(int number, double left_px, double side_px) {
  TagDetection tag{.tag = {FamilyId::Tag36h11, number}, .hamming = 1, .decision_margin = 61.25};
  tag.corners_px = {Eigen::Vector2d(left_px, 100), Eigen::Vector2d(left_px + side_px, 100),
                    Eigen::Vector2d(left_px + side_px, 100 + side_px),
                    Eigen::Vector2d(left_px, 100 + side_px)};
  return tag;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::vector<std::string> columns_of(const std::string& line) {
  std::istringstream stream(line);
  return {std::istream_iterator<std::string>(stream), {}};
}

TEST(DetectionsText, HasOneRowPerTag) {
  ImageReport report{.image = "a.png", .width_px = 640, .height_px = 480, .detected = true};
  EXPECT_EQ(to_text(report), "a.png: 0 tags in 640 x 480 px\n");
  report.detections = {square(3, 50, 40)};
  EXPECT_THAT(to_text(report), HasSubstr("a.png: 1 tag in"));
  report.detections.push_back(square(7, 200, 25));
  report.detections[1].corner_covariance_px2 = 0.04 * Eigen::Matrix<double, 8, 8>::Identity();
  const auto lines = lines_of(to_text(report));
  ASSERT_EQ(lines.size(), 4U);
  const auto first = columns_of(lines[2]);
  EXPECT_EQ(first, (std::vector<std::string>{"tag36h11:3", "70.00", "120.00", "40.0", "-", "61.2", "1"}));
  EXPECT_EQ(columns_of(lines[3])[4], "0.200") << "square root of the mean variance of the coordinates";
}

TEST(DetectionsText, UnrefinedCornersAreReportedWithTheReason) {
  ImageReport report{.image = "a.png", .width_px = 640, .height_px = 480, .detected = true};
  report.detections = {square(3, 50, 40), square(4, 150, 40)};
  report.refinements = {RefinementOutcome::Refined, RefinementOutcome::TooSmall};
  const auto lines = lines_of(to_text(report));
  EXPECT_THAT(lines[2], Not(HasSubstr("not refined")));
  EXPECT_THAT(lines[3], HasSubstr(std::string("corners not refined: ") +
                                  std::string(to_string(RefinementOutcome::TooSmall))));
  report.refinements[1] = RefinementOutcome::MovedTooFar;
  report.detections[1].corner_state = CornerState::Unreliable;
  EXPECT_THAT(lines_of(to_text(report))[3], HasSubstr("corners unreliable: moved_too_far"));
}

TEST(DetectionsText, PosesHaveBothSolutionsOrTheErrorMessage) {
  EXPECT_EQ(to_text(std::span<const TagDetection>(), PoseList()), "");
  const std::vector<TagDetection> tags = {square(3, 50, 40), square(4, 150, 40)};
  TagPose pose;
  pose.best.cam_T_tag = SE3(SO3(), {0.1, -0.2, 2});
  pose.best.covariance = 1e-6 * PoseCovariance::Identity();
  pose.best.rms_px = 0.1;
  pose.other = pose.best;
  pose.other->rms_px = 0.4;
  PoseList poses;
  poses.emplace_back(pose);
  poses.emplace_back(fail(ErrorCode::InvalidArgument, "unknown size"));
  const auto lines = lines_of(to_text(tags, poses));
  ASSERT_EQ(lines.size(), 4U);
  const auto first = columns_of(lines[1]);
  EXPECT_EQ(std::vector<std::string>(first.begin(), first.begin() + 7),
            (std::vector<std::string>{"tag36h11:3", "0.1000", "-0.2000", "2.0000", "2.2", "2.2", "1.0"}))
      << "1 mm, combined with 1 mrad of camera rotation at 2 m";
  EXPECT_THAT(lines[2], HasSubstr("or (ratio "));
  EXPECT_THAT(lines[3], HasSubstr("unknown size"));
}

constexpr TagId kVideoTag{FamilyId::Tag36h11, 7};
constexpr int kImages = 12;

testing::TagCorners corners_at(int k) {
  return testing::square_corners({100.3 + 9 * k, 120.7 + 2 * k}, 80, 0.2 + 0.03 * k);
}

SensorTime video_stamp(int k) { return SensorTime(std::chrono::milliseconds(33 * k + (k % 3))); }

/// A video of a moving tag.
class TagVideo : public ::testing::Test {
 protected:
  void SetUp() override {
    auto writer = VideoWriter::create(at("walk.mp4"), 320, 240, {.quality = 8, .rotation_deg = 90});
    if (!writer && writer.error().code == ErrorCode::Unsupported) GTEST_SKIP() << to_string(writer.error());
    ASSERT_TRUE(writer) << to_string(writer.error());
    for (int k = 0; k < kImages; ++k) {
      Image image(320, 240, 180);
      testing::paint_tag(image, kVideoTag, corners_at(k));
      ASSERT_TRUE(writer->add(image.view(), video_stamp(k)));
    }
    ASSERT_TRUE(writer->close());
  }
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }

  fs::path folder_ = testing::fresh_folder("jobs_video");
  TagFinder finder_{.detector = std::move(make_apriltag_detector({}).value()),
                    .refinement = RefinementOptions{}};
};

TEST_F(TagVideo, ReportsEveryImageWithItsStamp) {
  std::vector<ImageReport> seen;
  std::vector<std::string> notes;
  JobControl control;
  control.note = [&](const std::string& words) { notes.push_back(words); };
  const auto summary = detect_images({.sources = {at("walk.mp4")}}, finder_, control,
                                     [&](const ImageReport& report, const PoseList&) {
                                       seen.push_back(report);
                                       return true;
                                     });
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_EQ(summary->failed, 0U);
  ASSERT_EQ(seen.size(), static_cast<std::size_t>(kImages));
  for (int k = 0; k < kImages; ++k) {
    const ImageReport& report = seen[static_cast<std::size_t>(k)];
    ASSERT_EQ(report.detections.size(), 1U) << k;
    EXPECT_EQ(report.detections[0].tag, kVideoTag);
    EXPECT_LT(testing::max_corner_error_px(report.detections[0].corners_px, corners_at(k)), 0.15) << k;
    ASSERT_TRUE(report.stamp);
    EXPECT_EQ(*report.stamp, video_stamp(k));
  }
  EXPECT_EQ(seen[1].image, at("walk.mp4") + "#0.034000000");
  EXPECT_THAT(notes, ::testing::ElementsAre(::testing::HasSubstr("rotation")));
}

TEST_F(TagVideo, ACalibrationOfAnotherSizeIsReportedOnce) {
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 300, .fy = 301, .cx = 320, .cy = 240}, 640, 480).value();
  std::vector<std::string> notes;
  JobControl control;
  control.note = [&](const std::string& words) { notes.push_back(words); };
  std::size_t errors = 0;
  const DetectJob job{.sources = {at("walk.mp4")}, .poses = PoseSetup{.camera = camera}};
  const auto summary = detect_images(job, finder_, control, [&](const ImageReport& report, const PoseList&) {
    errors += report.error ? 1 : 0;
    return true;
  });
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_EQ(summary->failed, static_cast<std::size_t>(kImages));
  EXPECT_EQ(errors, static_cast<std::size_t>(kImages)) << "every report contains an error";
  EXPECT_THAT(notes, ::testing::UnorderedElementsAre(HasSubstr("640x480"), HasSubstr("rotation")));
}

TEST_F(TagVideo, WritesAnAnnotatedVideo) {
  const DetectJob job{.sources = {at("walk.mp4")}, .annotate_folder = at("seen.mp4")};
  const auto summary =
      detect_images(job, finder_, {}, [](const ImageReport&, const PoseList&) { return true; });
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_FALSE(summary->annotations_failed);
  auto reader = VideoReader::open(at("seen.mp4"));
  ASSERT_TRUE(reader) << to_string(reader.error());
  EXPECT_NEAR(reader->info().rotation_deg, 90, 1e-6);
  for (int k = 0; k < kImages; ++k) {
    const auto frame = reader->next();
    ASSERT_TRUE(frame && *frame);
    EXPECT_EQ((*frame)->stamp, video_stamp(k));
    EXPECT_EQ((*frame)->luma.width, 320);
  }
}

TEST_F(TagVideo, DoesNotReplaceAnExistingFile) {
  std::ofstream(at("seen.mp4")) << "something else";
  const DetectJob job{.sources = {at("walk.mp4")}, .annotate_folder = at("seen.mp4")};
  const auto summary =
      detect_images(job, finder_, {}, [](const ImageReport&, const PoseList&) { return true; });
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().place.source, at("seen.mp4"));
  EXPECT_EQ(fs::file_size(at("seen.mp4")), 14U);
}

TEST_F(TagVideo, CancellingKeepsTheAnnotatedVideoSoFar) {
  int images = 0;
  JobControl control;
  control.cancelled = [&] { return images >= 4; };
  const DetectJob job{.sources = {at("walk.mp4")}, .annotate_folder = at("seen.mkv")};
  const auto summary = detect_images(job, finder_, control, [&](const ImageReport&, const PoseList&) {
    ++images;
    return true;
  });
  ASSERT_TRUE(summary);
  EXPECT_TRUE(summary->stopped);
  auto reader = VideoReader::open(at("seen.mkv"));
  ASSERT_TRUE(reader) << to_string(reader.error());
  int written = 0;
  while (true) {
    const auto frame = reader->next();
    if (!frame || !*frame) break;
    ++written;
  }
  EXPECT_EQ(written, 4);
}

TEST_F(TagVideo, RefusesToOverwriteTheInputVideo) {
  const DetectJob job{.sources = {at("walk.mp4")}, .annotate_folder = at("walk.mp4")};
  const auto summary =
      detect_images(job, finder_, {}, [](const ImageReport&, const PoseList&) { return true; });
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::InvalidArgument);
}

TEST_F(TagVideo, BecomesARecordingOfTagsAndImages) {
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 300, .fy = 301, .cx = 160, .cy = 120}, 320, 240).value();
  const ConvertVideoJob job{.input = at("walk.mp4"),
                            .output = at("walk.mcap"),
                            .camera = camera,
                            .sizes = {.default_size_m = 0.165},
                            .images = "raw"};
  const auto found = convert_video(job, finder_, {});
  ASSERT_TRUE(found) << to_string(found.error());
  EXPECT_EQ(found->tags, static_cast<std::size_t>(kImages));
  const auto json = to_json(fields(ConvertedVideo{job.input, job.output, *found}));
  EXPECT_EQ(json["output"], job.output);
  EXPECT_EQ(json["images"], kImages);
  EXPECT_FALSE(json["codec"].get<std::string>().empty());
  const auto log = open_log(job.output);
  ASSERT_TRUE(log) << to_string(log.error());
  std::vector<TagFrame> tags;
  std::size_t images = 0;
  ASSERT_TRUE((*log)->visit_samples({}, [&](const Sample& sample) -> Status {
    if (const auto* frame = std::get_if<TagFrame>(&sample)) tags.push_back(*frame);
    images += std::holds_alternative<CameraFrame>(sample) ? 1 : 0;
    return {};
  }));
  EXPECT_EQ(images, static_cast<std::size_t>(kImages));
  ASSERT_EQ(tags.size(), static_cast<std::size_t>(kImages));
  EXPECT_EQ(tags[5].stamp, video_stamp(5));
  ASSERT_EQ(tags[5].detections.size(), 1U);
  EXPECT_TRUE(tags[5].detections[0].corner_covariance_px2);
  EXPECT_LT(testing::max_corner_error_px(tags[5].detections[0].corners_px, corners_at(5)), 0.15);
  const auto setup = (*log)->setup();
  ASSERT_TRUE(setup && setup->camera);
  EXPECT_NEAR(setup->camera->width_px(), 320, 0);
  EXPECT_EQ(setup->metadata.at("waymark").at("tag_size_m"), "0.165");
  const auto again = convert_video(job, finder_, {});
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().message, HasSubstr("exists"));
}

TEST_F(TagVideo, RejectsACameraOfAnotherSize) {
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 300, .fy = 301, .cx = 320, .cy = 240}, 640, 480).value();
  const auto found =
      convert_video({.input = at("walk.mp4"), .output = at("walk.mcap"), .camera = camera}, finder_, {});
  ASSERT_FALSE(found);
  EXPECT_FALSE(fs::exists(at("walk.mcap")));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

}  // namespace
}  // namespace waymark
