// A scene described by TagSLAM files: a rig with one camera faces tags on a wall.
#include "waymark/app/scene/map_scene.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"
#include "waymark/app/scene/scene_recording.hpp"
#include "waymark/base/random.hpp"
#include "waymark/config/exchange/map_exchange.hpp"
#include "waymark/config/exchange/trajectory_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr const char* kLab = R"(
tagslam_parameters: {pixel_noise: 1.0, minimum_tag_area: 100}
body_defaults: {position_noise: 0.001, rotation_noise: 0.001}
default_body: lab
bodies:
 - lab:
     is_static: true
     type: simple
     default_tag_size: 0.2
     pose: {position: {x: 0, y: 0, z: 0}, rotation: {x: 0, y: 0, z: 0}, position_noise: 0.00001, rotation_noise: 0.00001}
     tags:
       - {id: 0, pose: {position: {x: 0, y: 0, z: 0}, rotation: {x: 0, y: 0, z: 0}, position_noise: 0.00001, rotation_noise: 0.00001}}
 - rig: {is_static: false, type: simple}
)";
constexpr const char* kRigCamera = R"(
cam0: {camera_model: pinhole, intrinsics: [400, 400, 319.5, 239.5], distortion_model: radtan,
  distortion_coeffs: [0, 0, 0, 0], resolution: [640, 480], tagtopic: /tag_detections, rig_body: rig}
)";
constexpr const char* kRigPose = R"(
cam0:
  pose: {position: {x: 0, y: 0, z: 0}, rotation: {x: 0, y: 0, z: 0}, position_noise: 0.00001, rotation_noise: 0.00001}
)";

CameraModel rig_camera() {
  return CameraModel::make(PinholeRadtan{.fx = 400, .fy = 400, .cx = 320, .cy = 240}, 640, 480).value();
}

/// The z axis of the lab frame points out of the wall; that of a tag points into it.
SE3 wall_T_tag(int number) { return {SO3::exp({M_PI, 0, 0}), {0.5 * number, number % 2 == 0 ? 0 : 0.3, 0}}; }

/// The camera moves along the wall at a distance of two metres and rotates slightly.
SE3 wall_T_cam(int step) {
  const double s = 0.1 * step;
  return {SO3::exp({M_PI, 0, 0}) * SO3::from_rpy(0.1 * std::sin(s), 0.15 * std::cos(2 * s), 0.05 * s),
          {0.4 + 0.03 * step, 0.1 * std::sin(3 * s), 2 + 0.2 * std::sin(s)}};
}

SensorTime at_step(int step) { return SensorTime(std::chrono::milliseconds(100 * step + 1000)); }

/// The TagSLAM files and a recording with 40 frames.
struct TagslamScene {
  fs::path folder = testing::fresh_folder("jobs_scene");
  fs::path recording = folder / "tags.mcap";

  TagslamScene() {
    EXPECT_TRUE(write_text_file(folder / "tagslam.yaml", kLab));
    EXPECT_TRUE(write_text_file(folder / "cameras.yaml", kRigCamera));
    EXPECT_TRUE(write_text_file(folder / "camera_poses.yaml", kRigPose));
    record(recording, 0.1);
  }
  /// `offset` is added to the ids that the files do not list.
  static void record(const fs::path& file, double sigma_px, int offset = 0) {
    auto recorder = SampleRecorder::open(std::move(*create_file(file)));
    EXPECT_TRUE(recorder);
    Random random(17);
    for (int step = 0; step < 40; ++step) {
      TagFrame frame{.stamp = at_step(step)};
      for (int number = 0; number < 5; ++number) {
        const SE3 cam_T_tag = wall_T_cam(step).inverse() * wall_T_tag(number);
        auto corners = visible_corners(rig_camera(), cam_T_tag, 0.2);
        if (!corners) continue;
        for (auto& corner : *corners)
          corner += Eigen::Vector2d(random.normal(0, sigma_px), random.normal(0, sigma_px));
        const TagId id{FamilyId::Tag36h11, number == 0 ? 0 : number + offset};
        frame.detections.push_back({.tag = id, .corners_px = *corners});
      }
      EXPECT_TRUE(recorder->add(frame));
    }
    EXPECT_TRUE(recorder->close());
  }
  [[nodiscard]] MapSceneJob job(const fs::path& out) const {
    return {.recording = recording.string(), .tagslam = folder, .folder = out};
  }
};

const TagslamScene& wall_scene() {
  static const TagslamScene made;
  return made;
}

class MapScene : public ::testing::Test {
 protected:
  fs::path out_ = testing::fresh_folder("jobs_scene_map") / "map";
};

