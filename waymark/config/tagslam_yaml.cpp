#include <cmath>

#include "waymark/config/tagslam_parts.hpp"

namespace waymark::internal {
namespace {

struct Defaults {
  double sigma_m = 0.05, sigma_rad = 0.01;
};

/// position, rotation (rotation vector), their noise, or R.
ScenePrior read_pose(const YamlCursor& pose, const Defaults& defaults, TagslamReader& read) {
  const SE3 mean(SO3::exp(read.vector(pose, "rotation")), read.vector(pose, "position"));
  if (pose.find("R")) return {mean, read.sqrt_information(pose, "R")};
  return read.prior(pose, mean, read.vector(pose, "position_noise", defaults.sigma_m),
                    read.vector(pose, "rotation_noise", defaults.sigma_rad));
}

/// Boards of tags side by side, or with every second one left out.
void add_board(const YamlCursor& board, bool staggered, TagslamReader& read, SceneBody& body) {
  const int rows = read.integer(board, "tag_rows", 0);
  const int columns = read.integer(board, "tag_columns", 0);
  const double size = read.positive(board, "tag_size");
  const double pitch = size * (1 + read.number(board, "tag_spacing", 0));
  constexpr int kMost = 1000;
  if (rows < 1 || columns < 1 || rows > kMost || columns > kMost / rows + 1) {
    read.fail_at(board, "a board has 1 to 1000 tags");
    return;
  }
  constexpr double kAlmostExact = 1e-6;
  const Eigen::Vector3d sigma_m =
      Eigen::Vector3d::Constant(std::max(read.number(board, "tag_position_noise", 0), kAlmostExact));
  const Eigen::Vector3d sigma_rad =
      Eigen::Vector3d::Constant(std::max(read.number(board, "tag_rotation_noise", 0), kAlmostExact));
  int id = read.integer(board, "tag_start_id", 0);
  for (int row = 0; row < rows; ++row) {
    for (int column = staggered ? row % 2 : 0; column < columns; column += staggered ? 2 : 1) {
      const SE3 mean(SO3(), Eigen::Vector3d(column * pitch, (staggered ? -row : row) * pitch, 0));
      body.tags.push_back({.id = {FamilyId::Tag36h11, id++},
                           .size_m = size,
                           .body_T_tag = of_our_tag(ScenePrior::of(mean, sigma_m, sigma_rad))});
    }
  }
}

void read_tags(const YamlCursor& entry, const Defaults& defaults, TagslamReader& read, SceneBody& body) {
  const double override_m = read.number(entry, "override_tag_position_noise", 0);
  const double override_rad = read.number(entry, "override_tag_rotation_noise", 0);
  const auto list = entry.find("tags");
  for (const YamlCursor& at : list ? list->children() : std::vector<YamlCursor>()) {
    SceneTag tag{.id = {FamilyId::Tag36h11, read.integer(at, "id", -1)}};
    tag.size_m = at.find("size") ? read.positive(at, "size") : body.default_tag_size_m;
    if (tag.id.number < 0 || !(tag.size_m > 0)) read.fail_at(at, "a tag needs an id and a size in metres");
    if (const auto pose = at.find("pose")) {
      tag.body_T_tag = read_pose(*pose, defaults, read);
      if (override_m > 0 && override_rad > 0)
        tag.body_T_tag = ScenePrior::of(tag.body_T_tag->mean, Eigen::Vector3d::Constant(override_m),
                                        Eigen::Vector3d::Constant(override_rad));
      tag.body_T_tag = of_our_tag(*tag.body_T_tag);
    }
    body.tags.push_back(tag);
  }
}

SceneBody read_body(const YamlCursor& entry, std::string name, const Defaults& defaults,
                    TagslamReader& read) {
  SceneBody body{.name = std::move(name), .is_static = read.boolean(entry, "is_static", false)};
  body.default_tag_size_m = read.number(entry, "default_tag_size", 0);
  body.ignored = read.ids(entry, "ignore_tags");
  if (entry.find("max_hamming_distance")) body.max_hamming = read.integer(entry, "max_hamming_distance", 2);
  if (const auto pose = entry.find("pose")) {
    if (!body.is_static) read.fail_at(*pose, "a body that moves cannot have a pose");
    body.map_T_body = read_pose(*pose, defaults, read);
  }
  if (const auto sensor = entry.find("T_body_odom"))
    body.body_T_odom = SE3(SO3::exp(read.vector(*sensor, "rotation")), read.vector(*sensor, "position"));
  read_tagslam_odometry(entry, read, body);
  read_tags(entry, defaults, read, body);
  const std::string type = read.text(entry, "type", "simple");
  if (type == "board" || type == "staggered_board") {
    const auto board = entry.at(type);
    if (board)
      add_board(*board, type != "board", read, body);
    else
      read.keep(board, entry);
  } else if (type != "simple" && type != "camera_rig") {
    read.fail_at(entry, "there is no type '" + type + "' of a body");
  }
  return body;
}

/// A sequence of maps with one key each, the name.
template <class Visit>
void for_named(const YamlCursor& root, std::string_view key, const Visit& visit) {
  const auto list = root.find(key);
  for (const YamlCursor& item : list ? list->children() : std::vector<YamlCursor>()) {
    const std::vector<YamlCursor> values = item.children();
    for (std::size_t i = 0; item.is_map() && i < values.size(); ++i) visit(item.node().keys[i], values[i]);
  }
}

void read_measurements(const YamlCursor& root, TagslamReader& read, TagScene& scene) {
  for_named(root, "distance_measurements", [&](const std::string&, const YamlCursor& at) {
    scene.distances.push_back({read.integer(at, "tag1", -1), read.integer(at, "tag2", -1),
                               our_corner(read.integer(at, "corner1", 0)),
                               our_corner(read.integer(at, "corner2", 0)), read.number(at, "distance", 0),
                               read.positive(at, "noise")});
  });
  for_named(root, "plane_measurements", [&](const std::string&, const YamlCursor& at) {
    for (int id : read.ids(at, "tags"))
      scene.coordinates.push_back(
          {id, -1, read.vector(at, "direction"), read.number(at, "distance", 0), read.positive(at, "noise")});
  });
  for_named(root, "coordinate_measurements", [&](const std::string&, const YamlCursor& at) {
    scene.coordinates.push_back({read.integer(at, "tag", -1), our_corner(read.integer(at, "corner", -1)),
                                 read.vector(at, "direction"), read.number(at, "length", 0),
                                 read.positive(at, "noise")});
  });
}

}  // namespace

Result<TagScene> read_tagslam_yaml(const YamlCursor& tagslam, const YamlCursor& cameras,
                                   const std::optional<YamlCursor>& camera_poses) {
  TagslamReader read;
  TagScene scene{.max_hamming = 100};
  if (const auto at = tagslam.find("tagslam_parameters")) {
    scene.pixel_sigma_px = at->find("pixel_noise") ? read.positive(*at, "pixel_noise") : 1;
    scene.min_tag_area_px2 = read.number(*at, "minimum_tag_area", 0) / 2;  // TagSLAM's areas are twice ours
    scene.approximate_sync = read.boolean(*at, "use_approximate_sync", false);
    scene.max_hamming = read.integer(*at, "max_hamming_distance", scene.max_hamming);
  }
  Defaults defaults;
  if (const auto at = tagslam.find("body_defaults"))
    defaults = {read.positive(*at, "position_noise"), read.positive(*at, "rotation_noise")};
  for_named(tagslam, "bodies", [&](const std::string& name, const YamlCursor& entry) {
    scene.bodies.push_back(read_body(entry, name, defaults, read));
  });
  scene.default_body = scene.body_named(read.text(tagslam, "default_body", ""));
  read_measurements(tagslam, read, scene);
  read_tagslam_times(tagslam, read, scene);
  if (!read.status()) return tl::unexpected(read.status().error());
  const std::vector<YamlCursor> entries = cameras.children();
  for (std::size_t i = 0; cameras.is_map() && i < entries.size(); ++i) {
    const std::string& name = cameras.node().keys[i];
    auto camera = read_tagslam_camera(
        entries[i], name, {"intrinsics", "resolution", "distortion_coeffs", "distortion_model", "tagtopic"},
        scene);
    if (!camera) return tl::unexpected(camera.error());
    const auto known = camera_poses ? camera_poses->find(name) : std::nullopt;
    const auto pose = known ? known->find("pose") : std::nullopt;
    if (pose) camera->body_T_cam = read_pose(*pose, defaults, read);
    scene.cameras.push_back(std::move(*camera));
  }
  if (!read.status()) return tl::unexpected(read.status().error());
  return scene;
}

}  // namespace waymark::internal
