// Poses of a hand-held camera, estimated from simulated corners with ground truth and from a rendered video.
#include "waymark/app/localize/localize_video.hpp"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/hand_walk.hpp"
#include "waymark/app/common/camera_tags.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/config/exchange/map_exchange.hpp"
#include "waymark/config/exchange/trajectory_file.hpp"
#include "waymark/media/video_writer.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/simulation/render/photograph.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

CameraModel phone() {
  return CameraModel::make(PinholeRadtan{.fx = 520, .fy = 521, .cx = 318, .cy = 243}, 640, 480).value();
}

/// Ground truth and detections for a walk through a room, with a rolling shutter whose readout time is
/// `readout_s`.
struct Filmed {
  World world = testing::walk_room(0.165);
  std::vector<TagFrame> frames{};
  std::vector<SE3> map_T_body{};
};

Filmed filmed(double readout_s) {
  Filmed filmed;
  const testing::HandWalkOptions options{
      .seconds = 10, .readout_s = readout_s, .white_px = 0.2, .lasting_px = 0};
  Random random(20261127);
  const testing::HandWalk hand(random, options.seconds);
  for (SceneFrame& frame : testing::walked_views(filmed.world, phone(), hand, options, random)) {
    const double t_s = to_seconds(frame.stamp.time_since_epoch());
    filmed.frames.push_back({.stamp = frame.stamp, .detections = std::move(frame.views[0].detections)});
    filmed.map_T_body.push_back(hand.at(t_s) * SE3(body_R_optical().inverse(), Eigen::Vector3d::Zero()));
  }
  return filmed;
}

struct Errors {
  double rms_m = 0;
  double nees = 0;  ///< mean NEES; 6 is expected
  std::size_t known = 0;
};

Errors errors_of(const Filmed& filmed, double readout_s) {
  const auto [moments, corner_error_px] =
      camera_moments(filmed.frames, filmed.world.tags, phone(), readout_s);
  EXPECT_EQ(moments.size(), filmed.frames.size());
  Errors errors;
  for (std::size_t i = 0; i < moments.size(); ++i) {
    if (!moments[i].map_T_body || moments[i].tags < 2) continue;
    const Uncertain<SE3>& found = *moments[i].map_T_body;
    const Vector6 off = (filmed.map_T_body[i] * found.mean.inverse()).log();
    errors.rms_m += (found.mean.translation() - filmed.map_T_body[i].translation()).squaredNorm();
    errors.nees += off.dot(found.covariance.llt().solve(off));
    ++errors.known;
  }
  errors.rms_m = std::sqrt(errors.rms_m / static_cast<double>(errors.known));
  errors.nees /= static_cast<double>(errors.known);
  return errors;
}

TEST(CameraMoments, AreConsistent) {
  const Errors errors = errors_of(filmed(0), 0);
  EXPECT_GT(errors.known, 200U);
  EXPECT_GT(errors.nees, 4.5) << "6 expected";
  EXPECT_LT(errors.nees, 7.5);
}

TEST(CameraMoments, ModelARollingShutter) {
  const Filmed room = filmed(0.03);
  const Errors rolling = errors_of(room, 0.03);
  const Errors global = errors_of(room, 0);
  const Errors ideal = errors_of(filmed(0), 0);
  std::printf("rolling %.4f m NEES %.2f, global %.4f m NEES %.2f, ideal %.4f m\n", rolling.rms_m,
              rolling.nees, global.rms_m, global.nees, ideal.rms_m);
  EXPECT_LT(rolling.rms_m, 1.5 * ideal.rms_m);
  EXPECT_GT(global.rms_m, 2 * rolling.rms_m);
  EXPECT_LT(rolling.nees, 9);
  EXPECT_GT(global.nees, 2 * rolling.nees);
}

