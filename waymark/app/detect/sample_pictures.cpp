#include "waymark/app/detect/sample_pictures.hpp"

#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/calibrate_camera/calibrate_camera.hpp"
#include "waymark/base/random.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/config/camera_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/simulation/photograph.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr int kTagPictures = 6;
constexpr int kBoardPictures = 15;

/// A webcam of 640 x 480 with barrel distortion.
Result<CameraModel> sample_lens() {
  const PinholeRadtan lens{.fx = 612.4,
                           .fy = 611.1,
                           .cx = 325.7,
                           .cy = 236.2,
                           .k = {-0.24, 0.07, 0.0006, -0.0004},
                           .coefficients = 4};
  return CameraModel::make(lens, 640, 480);
}

Status write_lens(const fs::path& folder, const CameraModel& lens) {
  return write_text_file(folder / "camera.yaml", to_camera_info_yaml({.name = "samples", .camera = lens}));
}

nlohmann::ordered_json to_json(const TagTruth& truth) {
  nlohmann::ordered_json corners = nlohmann::ordered_json::array();
  for (const Eigen::Vector2d& corner : truth.corners_px) corners.push_back({corner.x(), corner.y()});
  const Eigen::Vector3d& at = truth.cam_T_tag.translation();
  const Eigen::Quaterniond& turned = truth.cam_T_tag.rotation().quaternion();
  return {{"tag", to_string(truth.tag)},
          {"size_m", truth.size_m},
          {"corners_px", corners},
          {"position_m", {at.x(), at.y(), at.z()}},
          {"quaternion_xyzw", {turned.x(), turned.y(), turned.z(), turned.w()}}};
}

/// Three tags side by side, nearer or farther, each turned its own way.
PhotographScene three_tags(int picture, Random& random) {
  PhotographScene scene;
  for (int place = 0; place < 3; ++place) {
    const double away_m = random.uniform(1.1, 2.2);
    const double turn_rad = random.uniform(-0.8, 0.8);
    const double nod_rad = random.uniform(-0.3, 0.3);
    const double roll_rad = random.uniform(-0.2, 0.2);
    const double up_m = random.uniform(-0.15, 0.15) * away_m;
    const SE3 cam_T_tag(SO3::from_rpy(nod_rad, turn_rad, roll_rad),
                        {0.3 * (place - 1) * away_m, up_m, away_m});
    scene.tags.push_back({{FamilyId::Tag36h11, 3 * picture + place}, cam_T_tag, kSampleTag_m});
  }
  return scene;
}

/// The board from all sides, near and far, in all corners of the picture.
SE3 cam_T_board_of(int picture, Random& random) {
  const double about = 2 * std::numbers::pi * picture * 4 / kBoardPictures;
  const double tilt_rad = picture % 5 == 0 ? 0.05 : 0.55;
  const double roll_rad = random.uniform(-0.3, 0.3);
  const double away_m = random.uniform(0.27, 0.45);
  const SO3 tilted = SO3::exp({tilt_rad * std::cos(about), tilt_rad * std::sin(about), roll_rad});
  return {tilted, {0.16 * away_m * std::cos(1.7 * picture), 0.12 * away_m * std::sin(1.7 * picture), away_m}};
}

}  // namespace

Status write_tag_pictures(const fs::path& folder, std::uint64_t seed) {
  const Result<CameraModel> lens = sample_lens();
  if (!lens) return tl::unexpected(lens.error());
  Random random(seed);
  nlohmann::ordered_json truths = nlohmann::ordered_json::object();
  for (int picture = 0; picture < kTagPictures; ++picture) {
    const auto taken = photograph(*lens, three_tags(picture, random), {}, random);
    if (!taken) return tl::unexpected(taken.error());
    const std::string name = fmt::format("{}.png", picture + 1);
    for (const TagTruth& truth : taken->tags) truths[name].push_back(to_json(truth));
    if (Status written = write_image(folder / name, taken->image); !written) return written;
  }
  Status written = write_text_file(folder / "truth.json", truths.dump(1) + "\n");
  return written ? write_lens(folder, *lens) : written;
}

Status write_board_pictures(const fs::path& folder, std::uint64_t seed) {
  const Result<CameraModel> lens = sample_lens();
  const Result<CalibrationTarget> target = CalibrationTarget::make(
      {.columns = kSampleBoardColumns, .rows = kSampleBoardRows, .tag_size_m = kSampleBoardTag_m});
  if (!lens) return tl::unexpected(lens.error());
  if (!target) return tl::unexpected(target.error());
  const TagMap& board = target->tags();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& [tag, mapped] : board.tags)
    middle += mapped.map_T_tag.translation() / static_cast<double>(board.tags.size());
  Random random(seed);
  for (int picture = 0; picture < kBoardPictures; ++picture) {
    const SE3 cam_T_board = cam_T_board_of(picture, random) * SE3(SO3(), -middle);
    PhotographScene scene;
    for (const auto& [tag, mapped] : board.tags)
      scene.tags.push_back({tag, cam_T_board * mapped.map_T_tag, mapped.size_m, 0.3});
    const auto taken = photograph(*lens, scene, {}, random);
    if (!taken) return tl::unexpected(taken.error());
    if (Status written = write_image(folder / fmt::format("{:02}.png", picture + 1), taken->image); !written)
      return written;
  }
  return write_lens(folder, *lens);
}

}  // namespace waymark
