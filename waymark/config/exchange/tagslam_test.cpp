// Tests of TagSLAM files: their contents, both formats, and errors.
#include "waymark/config/exchange/tagslam.hpp"

#include <filesystem>
#include <fstream>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"

namespace waymark {
namespace {

constexpr const char* kTagslam = R"(
tagslam_parameters: {pixel_noise: 2.0, minimum_tag_area: 2000, use_approximate_sync: true}
body_defaults: {position_noise: 0.05, rotation_noise: 0.01}
default_body: lab
bodies:
 - lab:
     is_static: true
     type: simple
     default_tag_size: 0.16
     ignore_tags: [7, 9]
     pose: {position: {x: 1, y: 2, z: 3}, rotation: {x: 0, y: 0, z: 1.5}}
     tags:
       - {id: 4, size: 0.1, pose: {position: {x: 1, y: 0, z: 0}, position_noise: {x: 0.1, y: 0.2, z: 0.3}}}
       - {id: 5}
 - rig: {is_static: false, type: simple, odom_frame_id: odo, odom_translation_noise: 0.02, odom_rotation_noise: 0.03}
 - board: {is_static: true, type: staggered_board, staggered_board: {tag_start_id: 20, tag_size: 0.05, tag_spacing: 1.0,
     tag_rows: 2, tag_columns: 3, tag_position_noise: 0.001, tag_rotation_noise: 0.001}}
distance_measurements:
 - one: {tag1: 4, tag2: 5, corner1: 0, corner2: 1, distance: 0.7, noise: 0.01}
plane_measurements:
 - floor: {tags: [4, 5], distance: 0.5, noise: 0.02, direction: [0, 0, 1]}
)";
constexpr const char* kCameras = R"(
cam0: {camera_model: pinhole, intrinsics: [400, 401, 320, 240], distortion_model: equidistant,
  distortion_coeffs: [0, 0, 0, 0], resolution: [640, 480], tagtopic: /tags, rig_body: rig, wiggle_rotation: 0.01,
  wiggle_translation: 0.02}
)";

class TagslamFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_);
    write("tagslam.yaml", kTagslam);
    write("cameras.yaml", kCameras);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  void write(const char* name, const std::string& text) { std::ofstream(folder_ / name) << text; }
  /// The error that occurs on reading a file in which one word has been replaced.
  std::string without(const char* name, std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    write(name, text);
    const auto scene = read_tagslam_folder(folder_);
    return scene ? std::string() : to_string(scene.error());
  }

  std::filesystem::path folder_ =
      std::filesystem::path(::testing::TempDir()) /
      (std::string("waymark_tagslam_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(TagslamFolder, ReadsAFolder) {
  const auto scene = read_tagslam_folder(folder_);
  ASSERT_TRUE(scene) << to_string(scene.error());
  EXPECT_EQ(scene->pixel_sigma_px, 2.0);
  EXPECT_EQ(scene->min_tag_area_px2, 1000);  // TagSLAM's areas are twice as large
  EXPECT_TRUE(scene->approximate_sync);
  ASSERT_EQ(scene->bodies.size(), 3U);
  const SceneBody& lab = scene->bodies[0];
  EXPECT_THAT(lab.ignored, ::testing::ElementsAre(7, 9));
  EXPECT_TRUE(lab.map_T_body->mean.translation().isApprox(Eigen::Vector3d(1, 2, 3)));
  // Waymark has y down and z into the tag; TagSLAM has y up and z out of it.
  ASSERT_TRUE(lab.tags[0].body_T_tag);
  const Eigen::Matrix3d turned = lab.tags[0].body_T_tag->mean.rotation().matrix();
  EXPECT_TRUE(turned.isApprox(Eigen::Vector3d(1, -1, -1).asDiagonal().toDenseMatrix(), 1e-12));
  const Vector6 sigma = lab.tags[0].body_T_tag->sqrt_information.diagonal().cwiseAbs().cwiseInverse();
  Vector6 expected;
  expected << 0.1, 0.2, 0.3, 0.01, 0.01, 0.01;
  EXPECT_TRUE(sigma.isApprox(expected, 1e-9)) << sigma.transpose();
  EXPECT_FALSE(lab.tags[1].body_T_tag);
  EXPECT_EQ(lab.tags[1].size_m, 0.16);
  EXPECT_EQ(scene->bodies[1].odometry.sigma_m, 0.02);
  ASSERT_EQ(scene->bodies[2].tags.size(), 3U);  // two in the first row, one in the second
  EXPECT_TRUE(
      scene->bodies[2].tags[2].body_T_tag->mean.translation().isApprox(Eigen::Vector3d(0.1, -0.1, 0)));
  EXPECT_EQ(scene->cameras[0].wiggle_m, 0.02);
  EXPECT_EQ(std::get<Equidistant>(scene->cameras[0].model.projection()).cx, 320.5);
  ASSERT_EQ(scene->distances.size(), 1U);
  EXPECT_EQ(scene->distances[0].corner_a, 3);  // their first corner is the lower left
  EXPECT_EQ(scene->coordinates.size(), 2U);
}

TEST_F(TagslamFolder, ReportsErrorsWithTheirPlace) {
  EXPECT_THAT(without("cameras.yaml", kCameras, "rig_body: rig", "rig_body: rog"),
              ::testing::HasSubstr("rog"));
  write("cameras.yaml", kCameras);
  EXPECT_THAT(without("tagslam.yaml", kTagslam, "pixel_noise: 2.0", "pixel_noise: -1"),
              ::testing::AllOf(::testing::HasSubstr("pixel_noise"), ::testing::HasSubstr("tagslam.yaml")));
  EXPECT_THAT(without("tagslam.yaml", kTagslam, "type: staggered_board,", "type: stagered_board,"),
              ::testing::HasSubstr("stagered_board"));
  EXPECT_THAT(without("tagslam.yaml", kTagslam, "tag_rows: 2", "tag_rows: 2000000000"),
              ::testing::HasSubstr("board"));
  for (const auto& [size, wrong] :
       {std::pair("default_tag_size: 0.16", "default_tag_size: 160"),
        std::pair(" size: 0.1", " size: 0.0001"), std::pair("tag_size: 0.05", "tag_size: -0.05")})
    EXPECT_THAT(without("tagslam.yaml", kTagslam, size, wrong), ::testing::HasSubstr("size")) << wrong;
  EXPECT_THAT(without("tagslam.yaml", kTagslam, "bodies:", "bodys:"), ::testing::HasSubstr("body"));
}

TEST_F(TagslamFolder, ReadsIgnoredAndRemappedDetections) {
  write("tagslam.yaml", std::string(kTagslam) + R"(
squash:
 - {time: "1527206556.891942748", tags: [85, 86]}
 - {camera: cam0, tags: [8]}
tag_id_remap:
 - id: 20
   remaps:
    - {remap_id: 420, start_time: 1541686885.999522770, end_time: 1541686936.5, camera: cam0}
    - {remap_id: 520, start_time: 1541687179, end_time: 1.541687229942551e9}
)");
  const auto scene = read_tagslam_folder(folder_);
  ASSERT_TRUE(scene) << to_string(scene.error());
  ASSERT_EQ(scene->squash.size(), 2U);
  EXPECT_EQ(scene->squash[0].stamp, SensorTime(Duration(1527206556891942748)));
  EXPECT_THAT(scene->squash[0].ids, ::testing::ElementsAre(85, 86));
  EXPECT_EQ(scene->squash[1].stamp, std::nullopt);
  EXPECT_EQ(scene->squash[1].camera, "cam0");
  ASSERT_EQ(scene->remaps.size(), 2U);
  EXPECT_EQ(scene->remaps[0].becomes, 420);
  EXPECT_EQ(scene->remaps[0].from, SensorTime(Duration(1541686885999522770)));
  EXPECT_EQ(scene->remaps[0].to, SensorTime(Duration(1541686936500000000)));
  EXPECT_EQ(scene->remaps[1].id, 20);
  EXPECT_NEAR(static_cast<double>(scene->remaps[1].to.time_since_epoch().count()), 1.541687229942551e18, 1e4);
  EXPECT_THAT(without("tagslam.yaml", std::string(kTagslam) + "squash:\n - {time: noon, tags: [1]}\n", "noon",
                      "noon"),
              ::testing::HasSubstr("noon"));
}

TEST_F(TagslamFolder, BothFormsAreEquivalent) {
  WAYMARK_REAL_DATA(data, "tagslam");
  for (const char* test : {"test_1", "test_4", "test_15", "test_21"}) {
    const auto yaml = read_tagslam_folder(data / test);
    ASSERT_TRUE(yaml) << test << ": " << to_string(yaml.error());
    std::filesystem::create_directories(folder_ / test);
    std::filesystem::copy(data / test / "config.json", folder_ / test / "config.json");
    const auto json = read_tagslam_folder(folder_ / test);
    ASSERT_TRUE(json) << test << ": " << to_string(json.error());
    ASSERT_EQ(json->bodies.size(), yaml->bodies.size());
    for (const SceneBody& body : yaml->bodies) {
      const SceneBody& other = json->bodies[*json->body_named(body.name)];
      ASSERT_EQ(body.tags.size(), other.tags.size()) << test << ' ' << body.name;
      EXPECT_EQ(body.map_T_body.has_value(), other.map_T_body.has_value());
      for (std::size_t t = 0; t < body.tags.size(); ++t) {
        EXPECT_EQ(body.tags[t].id, other.tags[t].id);
        EXPECT_EQ(body.tags[t].size_m, other.tags[t].size_m);
        ASSERT_EQ(body.tags[t].body_T_tag.has_value(), other.tags[t].body_T_tag.has_value());
        if (!body.tags[t].body_T_tag) continue;
        EXPECT_LT((body.tags[t].body_T_tag->mean.inverse() * other.tags[t].body_T_tag->mean).log().norm(),
                  1e-6);
        EXPECT_TRUE(body.tags[t].body_T_tag->sqrt_information.isApprox(
            other.tags[t].body_T_tag->sqrt_information, 1e-6));
      }
    }
    ASSERT_EQ(json->cameras.size(), yaml->cameras.size());
    for (std::size_t c = 0; c < yaml->cameras.size(); ++c) {
      EXPECT_EQ(json->cameras[c].model, yaml->cameras[c].model);
      EXPECT_EQ(json->cameras[c].topic, yaml->cameras[c].topic);
    }
  }
}

}  // namespace
}  // namespace waymark
