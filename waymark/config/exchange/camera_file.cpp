#include "waymark/config/exchange/camera_file.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/config/exchange/camera_formats.hpp"
#include "waymark/config/json_text.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_tree.hpp"

namespace waymark {
namespace {

constexpr YamlLimits kCameraLimits{.bytes = std::size_t{1} << 18U, .nodes = 20'000, .depth = 16};
/// JSON calibrations contain all observations (tens of megabytes), which are skipped.
constexpr YamlLimits kJsonLimits{.bytes = std::size_t{1} << 28U, .nodes = 20'000, .depth = 16};

/// OpenCV's YAML begins with an invalid directive ("%YAML:1.0"), which is replaced by a comment.
std::string without_directive(std::string_view text) {
  std::string plain(text);
  if (plain.starts_with("%YAML:")) plain.front() = '#';
  return plain;
}

Result<YamlNode> parse_tree(std::string_view text, const std::string& source) {
  if (text.starts_with("%YAML:")) return parse_yaml(without_directive(text), source, kCameraLimits);
  return looks_like_json(text) ? parse_json(text, source, kJsonLimits, {"observations", "perViewErrors"})
                               : parse_yaml(text, source, kCameraLimits);
}

/// Reads a file with one camera: camera_info, or a calibration of PhotonVision or OpenCV.
Result<NamedCamera> read_single(const YamlCursor& root) {
  if (internal::looks_like_opencv(root)) return internal::read_opencv(root);
  return internal::looks_like_photonvision(root) ? internal::read_photonvision(root)
                                                 : internal::read_camera_info(root);
}

/// The names of the cameras; empty for formats with a single camera.
Result<std::vector<std::string>> recognise(const YamlCursor& root) {
  if (internal::looks_like_camera_info(root) || internal::looks_like_photonvision(root) ||
      internal::looks_like_opencv(root))
    return std::vector<std::string>();
  std::vector<std::string> names = internal::camchain_names(root);
  if (!names.empty()) return names;
  return root.fail_here(ErrorCode::Unreadable, "not a camera calibration",
                        "Give a ROS camera_info YAML (image_width, camera_matrix, …), a kalibr camchain "
                        "(cam0: …) or a calibration of PhotonVision (JSON) or OpenCV (YAML).");
}

/// Robot files and calibrations store their camera under this key.
YamlCursor camera_part(const YamlCursor& root) {
  const auto inside = root.find("camera_info");
  return inside ? *inside : root;
}

Result<NamedCamera> choose(const YamlCursor& root, const std::vector<std::string>& names,
                           std::string_view name) {
  if (name.empty() && names.size() > 1) {
    return root.fail_here(ErrorCode::InvalidArgument,
                          fmt::format("the file contains {} cameras", names.size()),
                          fmt::format("Choose one of {}.", fmt::join(names, ", ")));
  }
  const std::string chosen = name.empty() ? names.front() : std::string(name);
  const auto entry = root.find(chosen);
  if (!entry || std::find(names.begin(), names.end(), chosen) == names.end()) {
    return root.fail_here(ErrorCode::NotFound,
                          fmt::format("no camera '{}' in the file", chosen.substr(0, 40)),
                          fmt::format("Available: {}.", fmt::join(names, ", ")));
  }
  return internal::read_camchain_camera(*entry, chosen);
}

Result<NamedCamera> only(Result<NamedCamera> camera, const YamlCursor& root, std::string_view name) {
  if (!camera || name.empty() || camera->name == name) return camera;
  return root.fail_here(ErrorCode::NotFound, fmt::format("no camera '{}' in the file", name.substr(0, 40)),
                        fmt::format("Available: {}.", camera->name));
}

}  // namespace

Result<std::vector<NamedCamera>> parse_cameras(std::string_view text, const std::string& source) {
  const auto tree = parse_tree(text, source);
  if (!tree) return tl::unexpected<Error>(tree.error());
  const YamlCursor root = camera_part(YamlCursor(*tree, source));
  const auto names = recognise(root);
  if (!names) return tl::unexpected<Error>(names.error());
  if (names->empty()) return read_single(root).map([](const NamedCamera& c) { return std::vector{c}; });
  if (Status status = root.check_keys(*names); !status) return tl::unexpected<Error>(status.error());
  std::vector<NamedCamera> cameras;
  for (const std::string& name : *names) {
    auto camera =
        root.read_at(name, [&](const YamlCursor& c) { return internal::read_camchain_camera(c, name); });
    if (!camera) return tl::unexpected<Error>(camera.error());
    cameras.push_back(*std::move(camera));
  }
  return cameras;
}

Result<NamedCamera> parse_camera(std::string_view text, const std::string& source, std::string_view name) {
  const auto tree = parse_tree(text, source);
  if (!tree) return tl::unexpected<Error>(tree.error());
  const YamlCursor root = camera_part(YamlCursor(*tree, source));
  const auto names = recognise(root);
  if (!names) return tl::unexpected<Error>(names.error());
  if (names->empty()) return only(read_single(root), root, name);
  if (Status status = root.check_keys(*names); !status) return tl::unexpected<Error>(status.error());
  return choose(root, *names, name);
}

Result<std::vector<NamedCamera>> read_cameras(const std::filesystem::path& path) {
  const auto text = read_text_file(path, kJsonLimits.bytes);
  if (!text) return tl::unexpected<Error>(text.error());
  return parse_cameras(*text, path.string());
}

Result<NamedCamera> read_camera(const std::filesystem::path& path, std::string_view name) {
  const auto text = read_text_file(path, kJsonLimits.bytes);
  if (!text) return tl::unexpected<Error>(text.error());
  return parse_camera(*text, path.string(), name);
}

}  // namespace waymark
