// Videos of painted tags: found in every picture, at their stamps; annotated; converted to a recording.
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/draw_tag.hpp"
#include "waymark/app/common/convert_video.hpp"
#include "waymark/app/detect/detect_pictures.hpp"
#include "waymark/media/video_writer.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/tags/apriltag_detector.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr TagId kVideoTag{FamilyId::Tag36h11, 7};
constexpr int kPictures = 12;

testing::TagCorners corners_at(int k) {
  return testing::square_corners({100.3 + 9 * k, 120.7 + 2 * k}, 80, 0.2 + 0.03 * k);
}

SensorTime video_stamp(int k) { return SensorTime(std::chrono::milliseconds(33 * k + (k % 3))); }

/// A tag that moves.
class TagVideo : public ::testing::Test {
 protected:
  void SetUp() override {
    auto writer = VideoWriter::create(at("walk.mp4"), 320, 240, {.quality = 8, .rotation_deg = 90});
    if (!writer && writer.error().code == ErrorCode::Unsupported) GTEST_SKIP() << to_string(writer.error());
    ASSERT_TRUE(writer) << to_string(writer.error());
    for (int k = 0; k < kPictures; ++k) {
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

TEST_F(TagVideo, EveryPictureIsReportedWithItsStamp) {
  std::vector<PictureReport> seen;
  std::vector<std::string> notes;
  JobControl control;
  control.note = [&](const std::string& words) { notes.push_back(words); };
  const auto summary = detect_pictures({.sources = {at("walk.mp4")}}, finder_, control,
                                       [&](const PictureReport& report, const PoseList&) {
                                         seen.push_back(report);
                                         return true;
                                       });
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_EQ(summary->failed, 0U);
  ASSERT_EQ(seen.size(), static_cast<std::size_t>(kPictures));
  for (int k = 0; k < kPictures; ++k) {
    const PictureReport& report = seen[static_cast<std::size_t>(k)];
    ASSERT_EQ(report.detections.size(), 1U) << k;
    EXPECT_EQ(report.detections[0].tag, kVideoTag);
    EXPECT_LT(testing::max_corner_error_px(report.detections[0].corners_px, corners_at(k)), 0.15) << k;
    ASSERT_TRUE(report.stamp);
    EXPECT_EQ(*report.stamp, video_stamp(k));
  }
  EXPECT_EQ(seen[1].image, at("walk.mp4") + "#0.034000000");
  EXPECT_THAT(notes, ::testing::ElementsAre(::testing::HasSubstr("has a rotation flag")));
}

TEST_F(TagVideo, ACalibrationOfAnotherSizeIsSaidOnce) {
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 300, .fy = 301, .cx = 320, .cy = 240}, 640, 480).value();
  std::vector<std::string> notes;
  JobControl control;
  control.note = [&](const std::string& words) { notes.push_back(words); };
  std::size_t errors = 0;
  const DetectJob job{.sources = {at("walk.mp4")}, .poses = PoseSetup{.camera = camera}};
  const auto summary =
      detect_pictures(job, finder_, control, [&](const PictureReport& report, const PoseList&) {
        errors += report.error ? 1 : 0;
        return true;
      });
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_EQ(summary->failed, static_cast<std::size_t>(kPictures));
  EXPECT_EQ(errors, static_cast<std::size_t>(kPictures)) << "each report has it";
  EXPECT_THAT(notes, ::testing::UnorderedElementsAre(HasSubstr("the calibration is for 640x480"),
                                                     HasSubstr("has a rotation flag")));
}

TEST_F(TagVideo, AnnotatedPicturesBecomeAVideo) {
  const DetectJob job{.sources = {at("walk.mp4")}, .annotate_folder = at("seen.mp4")};
  const auto summary =
      detect_pictures(job, finder_, {}, [](const PictureReport&, const PoseList&) { return true; });
  ASSERT_TRUE(summary) << to_string(summary.error());
  EXPECT_FALSE(summary->annotations_failed);
  auto reader = VideoReader::open(at("seen.mp4"));
  ASSERT_TRUE(reader) << to_string(reader.error());
  EXPECT_NEAR(reader->info().rotation_deg, 90, 1e-6);
  for (int k = 0; k < kPictures; ++k) {
    const auto frame = reader->next();
    ASSERT_TRUE(frame && *frame);
    EXPECT_EQ((*frame)->stamp, video_stamp(k));
    EXPECT_EQ((*frame)->luma.width, 320);
  }
}

TEST_F(TagVideo, WhenItIsCancelledTheAnnotatedVideoEndsThere) {
  int pictures = 0;
  JobControl control;
  control.cancelled = [&] { return pictures >= 4; };
  const DetectJob job{.sources = {at("walk.mp4")}, .annotate_folder = at("seen.mkv")};
  const auto summary = detect_pictures(job, finder_, control, [&](const PictureReport&, const PoseList&) {
    ++pictures;
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

TEST_F(TagVideo, TheVideoIsNotWrittenOver) {
  const DetectJob job{.sources = {at("walk.mp4")}, .annotate_folder = at("walk.mp4")};
  const auto summary =
      detect_pictures(job, finder_, {}, [](const PictureReport&, const PoseList&) { return true; });
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::InvalidArgument);
}

TEST_F(TagVideo, BecomesARecordingOfTagsAndPictures) {
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 300, .fy = 301, .cx = 160, .cy = 120}, 320, 240).value();
  const ConvertVideoJob job{.input = at("walk.mp4"),
                            .output = at("walk.mcap"),
                            .camera = camera,
                            .sizes = {.default_size_m = 0.165},
                            .pictures = "raw"};
  const auto found = convert_video(job, finder_, {});
  ASSERT_TRUE(found) << to_string(found.error());
  EXPECT_EQ(found->tags, static_cast<std::size_t>(kPictures));
  const auto log = open_log(job.output);
  ASSERT_TRUE(log) << to_string(log.error());
  std::vector<TagFrame> tags;
  std::size_t pictures = 0;
  ASSERT_TRUE((*log)->visit_samples({}, [&](const Sample& sample) -> Status {
    if (const auto* frame = std::get_if<TagFrame>(&sample)) tags.push_back(*frame);
    pictures += std::holds_alternative<CameraFrame>(sample) ? 1 : 0;
    return {};
  }));
  EXPECT_EQ(pictures, static_cast<std::size_t>(kPictures));
  ASSERT_EQ(tags.size(), static_cast<std::size_t>(kPictures));
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
  EXPECT_THAT(again.error().message, HasSubstr("exists already"));
}

TEST_F(TagVideo, ACameraOfAnotherSizeIsRefused) {
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