TEST_F(MapScene, TagAndCameraPosesAreAccurate) {
  const auto report = map_scene_recording(wall_scene().job(out_), {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->frames, 40);
  EXPECT_EQ(report->frames_without_pose, 0);
  const MapFile map = read_map(out_ / "map.yaml").value();
  ASSERT_EQ(map.tags.tags.size(), 5U);
  for (int number = 0; number < 5; ++number) {
    const MappedTag* tag = map.tags.find({FamilyId::Tag36h11, number});
    ASSERT_NE(tag, nullptr) << number;
    EXPECT_LT((tag->map_T_tag.translation() - wall_T_tag(number).translation()).norm(), 3e-3) << number;
    EXPECT_EQ(tag->size_m, 0.2);
    EXPECT_TRUE(tag->covariance);
  }
  const Trajectory rig = read_trajectory(out_ / "trajectory_rig.txt").value();
  ASSERT_EQ(rig.size(), 40U);
  double squared_m2 = 0;
  for (int step = 0; step < 40; ++step) {
    const SE3 apart = rig[static_cast<std::size_t>(step)].map_T_base.inverse() * wall_T_cam(step);
    squared_m2 += apart.translation().squaredNorm() / 40;
  }
  EXPECT_LT(std::sqrt(squared_m2), 0.012) << "0.1 px at 2 m with a focal length of 400 px";
}

TEST_F(MapScene, SummaryMatchesTheWrittenFiles) {
  const auto report = map_scene_recording(wall_scene().job(out_), {});
  ASSERT_TRUE(report);
  const auto json = nlohmann::json::parse(read_text_file(out_ / "summary.json", 1 << 20).value());
  EXPECT_EQ(json["tags"], 5);
  EXPECT_EQ(json["frames"], 40);
  EXPECT_NEAR(json["noise_px"].get<double>(), 0.1, 0.02) << "noise added to the simulated corners";
  EXPECT_LE(json["rejected_observations"].get<int>(), 3);
  EXPECT_FALSE(json.contains("against"));
  for (const std::string& file : report->files) EXPECT_TRUE(fs::exists(file)) << file;
  EXPECT_EQ(json["files"].size(), report->files.size());
}

TEST_F(MapScene, AcceptsItsOwnCameraPosesAsInput) {
  ASSERT_TRUE(map_scene_recording(wall_scene().job(out_), {}));
  const fs::path again = testing::fresh_folder("jobs_scene_again");
  for (const char* name : {"tagslam.yaml", "cameras.yaml"})
    fs::copy_file(wall_scene().folder / name, again / name);
  fs::copy_file(out_ / "camera_poses.yaml", again / "camera_poses.yaml");
  MapSceneJob job = wall_scene().job(again / "map");
  job.tagslam = again;
  const auto second = map_scene_recording(job, {});
  ASSERT_TRUE(second) << to_string(second.error());
  const MapFile first_map = read_map(out_ / "map.yaml").value();
  const MapFile second_map = read_map(again / "map" / "map.yaml").value();
  ASSERT_EQ(second_map.tags.tags.size(), 5U);
  for (const auto& [id, tag] : second_map.tags.tags)
    EXPECT_LT((tag.map_T_tag.translation() - first_map.tags.find(id)->map_T_tag.translation()).norm(), 1e-3);
}

TEST_F(MapScene, CancellingWritesNothing) {
  JobControl control;
  int calls = 0;
  control.cancelled = [&] { return ++calls > 2; };
  std::vector<std::string> steps;
  control.progress = [&](const JobProgress& now) { steps.push_back(now.text); };
  const auto report = map_scene_recording(wall_scene().job(out_), control);
  ASSERT_FALSE(report);
  EXPECT_THAT(to_string(report.error()), HasSubstr("nothing was written"));
  EXPECT_FALSE(fs::exists(out_));
  EXPECT_THAT(steps, Contains(HasSubstr("cost")));
}

TEST_F(MapScene, CovariancesOfUndeterminedPosesAreReadBack) {
  MapSceneJob job = wall_scene().job(out_);
  job.recording = (testing::fresh_folder("jobs_scene_exact") / "exact.mcap").string();
  TagslamScene::record(job.recording, 0);  // without noise, the normal equations do not determine all poses
  const auto report = map_scene_recording(job, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_THAT(report->warnings, Contains(HasSubstr("not determined")));
  const auto map = read_map(out_ / "map.yaml");
  ASSERT_TRUE(map) << to_string(map.error());
  EXPECT_EQ(map->tags.tags.size(), 5U);
}

TEST_F(MapScene, UnlistedIdsBeyondTag36h11AreReadBack) {
  constexpr int kOffset = 586;
  MapSceneJob job = wall_scene().job(out_);
  job.recording = (testing::fresh_folder("jobs_scene_family") / "tags.mcap").string();
  TagslamScene::record(job.recording, 0.1, kOffset);
  const auto report = map_scene_recording(job, {});
  ASSERT_TRUE(report) << to_string(report.error());
  const auto map = read_map(out_ / "map.yaml");
  ASSERT_TRUE(map) << to_string(map.error());
  const auto poses = read_any_map(out_ / "poses.yaml");
  ASSERT_TRUE(poses) << to_string(poses.error());
  for (const TagMap* tags : {&map->tags, &poses->map.tags}) {
    EXPECT_EQ(tags->tags.size(), 5U);
    for (const int number : {0, 1 + kOffset, 4 + kOffset})
      EXPECT_NE(tags->find({FamilyId::TagStandard41h12, number}), nullptr) << number;
  }
}

TEST_F(MapScene, BacksUpAnOlderMap) {
  fs::create_directories(out_);
  ASSERT_TRUE(write_text_file(out_ / "map.yaml", "older"));
  ASSERT_TRUE(map_scene_recording(wall_scene().job(out_), {}));
  EXPECT_EQ(read_text_file(out_ / "map.1.yaml", 100).value(), "older");
  EXPECT_TRUE(read_map(out_ / "map.yaml"));
}

TEST_F(MapScene, ReportsUnusableFilesAndWritesNothing) {
  const auto error = [&](const MapSceneJob& job) {
    const auto report = map_scene_recording(job, {});
    EXPECT_FALSE(report);
    EXPECT_FALSE(fs::exists(out_));
    return report ? Error{} : report.error();
  };
  MapSceneJob job = wall_scene().job(out_);
  job.recording = "/nowhere/tags.mcap";
  EXPECT_EQ(error(job).place.source, "/nowhere/tags.mcap");
  job = wall_scene().job(out_);
  job.tagslam = "/nowhere";
  EXPECT_THAT(error(job).place.source, HasSubstr("/nowhere"));
  const fs::path table = testing::fresh_folder("jobs_scene_table") / "tags.csv";
  ASSERT_TRUE(write_text_file(table, "t_ns,cam,tag,x0,y0,x1,y1,x2,y2,x3,y3\n1,cam0,4,1,4,3,4,3,2,1,2\n"));
  job = wall_scene().job(out_);
  job.recording = table.string();
  EXPECT_EQ(error(job).code, ErrorCode::InvalidArgument) << "a table has no camera names";
}

TEST(SceneRecordingOf, UsesTheTopicOfTheCameraOrTheOnlyTopic) {
  TagScene scene;
  scene.cameras.push_back({.name = "cam0", .topic = "/somewhere/else", .model = rig_camera()});
  scene.bodies.push_back({.name = "rig"});
  std::vector<std::string> problems;
  const auto only = read_scene_recording(wall_scene().recording, scene, {}, problems);
  ASSERT_TRUE(only) << to_string(only.error());
  EXPECT_EQ(only->frames.size(), 40U);
  EXPECT_TRUE(problems.empty());
  scene.cameras.push_back({.name = "cam1", .topic = "/another", .model = rig_camera()});
  const auto several = read_scene_recording(wall_scene().recording, scene, {}, problems);
  ASSERT_FALSE(several);
  EXPECT_THAT(several.error().hint, HasSubstr(topics::kTags));
  EXPECT_EQ(several.error().place.source, wall_scene().recording.string());
}

TEST(SceneRecordingOf, RejectsARecordingWithoutFrames) {
  const fs::path file = testing::fresh_folder("jobs_scene_empty") / "empty.mcap";
  auto recorder = SampleRecorder::open(std::move(*create_file(file)));
  ASSERT_TRUE(recorder);
  ASSERT_TRUE(recorder->add(Odometry{.stamp = at_step(0)}));
  ASSERT_TRUE(recorder->close());
  TagScene scene;
  scene.cameras.push_back({.name = "cam0", .topic = topics::kTags, .model = rig_camera()});
  std::vector<std::string> problems;
  const auto none = read_scene_recording(file, scene, {}, problems);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().place.source, file.string());
}

TEST(MapSceneJob, TagslamModelExcludesFreeIntrinsics) {
  MapSceneJob job;
  job.options.free_intrinsics = true;
  job.options.model = parse_scene_model("waymark").value();
  EXPECT_TRUE(check(job));
  job.options.model = parse_scene_model("tagslam").value();
  EXPECT_EQ(job.options.model, SceneModel::Tagslam);
  const Error fixed = check(job).error();
  EXPECT_EQ(fixed.place.key, "free_intrinsics");
  EXPECT_NE(fixed.hint.find("`model=tagslam`"), std::string::npos);
  const Error unknown = parse_scene_model("tagslm").error();
  EXPECT_EQ(unknown.place.key, "model");
  EXPECT_THAT(unknown.message, HasSubstr("'tagslm'"));
  EXPECT_THAT(unknown.hint, HasSubstr("'tagslam'"));
}

}  // namespace
}  // namespace waymark
