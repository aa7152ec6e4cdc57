// Tests tag detection in recorded images, and laps that contain images instead of tags.
#include "waymark/app/common/detect_all.hpp"

#include <algorithm>
#include <set>

#include <rapidcheck.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/draw_tag.hpp"
#include "tests/support/recorded_lap.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/random.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

nlohmann::ordered_json line_of(const ImageReport& report, bool with_covariance) {
  return to_json(fields(ImageLine{.report = report, .with_covariance = with_covariance}));
}

ImageReport some_report(std::uint64_t seed, bool with_covariance) {
  Random random(seed);
  ImageReport report{.image = "a/b \"c\".png", .width_px = 640, .height_px = 480, .detected = true};
  for (int i = 0; i < 3; ++i) {
    TagDetection tag;
    tag.tag = {kAllFamilies.at(random.index(kAllFamilies.size())), static_cast<int>(random.index(30))};
    tag.hamming = static_cast<int>(random.index(3));
    tag.decision_margin = random.uniform(0, 100);
    if (i == 1) tag.corner_state = CornerState::Unreliable;
    for (auto& corner : tag.corners_px) corner = {random.uniform(-10, 700), random.uniform(-10, 500)};
    if (with_covariance) {
      const CornerCovariance root =
          CornerCovariance::NullaryExpr([&](Eigen::Index, Eigen::Index) { return random.normal(); });
      tag.corner_covariance_px2 = 1e-3 * root * root.transpose();
    }
    report.detections.push_back(tag);
  }
  return report;
}

TEST(DetectionsJson, RoundTrips) {
  rc::check("writing and reading keep everything that matters", [](std::uint64_t seed, bool with_covariance) {
    const ImageReport report = some_report(seed, with_covariance);
    const auto back = parse_reports(json_line(line_of(report, true)), "t.jsonl");
    RC_ASSERT(back.has_value());
    RC_ASSERT(back->size() == 1U);
    const ImageReport& got = back->front();
    RC_ASSERT(got.image == report.image);
    RC_ASSERT(got.width_px == 640);
    RC_ASSERT(got.detected);
    RC_ASSERT(got.detections.size() == report.detections.size());
    for (std::size_t i = 0; i < got.detections.size(); ++i) {
      const TagDetection& a = got.detections[i];
      const TagDetection& b = report.detections[i];
      RC_ASSERT(a.tag == b.tag);
      RC_ASSERT(a.hamming == b.hamming);
      RC_ASSERT(a.corner_state == b.corner_state);
      for (std::size_t c = 0; c < 4; ++c) RC_ASSERT((a.corners_px[c] - b.corners_px[c]).norm() <= 1e-6);
      RC_ASSERT(a.corner_covariance_px2 ==
                b.corner_covariance_px2);  // the shortest decimal form that yields the same double
    }
  });
}

TEST(DetectionsJson, HasTheDocumentedKeys) {
  const ImageReport report = some_report(1, true);
  std::vector<std::string> keys;
  const auto value = line_of(report, false);
  for (const auto& [key, ignored] : value.items()) keys.push_back(key);
  EXPECT_THAT(keys, ::testing::ElementsAre("image", "width_px", "height_px", "lens", "detections"));
  keys.clear();
  for (const auto& [key, ignored] : value["detections"][0].items()) keys.push_back(key);
  EXPECT_THAT(keys, ::testing::ElementsAre("tag", "family", "id", "hamming", "decision_margin", "corners_px",
                                           "center_px", "corner_sigma_px"));
  EXPECT_TRUE(line_of(report, true)["detections"][0].contains("corner_covariance_px2"));
  EXPECT_EQ(value["detections"][1]["corners"], "unreliable");
}

TEST(DetectionsJson, ALineOfALiveCameraHasTheAgeOfItsImage) {
  const auto value = to_json(fields(ImageLine{.report = some_report(1, false), .age_ms = 12.5}));
  EXPECT_EQ(value["age_ms"], 12.5);
  EXPECT_FALSE(value["detections"][0].contains("pose"));
}

