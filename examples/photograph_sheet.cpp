// Photographs a printed sheet with a virtual camera: the page drawn by
//  waymark tags sheet --ids 7 --tag-size-m 0.16 --paper A4 --dpi 300 -o SHEET.png
// with blur and noise from a known pose.
//  usage: waymark_photograph_sheet SHEET.png OUT_DIR      writes sheet_photo.png and camera.yaml there,
//  prints the truth
#include <cstdio>
#include <filesystem>
#include <string>

#include <fmt/format.h>

#include "waymark/codecs/image_file.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/plot/tag_sheet.hpp"
#include "waymark/simulation/render/photograph.hpp"

namespace waymark {
namespace {

constexpr double kMetresPerPixel = 0.0254 / 300;

/// Pose of the tag relative to the centre of the page.
Result<SE3> sheet_T_tag() {
  const auto layout = plot::layout_sheet(FamilyId::Tag36h11, {7}, {.tag_size_m = 0.16});
  if (!layout) return tl::unexpected(layout.error());
  const plot::Box& square = layout->pages[0][0].square;
  const double x_mm = square.middle_x_mm() - layout->paper.width_mm / 2;
  const double y_mm = square.middle_y_mm() - layout->paper.height_mm / 2;
  return SE3(SO3(), {x_mm / 1000, y_mm / 1000, 0});
}

Status run(const std::string& sheet_path, const std::filesystem::path& folder) {
  const PinholeRadtan lens{
      .fx = 442.17, .fy = 443.88, .cx = 323.5, .cy = 247, .k = {0.045, -0.077}, .coefficients = 4};
  const Result<CameraModel> camera = CameraModel::make(lens, 640, 480);
  if (!camera) return tl::unexpected(camera.error());
  const Result<Image> sheet = read_image(sheet_path);
  if (!sheet) return tl::unexpected(sheet.error());
  const Result<SE3> sheet_T_tag_ = sheet_T_tag();
  if (!sheet_T_tag_) return tl::unexpected(sheet_T_tag_.error());

  const SE3 cam_T_sheet(SO3::from_rpy(0.35, -0.45, 0.1), {0.05, -0.02, 0.75});
  Random random(3);
  const Result<Photograph> taken =
      photograph(*camera, {.tags = {}, .sheets = {{*sheet, kMetresPerPixel, cam_T_sheet}}},
                 {.blur_sigma_px = 0.7, .read_noise_dn = 2}, random);
  if (!taken) return tl::unexpected(taken.error());
  const Eigen::Vector3d truth = (cam_T_sheet * *sheet_T_tag_).translation();
  fmt::print("truth: the tag's centre is at x {:.4f}, y {:.4f}, z {:.4f} m in the camera\n", truth.x(),
             truth.y(), truth.z());

  if (Status status = write_image(folder / "sheet_photo.png", taken->image); !status) return status;
  const std::string yaml = to_camera_info_yaml({"limo", *camera});
  return write_bytes(folder / "camera.yaml",
                     {reinterpret_cast<const std::uint8_t*>(yaml.data()), yaml.size()});
}

}  // namespace
}  // namespace waymark

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("usage: waymark_photograph_sheet SHEET.png OUT_DIR\n", stderr);
    return 2;
  }
  const waymark::Status status = waymark::run(argv[1], argv[2]);
  if (status) return 0;
  std::fprintf(stderr, "waymark_photograph_sheet: %s\n", waymark::to_string(status.error()).c_str());
  return 1;
}
