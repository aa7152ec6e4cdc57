// Solutions from other programs: pose tables, plain or compressed, and invalid rows.
#include "waymark/app/scene/scene_recording.hpp"

#include <fstream>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr const char* kHead = "parent,child,px,py,pz,qx,qy,qz,qw\n";

class SceneValuesFile : public ::testing::Test {
 protected:
  void SetUp() override {
    scene_.cameras.push_back(
        {.name = "cam0",
         .topic = {},
         .model =
             CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value()});
    write("ref_static.csv", std::string(kHead) +
                                "map,lab,1,2,3,0,0,0,1\n"
                                "rig,cam0,0.1,0,0.2,0,0,0.7071067811865476,0.7071067811865476\n"
                                "lab,tag_7,0,0,1,0,0,0,1\n");
    write("ref_trajectory.csv", "t_ns,body,px,py,pz,qx,qy,qz,qw\n5000000000,rig,4,5,6,0,0,0,1\n");
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  [[nodiscard]] std::string error() const {
    const auto values = read_scene_values(folder_, scene_);
    return values ? "none" : to_string(values.error());
  }
  fs::path folder_ = testing::fresh_folder("jobs_scene_values");
  TagScene scene_{};
};

TEST_F(SceneValuesFile, ReadsBodiesCamerasTagsAndTrajectories) {
  const auto values = read_scene_values(folder_, scene_);
  ASSERT_TRUE(values) << to_string(values.error());
  EXPECT_EQ(values->static_bodies.at("lab").translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(values->static_bodies.count("cam0"), 0U);
  EXPECT_NEAR(values->cameras.at("cam0").rotation().log().z(), std::numbers::pi / 2, 1e-9);
  const auto& trajectory = values->moving_bodies;
  ASSERT_EQ(trajectory.size(), 1U);
  EXPECT_EQ(trajectory.begin()->second.translation(), Eigen::Vector3d(4, 5, 6));
}

TEST_F(SceneValuesFile, ConvertsTagsToWaymarkFrames) {
  const auto values = read_scene_values(folder_, scene_);
  ASSERT_TRUE(values);
  const SE3& tag = values->tags.at(7);
  EXPECT_EQ(tag.translation(), Eigen::Vector3d(0, 0, 1));
  const Eigen::Vector3d normal = tag.rotation() * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(normal.z(), -1, 1e-12)
      << "z points towards the viewer in TagSLAM, and away from the viewer in Waymark";
}

TEST_F(SceneValuesFile, ReportsInvalidRowsWithTheirLine) {
  for (const char* row :
       {"map,lab,1,2,3,0,0,0", "map,lab,1,2,x,0,0,0,1", "map,lab,1,2,3,0,0,0,0.5", "nonsense"}) {
    write("ref_static.csv", std::string(kHead) + "map,lab,1,2,3,0,0,0,1\n" + row + "\n");
    EXPECT_THAT(error(), HasSubstr("ref_static.csv:3")) << row;
  }
}

TEST_F(SceneValuesFile, IgnoresEmptyLines) {
  write("ref_static.csv", std::string(kHead) + "\nmap,lab,1,2,3,0,0,0,1\n\n");
  EXPECT_EQ(error(), "none");
}

TEST_F(SceneValuesFile, RequiresBothFiles) {
  fs::remove(folder_ / "ref_trajectory.csv");
  EXPECT_THAT(error(), HasSubstr("ref_trajectory.csv"));
  fs::remove(folder_ / "ref_static.csv");
  EXPECT_THAT(error(), HasSubstr("ref_static.csv"));
}

TEST_F(SceneValuesFile, RejectsATruncatedCompressedFile) {
  fs::remove(folder_ / "ref_static.csv");
  write("ref_static.csv.gz", std::string("\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03", 10));
  EXPECT_THAT(error(), HasSubstr("ref_static.csv.gz"));
}

}  // namespace
}  // namespace waymark
