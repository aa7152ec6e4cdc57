#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/families/family.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark {

/// Cross-covariance between the errors of two tags in a map.
struct TagTie {
  TagId to{};
  /// 6x6, with rows for this tag and columns for the other, each in its left tangent space in the map frame
  /// [m, rad].
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// One tag in a map.
struct MappedTag {
  SE3 map_T_tag{};    ///< tag frame: centre, x right, y down, z into the tag
  double size_m = 0;  ///< side of the square where the black border meets the white border
  /// 6x6 covariance of map_T_tag in the left tangent space (translation, rotation) [m, rad], expressed in the
  /// map frame; empty if unknown (or surveyed exactly).
  std::optional<Eigen::Matrix<double, 6, 6>> covariance{};
  /// Tie to the most informative other tag in the map; ties form no cycles. Empty if unknown.
  std::optional<TagTie> tie{};
};

/// The floor on which a robot drives: the plane of all points p with normal . (p - (0, 0, z_m)) = 0.
struct FloorPlane {
  double z_m = 0;                                     ///< height at the map's origin
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< upwards, of length 1; z is not 0
  /// Covariance of (z_m, rotation about x, rotation about y) [m, rad]; empty if unknown.
  std::optional<Eigen::Matrix3d> covariance{};
};

/// The frame whose plane z = 0 is the floor. It is rotated from the map by the smallest rotation that makes
/// the floor level. Its origin is on the floor, at x = y = 0 in a level map.
[[nodiscard]] SE3 map_T_floor(const FloorPlane& floor);

/// The poses of the tags, ordered by id so that results computed from a map have a fixed order.
struct TagMap {
  std::map<TagId, MappedTag> tags{};
  FloorPlane floor{};  ///< the floor on which the robot drives; the anchor's centre may be the origin

  /// The tag, or nullptr if it is not in the map. O(log n).
  [[nodiscard]] const MappedTag* find(const TagId& tag) const {
    const auto it = tags.find(tag);
    return it == tags.end() ? nullptr : &it->second;
  }
};

/// The names of the tag families to search for in images, sorted and without duplicates. O(n).
[[nodiscard]] std::vector<std::string> families_of(const TagMap& map);

}  // namespace waymark