TEST(DetectionsJson, AllKeysAreListedWithoutAnImage) {
  const auto names_in = [](const ReportFields& of) {
    std::vector<std::string> names;
    for (const ReportField& field : of) names.push_back(field.name);
    return names;
  };
  const ReportFields all = fields(ImageLine{});
  EXPECT_THAT(names_in(all), ::testing::Contains("age_ms"));
  const auto detections = std::ranges::find(all, "detections", &ReportField::name);
  ASSERT_NE(detections, all.end());
  EXPECT_THAT(names_in(detections->value.keys()), ::testing::IsSupersetOf({"tag", "refinement", "pose"}));
}

TEST(DetectionsJson, AFailureContainsMessageAndPlace) {
  const ImageReport report{
      .image = "x.png",
      .error = Error{ErrorCode::Unreadable, "cut short", {.source = "x.png", .byte = 7}, "Copy again."}};
  EXPECT_EQ(
      json_line(line_of(report, false)),
      R"({"image":"x.png","error":{"code":"unreadable","message":"cut short","source":"x.png","byte":7,)"
      R"("hint":"Copy again."}})"
      "\n");
  const auto back = parse_reports(json_line(line_of(report, false)), "t.jsonl");
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->front().error.has_value());
}

TEST(DetectionsJson, AFileNameThatIsNotUtf8StaysValidJson) {
  EXPECT_THAT(json_line(line_of(ImageReport{.image = "\xFF.png", .width_px = 1, .height_px = 1}, false)),
              HasSubstr("\xEF\xBF\xBD.png"));
}

TEST(DetectionsJson, ErrorsNameLineAndKey) {
  const auto failure = [](const std::string& text) {
    const auto reports = parse_reports(text, "t.jsonl");
    return reports ? "read" : to_string(reports.error());
  };
  const std::string good = R"({"image":"a","detections":[]})";
  EXPECT_EQ(failure(good + "\n\n" + good), "read");
  EXPECT_THAT(failure(good + "\n{\n"), HasSubstr("t.jsonl:2: is not a JSON object"));
  EXPECT_THAT(failure("[]"), HasSubstr("t.jsonl:1: is not a JSON object"));
  EXPECT_THAT(failure(R"({"detections":[]})"), HasSubstr("t.jsonl:1 (image): is missing"));
  EXPECT_THAT(failure(R"({"image":"a"})"), HasSubstr("t.jsonl:1 (detections): is missing"));
  EXPECT_THAT(failure(R"({"image":1,"detections":[]})"), HasSubstr("(image): is not a string"));
  EXPECT_THAT(failure(R"({"image":"a","detections":[7]})"), HasSubstr("(detections): is not an object"));
  EXPECT_THAT(failure(R"({"image":"a","detections":[{"tag":"tag36h11:7"}]})"),
              HasSubstr("(detections[0].corners_px): is missing"));
  EXPECT_THAT(
      failure(R"({"image":"a","detections":[{"tag":"tag36h11:7","corners_px":[[1,2],[3,4],[5,6],[7]]}]})"),
      HasSubstr("(detections[0].corners_px): is not a table of 4 x 2 finite numbers"));
  EXPECT_THAT(
      failure(R"({"image":"a","detections":[{"tag":"tag36h99:7","corners_px":[[1,2],[3,4],[5,6],[7,8]]}]})"),
      HasSubstr("(detections[0].tag)"));
}

TEST(DetectionsJson, NestingIsLimitedAndBracketsInTextDoNotCount) {
  const auto nested = [](std::size_t depth) {
    return R"({"image":"a","detections":[],"more":)" + std::string(depth, '[') + std::string(depth, ']') +
           "}";
  };
  EXPECT_TRUE(parse_reports(nested(60), "t.jsonl"));
  const auto deep = parse_reports(nested(100000), "t.jsonl");
  ASSERT_FALSE(deep);
  EXPECT_EQ(deep.error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(deep.error().place.line, 1);
  const std::string brackets = R"({"image":"\"[)" + std::string(500, '[') + R"(","detections":[]})";
  EXPECT_TRUE(parse_reports(brackets, "t.jsonl")) << "a valid file name";
}

