// Time and memory of mapping a generated place by size: a table, and the exponent between the smallest and
// the largest. A lap with wheel odometry past signs; a walk through aisles, or below a ceiling of tags,
// without odometry: 20 tags per image, or 37 for a high ceiling.
//
// usage: warehouse_mapping [lap|aisles|ceiling|high-ceiling] [TAGS ...]      default: lap 250 500 1000 2000
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include <sys/resource.h>

#include "tests/support/tag_scenes.hpp"
#include "tests/support/warehouse.hpp"
#include "waymark/mapping/lap/map_checks.hpp"
#include "waymark/mapping/scene/scene_map.hpp"
#include "waymark/mapping/scene/scene_report.hpp"

namespace {

double cpu_s() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

double peak_mib() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  return static_cast<double>(used.ru_maxrss) / 1024;
}

struct Row {
  double detections = 0, seconds = 0;
};

/// Prints the duration of each stage of a search.
class Stages {
 public:
  bool operator()(const std::string& name, int /*iteration*/, double /*cost*/) {
    if (name != stage_) end();
    stage_ = name;
    ++steps_;
    return true;
  }
  void end() {
    std::printf("  %-24s %7.1f s %4d steps\n", stage_.c_str(), cpu_s() - since_, steps_);
    since_ = cpu_s();
    steps_ = 0;
  }

 private:
  std::string stage_ = "start";
  double since_ = cpu_s();
  int steps_ = 0;
};

void report(int tags, std::size_t frames, const Row& row, std::size_t mapped, double worst_m,
            std::size_t warnings) {
  std::printf(
      "%6d tags %7zu frames %8.0f detections: %7.1f s, %6.0f MiB so far, %zu mapped, worst %.2f m, %zu "
      "warnings\n",
      tags, frames, row.detections, row.seconds, peak_mib(), mapped, worst_m, warnings);
  std::fflush(stdout);
}

bool failed(const waymark::Error& error) {
  std::fprintf(stderr, "%s\n", to_string(error).c_str());
  return false;
}

bool measure_lap(int tags, std::vector<Row>& rows) {
  using namespace waymark;
  const test::Warehouse house = test::drive_warehouse(
      {.tags = tags, .frame_m = 0.0395, .farthest_m = 5.9});  // 10 frames, 100 detections per tag
  const double begin = cpu_s();
  Stages stages;
  const auto map = map_by_bundle(house.lap, {}, {}, std::ref(stages));
  if (!map) return failed(map.error());
  stages.end();
  const std::size_t warnings = check_map(house.lap, *map).size();
  rows.push_back({static_cast<double>(house.detections), cpu_s() - begin});
  double worst = 0;
  for (const auto& [id, tag] : map->map.tags)
    worst = std::max(worst,
                     (tag.map_T_tag.translation() - house.truth.tags.at(id).map_T_tag.translation()).norm());
  report(tags, house.lap.frames.size(), rows.back(), map->map.tags.size(), worst, warnings);
  return true;
}

bool measure_scene(const waymark::test::WideScene& wide, int tags, std::vector<Row>& rows) {
  using namespace waymark;
  const double begin = cpu_s();
  Stages stages;
  const auto map = map_scene(wide.scene, wide.recording, {}, std::ref(stages));
  if (!map) return failed(map.error());
  stages.end();
  const std::size_t warnings = scene_warnings(*map).size();
  rows.push_back({static_cast<double>(wide.detections), cpu_s() - begin});
  double worst = 0;
  std::size_t mapped = 0;
  for (std::size_t t = 0; t < map->scene.bodies[0].tags.size(); ++t) {
    const auto map_T_tag = map->map_T_tag(0, t);
    if (!map_T_tag) continue;
    const SE3& truth = wide.truth.at(map->scene.bodies[0].tags[t].id.number);
    worst = std::max(worst, (map_T_tag->translation() - truth.translation()).norm());
    ++mapped;
  }
  report(tags, wide.recording.frames.size(), rows.back(), mapped, worst, warnings);
  return true;
}

bool measure(const std::string& shape, int tags, std::vector<Row>& rows) {
  using namespace waymark;
  if (shape == "aisles") return measure_scene(test::aisles(tags, 1), tags, rows);
  if (shape == "ceiling") return measure_scene(test::ceiling(tags, 1), tags, rows);
  constexpr double kHighM = 3.4;
  if (shape == "high-ceiling") return measure_scene(test::ceiling(tags, 1, 0.2, kHighM), tags, rows);
  return shape == "lap" && measure_lap(tags, rows);
}

}  // namespace

int main(int argc, char** argv) {
  std::string shape = "lap";
  std::vector<int> sizes;
  for (int i = 1; i < argc; ++i) {
    if (std::isdigit(static_cast<unsigned char>(argv[i][0])) != 0)
      sizes.push_back(std::atoi(argv[i]));
    else
      shape = argv[i];
  }
  if (sizes.empty()) sizes = {250, 500, 1000, 2000};
  std::vector<Row> rows;
  for (int tags : sizes) {
    if (tags < 1 || !measure(shape, tags, rows)) return 1;
  }
  if (rows.size() > 1)
    std::printf("exponent of time over detections: %.2f\n",
                std::log(rows.back().seconds / rows.front().seconds) /
                    std::log(rows.back().detections / rows.front().detections));
  return 0;
}
