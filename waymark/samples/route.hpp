#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/families/family.hpp"
#include "waymark/geometry/se2.hpp"

namespace waymark {

/// One point of a route.
struct RoutePoint {
  SE2 map_T_base{};          ///< x where the robot looks: backwards where it reverses
  double arc_length_m = 0;   ///< of the way driven, from the first point; always grows
  double curvature_1_m = 0;  ///< turn of the robot over the way, positive to the left
  double speed_m_s = 0;      ///< reference speed; negative where the robot reverses
};

/// A place of a route where the robot stands for a while and then goes on by itself.
struct Station {
  std::string name{};
  double arc_length_m = 0;
  double pause_s = 0;
};

/// A tag by which the map of a route is recognised.
struct RouteTag {
  TagId tag{};
  double x_m = 0;  ///< in map
  double y_m = 0;
};

/// A path to drive, points in order of arc length. Closed: the first point follows the last, `length_m` after
/// the start.
struct Route {
  std::vector<RoutePoint> points{};
  bool closed = false;
  double length_m = 0;
  /// The longest stretch in which no tag of the map was seen when the route was taught; nothing: not known.
  std::optional<double> longest_without_tags_m{};
  std::vector<RouteTag> map_tags{};  ///< some tags of the map that the route belongs to; empty: not known
  std::vector<Station> stations{};   ///< in order of arc length; on a closed route served in every lap
};

}  // namespace waymark