TEST(DetectionsJson, ArbitraryTextIsReadOrRefused) {
  rc::check("a damaged line does not crash", [](std::uint64_t seed) {
    Random random(seed);
    std::string line = json_line(line_of(some_report(seed, true), true));
    for (int i = 0; i < 3; ++i) line.at(random.index(line.size())) = static_cast<char>(random.index(128));
    (void)parse_reports(line, "t.jsonl");
  });
}

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr TagId kPainted{FamilyId::Tag36h11, 12};

Image painted_image(double x_px) {
  Image image(200, 150);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) image.row(y)[x] = 190;
  testing::paint_tag(image, kPainted, testing::square_corners({x_px, 75}, 60, 0.1));
  return image;
}

TagFinder plain_finder() { return {.detector = std::move(make_apriltag_detector({}).value())}; }

/// A recording of three images, the last of which shows no tag.
class DetectRecording : public ::testing::Test {
 protected:
  void SetUp() override {
    auto recorder = SampleRecorder::open(std::move(*create_file(file_)));
    ASSERT_TRUE(recorder);
    for (int i = 0; i < 3; ++i) {
      const SensorTime stamp(std::chrono::milliseconds(1500 + 250 * i));
      ASSERT_TRUE(recorder->add(Odometry{.stamp = stamp}));
      Image photo(200, 150);
      if (i < 2) photo = painted_image(80 + 20 * i);
      ASSERT_TRUE(recorder->add(CameraFrame{.stamp = stamp, .image = std::move(photo)}));
    }
    ASSERT_TRUE(recorder->close());
  }
  DetectSummary detect(const JobControl& control = {}, int most = 100) {
    seen_.clear();
    const auto each = [&](std::size_t, ImageReport& report, const ImageView& image) {
      EXPECT_EQ(image.width, report.width_px);
      seen_.push_back(report);
      return static_cast<int>(seen_.size()) < most;
    };
    const LensChoice unknown{.camera = ImageLens::unknown(), .use_recorded = false};
    return detect_all(find_inputs({file_.string()}, false), finder_, unknown, control, each);
  }
  fs::path file_ = testing::fresh_folder("jobs_detect_recording") / "lap.mcap";
  TagFinder finder_ = plain_finder();
  std::vector<ImageReport> seen_{};
};

TEST_F(DetectRecording, EachImageIsNamedAfterItsStamp) {
  const DetectSummary summary = detect();
  EXPECT_EQ(summary.images, 3U);
  EXPECT_EQ(summary.tags, 2U);
  EXPECT_EQ(summary.failed, 0U);
  std::vector<std::string> names;
  for (const ImageReport& report : seen_) names.push_back(report.image);
  EXPECT_THAT(names, ElementsAre(file_.string() + "#1.500000000", file_.string() + "#1.750000000",
                                 file_.string() + "#2.000000000"));
  EXPECT_EQ(seen_[0].detections.at(0).tag, kPainted);
  EXPECT_TRUE(seen_[2].detected && seen_[2].detections.empty());
}

TEST_F(DetectRecording, EndsWhenTheCallerStopsItOrCancels) {
  EXPECT_EQ(detect({}, 1).images, 1U);
  EXPECT_EQ(seen_.size(), 1U);
  JobControl control;
  control.cancelled = [&] { return seen_.size() >= 2; };
  EXPECT_TRUE(detect(control).stopped);
  EXPECT_EQ(seen_.size(), 2U);
}

