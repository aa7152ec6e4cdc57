// Makes a map from a rendered video of a walk with a hand-held camera, and compares it with ground truth.
#include "waymark/app/video/map_video.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/recorded_lap.hpp"
#include "waymark/app/common/camera_tags.hpp"
#include "waymark/config/exchange/map_exchange.hpp"
#include "waymark/media/video_writer.hpp"
#include "waymark/simulation/render/photograph.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr double kWalkTag_m = 0.165;

CameraModel walk_camera() {
  return CameraModel::make(PinholeRadtan{.fx = 520, .fy = 521, .cx = 318, .cy = 243}, 640, 480).value();
}

/// Six tags on two adjacent walls. Tag 0 hangs upright at the origin (map x points into it).
TagMap walk_truth() {
  const SO3 on_wall = SO3::from_matrix((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished());
  TagMap truth;
  const auto add = [&](int id, const Eigen::Vector3d& at, double yaw_rad, double roll_rad) {
    const SO3 turn = SO3::from_rpy(0, 0, yaw_rad) * on_wall * SO3::exp({0, 0, roll_rad});
    truth.tags[{FamilyId::Tag36h11, id}] = {.map_T_tag = SE3(turn, at), .size_m = kWalkTag_m};
  };
  add(0, {0, 0, 0}, 0, 0);
  add(1, {0, -0.45, 0.1}, 0, 0.1);
  add(2, {0.02, -0.9, -0.1}, 0.05, 0);
  add(3, {-0.3, -1.25, 0.05}, -1.2, 0);
  add(4, {-0.7, -1.4, 0.0}, -1.3, -0.2);
  add(5, {0.0, 0.45, -0.15}, 0, 0);
  return truth;
}

/// Pose of the hand-held camera in image k of n. It moves along the wall and shakes.
SE3 hand_at(int k, int n) {
  const double s = static_cast<double>(k) / n;
  const Eigen::Vector3d at(-1.3 - 0.15 * std::sin(5 * s), 0.4 - 1.2 * s, 0.05 * std::sin(9 * s));
  const SO3 heading =
      SO3::from_rpy(0.04 * std::sin(11 * s), 0.05 * std::cos(7 * s), 0.05 - 0.7 * s + 0.1 * std::sin(4 * s));
  const SO3 optical = SO3::from_matrix((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished());
  return {heading * optical, at};
}

class Walk : public ::testing::Test {
 protected:
  /// Renders a video of the walk with the given number of images.
  void film(int images) {
    const CameraModel camera = walk_camera();
    auto writer = VideoWriter::create(at("walk.mp4"), 640, 480, {.quality = 18});
    if (!writer && writer.error().code == ErrorCode::Unsupported) GTEST_SKIP() << to_string(writer.error());
    ASSERT_TRUE(writer) << to_string(writer.error());
    Random random(20261123);
    for (int k = 0; k < images; ++k) {
      PhotographScene scene;
      for (const auto& [id, tag] : truth_.tags)
        scene.tags.push_back(
            {.tag = id, .cam_T_tag = hand_at(k, images).inverse() * tag.map_T_tag, .size_m = tag.size_m});
      const auto photo = photograph(camera, scene, {}, random);
      ASSERT_TRUE(photo) << to_string(photo.error());
      ASSERT_TRUE(writer->add(photo->image.view(), SensorTime(std::chrono::milliseconds(66 * k))));
    }
    ASSERT_TRUE(writer->close());
  }
  void SetUp() override {
    job_.videos = {at("walk.mp4")};
    job_.sizes.default_size_m = kWalkTag_m;
    job_.folder = at("map");
  }
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }

  static constexpr int kImages = 30;
  TagMap truth_ = walk_truth();
  fs::path folder_ = testing::fresh_folder("jobs_map_video");
  MapVideoJob job_{.camera = walk_camera()};
  TagFinder finder_ = std::move(make_tag_finder().value());
};

TEST_F(Walk, TagErrorsAreConsistentWithTheirCovariances) {
  film(kImages);
  if (IsSkipped() || HasFatalFailure()) return;
  job_.anchors = {{FamilyId::Tag36h11, 0}};
  job_.prior = truth_;
  const auto report = map_video(job_, finder_, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->images, static_cast<std::size_t>(kImages));
  EXPECT_EQ(report->file.tags.tags.size(), truth_.tags.size());
  ASSERT_EQ(report->beside.size(), truth_.tags.size() - 1);
  double square = 0;
  double nees = 0;
  for (const TagBesidePrior& tag : report->beside) {
    square += tag.off_m.squaredNorm();
    EXPECT_LT(tag.turned_rad, 0.02) << to_string(tag.tag);
    for (Eigen::Index i = 0; i < 3; ++i) {
      ASSERT_GT(tag.sigma_m[i], 0);
      nees += std::pow(tag.off_m[i] / tag.sigma_m[i], 2) / 3;
    }
  }
  const auto count = static_cast<double>(report->beside.size());
  EXPECT_LT(std::sqrt(square / count), 0.01) << "map RMSE [m]";
  EXPECT_THAT(report->warnings, ::testing::Each(::testing::Not(HasSubstr("detector's covariances"))));
  EXPECT_LT(nees / count, 4)
      << "NEES per coordinate; 1 if the covariances are consistent, but tags are not independent";
  EXPECT_GE(report->map.correlated_frames, 1);
  EXPECT_GT(report->trajectory.size(), 25U);
  const SE3 end = report->trajectory.back().map_T_base;
  EXPECT_LT((end.translation() - hand_at(kImages - 1, kImages).translation()).norm(), 0.03);
}

TEST_F(Walk, WrittenFilesAreReadBack) {
  film(6);
  if (IsSkipped() || HasFatalFailure()) return;
  job_.field = FieldSize{16.5, 8.2};
  const auto report = map_video(job_, finder_, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_THAT(report->warnings, ::testing::Contains(HasSubstr("`anchor_pose`")));
  const auto map = read_any_map(at("map/map.yaml"));
  const auto layout = read_any_map(at("map/layout.json"), kWalkTag_m);
  const auto fmap = read_any_map(at("map/layout.fmap"));
  ASSERT_TRUE(fmap) << to_string(fmap.error());
  ASSERT_TRUE(map) << to_string(map.error());
  ASSERT_TRUE(layout) << to_string(layout.error());
  EXPECT_EQ(layout->field, job_.field);
  EXPECT_EQ(fmap->field, job_.field);
  EXPECT_EQ(map->map.anchor, report->file.anchor);
  for (const auto& [id, tag] : map->map.tags.tags) {
    const MappedTag* same = layout->map.tags.find(id);
    ASSERT_NE(same, nullptr);
    EXPECT_LT((same->map_T_tag.translation() - tag.map_T_tag.translation()).norm(), 1e-9);
    EXPECT_LT((fmap->map.tags.tags.at(id).map_T_tag.inverse() * tag.map_T_tag).log().norm(), 1e-9);
  }
  for (const char* name : {"poses.yaml", "trajectory.txt", "summary.json"})
    EXPECT_TRUE(fs::exists(folder_ / "map" / name)) << name;
}

TEST_F(Walk, RecordingOfTheVideoGivesTheSameMap) {
  film(12);
  if (IsSkipped() || HasFatalFailure()) return;
  ASSERT_TRUE(convert_video({.input = at("walk.mp4"), .output = at("walk.mcap"), .camera = walk_camera()},
                            finder_, {}));
  const auto of_video = map_video(job_, finder_, {});
  ASSERT_TRUE(of_video) << to_string(of_video.error());
  job_.videos = {at("walk.mcap")};
  job_.folder = at("again");
  const auto of_recording = map_video(job_, finder_, {});
  ASSERT_TRUE(of_recording) << to_string(of_recording.error());
  EXPECT_EQ(of_recording->images, of_video->images);
  ASSERT_EQ(of_recording->file.tags.tags.size(), of_video->file.tags.tags.size());
  for (const auto& [id, tag] : of_recording->file.tags.tags)
    EXPECT_LT((of_video->file.tags.tags.at(id).map_T_tag.inverse() * tag.map_T_tag).log().norm(), 1e-6)
        << to_string(id);
}

TEST_F(Walk, UnobservedAnchorOrCancellingWritesNothing) {
  film(2);
  if (IsSkipped() || HasFatalFailure()) return;
  job_.anchors = {{FamilyId::Tag36h11, 77}};
  const auto absent = map_video(job_, finder_, {});
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().place.key, "anchor");
  EXPECT_THAT(absent.error().message, HasSubstr("tag36h11:77"));
  job_.anchors = {};
  JobControl control;
  control.cancelled = [] { return true; };
  EXPECT_FALSE(map_video(job_, finder_, control));
  EXPECT_FALSE(fs::exists(folder_ / "map"));
}

TEST_F(Walk, DistancesThatRejectAllTagsAreAnError) {
  film(30);
  if (IsSkipped() || HasFatalFailure()) return;
  MapVideoJob plain = job_;
  plain.folder = (folder_ / "plain").string();
  const auto all = map_video(plain, finder_, {});
  ASSERT_TRUE(all) << to_string(all.error());
  const TagId first = all->file.tags.tags.begin()->first;
  for (const auto& [tag, mapped] : all->file.tags.tags)
    if (tag != first)
      for (const double wrong_m : {50.0, 90.0}) job_.distances.push_back({first, tag, wrong_m});
  const auto refused = map_video(job_, finder_, {});
  ASSERT_FALSE(refused) << refused->file.tags.tags.size() << " tags";
  EXPECT_EQ(refused.error().code, ErrorCode::NotFound);
  EXPECT_THAT(refused.error().hint, HasSubstr("`distance`"));
  EXPECT_FALSE(fs::exists(folder_ / "map"));
}

TEST_F(Walk, RejectsAVideoGivenTwice) {
  std::ofstream(at("walk.mp4")) << "no video";
  fs::create_hard_link(at("walk.mp4"), at("link.mp4"));
  for (const std::string& again : {at("walk.mp4"), (folder_ / "." / "walk.mp4").string(), at("link.mp4")}) {
    job_.videos = {at("walk.mp4"), again};
    const auto report = map_video(job_, finder_, {});
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().place.source, again);
    EXPECT_EQ(report.error().code, ErrorCode::InvalidArgument);
  }
}