TEST(CameraMoments, HaveNoPoseWithoutMapTags) {
  EXPECT_TRUE(camera_moments({}, testing::walk_room(0.165).tags, phone(), 0.01).moments.empty());
  const auto moments = camera_moments({TagFrame{}, TagFrame{}, TagFrame{}}, {}, phone(), 0.01).moments;
  ASSERT_EQ(moments.size(), 3U);
  EXPECT_FALSE(moments[1].map_T_body);
  EXPECT_EQ(moments[1].tags, 0);
  EXPECT_STREQ(moments[1].why, "");
  TagDetection unmapped{.tag = {FamilyId::Tag16h5, 3}};
  EXPECT_STREQ(camera_moment({.detections = {unmapped}}, {}, phone()).why, "none of the tags is in the map");
}

TEST(CameraMoments, NeedAMapWithTags) {
  EXPECT_FALSE(check_tag_poses({}, "points.csv"));
  TagMap map;
  map.tags[{FamilyId::Tag16h5, 3}] = {.size_m = 0.1};
  EXPECT_TRUE(check_tag_poses(map, "map.yaml"));
  EXPECT_TRUE(tag_finder_for(map));
}

/// A video of three tags on a wall, recorded by a camera that moves past them.
class FilmedWall : public ::testing::Test {
 protected:
  static SE3 camera_at(int k) { return {SO3(), {-0.2 + 0.04 * k, 0.02 * k, -0.01 * k}}; }

  void SetUp() override {
    for (int id : {1, 2, 3})
      map_.tags.tags[{FamilyId::Tag36h11, id}] = {
          .map_T_tag = {SO3::exp({0, 0.1 * id, 0}), {0.35 * (id - 2), 0.05 * id, 1.2}}, .size_m = 0.165};
    std::ofstream(at("map.yaml")) << to_yaml(map_);
    auto writer = VideoWriter::create(at("walk.mp4"), 640, 480, {.quality = 10});
    if (!writer && writer.error().code == ErrorCode::Unsupported) GTEST_SKIP() << to_string(writer.error());
    ASSERT_TRUE(writer) << to_string(writer.error());
    Random random(1);
    for (int k = 0; k < kImages; ++k) {
      PhotographScene scene;
      for (const auto& [id, tag] : map_.tags.tags)
        scene.tags.push_back(
            {.tag = id, .cam_T_tag = camera_at(k).inverse() * tag.map_T_tag, .size_m = tag.size_m});
      const auto image = photograph(phone(), scene, {}, random);
      ASSERT_TRUE(image) << to_string(image.error());
      ASSERT_TRUE(writer->add(image->image.view(), SensorTime(std::chrono::milliseconds(100 * k))));
    }
    ASSERT_TRUE(writer->close());
    job_.video = at("walk.mp4");
    write_camera(phone());
    job_.map = at("map.yaml");
  }
  void write_camera(const CameraModel& camera) const {
    std::ofstream(at("camera.yaml")) << to_camera_info_yaml({.name = "cam", .camera = camera});
  }
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_ / name).string(); }

  static constexpr int kImages = 8;
  fs::path folder_ = testing::fresh_folder("jobs_localize_video");
  MapFile map_{.anchor = {FamilyId::Tag36h11, 1}};
  LocalizeVideoJob job_{.camera = {.file = at("camera.yaml")}};
};

