// Selection of views from a video, lenses for each output format, and calibration from a rendered video of a
// board that alternately moves and stops.
#include "waymark/app/calibrate_camera/calibrate_camera.hpp"

#include <cmath>
#include <filesystem>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/media/video_writer.hpp"
#include "waymark/simulation/render/photograph.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Lt;
using ::testing::Not;

/// A board whose tags are at the horizontal image position `x_px`, in an image taken k/30 s after the first
/// one.
StampedMarks board_at(int k, double x_px, int tags = 6) {
  StampedMarks image{.stamp = SensorTime(std::chrono::microseconds(33'333 * k))};
  for (int i = 0; i < tags; ++i) {
    const Eigen::Vector2d at(x_px + 50 * (i % 3), 100 + 50 * (i / 3));
    TargetMark tag{.key = i, .target_points_m = std::vector<Eigen::Vector3d>(4, {0, 0, 0})};
    tag.seen_px = {at, at + Eigen::Vector2d(30, 0), at + Eigen::Vector2d(30, 30),
                   at + Eigen::Vector2d(0, 30)};
    image.marks.push_back(tag);
  }
  return image;
}

TEST(CalibrateCameraReport, NamesParametersAndTheMarksOfItsTarget) {
  EXPECT_EQ(to_json(fields(CalibrateCameraReport{}))["regions"].size(), 9U);
  CalibrateCameraReport report{.images = {"a.png"}, .mark_kind = "corners"};
  report.found.names = {"fx_px"};
  report.found.parameters = Eigen::VectorXd::Constant(1, 440);
  report.found.covariance = Eigen::MatrixXd::Constant(1, 1, 0.25);
  report.found.views = {{.marks = 30, .rejected = 1, .rms_px = 0.5, .tilt_deg = 20, .distance_m = 2}};
  report.found.trials = {{.lens = LensModel::Radtan4}};
  const auto json = to_json(fields(report));
  EXPECT_EQ(json["parameters"].dump(), R"({"fx_px":{"value":440.0,"sigma":0.5}})");
  EXPECT_EQ(json["lenses"].dump(), R"([{"lens":"radtan4","held_out_rms_px":null}])");
  EXPECT_EQ(json["images"].dump(),
            R"([{"image":"a.png","corners":30,"rejected":1,"rms_px":0.5,"tilt_deg":20.0,"distance_m":2.0}])");
}

TEST(VideoViews, TakesOneStillImagePerPosition) {
  std::vector<StampedMarks> images;
  int k = 0;
  const auto stay = [&](double x_px) {
    for (int i = 0; i < 10; ++i) images.push_back(board_at(k++, x_px + 0.1 * i));
  };
  stay(10);
  for (int i = 1; i < 10; ++i) images.push_back(board_at(k++, 10 + 20 * i));  // moves at 600 px/s
  stay(210);
  const auto chosen = choose_views(images, 800);
  ASSERT_EQ(chosen.size(), 2U);
  EXPECT_LT(chosen[0], 10U);
  EXPECT_GE(chosen[1], 19U);
}

TEST(VideoViews, RejectsFastMotionAndFewTags) {
  std::vector<StampedMarks> fast;
  for (int k = 0; k < 30; ++k) fast.push_back(board_at(k, 15.0 * k));
  EXPECT_TRUE(choose_views(fast, 800).empty());
  std::vector<StampedMarks> few;
  for (int k = 0; k < 30; ++k) few.push_back(board_at(k, 1.0 * k, 3));
  EXPECT_TRUE(choose_views(few, 800).empty());
  EXPECT_FALSE(choose_views(few, 800, {.fewest_tags = 3}).empty());
}

TEST(VideoViews, LimitsTheNumberOfViews) {
  std::vector<StampedMarks> slow;
  for (int k = 0; k < 600; ++k) slow.push_back(board_at(k, 1.0 * k));
  const auto all = choose_views(slow, 800);
  EXPECT_GT(all.size(), 10U);
  EXPECT_THAT(all, Each(Lt(600U)));
  EXPECT_EQ(choose_views(slow, 800, {.most_views = 5}).size(), 5U);
  EXPECT_THAT(choose_views({board_at(0, 10)}, 800), ElementsAre(0));
  EXPECT_TRUE(choose_views({}, 800).empty());
}

CameraFitJob job_of(const std::string& output, const std::string& format = "") {
  return {.output = output, .format = format};
}

TEST(FitOptions, AutoTriesOnlyLensesThatTheFormatSupports) {
  for (const CameraFitJob& job : {job_of("a.json"), job_of("a.yaml", "photonvision")}) {
    EXPECT_THAT(fit_options(job).lenses, Not(Contains(LensModel::Equidistant)));
    EXPECT_THAT(fit_options(job).lenses, Contains(LensModel::Rational8));
  }
  EXPECT_THAT(fit_options(job_of("a.yaml", "kalibr")).lenses, Not(Contains(LensModel::Rational8)));
  EXPECT_THAT(fit_options(job_of("a.yaml", "kalibr")).lenses, Contains(LensModel::Equidistant));
  for (const CameraFitJob& job : {job_of("a.yaml"), job_of(""), job_of("a.yaml", "ros")})
    EXPECT_EQ(fit_options(job).lenses, lens_models()) << job.format;
}

TEST(FitOptions, NamesTheLensesThatAreNotTried) {
  EXPECT_THAT(untried_lenses_note(job_of("a.json")),
              AllOf(HasSubstr("photonvision"), HasSubstr("`lens=equidistant`")));
  EXPECT_EQ(untried_lenses_note(job_of("a.yaml")), "");
  CameraFitJob chosen = job_of("a.json");
  chosen.lens = "radtan5";
  EXPECT_EQ(untried_lenses_note(chosen), "");
}

TEST(CheckOutputs, RejectsTheExtensionOfAnotherFormat) {
  for (const CameraFitJob& job : {job_of("x.txt"), job_of("x.json", "ros"), job_of("x.yaml", "photonvision")})
    EXPECT_EQ(check_outputs(job).error().place.key, "output") << job.output;
  for (const CameraFitJob& job : {job_of("x.yml"), job_of("x.json"), job_of("x.yaml", "ros"), job_of("")})
    EXPECT_TRUE(check_outputs(job)) << job.output;
  const Error ending = check_outputs(job_of("x.txt", "ros")).error();
  EXPECT_EQ(ending.place.key, "output");
  EXPECT_THAT(ending.message, HasSubstr("x.txt"));
  EXPECT_THAT(ending.message, HasSubstr("ros"));
  EXPECT_THAT(ending.hint, HasSubstr(".yaml"));
}

constexpr int kStops = 9;
constexpr int kImagesPerStop = 3;

/// Pose of the board at a stop or, if `stop` has a fractional part, between two stops.
SE3 cam_T_board_at(double stop) {
  const SO3 tilt = SO3::exp(
      {to_radians(30) * std::cos(2.0 * stop), to_radians(30) * std::sin(2.0 * stop), 0.15 * std::sin(stop)});
  return {tilt, {0.05 * std::sin(1.7 * stop), 0.04 * std::cos(2.3 * stop), 0.42 + 0.02 * stop}};
}

TEST(CalibrateVideo, UsesTheStopsAndEstimatesTheFocalLength) {
  const CameraModel truth =
      CameraModel::make(PinholeRadtan{.fx = 512, .fy = 509, .cx = 326, .cy = 236}, 640, 480).value();
  const std::filesystem::path folder = testing::fresh_folder("jobs_calibrate_video");
  CalibrateCameraJob job{.target = {.columns = 5, .rows = 4, .tag_size_m = 0.04}, .fit = {.lens = "none"}};
  const CalibrationTarget target = CalibrationTarget::make(job.target).value();
  auto writer = VideoWriter::create(folder / "board.mp4", 640, 480, {.quality = 12});
  if (!writer && writer.error().code == ErrorCode::Unsupported) GTEST_SKIP() << to_string(writer.error());
  ASSERT_TRUE(writer) << to_string(writer.error());
  Random random(20261123);
  int k = 0;
  const auto show = [&](double stop) {
    PhotographScene scene;
    for (const auto& [id, tag] : target.tags().tags)
      scene.tags.push_back({.tag = id,
                            .cam_T_tag = cam_T_board_at(stop) * tag.map_T_tag,
                            .size_m = tag.size_m,
                            .margin_cells = 0.5});
    const auto photo = photograph(truth, scene, {}, random);
    ASSERT_TRUE(photo) << to_string(photo.error());
    ASSERT_TRUE(writer->add(photo->image.view(), SensorTime(std::chrono::milliseconds(33 * k++))));
  };
  for (int stop = 0; stop < kStops; ++stop) {
    for (int i = 0; i < kImagesPerStop; ++i) show(stop);
    show(stop + 0.5);  // between two stops, where it moves too fast
  }
  ASSERT_TRUE(writer->close());
  job.sources = {(folder / "board.mp4").string()};
  std::vector<std::string> notes;
  JobControl control;
  control.note = [&](const std::string& note) { notes.push_back(note); };
  const TagFinder finder = std::move(make_tag_finder().value());
  const auto report = calibrate_camera(job, target, finder, control);
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_THAT(notes, ::testing::Contains(::testing::HasSubstr("36 images")));
  EXPECT_GE(report->images.size(), 6U);
  std::set<int> stops;  // not necessarily all stops, because some views are similar
  for (const std::string& name : report->images) {
    const int index = static_cast<int>(std::lround(std::stod(name.substr(name.rfind('#') + 1)) / 0.033));
    EXPECT_LT(index % (kImagesPerStop + 1), kImagesPerStop) << "taken between two stops: " << name;
    EXPECT_TRUE(stops.insert(index / (kImagesPerStop + 1)).second) << "stop selected twice: " << name;
  }
  ASSERT_EQ(report->found.names[0], "fx_px");
  EXPECT_NEAR(report->found.parameters[0], 512, 2.5);
  EXPECT_LT(std::abs(report->found.parameters[0] - 512), 5 * sigma_of(report->found, 0));
}

}  // namespace
}  // namespace waymark
