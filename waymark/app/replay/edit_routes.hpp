#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/samples/route.hpp"

/// `waymark routes`: the routes of a map's folder, and where the robot pauses on them.
namespace waymark {

struct RoutesJob {
  std::string folder{};  ///< that `waymark map` wrote
  /// This route alone; nothing: all of them, or where a station changes the taught one.
  std::optional<std::string> route{};
  std::string station{};            ///< put on the route, or moved
  std::optional<double> at_m{};     ///< where: along the route …
  std::string at_tag{};             ///< … or nearest to this tag
  std::optional<double> pause_s{};  ///< nothing: 5 s, or what a station that is moved had
  std::string remove{};             ///< a station

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.folder, JobField("folder MAP", "Folder that `waymark map` wrote").input().required());
    visit(self.route, JobField("route NAME",
                               "Name of the route to list or edit. Unless given: the taught route for "
                               "stations, all routes for the list"));
    visit(self.station,
          JobField("station NAME",
                   "Name of a station, a place where the robot stops for a while, to add or move"));
    visit(self.at_m, JobField("at_m FLOAT", "Position of the station along the route, in metres", 0.0, 1e6));
    visit(self.at_tag,
          JobField("at_tag TAG", "Tag whose nearest point of the route is the position of the station"));
    visit(self.pause_s,
          JobField("pause_s FLOAT",
                   "Duration of the stop at the station; a station that is moved keeps its duration", 0.0,
                   86400.0)
              .usually("5"));
    visit(self.remove, JobField("remove_station NAME", "Name of a station to remove"));
  }
};

struct NamedRoute {
  std::string name{};  ///< empty: the taught one
  Route route{};
};
using NamedRoutes = std::vector<NamedRoute>;

/// The routes that are asked for, after the change that is asked for was written.
[[nodiscard]] Result<NamedRoutes> edit_routes(const RoutesJob& job);
[[nodiscard]] std::string to_text(const NamedRoute& named);
[[nodiscard]] ReportFields fields(const NamedRoute& named);
[[nodiscard]] ReportFields fields(const Station& station);

}  // namespace waymark
