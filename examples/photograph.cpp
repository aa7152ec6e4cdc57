// Renders a photograph of a dozen tags with exact corners.
//   usage: waymark_photograph OUT_DIR      writes photograph.png, truth.csv and camera.yaml there
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <string>

#include <fmt/format.h>

#include "waymark/codecs/image_file.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/simulation/render/photograph.hpp"

namespace waymark {
namespace {

/// Twelve tags in four columns and three rows, from near to far, each with its own rotation.
PhotographScene a_dozen_tags(Random& random) {
  PhotographScene scene;
  for (int i = 0; i < 12; ++i) {
    const double distance = 0.9 * std::pow(1.13, i);  // 0.16 m at 0.9 m to 3.5 m: 160 to 41 px
    const Eigen::Vector3d direction(-0.48 + 0.32 * (i % 4), -0.26 + 0.26 * static_cast<double>(i / 4), 1);
    const SO3 cam_R_facing = SO3::from_rpy(-std::atan(direction.y()), std::atan(direction.x()), 0);
    // one per statement: the evaluation order of arguments is unspecified
    const double yaw = random.uniform(-3, 3);
    const double pitch = random.uniform(-0.75, 0.75);
    const double roll = random.uniform(-0.75, 0.75);
    const SO3 turned = SO3::from_rpy(roll, pitch, yaw);
    scene.tags.push_back({{FamilyId::Tag36h11, 10 + i}, {cam_R_facing * turned, distance * direction}, 0.16});
  }
  return scene;
}

std::string truth_csv(const std::string& image, const std::vector<TagTruth>& tags) {
  std::string csv = "image,family,id,size_px,tilt_deg,x0,y0,x1,y1,x2,y2,x3,y3\n";
  for (const TagTruth& tag : tags) {
    csv += fmt::format("{},{},{},{:.3f},{:.3f}", image, to_string(tag.tag.family), tag.tag.number,
                       tag.size_px, tag.tilt_rad * 180 / std::numbers::pi);
    for (const Eigen::Vector2d& corner : tag.corners_px)
      csv += fmt::format(",{:.6f},{:.6f}", corner.x(), corner.y());
    csv += '\n';
  }
  return csv;
}

Status write_text(const std::filesystem::path& path, const std::string& text) {
  return write_bytes(path, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

Status run(const std::filesystem::path& folder) {
  const PinholeRadtan lens{
      .fx = 900, .fy = 900, .cx = 640, .cy = 360, .k = {-0.12, 0.02, 0, 0}, .coefficients = 4};
  const Result<CameraModel> camera = CameraModel::make(lens, 1280, 720);
  if (!camera) return tl::unexpected(camera.error());

  Random random(7);
  const PhotographScene scene = a_dozen_tags(random);
  const Result<Photograph> taken =
      photograph(*camera, scene, {.blur_sigma_px = 0.7, .read_noise_dn = 2}, random);
  if (!taken) return tl::unexpected(taken.error());

  Status status = write_image(folder / "photograph.png", taken->image);
  if (status) status = write_text(folder / "truth.csv", truth_csv("photograph.png", taken->tags));
  if (status) status = write_text(folder / "camera.yaml", to_camera_info_yaml({"camera", *camera}));
  return status;
}

}  // namespace
}  // namespace waymark

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: waymark_photograph OUT_DIR\n", stderr);
    return 2;
  }
  const waymark::Status status = waymark::run(argv[1]);
  if (status) return 0;
  std::fprintf(stderr, "waymark_photograph: %s\n", waymark::to_string(status.error()).c_str());
  return 1;
}
