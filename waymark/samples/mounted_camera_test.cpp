// Tests of the selection of a sample's camera, and of the tags in view of all cameras.
#include "waymark/samples/mounted_camera.hpp"

#include <gtest/gtest.h>

#include "waymark/samples/tags_in_view.hpp"

namespace waymark {
namespace {

CameraModel lens(double f_px) {
  return CameraModel::make(PinholeRadtan{.fx = f_px, .fy = f_px, .cx = 320, .cy = 240}, 640, 480).value();
}

struct TwoCameras {
  CameraModel camera = lens(400);
  SE3 base_T_cam{};
  std::vector<MountedCamera> more_cameras{{.name = "rear", .camera = lens(300)}};
};

TEST(MountedCamera, ASingleCameraMatchesAnyName) {
  const std::vector<MountedCamera> one = {{.name = "front", .camera = lens(400)}};
  EXPECT_EQ(find_camera(one, "front"), &one[0]);
  EXPECT_EQ(find_camera(one, "cam"), &one[0]);
  EXPECT_EQ(find_camera({}, "cam"), nullptr);
}

TEST(MountedCamera, SeveralCamerasAreSelectedByName) {
  const std::vector<MountedCamera> two = {{.name = "front", .camera = lens(400)},
                                          {.name = "rear", .camera = lens(300)}};
  EXPECT_EQ(find_camera(two, "rear"), &two[1]);
  EXPECT_EQ(find_camera(two, "left"), nullptr);
  const TwoCameras setup;
  EXPECT_EQ(&camera_of(setup, "rear").camera, &setup.more_cameras[0].camera);
  EXPECT_EQ(&camera_of(setup, "front").camera, &setup.camera) << "the first camera";
}

TEST(TagsInView, AddsUpTheNewestFramesOfAllCameras) {
  const auto at = [](int ms) { return SensorTime(std::chrono::milliseconds(ms)); };
  const std::vector<TagId> one = {{FamilyId::Tag36h11, 1}};
  const std::vector<TagId> two = {{FamilyId::Tag36h11, 2}, {FamilyId::Tag36h11, 3}};
  TagsInView view;
  view.add("front", at(1000), one);
  EXPECT_EQ(view.count(at(1000)), 1U);
  EXPECT_TRUE(view.beside("front", at(1000)).empty());
  view.add("rear", at(1000), two);
  EXPECT_EQ(view.count(at(1000)), 3U);
  EXPECT_EQ(view.beside("rear", at(1000)), one);
  view.add("front", at(1060), {});
  EXPECT_EQ(view.count(at(1060)), 2U);
  EXPECT_TRUE(view.beside("front", at(1060)).empty()) << "not at the same time";
  view.add("front", at(1200), {});
  EXPECT_EQ(view.count(at(1200)), 0U) << "the rear camera has sent nothing recently";
}

}  // namespace
}  // namespace waymark