TEST_F(DetectRecording, FailsOnARecordingWithoutImages) {
  std::vector<std::string> notes;
  JobControl control;
  control.note = [&](const std::string& words) { notes.push_back(words); };
  file_ = test::record_lap(testing::fresh_folder("jobs_no_images") / "lap.mcap", 95, {.for_s = 1});
  EXPECT_EQ(detect(control).failed, 1U);
  EXPECT_THAT(notes, Contains(HasSubstr(file_.string())));
  file_ = testing::fresh_folder("jobs_broken") / "broken.mcap";
  ASSERT_TRUE(write_text_file(file_, "SQLite format 3, and nothing else"));
  EXPECT_EQ(detect(control).failed, 1U);
}

TEST_F(DetectRecording, DepthImagesAreNamedAndIgnored) {
  constexpr const char* kDepth = "/camera/depth/image_rect_raw/compressedDepth";
  for (const bool color : {false, true}) {
    std::vector<std::string> notes;
    JobControl control;
    control.note = [&](const std::string& words) { notes.push_back(words); };
    file_ = testing::fresh_folder("jobs_depth_images") / "depth.mcap";
    auto recorder = SampleRecorder::open(std::move(*create_file(file_)));
    ASSERT_TRUE(recorder);
    const SensorTime stamp(std::chrono::seconds(1));
    ASSERT_TRUE(recorder->add_message(
        kDepth, stamp, ros2::CompressedImage{.format = "16UC1; compressedDepth", .data = Bytes(40)}));
    if (color) {
      ASSERT_TRUE(recorder->add(CameraFrame{.stamp = stamp, .image = painted_image(80)}));
    }
    ASSERT_TRUE(recorder->close());
    const DetectSummary summary = detect(control);
    EXPECT_EQ(summary.failed, color ? 0U : 1U);
    EXPECT_EQ(summary.tags, color ? 1U : 0U);
    ASSERT_FALSE(notes.empty());
    EXPECT_THAT(notes.front(), ::testing::AllOf(HasSubstr(kDepth), HasSubstr("depth images")));
  }
}

TEST_F(DetectRecording, TagsAreDetectedWhileALapOfImagesIsRead) {
  std::vector<std::string> words;
  JobControl control;
  control.progress = [&](const JobProgress& now) { words.push_back(now.text); };
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

TEST_F(DetectRecording, TheFamilyOfTheRecordedAnchorIsDetectedToo) {
  constexpr TagId kAnchor{FamilyId::TagCustom48h12, 7};
  Image image = painted_image(50);
  testing::paint_tag(image, kAnchor, testing::square_corners({145, 75}, 40, 0));
  file_ = testing::fresh_folder("jobs_anchor_family") / "lap.mcap";
  auto recorder = SampleRecorder::open(std::move(*create_file(file_)));
  ASSERT_TRUE(recorder);
  ASSERT_TRUE(recorder->add_metadata(lap_facts::kMetadata, {{lap_facts::kAnchor, to_string(kAnchor)}}));
  ASSERT_TRUE(recorder->add(CameraFrame{.image = std::move(image)}));
  ASSERT_TRUE(recorder->close());
  const auto lap = read_lap_file(file_.string());
  ASSERT_TRUE(lap) << to_string(lap.error());
  std::set<TagId> found;
  for (const TagDetection& detection : lap->frames.at(0).detections) found.insert(detection.tag);
  EXPECT_THAT(found, ElementsAre(kPainted, kAnchor));
}

TEST_F(DetectRecording, AGivenFinderUsesTheImagesEvenIfTagsAreRecorded) {
  const std::string tags_only =
      test::record_lap(testing::fresh_folder("jobs_tags_only") / "lap.mcap", 96, {.for_s = 1});
  EXPECT_TRUE(read_lap_file(tags_only));
  const auto none = read_lap_file(tags_only, {}, &finder_);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("no images"));
  EXPECT_EQ(read_lap_file(file_.string(), {}, &finder_)->frames.size(), 3U);
}

}  // namespace
}  // namespace waymark
