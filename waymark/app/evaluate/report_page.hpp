#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/lap_input.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/evaluation/recording_profile.hpp"
#include "waymark/plot/page.hpp"
#include "waymark/samples/route.hpp"
#include "waymark/samples/trajectory.hpp"

/// Inputs for a report and its figures.
namespace waymark {

/// One recording.
struct DriveRun {
  std::string file{};
  RecordedLap lap{};
  EstimatedTrajectory estimate{};             ///< empty if the recording contains none
  std::optional<RecordingProfile> profile{};  ///< empty if the speeds are unknown
};

/// One map and the other files in its folder.
struct MapRun {
  std::filesystem::path folder{};
  MapFile map{};
  std::optional<Route> route{};
  Trajectory trajectory{};  ///< trajectory for the map's lap; empty if missing
};

struct Runs {
  std::vector<DriveRun> drives{};  ///< in the given order, or oldest first if read from a folder
  std::vector<MapRun> maps{};
  std::vector<std::string> warnings{};
};

/// Reads the runs at the given paths. Each path is a recording, a map folder, or a folder with recordings and
/// optionally a map/ folder, as written by `waymark demo`. Fails if a file is of any other kind or
/// unreadable.
[[nodiscard]] Result<Runs> read_runs(const std::vector<std::string>& paths, const JobControl& control);

/// The drive from which a map was made, if it is among the runs (map.yaml contains the name of its
/// recording).
[[nodiscard]] const DriveRun* drive_of(const MapRun& map, const Runs& runs);

/// The report. It has one section for each drive and each map, and one that compares the drives. Fails if the
/// runs contain nothing to show.
[[nodiscard]] Result<plot::Page> report_page(const Runs& runs, const JobControl& control);

struct ReportSummary {
  std::size_t sections = 0;
  std::size_t bytes = 0;
};

struct ReportJob {
  std::vector<std::string> runs{};  ///< see read_runs()
  std::string output = "report.html";
  bool force = false;  ///< whether files that are not reports may be replaced as well

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.runs,
          JobField("runs RUN ...",
                   "Recordings, map folders, or a demo folder; all drives are compared with the first one")
              .input()
              .required());
    visit(self.output, JobField("output FILE", "HTML file to write"));
    visit(self.force, JobField("force", "Replace a file that was not written by `waymark report`"));
  }
};

/// The page as HTML, with all text converted by JobControl::for_users.
[[nodiscard]] Result<std::string> html_of(const plot::Page& page, const JobControl& control);

/// Writes the report on the given paths to an HTML file. An older report is replaced; any other file is only
/// replaced if `force` is set.
[[nodiscard]] Result<ReportSummary> write_report(const std::vector<std::string>& paths,
                                                 const std::filesystem::path& output, bool force,
                                                 const JobControl& control);

/// The figures on a page, in order. If two figures have the same name, the second is called NAME_2. The
/// caption is the title of the section.
[[nodiscard]] std::vector<plot::PageFigure> figures_of(const plot::Page& page);

/// The sections of the page.
[[nodiscard]] plot::PageSection drive_section(const DriveRun& drive);
[[nodiscard]] plot::PageSection map_section(const MapRun& map, const DriveRun* drive,
                                            const JobControl& control);
/// Empty if there are fewer than two drives.
[[nodiscard]] std::optional<plot::PageSection> comparison_section(const Runs& runs);
/// One row per drive, with values that need no ground truth, for comparing simulation with reality.
[[nodiscard]] plot::PageTable side_by_side(const Runs& runs);
/// Rates, gaps, latencies and noise, with one column per drive, all measured in the same way. There are no
/// rows if fewer than two drives could be measured.
[[nodiscard]] plot::PageTable sensors_side_by_side(const Runs& runs);

}  // namespace waymark
