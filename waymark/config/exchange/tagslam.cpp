#include "waymark/config/exchange/tagslam.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "waymark/config/exchange/camera_formats.hpp"
#include "waymark/config/exchange/xyz.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_tree.hpp"
#include "waymark/mapping/scene/tag_scene.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {
namespace {

/// Reads many values and keeps the first error.
class TagslamReader {
 public:
  [[nodiscard]] const Status& status() const { return status_; }
  template <class T>
  T keep(const Result<T>& value, T fallback) {
    if (!value && status_) status_ = tl::unexpected(value.error());
    return value ? *value : std::move(fallback);
  }
  void fail_at(const YamlCursor& at, std::string message) {
    if (status_) status_ = at.fail_here(ErrorCode::InvalidArgument, std::move(message));
  }

  double number(const YamlCursor& at, std::string_view key, double fallback);
  int integer(const YamlCursor& at, std::string_view key, int fallback);
  bool boolean(const YamlCursor& at, std::string_view key, bool fallback);
  std::string text(const YamlCursor& at, std::string_view key, const std::string& fallback);
  std::set<int> ids(const YamlCursor& at, std::string_view key);
  std::vector<double> numbers(const YamlCursor& at, std::string_view key, std::size_t count);
  /// Reads {x:, y:, z:} or [x, y, z]; zero if missing.
  Eigen::Vector3d vector(const YamlCursor& at, std::string_view key, double fallback = 0);
  double positive(const YamlCursor& at, std::string_view key);
  /// Reads the side of a printed tag [m].
  double tag_size(const YamlCursor& at, std::string_view key);
  /// 0 if there is none.
  double default_tag_size(const YamlCursor& body);
  void check_tag_size(const YamlCursor& at, std::string_view key, double size_m);
  /// Reads seconds with up to nine decimals exactly, quoted or not.
  SensorTime time(const YamlCursor& at, std::string_view key);

  /// Reads a TagSLAM matrix W (rotation first) and converts it to translation first. TagSLAM stores the 36
  /// numbers column by column; only with this order do its own results minimise its cost.
  Matrix6 sqrt_information(const YamlCursor& at, std::string_view key);
  ScenePrior prior(const YamlCursor& at, const SE3& mean, const Eigen::Vector3d& sigma_m,
                   const Eigen::Vector3d& sigma_rad);