TEST_F(Walk, RejectsACameraOfAnotherImageSize) {
  film(2);
  if (IsSkipped() || HasFatalFailure()) return;
  const PinholeRadtan lens{.fx = 1040, .fy = 1042, .cx = 636, .cy = 486};
  job_.camera = CameraModel::make(lens, 1280, 960).value();
  const auto report = map_video(job_, finder_, {});
  ASSERT_FALSE(report);
  EXPECT_THAT(to_string(report.error()), ::testing::AllOf(HasSubstr("1280"), HasSubstr("640")));
  EXPECT_FALSE(fs::exists(folder_ / "map"));
}

TEST_F(Walk, RejectsTheLapOfARobot) {
  job_.videos = {test::record_lap(folder_ / "lap.mcap", 9, {.for_s = 1})};
  const auto report = map_video(job_, finder_, {});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().place.key, job_.videos.front());
  EXPECT_THAT(to_string(report.error()), HasSubstr("`waymark map lap`"));
}

TEST_F(Walk, FieldSizeIsThatOfThePriorMap) {
  std::ofstream(at("field.json")) << R"({"tags":[{"ID":7,"pose":{"translation":{"x":4,"y":1,"z":1},
    "rotation":{"quaternion":{"W":0,"X":0,"Y":0,"Z":1}}}}],"field":{"length":16.5,"width":8.2}})";
  ASSERT_TRUE(read_prior_map(at("field.json"), job_));
  EXPECT_EQ(job_.field, (FieldSize{16.5, 8.2}));
  EXPECT_EQ(job_.prior.tags.size(), 1U);
  EXPECT_FALSE(read_prior_map(at("none.json"), job_));
}

