#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/families/family.hpp"
#include "waymark/geometry/se2.hpp"

namespace waymark {

/// One point of a route.
struct RoutePoint {
  SE2 map_T_base{};  ///< x points in the robot's forward direction: along the route or, if it reverses,
                     ///< opposite to it, unless it was taught sideways
  double arc_length_m = 0;   ///< distance driven since the first point; strictly increasing
  double curvature_1_m = 0;  ///< turn of the robot per distance; positive to the left
  double speed_m_s = 0;      ///< reference speed; negative if the robot reverses
};

/// A place on a route where the robot stops for some time and then continues automatically.
struct Station {
  std::string name{};
  double arc_length_m = 0;
  double pause_s = 0;
};

/// A tag by which the map of a route is identified.
struct RouteTag {
  TagId tag{};
  double x_m = 0;  ///< in the map frame
  double y_m = 0;
};

/// A path to drive, with points in order of arc length. If closed, the first point follows the last,
/// `length_m` after the start.
struct Route {
  std::vector<RoutePoint> points{};
  bool closed = false;
  double length_m = 0;
  /// Length of the longest segment without a visible map tag during teaching; empty if unknown.
  std::optional<double> longest_without_tags_m{};
  std::vector<RouteTag> map_tags{};  ///< some tags of the route's map; empty if unknown
  std::vector<Station>
      stations{};  ///< in order of arc length; on a closed route, the robot stops there in every lap
};

}  // namespace waymark
