#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/families/family.hpp"
#include "waymark/geometry/se2.hpp"

namespace waymark {

/// One point of a route.
struct RoutePoint {
  SE2 map_T_base{};  ///< x points in the robot's forward direction: backwards along the route if it reverses
  double arc_length_m = 0;   ///< distance driven since the first point; strictly increasing
  double curvature_1_m = 0;  ///< turn of the robot per distance, positive to the left
  double speed_m_s = 0;      ///< reference speed; negative if the robot reverses
};

/// A place on a route where the robot stops for some time and then continues automatically.
struct Station {
  std::string name{};
  double arc_length_m = 0;
  double pause_s = 0;
};

/// A tag that identifies the map of a route.
struct RouteTag {
  TagId tag{};
  double x_m = 0;  ///< in map
  double y_m = 0;
};

/// A path to drive, with points in order of arc length. Closed: the first point follows the last, `length_m`
/// after the start.
struct Route {
  std::vector<RoutePoint> points{};
  bool closed = false;
  double length_m = 0;
  /// The longest segment in which no map tag was seen during teaching; nothing if unknown.
  std::optional<double> longest_without_tags_m{};
  std::vector<RouteTag> map_tags{};  ///< some tags of the map to which the route belongs; empty: unknown
  std::vector<Station>
      stations{};  ///< in order of arc length; on a closed route, stops are made in every lap
};

}  // namespace waymark
