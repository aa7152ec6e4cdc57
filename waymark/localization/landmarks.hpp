#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// A place that is known and can be recognised: a tag, or a landmark with a number.
struct Landmark {
  TagId tag{};      ///< of a landmark that is no tag: only the number counts
  SE3 map_T_tag{};  ///< in the level frame on the floor (map_T_floor()); a point has a rotation that says
                    ///< nothing
  bool oriented = true;      ///< false: only where it is, is known
  bool family_known = true;  ///< false: any family with this number is meant
  double size_m = 0;         ///< 0: not known
  /// Of (place in map axes [m], turn about its own centre in map axes [rad]).
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  /// The same where the place of the tag that tells most of this one is known: of errors that the two do not
  /// have in common. As `covariance` where the map does not say.
  Eigen::Matrix<double, 6, 6> own_covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// A point of a map without directions: number, x, y.
struct LandmarkPoint {
  std::int64_t number = 0;
  Eigen::Vector2d map_p = Eigen::Vector2d::Zero();
};

/// The known places of one map, found by number. Immutable.
class Landmarks {
 public:
  Landmarks() = default;
  /// Levels the map: places are in the frame whose z = 0 is its floor.
  explicit Landmarks(const TagMap& map);
  /// Fails on a number given twice and on a place that is not finite.
  [[nodiscard]] static Result<Landmarks> of_points(const std::vector<LandmarkPoint>& points);

  /// The index, or -1: not in the map, or of another family. O(1).
  [[nodiscard]] int find(const TagId& tag) const;
  [[nodiscard]] int find(std::int64_t number) const;
  [[nodiscard]] const Landmark& operator[](int index) const { return all_[static_cast<std::size_t>(index)]; }
  [[nodiscard]] int size() const { return static_cast<int>(all_.size()); }
  [[nodiscard]] const std::vector<Landmark>& all() const { return all_; }

  /// Two tags that cannot both be where the map says they are: nearer to each other than half of their sizes
  /// [m]; empty when there are none.
  [[nodiscard]] std::vector<std::pair<int, int>> overlapping() const;

 private:
  void add(const Landmark& landmark);
  std::vector<Landmark> all_;
  std::unordered_multimap<std::int64_t, int> by_number_;
};

}  // namespace waymark