TEST(Distance, ParsesIdsMetresAndStandardDeviation) {
  const auto distance = parse_distance("3,7,2.41");
  ASSERT_TRUE(distance) << to_string(distance.error());
  EXPECT_EQ(distance->a, (TagId{FamilyId::Tag36h11, 3}));
  EXPECT_EQ(distance->b, (TagId{FamilyId::Tag36h11, 7}));
  EXPECT_DOUBLE_EQ(distance->measured_m, 2.41);
  EXPECT_DOUBLE_EQ(distance->sigma_m, 0.005);
  EXPECT_DOUBLE_EQ(parse_distance("tag36h11:3,9,1.5,0.002")->sigma_m, 0.002);
}

TEST(Distance, RejectsInvalidText) {
  for (const char* text : {"", "3,7", "3,7,", "3,7,far", "3,7,-1", "3,7,0", "3,3,1", "3,7,1,0", "3,7,nan",
                           "3,7,inf", "3,7,2.4m", "3,7,1,0.01,5", "wall,7,1"}) {
    const auto refused = parse_distance(text);
    ASSERT_FALSE(refused) << text;
    EXPECT_EQ(refused.error().place.key, "distance");
    EXPECT_THAT(refused.error().message, HasSubstr(text));
  }
}

constexpr TagId wall_tag(int number) { return {FamilyId::Tag36h11, number}; }

