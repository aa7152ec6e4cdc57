#include "waymark/config/tagslam_parts.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "waymark/config/camera_formats.hpp"

namespace waymark::internal {
namespace {

constexpr std::int64_t kLargest = 1'000'000'000;

template <class Visit>
void each(const YamlCursor& at, std::string_view key, const Visit& visit) {
  const auto list = at.find(key);
  for (const YamlCursor& item : list ? list->children() : std::vector<YamlCursor>()) visit(item);
}

/// "1527206556.891942748" in nanoseconds; nothing where it is no such number.
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

}  // namespace

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

std::string TagslamReader::text(const YamlCursor& at, std::string_view key, std::string fallback) {
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
  if (!(value > 0)) fail_at(*at.find(key), "must be greater than 0");
  return value > 0 ? value : 1;
}

SensorTime TagslamReader::time(const YamlCursor& at, std::string_view key) {
  const std::string text = keep(at.read_at(key, &YamlCursor::text), std::string("0"));
  if (const auto exact = nanoseconds_of(text)) return SensorTime(Duration(*exact));
  const double seconds = number(at, key, 0);
  constexpr double kFarthest = 9e9;
  if (std::abs(seconds) > kFarthest) fail_at(*at.find(key), "a time in seconds is needed");
  return SensorTime(Duration(std::abs(seconds) > kFarthest ? 0 : std::llround(seconds * 1e9)));
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

ScenePrior of_our_tag(const ScenePrior& theirs) {
  return {theirs.mean * half_turn(), theirs.sqrt_information * half_turn().adjoint()};
}

int our_corner(int theirs) { return theirs < 0 ? theirs : 3 - theirs; }

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
  const auto camera =
      make_camera(*model, {f[0], f[1], f[2], f[3]}, k, static_cast<std::int64_t>(size[0]),
                  static_cast<std::int64_t>(size[1]), {*intrinsics, *resolution, *distortion});
  if (!camera) return tl::unexpected(camera.error());
  const auto on = scene.body_named(body);
  if (!on) {
    return entry.fail_here(ErrorCode::NotFound, "no body is called '" + body + "'",
                           "rig_body must be one of the bodies of tagslam.yaml.");
  }
  return CameraOnBody{.name = std::move(name),
                      .topic = topic,
                      .model = *camera,
                      .body = *on,
                      .wiggle_m = wiggle_m,
                      .wiggle_rad = wiggle_rad};
}

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
    read.fail_at(body, "the noise of odometry must be greater than 0, its maximum no less than its minimum");
  const double stays_m = read.number(body, "fake_odom_translation_noise", 0);
  const double stays_rad = read.number(body, "fake_odom_rotation_noise", 0);
  if (stays_m > 0 && stays_rad > 0)
    into.stays_put = SceneMotionNoise{.sigma_m = stays_m, .sigma_rad = stays_rad};
}

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

}  // namespace waymark::internal
