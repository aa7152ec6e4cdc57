#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/samples/route.hpp"

/// `waymark routes`: lists the routes in a map folder and edits their stations.
namespace waymark {

struct RoutesJob {
  std::string folder{};  ///< folder written by `waymark map`
  /// Only this route. If not set, all routes, or the route taught first if a station is edited.
  std::optional<std::string> route{};
  std::string station{};            ///< station to add or move
  std::optional<double> at_m{};     ///< arc length of the station along the route [m]
  std::string at_tag{};             ///< used instead of at_m: the tag nearest to the station
  std::optional<double> pause_s{};  ///< dwell time; defaults to 5 s, or to that of the moved station
  std::string remove{};             ///< station to remove

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.folder, JobField("folder MAP", "Folder that `waymark map` wrote").input().required());
    visit(self.route, JobField("route NAME",
                               "Name of the route to list or edit. Default: the taught route for "
                               "stations, all routes for the list"));
    visit(self.station,
          JobField("station NAME",
                   "Name of the station to add or move; the robot stops there for the dwell time"));
    visit(self.at_m, JobField("at_m FLOAT", "Position of the station along the route, in metres", 0.0, 1e6));
    visit(self.at_tag, JobField("at_tag TAG", "Tag; the station is at the nearest point of the route"));
    visit(self.pause_s,
          JobField("pause_s FLOAT",
                   "Dwell time at the station; a moved station keeps its dwell time by default", 0.0, 86400.0)
              .usually("5"));
    visit(self.remove, JobField("remove_station NAME", "Name of a station to remove"));
  }
};

struct NamedRoute {
  std::string name{};  ///< empty for the route taught first
  Route route{};
};
using NamedRoutes = std::vector<NamedRoute>;

/// Makes the requested change and returns the requested routes.
[[nodiscard]] Result<NamedRoutes> edit_routes(const RoutesJob& job);
[[nodiscard]] std::string to_text(const NamedRoute& named);
[[nodiscard]] ReportFields fields(const NamedRoute& named);
[[nodiscard]] ReportFields fields(const Station& station);

}  // namespace waymark