MapVideoJob valid_video_job() {
  MapVideoJob job{.camera = walk_camera()};
  job.sizes.default_size_m = kWalkTag_m;
  return job;
}

std::string refused_field_of_video(const MapVideoJob& job) {
  const Status valid = check(job);
  return valid ? std::string("none") : valid.error().place.key;
}

TEST(MapVideoJob, RequiresACameraAndATagSize) {
  EXPECT_EQ(refused_field_of_video(valid_video_job()), "none");
  EXPECT_EQ(refused_field_of_video({}), "camera");
  EXPECT_EQ(refused_field_of_video({.camera = walk_camera()}), "tag_size_m");
}

TEST(MapVideoJob, RejectsATagOnFloorAndWall) {
  MapVideoJob job = valid_video_job();
  job.floor = {wall_tag(3), wall_tag(4)};
  job.upright = {wall_tag(7)};
  EXPECT_EQ(refused_field_of_video(job), "none");
  job.upright.push_back(wall_tag(4));
  const Error both = check(job).error();
  EXPECT_EQ(both.place.key, "upright");
  EXPECT_THAT(both.message, HasSubstr("tag36h11:4 "));
  EXPECT_THAT(both.message, HasSubstr("`floor`"));
}

TEST(MapVideoJob, RejectsStandardDeviationsWithoutTheirFields) {
  MapVideoJob job = valid_video_job();
  job.level_sigma_deg = 2;
  EXPECT_EQ(refused_field_of_video(job), "level_sigma_deg");
  job.planes = {{wall_tag(3), wall_tag(4)}};
  EXPECT_EQ(refused_field_of_video(job), "none");
  job.prior_sigma_deg = 1;
  EXPECT_EQ(refused_field_of_video(job), "prior_sigma_deg");
  job.prior_sigma_m = 0.01;
  EXPECT_EQ(refused_field_of_video(job), "prior_sigma_m");
  job.prior = walk_truth();
  EXPECT_EQ(refused_field_of_video(job), "none");
  job.map_T_anchor = SE3();
  EXPECT_EQ(refused_field_of_video(job), "anchor_pose") << "the prior map defines the map frame";
  job.prior_sigma_m.reset();
  job.prior_sigma_deg.reset();
  EXPECT_EQ(refused_field_of_video(job), "none");
  job.anchors = {wall_tag(0), wall_tag(1)};
  EXPECT_EQ(refused_field_of_video(job), "anchor_pose");
}

}  // namespace
}  // namespace waymark
