// Pictures inside a recording are searched one by one, and a lap without tags is mapped by them.
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/draw_tag.hpp"
#include "tests/support/recorded_lap.hpp"
#include "waymark/app/common/detect_all.hpp"
#include "waymark/tags/apriltag_detector.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr TagId kPainted{FamilyId::Tag36h11, 12};

Image painted_picture(double x_px) {
  Image image(200, 150);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) image.row(y)[x] = 190;
  testing::paint_tag(image, kPainted, testing::square_corners({x_px, 75}, 60, 0.1));
  return image;
}

TagFinder plain_finder() { return {.detector = std::move(make_apriltag_detector({}).value())}; }

/// A recording of three pictures, the last without a tag.
class DetectRecording : public ::testing::Test {
 protected:
  void SetUp() override {
    auto recorder = SampleRecorder::open(std::move(*create_file(file_)));
    ASSERT_TRUE(recorder);
    for (int i = 0; i < 3; ++i) {
      const SensorTime stamp(std::chrono::milliseconds(1500 + 250 * i));
      ASSERT_TRUE(recorder->add(Odometry{.stamp = stamp}));
      Image picture(200, 150);
      if (i < 2) picture = painted_picture(80 + 20 * i);
      ASSERT_TRUE(recorder->add(CameraFrame{.stamp = stamp, .image = std::move(picture)}));
    }
    ASSERT_TRUE(recorder->close());
  }
  DetectSummary detect(const JobControl& control = {}, int most = 100) {
    seen_.clear();
    const auto each = [&](std::size_t, PictureReport& report, const ImageView& image) {
      EXPECT_EQ(image.width, report.width_px);
      seen_.push_back(report);
      return static_cast<int>(seen_.size()) < most;
    };
    return detect_all(find_inputs({file_.string()}, false), finder_, nullptr, control, each);
  }
  fs::path file_ = testing::fresh_folder("jobs_detect_recording") / "lap.mcap";
  TagFinder finder_ = plain_finder();
  std::vector<PictureReport> seen_{};
};

TEST_F(DetectRecording, EachPictureIsNamedAfterItsStamp) {
  const DetectSummary summary = detect();
  EXPECT_EQ(summary.pictures, 3U);
  EXPECT_EQ(summary.tags, 2U);
  EXPECT_EQ(summary.failed, 0U);
  std::vector<std::string> names;
  for (const PictureReport& report : seen_) names.push_back(report.image);
  EXPECT_THAT(names, ElementsAre(file_.string() + "#1.500000000", file_.string() + "#1.750000000",
                                 file_.string() + "#2.000000000"));
  EXPECT_EQ(seen_[0].detections.at(0).tag, kPainted);
  EXPECT_TRUE(seen_[2].detected && seen_[2].detections.empty());
}

TEST_F(DetectRecording, EnoughAndCancellingEndIt) {
  EXPECT_EQ(detect({}, 1).pictures, 1U);
  EXPECT_EQ(seen_.size(), 1U);
  JobControl control;
  control.cancelled = [&] { return seen_.size() >= 2; };
  EXPECT_TRUE(detect(control).stopped);
  EXPECT_EQ(seen_.size(), 2U);
}

TEST_F(DetectRecording, ARecordingWithoutPicturesOrOfNothingFails) {
  std::vector<std::string> notes;
  JobControl control;
  control.note = [&](const std::string& words) { notes.push_back(words); };
  file_ = test::record_lap(testing::fresh_folder("jobs_no_pictures") / "lap.mcap", 95, {.for_s = 1});
  EXPECT_EQ(detect(control).failed, 1U);
  EXPECT_THAT(notes, Contains(HasSubstr(file_.string())));
  file_ = testing::fresh_folder("jobs_broken") / "broken.mcap";
  ASSERT_TRUE(write_text_file(file_, "SQLite format 3, and nothing else"));
  EXPECT_EQ(detect(control).failed, 1U);
}

TEST_F(DetectRecording, ALapOfPicturesGetsItsTagsWhileItIsRead) {
  std::vector<std::string> words;
  JobControl control;
  control.progress = [&](const JobProgress& now) { words.push_back(now.words); };
  const auto lap = read_lap_file(file_.string(), control);
  ASSERT_TRUE(lap) << to_string(lap.error());
  ASSERT_EQ(lap->frames.size(), 3U);
  EXPECT_EQ(lap->frames[1].detections.at(0).tag, kPainted);
  EXPECT_TRUE(lap->frames[2].detections.empty());
  EXPECT_THAT(words, Contains(HasSubstr("finding tags")));
  const auto stopped = read_lap_file(file_.string(), test::cancelled_after(1));
  ASSERT_FALSE(stopped);
  EXPECT_THAT(stopped.error().message, HasSubstr("stopped"));
}

TEST_F(DetectRecording, TheFamilyOfTheRecordedAnchorIsLookedForToo) {
  constexpr TagId kAnchor{FamilyId::TagCustom48h12, 7};
  Image picture = painted_picture(50);
  testing::paint_tag(picture, kAnchor, testing::square_corners({145, 75}, 40, 0));
  file_ = testing::fresh_folder("jobs_anchor_family") / "lap.mcap";
  auto recorder = SampleRecorder::open(std::move(*create_file(file_)));
  ASSERT_TRUE(recorder);
  ASSERT_TRUE(recorder->add_metadata(lap_facts::kMetadata, {{lap_facts::kAnchor, to_string(kAnchor)}}));
  ASSERT_TRUE(recorder->add(CameraFrame{.image = std::move(picture)}));
  ASSERT_TRUE(recorder->close());
  const auto lap = read_lap_file(file_.string());
  ASSERT_TRUE(lap) << to_string(lap.error());
  std::set<TagId> found;
  for (const TagDetection& detection : lap->frames.at(0).detections) found.insert(detection.tag);
  EXPECT_THAT(found, ElementsAre(kPainted, kAnchor));
}

TEST_F(DetectRecording, TheDetectorThatIsNamedSearchesThePicturesAlsoBesideTags) {
  const std::string tags_only =
      test::record_lap(testing::fresh_folder("jobs_tags_only") / "lap.mcap", 96, {.for_s = 1});
  EXPECT_TRUE(read_lap_file(tags_only));
  const auto none = read_lap_file(tags_only, {}, &finder_);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("no pictures"));
  EXPECT_EQ(read_lap_file(file_.string(), {}, &finder_)->frames.size(), 3U);
}

}  // namespace
}  // namespace waymark
