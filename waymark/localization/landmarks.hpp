#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// A landmark of a known map: a tag, or a point with a number.
struct Landmark {
  TagId tag{};      ///< only the number is used if the landmark is not a tag
  SE3 map_T_tag{};  ///< in the level frame on the floor (map_T_floor()); the rotation of a point is unused
  bool oriented = true;      ///< false: only the position is known
  bool family_known = true;  ///< false: any family with this number matches
  double size_m = 0;         ///< 0: unknown
  /// Covariance of (position in map axes [m], rotation about its own centre in map axes [rad]).
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  /// Covariance given the position of the tag to which this one is tied, which excludes the errors that both
  /// share. Equals `covariance` if the map contains no tie.
  Eigen::Matrix<double, 6, 6> own_covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// A map point without orientation: number, x, y.
struct LandmarkPoint {
  std::int64_t number = 0;
  Eigen::Vector2d map_p = Eigen::Vector2d::Zero();
};

/// Landmarks of one map, found by number. Immutable.
class Landmarks {
 public:
  Landmarks() = default;
  /// Levels the map: positions are in the frame whose z = 0 is its floor.
  explicit Landmarks(const TagMap& map);
  /// Fails on a duplicate number and on a non-finite position.
  [[nodiscard]] static Result<Landmarks> of_points(const std::vector<LandmarkPoint>& points);

  /// Index of the tag; -1 if it is not in the map or of another family. O(1).
  [[nodiscard]] int find(const TagId& tag) const;
  [[nodiscard]] int find(std::int64_t number) const;
  [[nodiscard]] const Landmark& operator[](int index) const { return all_[static_cast<std::size_t>(index)]; }
  [[nodiscard]] int size() const { return static_cast<int>(all_.size()); }
  [[nodiscard]] const std::vector<Landmark>& all() const { return all_; }

  /// Pairs of tags that cannot both be where the map places them: nearer to each other than half of their
  /// sizes [m].
  [[nodiscard]] std::vector<std::pair<int, int>> overlapping() const;

 private:
  void add(const Landmark& landmark);
  std::vector<Landmark> all_;
  std::unordered_multimap<std::int64_t, int> by_number_;
};

}  // namespace waymark
