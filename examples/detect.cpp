// Tags in an image, and their positions relative to the camera: waymark_detect IMAGE CALIBRATION TAG_SIZE_M
#include <cstdio>
#include <cstdlib>

#include "waymark/codecs/image_file.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/pose/tag_pose.hpp"
#include "waymark/tags/tag_finder.hpp"

int fail(const waymark::Error& error) {
  std::fprintf(stderr, "%s\n", waymark::to_string(error).c_str());
  return 1;
}

int main(int argc, char** argv) {
  if (argc != 4) return std::fprintf(stderr, "usage: waymark_detect IMAGE CALIBRATION TAG_SIZE_M\n"), 2;
  // [quoted by docs/howto/cpp.md]
  const auto image = waymark::read_image(argv[1]);
  if (!image) return fail(image.error());
  const auto calibration = waymark::read_camera(argv[2]);
  if (!calibration) return fail(calibration.error());
  const auto finder = waymark::make_tag_finder();
  const auto found = waymark::find_tags(*image, *finder, waymark::ImageLens::of(calibration->camera));
  if (!found) return fail(found.error());
  for (const auto& detection : found->detections) {
    const auto pose = waymark::estimate_tag_pose(detection, std::atof(argv[3]), calibration->camera);
    if (!pose) return fail(pose.error());
    const auto position_m = pose->best.cam_T_tag.translation();
    std::printf("tag %d: %.3f %.3f %.3f m\n", detection.tag.number, position_m.x(), position_m.y(),
                position_m.z());
  }
  // [end]
}