TEST_F(FilmedWall, ComputesTheCameraPoses) {
  job_.output = at("poses.tum");
  int moments = 0;
  job_.on_moment = [&](const CameraMoment& moment) {
    EXPECT_EQ(moment.stamp.time_since_epoch(), std::chrono::milliseconds(100 * moments++));
    EXPECT_EQ(moment.tags, 3);
  };
  const auto report = localize_video(job_, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(moments, kImages);
  EXPECT_EQ(report->known, static_cast<std::size_t>(kImages));
  const auto poses = read_trajectory(at("poses.tum"));
  ASSERT_TRUE(poses) << to_string(poses.error());
  ASSERT_EQ(poses->size(), static_cast<std::size_t>(kImages));
  for (int k = 0; k < kImages; ++k) {
    const SE3 body = camera_at(k) * SE3(body_R_optical().inverse(), Eigen::Vector3d::Zero());
    const SE3 off = body.inverse() * (*poses)[static_cast<std::size_t>(k)].map_T_base;
    EXPECT_LT(off.translation().norm(), 0.005) << k;
    EXPECT_LT(off.rotation().log().norm(), to_radians(0.3)) << k;
  }
}

TEST_F(FilmedWall, RecordingGivesTheSamePosesAsTheVideo) {
  const TagFinder finder = std::move(*make_tag_finder());
  ASSERT_TRUE(
      convert_video({.input = at("walk.mp4"), .output = at("tags.mcap"), .camera = phone()}, finder, {}));
  EXPECT_FALSE(is_of_camera(at("tags.mcap"), false)) << "it may be a lap with odometry in another file";
  EXPECT_TRUE(is_of_camera(at("tags.mcap"), true));
  EXPECT_TRUE(is_of_camera(at("walk.mp4"), false));
  for (const char* unreadable : {"nothing.mp4", "nothing.mcap", "map.yaml"})
    EXPECT_TRUE(is_of_camera(at(unreadable), true))
        << "the error is reported when the file is opened: " << unreadable;
  std::vector<SE3> of_video, of_recording;
  for (const auto& [file, poses] : {std::pair("walk.mp4", &of_video), {"tags.mcap", &of_recording}}) {
    job_.video = at(file);
    job_.on_moment = [to = poses](const CameraMoment& moment) {
      to->push_back(moment.map_T_body.value().mean);
    };
    const auto report = localize_video(job_, {});
    ASSERT_TRUE(report) << to_string(report.error());
  }
  ASSERT_EQ(of_recording.size(), of_video.size());
  for (std::size_t k = 0; k < of_video.size(); ++k)
    EXPECT_LT((of_video[k].inverse() * of_recording[k]).log().norm(), 1e-6) << k;
}

TEST_F(FilmedWall, TruncatedRecordingIsLocalisedUpToItsEnd) {
  const TagFinder finder = std::move(*make_tag_finder());
  ASSERT_TRUE(
      convert_video({.input = at("walk.mp4"), .output = at("cut.mcap"), .camera = phone()}, finder, {}));
  const auto whole = fs::file_size(at("cut.mcap"));
  job_.video = at("cut.mcap");
  fs::resize_file(at("cut.mcap"), whole - 200);  // cuts off the end of the summary
  EXPECT_TRUE(is_of_camera(at("cut.mcap"), true));
  const auto all = localize_video(job_, {});
  ASSERT_TRUE(all) << to_string(all.error());
  EXPECT_EQ(all->video.images, static_cast<std::size_t>(kImages));
  fs::resize_file(at("cut.mcap"), 300);
  EXPECT_TRUE(is_of_camera(at("cut.mcap"), true));
  const auto none = localize_video(job_, {});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::Unreadable);
  EXPECT_EQ(none.error().place.source, at("cut.mcap"));
}

TEST_F(FilmedWall, WritesAllOrNothing) {
  job_.output = at("walk.mcap");
  JobControl control;
  int calls = 0;
  control.cancelled = [&] { return ++calls > 3; };
  EXPECT_FALSE(localize_video(job_, control));
  EXPECT_FALSE(fs::exists(at("walk.mcap")));
  ASSERT_TRUE(localize_video(job_, {}));
  EXPECT_TRUE(fs::exists(at("walk.mcap")));
  const auto again = localize_video(job_, {});
  ASSERT_FALSE(again);
  EXPECT_TRUE(fs::exists(at("walk.mcap"))) << "the existing file is kept";
}

TEST_F(FilmedWall, RejectsACalibrationOfAnotherImageSize) {
  write_camera(
      CameraModel::make(PinholeRadtan{.fx = 260, .fy = 260, .cx = 160, .cy = 120}, 320, 240).value());
  const auto report = localize_video(job_, {});
  ASSERT_FALSE(report);
  EXPECT_THAT(to_string(report.error()), HasSubstr("walk.mp4"));
}

TEST_F(FilmedWall, NeedsACalibration) {
  job_.camera = {};
  const auto report = localize_video(job_, {});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().place.key, "camera");
}

}  // namespace
}  // namespace waymark