 private:
  Status status_{};
};

constexpr std::int64_t kLargest = 1'000'000'000;

template <class Visit>
void each(const YamlCursor& at, std::string_view key, const Visit& visit) {
  const auto list = at.find(key);
  for (const YamlCursor& item : list ? list->children() : std::vector<YamlCursor>()) visit(item);
}

/// Converts "1527206556.891942748" to nanoseconds; `nullopt` for any other text.
std::optional<std::int64_t> nanoseconds_of(std::string_view text) {
  constexpr std::size_t kDigits = 9;
  const std::size_t point = std::min(text.find('.'), text.size());
  std::string digits(text.substr(0, point));
  std::string fraction(text.substr(std::min(point + 1, text.size())));
  const auto other = [](char c) { return c < '0' || c > '9'; };
  if (digits.empty() || std::ranges::any_of(fraction, other)) return std::nullopt;
  fraction.resize(kDigits, '0');
  digits += fraction;
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
  return value;
}

SE3 half_turn() { return SE3(SO3::exp(Eigen::Vector3d(std::numbers::pi, 0, 0)), Eigen::Vector3d::Zero()); }

double TagslamReader::number(const YamlCursor& at, std::string_view key, double fallback) {
  return at.find(key) ? keep(at.read_at(key, &YamlCursor::number), fallback) : fallback;
}

int TagslamReader::integer(const YamlCursor& at, std::string_view key, int fallback) {
  const auto read = [](const YamlCursor& c) { return c.integer(-kLargest, kLargest); };
  return at.find(key) ? static_cast<int>(keep(at.read_at(key, read), std::int64_t{fallback})) : fallback;
}

bool TagslamReader::boolean(const YamlCursor& at, std::string_view key, bool fallback) {
  return at.find(key) ? keep(at.read_at(key, &YamlCursor::boolean), fallback) : fallback;
}

std::string TagslamReader::text(const YamlCursor& at, std::string_view key, const std::string& fallback) {
  return at.find(key) ? keep(at.read_at(key, &YamlCursor::text), fallback) : fallback;
}

std::set<int> TagslamReader::ids(const YamlCursor& at, std::string_view key) {
  std::set<int> result;
  const auto list = at.find(key);
  for (const YamlCursor& id : list ? list->children() : std::vector<YamlCursor>())
    result.insert(static_cast<int>(keep(id.integer(0, kLargest), std::int64_t{0})));
  return result;
}

std::vector<double> TagslamReader::numbers(const YamlCursor& at, std::string_view key, std::size_t count) {
  const auto read = [count](const YamlCursor& c) { return c.exactly_numbers(count); };
  return keep(at.read_at(key, read), std::vector<double>(count, 0.0));
}

Eigen::Vector3d TagslamReader::vector(const YamlCursor& at, std::string_view key, double fallback) {
  Eigen::Vector3d v = Eigen::Vector3d::Constant(fallback);
  const auto value = at.find(key);
  if (!value) return v;
  if (value->is_sequence()) {
    const std::vector<double> list = numbers(at, key, 3);
    return {list[0], list[1], list[2]};
  }
  for (int i = 0; i < 3; ++i)
    v[i] = number(*value, std::array{"x", "y", "z"}[static_cast<std::size_t>(i)], fallback);
  return v;
}

double TagslamReader::positive(const YamlCursor& at, std::string_view key) {
  const double value = keep(at.read_at(key, &YamlCursor::number), 1.0);
  if (!(value > 0)) fail_at(*at.find(key), fmt::format("{:g} is not greater than 0", value));
  return value > 0 ? value : 1;
}

void TagslamReader::check_tag_size(const YamlCursor& at, std::string_view key, double size_m) {
  const Status usual = check_printed_size(size_m, std::string(key));
  if (!usual) fail_at(*at.find(key), usual.error().message);
}

double TagslamReader::tag_size(const YamlCursor& at, std::string_view key) {
  const double size_m = positive(at, key);
  check_tag_size(at, key, size_m);
  return size_m;
}

double TagslamReader::default_tag_size(const YamlCursor& body) {
  constexpr std::string_view kKey = "default_tag_size";
  const double size_m = number(body, kKey, 0);
  if (size_m != 0) check_tag_size(body, kKey, size_m);
  return size_m;
}

SensorTime TagslamReader::time(const YamlCursor& at, std::string_view key) {
  const std::string text = keep(at.read_at(key, &YamlCursor::text), std::string("0"));
  if (const auto exact = nanoseconds_of(text)) return SensorTime(Duration(*exact));
  const double seconds = number(at, key, 0);
  constexpr double kMaxTime_s = 9e9;
  if (std::abs(seconds) > kMaxTime_s) fail_at(*at.find(key), "must be a time in seconds");
  return SensorTime(Duration(std::abs(seconds) > kMaxTime_s ? 0 : std::llround(seconds * 1e9)));
}

Matrix6 TagslamReader::sqrt_information(const YamlCursor& at, std::string_view key) {
  const std::vector<double> list = numbers(at, key, 36);
  const Matrix6 theirs = Eigen::Map<const Matrix6>(list.data());
  Matrix6 ours;
  ours << theirs.rightCols<3>(), theirs.leftCols<3>();
  return ours;
}

ScenePrior TagslamReader::prior(const YamlCursor& at, const SE3& mean, const Eigen::Vector3d& sigma_m,
                                const Eigen::Vector3d& sigma_rad) {
  if (!(sigma_m.minCoeff() > 0 && sigma_rad.minCoeff() > 0)) {
    fail_at(at, "the noise of a pose must be greater than 0");
    return {.mean = mean};
  }
  return ScenePrior::of(mean, sigma_m, sigma_rad);
}

/// Converts a prior on TagSLAM's tag frame (y up, z towards the viewer) to Waymark's tag frame.
ScenePrior of_our_tag(const ScenePrior& theirs) {
  return {theirs.mean * half_turn(), theirs.sqrt_information * half_turn().adjoint()};
}

/// Converts TagSLAM's number of a corner (BL, BR, TR, TL) to Waymark's.
int our_corner(int theirs) { return theirs < 0 ? theirs : 3 - theirs; }

/// The key names used for a camera.
struct TagslamCameraKeys {
  std::string_view intrinsics, resolution, distortion, model, topic;
};

/// Reads the camera of an entry with these key names.
Result<CameraOnBody> read_tagslam_camera(const YamlCursor& entry, std::string name,
                                         const TagslamCameraKeys& keys, const TagScene& scene) {
  TagslamReader read;
  const auto intrinsics = entry.at(keys.intrinsics);
  const auto resolution = entry.at(keys.resolution);
  const auto distortion = entry.at(keys.distortion);
  const auto model = entry.at(keys.model);
  for (const auto* part : {&intrinsics, &resolution, &distortion, &model}) {
    if (!*part) return tl::unexpected(part->error());
  }
  const std::vector<double> f = read.numbers(entry, keys.intrinsics, 4);
  const std::vector<double> size = read.numbers(entry, keys.resolution, 2);
  const std::vector<double> k = read.keep(distortion->numbers(), std::vector<double>());
  const std::string body = read.text(entry, "rig_body", "");
  const std::string topic = read.text(entry, keys.topic, "");
  const double wiggle_m = read.number(entry, "wiggle_translation", 0);
  const double wiggle_rad = read.number(entry, "wiggle_rotation", 0);
  if (!read.status()) return tl::unexpected(read.status().error());
  const auto camera = internal::make_camera(
      *model, {f[0], 0, f[2], 0, f[1], f[3], 0, 0, 1}, k, static_cast<std::int64_t>(size[0]),
      static_cast<std::int64_t>(size[1]), {*intrinsics, *resolution, *distortion, {}});
  if (!camera) return tl::unexpected(camera.error());
  const auto on = scene.body_named(body);
  if (!on) {
    return entry.fail_here(ErrorCode::NotFound, "unknown body '" + body + "'",
                           "rig_body must be one of the bodies of tagslam.yaml.");
  }
  return CameraOnBody{.name = std::move(name),
                      .topic = topic,
                      .model = *camera,
                      .body = *on,
                      .wiggle_m = wiggle_m,
                      .wiggle_rad = wiggle_rad};
}

/// Reads the odometry keys of a body. Both files have the same keys, except for T_body_odom.
void read_tagslam_odometry(const YamlCursor& body, TagslamReader& read, SceneBody& into) {
  into.odometry_frame = read.text(body, "odom_frame_id", "");
  SceneMotionNoise& noise = into.odometry;
  noise.sigma_m = read.number(body, "odom_translation_noise", 0);
  noise.sigma_rad = read.number(body, "odom_rotation_noise", 0);
  const auto least = [&](const char* now, const char* before) {
    return read.number(body, now, read.number(body, before, 5));
  };
  noise.acceleration_min_m_s2 = least("odom_acceleration_noise_min", "odom_acceleration");
  noise.angular_min_rad_s2 = least("odom_angular_acceleration_noise_min", "odom_angular_acceleration");
  noise.acceleration_max_m_s2 =
      read.number(body, "odom_acceleration_noise_max", 10 * noise.acceleration_min_m_s2);
  noise.angular_max_rad_s2 =
      read.number(body, "odom_angular_acceleration_noise_max", 10 * noise.angular_min_rad_s2);
  if (!(noise.acceleration_min_m_s2 > 0 && noise.angular_min_rad_s2 > 0 &&
        noise.acceleration_max_m_s2 >= noise.acceleration_min_m_s2 &&
        noise.angular_max_rad_s2 >= noise.angular_min_rad_s2))
    read.fail_at(body,
                 "the odometry noise must be greater than 0, and its maximum not less than its minimum");
  const double stays_m = read.number(body, "fake_odom_translation_noise", 0);
  const double stays_rad = read.number(body, "fake_odom_rotation_noise", 0);
  if (stays_m > 0 && stays_rad > 0)
    into.stays_put = SceneMotionNoise{.sigma_m = stays_m, .sigma_rad = stays_rad};
}

/// Reads `tag_id_remap` and `squash`, which are the same in both files.
void read_tagslam_times(const YamlCursor& root, TagslamReader& read, TagScene& scene) {
  each(root, "tag_id_remap", [&](const YamlCursor& entry) {
    each(entry, "remaps", [&](const YamlCursor& at) {
      scene.remaps.push_back({read.integer(entry, "id", -1), read.integer(at, "remap_id", -1),
                              read.time(at, "start_time"), read.time(at, "end_time"),
                              read.text(at, "camera", "")});
    });
  });
  each(root, "squash", [&](const YamlCursor& at) {
    SceneSquash squash{.camera = read.text(at, "camera", ""), .ids = read.ids(at, "tags")};
    if (at.find("time")) squash.stamp = read.time(at, "time");
    scene.squash.push_back(std::move(squash));
  });
}

struct Defaults {
  double sigma_m = 0.05, sigma_rad = 0.01;
};

/// Reads the position, the rotation (as a rotation vector), and their noise or R.
ScenePrior read_tagslam_pose(const YamlCursor& pose, const Defaults& defaults, TagslamReader& read) {
  const SE3 mean(SO3::exp(read.vector(pose, "rotation")), read.vector(pose, "position"));
  if (pose.find("R")) return {mean, read.sqrt_information(pose, "R")};
  return read.prior(pose, mean, read.vector(pose, "position_noise", defaults.sigma_m),
                    read.vector(pose, "rotation_noise", defaults.sigma_rad));
}

/// Adds a board with a grid of tags, optionally with every second tag omitted.
void add_board(const YamlCursor& board, bool staggered, TagslamReader& read, SceneBody& body) {
  const int rows = read.integer(board, "tag_rows", 0);
  const int columns = read.integer(board, "tag_columns", 0);
  const double size = read.tag_size(board, "tag_size");
  const double pitch = size * (1 + read.number(board, "tag_spacing", 0));
  constexpr int kMaxTags = 1000;
  if (rows < 1 || columns < 1 || rows > kMaxTags || columns > kMaxTags / rows + 1) {
    read.fail_at(board, "a board must have 1 to 1000 tags");
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

void read_tagslam_tags(const YamlCursor& entry, const Defaults& defaults, TagslamReader& read,
                       SceneBody& body) {
  const double override_m = read.number(entry, "override_tag_position_noise", 0);
  const double override_rad = read.number(entry, "override_tag_rotation_noise", 0);
  const auto list = entry.find("tags");
  for (const YamlCursor& at : list ? list->children() : std::vector<YamlCursor>()) {
    SceneTag tag{.id = {FamilyId::Tag36h11, read.integer(at, "id", -1)}};
    tag.size_m = at.find("size") ? read.tag_size(at, "size") : body.default_tag_size_m;
    if (tag.id.number < 0 || !(tag.size_m > 0)) read.fail_at(at, "a tag needs an id and a size in metres");
    if (const auto pose = at.find("pose")) {
      tag.body_T_tag = read_tagslam_pose(*pose, defaults, read);
      if (override_m > 0 && override_rad > 0)
        tag.body_T_tag = ScenePrior::of(tag.body_T_tag->mean, Eigen::Vector3d::Constant(override_m),
                                        Eigen::Vector3d::Constant(override_rad));
      tag.body_T_tag = of_our_tag(*tag.body_T_tag);
    }
    body.tags.push_back(tag);
  }
}

SceneBody read_tagslam_body(const YamlCursor& entry, std::string name, const Defaults& defaults,
                            TagslamReader& read) {
  SceneBody body{.name = std::move(name), .is_static = read.boolean(entry, "is_static", false)};
  body.default_tag_size_m = read.default_tag_size(entry);
  body.ignored = read.ids(entry, "ignore_tags");
  if (entry.find("max_hamming_distance")) body.max_hamming = read.integer(entry, "max_hamming_distance", 2);
  if (const auto pose = entry.find("pose")) {
    if (!body.is_static) read.fail_at(*pose, "a body that moves cannot have a pose");
    body.map_T_body = read_tagslam_pose(*pose, defaults, read);
  }
  if (const auto sensor = entry.find("T_body_odom"))
    body.body_T_odom = SE3(SO3::exp(read.vector(*sensor, "rotation")), read.vector(*sensor, "position"));
  read_tagslam_odometry(entry, read, body);
  read_tagslam_tags(entry, defaults, read, body);
  const std::string type = read.text(entry, "type", "simple");
  if (type == "board" || type == "staggered_board") {
    const auto board = entry.at(type);
    if (board)
      add_board(*board, type != "board", read, body);
    else
      read.keep(board, entry);
  } else if (type != "simple" && type != "camera_rig") {
    read.fail_at(entry, "unknown body type '" + type + "'");
  }
  return body;
}

/// Visits a sequence of maps, each with a single key: the name.
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

Result<TagScene> read_tagslam_yaml(const YamlCursor& tagslam, const YamlCursor& cameras,
                                   const std::optional<YamlCursor>& camera_poses) {
  TagslamReader read;
  TagScene scene{.max_hamming = 100};
  if (const auto at = tagslam.find("tagslam_parameters")) {
    scene.pixel_sigma_px = at->find("pixel_noise") ? read.positive(*at, "pixel_noise") : 1;
    scene.min_tag_area_px2 =
        read.number(*at, "minimum_tag_area", 0) / 2;  // TagSLAM's areas are twice as large
    scene.approximate_sync = read.boolean(*at, "use_approximate_sync", false);
    scene.max_hamming = read.integer(*at, "max_hamming_distance", scene.max_hamming);
  }
  Defaults defaults;
  if (const auto at = tagslam.find("body_defaults"))
    defaults = {read.positive(*at, "position_noise"), read.positive(*at, "rotation_noise")};
  for_named(tagslam, "bodies", [&](const std::string& name, const YamlCursor& entry) {
    scene.bodies.push_back(read_tagslam_body(entry, name, defaults, read));
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
    if (pose) camera->body_T_cam = read_tagslam_pose(*pose, defaults, read);
    scene.cameras.push_back(std::move(*camera));
  }
  if (!read.status()) return tl::unexpected(read.status().error());
  return scene;
}

/// {t, rotvec} with {sigma_t, sigma_r} or {sqrtinfo_R_rot_then_trans}.
SE3 read_tagslam_transform(const YamlCursor& at, TagslamReader& read) {
  return {SO3::exp(read.vector(at, "rotvec")), read.vector(at, "t")};
}

ScenePrior read_prior(const YamlCursor& at, TagslamReader& read) {
  const SE3 mean = read_tagslam_transform(at, read);
  if (at.find("sqrtinfo_R_rot_then_trans"))
    return {mean, read.sqrt_information(at, "sqrtinfo_R_rot_then_trans")};
  return read.prior(at, mean, read.vector(at, "sigma_t"), read.vector(at, "sigma_r"));
}

SceneBody read_body_json(const YamlCursor& entry, TagslamReader& read) {
  SceneBody body{.name = read.text(entry, "name", ""), .is_static = read.boolean(entry, "is_static", false)};
  body.default_tag_size_m = read.default_tag_size(entry);
  body.ignored = read.ids(entry, "ignore_tags");
  if (entry.find("max_hamming_distance")) body.max_hamming = read.integer(entry, "max_hamming_distance", 2);
  if (const auto prior = entry.find("T_world_body_prior")) body.map_T_body = read_prior(*prior, read);
  if (const auto sensor = entry.find("T_body_odom")) body.body_T_odom = read_tagslam_transform(*sensor, read);
  read_tagslam_odometry(entry, read, body);
  const double override_m = read.number(entry, "override_tag_position_noise", 0);
  const double override_rad = read.number(entry, "override_tag_rotation_noise", 0);
  const auto list = entry.find("tags");
  for (const YamlCursor& at : list ? list->children() : std::vector<YamlCursor>()) {
    SceneTag tag{.id = {FamilyId::Tag36h11, read.integer(at, "id", -1)}, .size_m = read.tag_size(at, "size")};
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

Result<TagScene> read_tagslam_json(const YamlCursor& config) {
  TagslamReader read;
  TagScene scene{.max_hamming = read.integer(config, "max_hamming_distance", 100)};
  if (const auto at = config.find("parameters")) {
    scene.pixel_sigma_px = at->find("pixel_noise") ? read.positive(*at, "pixel_noise") : 1;
    scene.min_tag_area_px2 =
        read.number(*at, "minimum_tag_area", 0) / 2;  // TagSLAM's areas are twice as large
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

constexpr std::size_t kMaxTagslamBytes = std::size_t{1} << 22U;

Result<YamlNode> parse_tagslam_file(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, kMaxTagslamBytes);
  if (!text) return tl::unexpected(text.error());
  return parse_yaml(*text, path.string(), {.bytes = kMaxTagslamBytes, .nodes = 1'000'000});
}

/// TagSLAM's files do not contain the family; ids that are too large rule out tag36h11.
void name_family(TagScene& scene) {
  int largest = -1;
  for (const SceneBody& body : scene.bodies) {
    for (const SceneTag& tag : body.tags) largest = std::max(largest, tag.id.number);
  }
  const FamilyId family = usual_family(largest);
  for (SceneBody& body : scene.bodies) {
    for (SceneTag& tag : body.tags) tag.id.family = family;
  }
}

Result<TagScene> read_tagslam_files(const std::filesystem::path& folder) {
  std::error_code error;
  if (!std::filesystem::exists(folder / "tagslam.yaml", error) &&
      std::filesystem::exists(folder / "config.json", error)) {
    const Result<YamlNode> config = parse_tagslam_file(folder / "config.json");
    if (!config) return tl::unexpected(config.error());
    return read_tagslam_json(YamlCursor(*config, (folder / "config.json").string()));
  }
  const Result<YamlNode> tagslam = parse_tagslam_file(folder / "tagslam.yaml");
  if (!tagslam) return tl::unexpected(tagslam.error());
  const Result<YamlNode> cameras = parse_tagslam_file(folder / "cameras.yaml");
  if (!cameras) return tl::unexpected(cameras.error());
  std::optional<YamlCursor> poses;
  Result<YamlNode> camera_poses = YamlNode{};
  if (std::filesystem::exists(folder / "camera_poses.yaml", error)) {
    camera_poses = parse_tagslam_file(folder / "camera_poses.yaml");
    if (!camera_poses) return tl::unexpected(camera_poses.error());
    poses.emplace(*camera_poses, (folder / "camera_poses.yaml").string());
  }
  return read_tagslam_yaml(YamlCursor(*tagslam, (folder / "tagslam.yaml").string()),
                           YamlCursor(*cameras, (folder / "cameras.yaml").string()), poses);
}

}  // namespace

Result<TagScene> read_tagslam_folder(const std::filesystem::path& folder) {
  Result<TagScene> scene = read_tagslam_files(folder);
  if (!scene) return scene;
  if (scene->bodies.empty() || scene->cameras.empty())
    return fail(ErrorCode::InvalidArgument, "there must be at least one body and one camera",
                {.source = folder.string()});
  name_family(*scene);
  return scene;
}

namespace {

/// Covariance of the error in the axes of the pose itself, as defined by TagSLAM.
Matrix6 own_axes(const SE3& pose, const Matrix6& left) {
  const Matrix6 Ad = pose.inverse().adjoint();
  return Ad * left * Ad.transpose();
}

std::string pose_with_noise(const SE3& pose, const Matrix6& left, const std::string& indent) {
  constexpr double kLeast = 1e-6;  // minimum that TagSLAM's solver accepts
  const Eigen::VectorXd sigma = own_axes(pose, left).diagonal().cwiseMax(kLeast * kLeast).cwiseSqrt();
  return indent + "pose:\n" + xyz_lines("position", pose.translation(), indent + "  ") +
         xyz_lines("rotation", pose.rotation().log(), indent + "  ") +
         xyz_lines("position_noise", sigma.head<3>(), indent + "  ") +
         xyz_lines("rotation_noise", sigma.tail<3>(), indent + "  ");
}

}  // namespace

std::string to_tagslam_camera_poses(const SceneMap& map) {
  std::string text;
  for (std::size_t c = 0; c < map.scene.cameras.size(); ++c) {
    const PoseIndex at = map.problem.cameras[c];
    if (map.placed[at] == 0) continue;
    const SE3& pose = map.problem.bundle.poses[at].value;
    const Matrix6 P = own_axes(pose, map.covariance.poses[at]) + 1e-12 * Matrix6::Identity();
    Matrix6 rotation_first;
    rotation_first << P.bottomRightCorner<3, 3>(), P.bottomLeftCorner<3, 3>(), P.topRightCorner<3, 3>(),
        P.topLeftCorner<3, 3>();
    const Matrix6 R = rotation_first.inverse().llt().matrixU();
    text += fmt::format("{}:\n  pose:\n", map.scene.cameras[c].name) +
            xyz_lines("position", pose.translation(), "    ") +
            xyz_lines("rotation", pose.rotation().log(), "    ") + "    R: [";
    for (int i = 0; i < 36; ++i)
      text += fmt::format("{}{:.8f}", i == 0 ? "" : ", ", R(i % 6, i / 6));  // column-major, as in TagSLAM
    text += "]\n";
  }
  return text;
}

std::string to_tagslam_poses(const SceneMap& map) {
  const SE3 half_turn(SO3::exp(Eigen::Vector3d(std::numbers::pi, 0, 0)), Eigen::Vector3d::Zero());
  std::string text = "bodies:\n";
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    const SceneBody& body = map.scene.bodies[b];
    text +=
        fmt::format(" - {}:\n     type: simple\n     is_static: {}\n", yaml_text(body.name), body.is_static);
    if (body.default_tag_size_m > 0)
      text += fmt::format("     default_tag_size: {}\n", yaml_number(body.default_tag_size_m));
    const PoseIndex at = map.problem.bodies[b].front();
    if (body.is_static && map.placed[at] != 0)
      text += pose_with_noise(map.problem.bundle.poses[at].value, map.covariance.poses[at], "     ");
    std::string tags;
    for (std::size_t t = 0; t < body.tags.size(); ++t) {
      const PoseIndex tag = map.problem.tags[b][t];
      if (map.placed[tag] == 0) continue;
      tags += fmt::format("       - id: {}\n         size: {}\n", body.tags[t].id.number,
                          yaml_number(body.tags[t].size_m));
      tags += pose_with_noise(map.problem.bundle.poses[tag].value * half_turn, map.covariance.poses[tag],
                              "         ");
    }
    if (!tags.empty()) text += "     tags:\n" + tags;
  }
  return text;
}

}  // namespace waymark
