#include "waymark/cli/pose_flags.hpp"

#include <charconv>
#include <utility>

#include <fmt/format.h>

#include "waymark/config/camera_file.hpp"

namespace waymark::cli {
namespace {

Result<double> parse_size_m(const std::string& text, const std::string& whole) {
  double size_m = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), size_m);
  if (error == std::errc() && end == text.data() + text.size() && is_tag_size(size_m)) return size_m;
  return fail(
      ErrorCode::InvalidArgument, fmt::format("'{}' is not a size in metres", whole), {.key = "--tag-size-m"},
      "Measure the side of the square where black border meets white, for example --tag-size-m 0.16.");
}

}  // namespace

Result<TagSizes> parse_tag_sizes(const std::vector<std::string>& words) {
  TagSizes sizes;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    const Result<double> size =
        parse_size_m(equals == std::string::npos ? word : word.substr(equals + 1), word);
    if (!size) return tl::unexpected(size.error());
    if (equals == std::string::npos) {
      sizes.default_size_m = *size;
      continue;
    }
    const std::string name = word.substr(0, equals);
    const Result<TagId> tag = parse_tag_id(name.find(':') == std::string::npos ? "tag36h11:" + name : name);
    if (!tag) return tl::unexpected(tag.error());
    sizes.size_by_tag_m[*tag] = *size;
  }
  return sizes;
}

PoseFlags::PoseFlags(CLI::App& app) {
  app.add_option("--camera", camera_path_,
                 "Calibration of the camera (ROS camera_info, kalibr YAML or JSON of PhotonVision): gives "
                 "the pose of each tag")
      ->type_name("FILE")
      ->group("Poses");
  app.add_option("--camera-name", camera_name_, "Which camera of the file, when it holds several")
      ->type_name("NAME")
      ->group("Poses");
  app.add_option("--tag-size-m", sizes_,
                 "Side of the square where black border meets white [m]; ID=SIZE for a tag of another size "
                 "(repeatable)")
      ->allow_extra_args(false)  // or it would take the pictures that follow for sizes
      ->type_name("SIZE")
      ->group("Poses");
}

Result<std::optional<PoseSetup>> PoseFlags::make() const {
  if (camera_path_.empty() && sizes_.empty()) return std::optional<PoseSetup>();
  if (camera_path_.empty() || sizes_.empty()) {
    return fail(ErrorCode::InvalidArgument, "poses need both the camera and the size of the tags",
                {.key = camera_path_.empty() ? "--camera" : "--tag-size-m"},
                "Give --camera camera.yaml and --tag-size-m 0.16 (the side of the black square in metres).");
  }
  Result<TagSizes> sizes = parse_tag_sizes(sizes_);
  if (!sizes) return tl::unexpected(sizes.error());
  Result<NamedCamera> camera = read_camera(camera_path_, camera_name_);
  if (!camera) return tl::unexpected(camera.error());
  return std::optional<PoseSetup>(PoseSetup{std::move(camera->camera), std::move(*sizes)});
}

}  // namespace waymark::cli
