#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// A landmark in a known map: a tag, or a numbered point.
struct Landmark {
  TagId tag{};      ///< if the landmark is not a tag, only the number is used
  SE3 map_T_tag{};  ///< in the level frame on the floor (map_T_floor()); for a point, the rotation is unused
  bool oriented = true;      ///< if false, only the position is known
  bool family_known = true;  ///< if false, a tag of any family with this number matches
  double size_m = 0;         ///< 0 if unknown
  /// Covariance of (position along map axes [m], rotation about its own centre along map axes [rad]).
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  /// Covariance given the position of the tag to which this one is tied, which excludes errors that are
  /// common to both. Equals `covariance` if the map does not contain a tie for this tag.
  Eigen::Matrix<double, 6, 6> own_covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// A point in the map without orientation: number, x and y.
struct LandmarkPoint {
  std::int64_t number = 0;
  Eigen::Vector2d map_p = Eigen::Vector2d::Zero();
};

/// The landmarks in one map, which can be looked up by number. Immutable.
class Landmarks {
 public:
  Landmarks() = default;
  /// Levels the map: positions are in the frame in which the floor is z = 0.
  explicit Landmarks(const TagMap& map);
  /// Fails if a number is duplicated or a position is not finite.
  [[nodiscard]] static Result<Landmarks> of_points(const std::vector<LandmarkPoint>& points);

  /// Index of the tag; -1 if it is not in the map or belongs to another family. O(1).
  [[nodiscard]] int find(const TagId& tag) const;
  [[nodiscard]] int find(std::int64_t number) const;
  [[nodiscard]] const Landmark& operator[](int index) const { return all_[static_cast<std::size_t>(index)]; }
  [[nodiscard]] int size() const { return static_cast<int>(all_.size()); }
  [[nodiscard]] const std::vector<Landmark>& all() const { return all_; }

  /// Pairs of tags that cannot both be where the map places them, because they are closer together than half
  /// their sizes [m].
  [[nodiscard]] std::vector<std::pair<int, int>> overlapping() const;

 private:
  void add(const Landmark& landmark);
  std::vector<Landmark> all_;
  std::unordered_multimap<std::int64_t, int> by_number_;
};

}  // namespace waymark
