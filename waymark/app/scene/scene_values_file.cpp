#include <charconv>
#include <numbers>
#include <sstream>

#include "waymark/app/scene/scene_recording.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/recording/unpack.hpp"

namespace waymark {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{1} << 27U;

/// Of the file, or of the same packed as a whole (.gz, .bz2, .zst).
Result<std::string> read_perhaps_packed(const std::filesystem::path& path) {
  std::error_code ignored;
  std::filesystem::path found = path;
  for (const char* suffix : {"", ".gz", ".bz2", ".zst"}) {
    if (std::filesystem::exists(path.string() + suffix, ignored)) {
      found = path.string() + suffix;
      break;
    }
  }
  Result<std::string> text = read_file(found, kMaxBytes);
  if (!text) return text;
  const Packing packing = packing_of(as_bytes(*text));
  if (packing == Packing::None) return text;
  const UnpackedBytes unpacked = unpack_bytes(packing, as_bytes(*text), kMaxBytes);
  if (!unpacked.damage) return std::string(as_text(unpacked.bytes));
  Error error = *unpacked.damage;
  error.place.source = found.string();
  return tl::unexpected(error);
}

/// Calls visit with the words of each line but the first.
Status for_rows(const std::filesystem::path& path, std::size_t words,
                const std::function<bool(const std::vector<std::string>&)>& visit) {
  const auto text = read_perhaps_packed(path);
  if (!text) return tl::unexpected(text.error());
  std::istringstream lines(*text);
  std::string line;
  for (std::int64_t number = 1; std::getline(lines, line); ++number) {
    if (number == 1 || line.empty()) continue;
    std::vector<std::string> row;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    if (row.size() < words || !visit(row))
      return fail(ErrorCode::Unreadable, "this is not a row of a solution",
                  {.source = path.string(), .line = number}, "See docs/formats/tagslam.md.");
  }
  return {};
}

std::optional<SE3> pose_of(const std::vector<std::string>& row, std::size_t first) {
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    const std::string& text = row[first + i];
    if (std::from_chars(text.data(), text.data() + text.size(), v[i]).ec != std::errc{}) return std::nullopt;
  }
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  if (!(q.norm() > 0.9 && q.norm() < 1.1)) return std::nullopt;
  return SE3(SO3::from_matrix(q.normalized().toRotationMatrix()), Eigen::Vector3d(v[0], v[1], v[2]));
}

}  // namespace

Result<SceneValues> read_scene_values(const std::filesystem::path& folder, const TagScene& scene) {
  SceneValues values;
  const SE3 half_turn(SO3::exp(Eigen::Vector3d(std::numbers::pi, 0, 0)), Eigen::Vector3d::Zero());
  Status status = for_rows(folder / "ref_static.csv", 9, [&](const std::vector<std::string>& row) {
    const auto pose = pose_of(row, 2);
    const std::string& child = row[1];
    if (!pose) return false;
    if (child.starts_with("tag_"))
      values.tags[std::atoi(child.c_str() + 4)] = *pose * half_turn;
    else if (row[0] == "map")
      values.static_bodies[child] = *pose;
    else if (std::ranges::any_of(scene.cameras, [&](const CameraOnBody& c) { return c.name == child; }))
      values.cameras[child] = *pose;
    return true;
  });
  if (!status) return tl::unexpected(status.error());
  status = for_rows(folder / "ref_trajectory.csv", 9, [&](const std::vector<std::string>& row) {
    const auto pose = pose_of(row, 2);
    if (pose) values.moving_bodies[{row[1], std::atoll(row[0].c_str())}] = *pose;
    return pose.has_value();
  });
  if (!status) return tl::unexpected(status.error());
  return values;
}

}  // namespace waymark
