#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/shell_word.hpp"
#include "waymark/app/teach/teach_lap.hpp"

namespace waymark {
namespace {

nlohmann::ordered_json links_json(const TeachSummary& summary) {
  auto links = nlohmann::ordered_json::array();
  for (const TagLink& link : summary.weak_links)
    links.push_back({{"tags", {to_string(link.first), to_string(link.second)}}, {"frames", link.frames}});
  return links;
}

}  // namespace

std::string to_text(const TeachReport& report, const std::string& file, bool loop) {
  const TeachSummary& s = report.summary;
  std::string text = fmt::format(
      "{}: {:.1f} s, {:.2f} m by odometry, {} frames\n"
      "{} tags seen, {} detections, two or more in view {:.1f} % of the time ({} frames with fewer)\n",
      file, report.end.lap_s, s.distance_m, s.frames, s.seen.size(), s.detections,
      100 * s.two_tags_fraction(), s.low_observability_frames);
  if (s.closed_loop || loop)
    text += s.closed_loop ? "The loop is closed: the anchor was seen at the start and again at the end.\n"
                          : "The loop is not closed.\n";
  if (!s.seen.empty()) {
    const auto fewest = std::ranges::min_element(s.seen, {}, [](const auto& seen) { return seen.second; });
    text += fmt::format("Every tag was seen in {} frames or more ({} in fewest).\n", fewest->second,
                        to_string(fewest->first));
  }
  if (s.seen.empty()) return text + "No tag was seen: there is nothing to make a map of.\n";
  text += s.mappable ? fmt::format("The lap can be mapped: waymark map {} -o map\n", shell_word(file))
                     : "As it is the lap makes no good map: the warnings say what it lacks. `waymark map` "
                       "makes of it what it can.\n";
  return text;
}

nlohmann::ordered_json to_json(const TeachReport& report, const std::string& file) {
  const TeachSummary& s = report.summary;
  return {{"file", file},
          {"wall_s", report.wall_s},
          {"lap_s", report.end.lap_s},
          {"frames", s.frames},
          {"detections", s.detections},
          {"tags", s.seen.size()},
          {"low_observability_frames", s.low_observability_frames},
          {"two_tags_fraction", s.two_tags_fraction()},
          {"longest_blind_s", s.longest_blind_s},
          {"longest_silence_s", s.longest_silence_s},
          {"clock_back_s", s.clock_back_s},
          {"odometry_jumps", s.odometry_jumps},
          {"distance_m", s.distance_m},
          {"worst_blur_px", report.worst_blur_px},
          {"blurred_frames", report.blurred_frames},
          {"abrupt_moments", report.abrupt_moments},
          {"weak_links", links_json(s)},
          {"closed_loop", s.closed_loop},
          {"mappable", s.mappable},
          {"finished", report.end.finished},
          {"warnings", s.warnings}};
}

}  // namespace waymark
