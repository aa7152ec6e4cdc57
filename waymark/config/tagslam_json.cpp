#include "waymark/config/tagslam_parts.hpp"

namespace waymark::internal {
namespace {

/// {t, rotvec} with {sigma_t, sigma_r} or {sqrtinfo_R_rot_then_trans}.
SE3 read_transform(const YamlCursor& at, TagslamReader& read) {
  return {SO3::exp(read.vector(at, "rotvec")), read.vector(at, "t")};
}

ScenePrior read_prior(const YamlCursor& at, TagslamReader& read) {
  const SE3 mean = read_transform(at, read);
  if (at.find("sqrtinfo_R_rot_then_trans"))
    return {mean, read.sqrt_information(at, "sqrtinfo_R_rot_then_trans")};
  return read.prior(at, mean, read.vector(at, "sigma_t"), read.vector(at, "sigma_r"));
}

SceneBody read_body_json(const YamlCursor& entry, TagslamReader& read) {
  SceneBody body{.name = read.text(entry, "name", ""), .is_static = read.boolean(entry, "is_static", false)};
  body.default_tag_size_m = read.number(entry, "default_tag_size", 0);
  body.ignored = read.ids(entry, "ignore_tags");
  if (entry.find("max_hamming_distance")) body.max_hamming = read.integer(entry, "max_hamming_distance", 2);
  if (const auto prior = entry.find("T_world_body_prior")) body.map_T_body = read_prior(*prior, read);
  if (const auto sensor = entry.find("T_body_odom")) body.body_T_odom = read_transform(*sensor, read);
  read_tagslam_odometry(entry, read, body);
  const double override_m = read.number(entry, "override_tag_position_noise", 0);
  const double override_rad = read.number(entry, "override_tag_rotation_noise", 0);
  const auto list = entry.find("tags");
  for (const YamlCursor& at : list ? list->children() : std::vector<YamlCursor>()) {
    SceneTag tag{.id = {FamilyId::Tag36h11, read.integer(at, "id", -1)}, .size_m = read.positive(at, "size")};
    if (tag.id.number < 0) read.fail_at(at, "a tag needs an id");
    if (const auto prior = at.find("T_body_tag_prior")) {
      ScenePrior theirs = read_prior(*prior, read);
      if (override_m > 0 && override_rad > 0)
        theirs = ScenePrior::of(theirs.mean, Eigen::Vector3d::Constant(override_m),
                                Eigen::Vector3d::Constant(override_rad));
      tag.body_T_tag = of_our_tag(theirs);
    }
    body.tags.push_back(tag);
  }
  return body;
}

void read_lists(const YamlCursor& config, TagslamReader& read, TagScene& scene) {
  const auto each = [](const YamlCursor& at, std::string_view key, const auto& visit) {
    const auto list = at.find(key);
    for (const YamlCursor& item : list ? list->children() : std::vector<YamlCursor>()) visit(item);
  };
  read_tagslam_times(config, read, scene);
  each(config, "distance_measurements", [&](const YamlCursor& at) {
    scene.distances.push_back({read.integer(at, "tag1", -1), read.integer(at, "tag2", -1),
                               our_corner(read.integer(at, "corner1", 0)),
                               our_corner(read.integer(at, "corner2", 0)), read.number(at, "distance", 0),
                               read.positive(at, "noise")});
  });
  each(config, "plane_measurements", [&](const YamlCursor& at) {
    for (int id : read.ids(at, "tags"))
      scene.coordinates.push_back(
          {id, -1, read.vector(at, "direction"), read.number(at, "distance", 0), read.positive(at, "noise")});
  });
}

}  // namespace

Result<TagScene> read_tagslam_json(const YamlCursor& config) {
  TagslamReader read;
  TagScene scene{.max_hamming = read.integer(config, "max_hamming_distance", 100)};
  if (const auto at = config.find("parameters")) {
    scene.pixel_sigma_px = at->find("pixel_noise") ? read.positive(*at, "pixel_noise") : 1;
    scene.min_tag_area_px2 = read.number(*at, "minimum_tag_area", 0) / 2;  // TagSLAM's areas are twice ours
    scene.approximate_sync = read.boolean(*at, "use_approximate_sync", false);
  }
  const auto bodies = config.at("bodies");
  if (!bodies) return tl::unexpected(bodies.error());
  for (const YamlCursor& entry : bodies->children()) scene.bodies.push_back(read_body_json(entry, read));
  scene.default_body = scene.body_named(read.text(config, "default_body", ""));
  read_lists(config, read, scene);
  const auto cameras = config.at("cameras");
  if (!cameras) return tl::unexpected(cameras.error());
  for (const YamlCursor& entry : cameras->children()) {
    auto camera = read_tagslam_camera(
        entry, read.text(entry, "name", "cam"),
        {"fx_fy_cx_cy", "resolution_w_h", "distortion_coeffs", "distortion", "tag_topic"}, scene);
    if (!camera) return tl::unexpected(camera.error());
    if (const auto prior = entry.find("T_rig_cam_prior")) camera->body_T_cam = read_prior(*prior, read);
    scene.cameras.push_back(std::move(*camera));
  }
  if (!read.status()) return tl::unexpected(read.status().error());
  return scene;
}

}  // namespace waymark::internal
