#pragma once

#include <optional>
#include <string_view>

#include "waymark/config/yaml_cursor.hpp"
#include "waymark/mapping/scene/tag_scene.hpp"

/// What tagslam.yaml and config.json share. For the .cpp files of tagslam_folder only.
namespace waymark::internal {

/// Keeps the first error of many reads.
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
  std::string text(const YamlCursor& at, std::string_view key, std::string fallback);
  std::set<int> ids(const YamlCursor& at, std::string_view key);
  std::vector<double> numbers(const YamlCursor& at, std::string_view key, std::size_t count);
  /// {x:, y:, z:} or [x, y, z]; zero where it is missing.
  Eigen::Vector3d vector(const YamlCursor& at, std::string_view key, double fallback = 0);
  double positive(const YamlCursor& at, std::string_view key);
  /// Seconds with up to nine digits behind the point, exactly; quoted or not.
  SensorTime time(const YamlCursor& at, std::string_view key);

  /// A matrix W of TagSLAM, rotation first, as ours: translation first. TagSLAM takes the 36 numbers by
  /// columns (only so are its own results the minimum of its cost).
  Matrix6 sqrt_information(const YamlCursor& at, std::string_view key);
  ScenePrior prior(const YamlCursor& at, const SE3& mean, const Eigen::Vector3d& sigma_m,
                   const Eigen::Vector3d& sigma_rad);

 private:
  Status status_{};
};

/// A prior on TagSLAM's tag frame (y up, z to the reader) as one on ours.
[[nodiscard]] ScenePrior of_our_tag(const ScenePrior& theirs);
/// A corner by TagSLAM's number (BL, BR, TR, TL) in ours.
[[nodiscard]] int our_corner(int theirs);
/// The camera of an entry with its names of keys.
struct TagslamCameraKeys {
  std::string_view intrinsics, resolution, distortion, model, topic;
};
[[nodiscard]] Result<CameraOnBody> read_tagslam_camera(const YamlCursor& entry, std::string name,
                                                       const TagslamCameraKeys& keys, const TagScene& scene);
/// What odometry keys say of a body; they are the same in both files but for T_body_odom.
void read_tagslam_odometry(const YamlCursor& body, TagslamReader& read, SceneBody& into);
/// `tag_id_remap` and `squash`, the same in both files.
void read_tagslam_times(const YamlCursor& root, TagslamReader& read, TagScene& scene);

[[nodiscard]] Result<TagScene> read_tagslam_yaml(const YamlCursor& tagslam, const YamlCursor& cameras,
                                                 const std::optional<YamlCursor>& camera_poses);
[[nodiscard]] Result<TagScene> read_tagslam_json(const YamlCursor& config);

}  // namespace waymark::internal
