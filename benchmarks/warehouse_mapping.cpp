// Time and memory of mapping a generated warehouse against its size: a table, and the exponent between the
// smallest and the largest.
//
// usage: warehouse_mapping [TAGS ...]      usual: 250 500 1000 2000
#include <sys/resource.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "tests/support/warehouse.hpp"
#include "waymark/mapping/lap/map_checks.hpp"

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

bool measure(int tags, std::vector<Row>& rows) {
  using namespace waymark;
  const test::Warehouse house = test::drive_warehouse(
      {.tags = tags, .frame_m = 0.0395, .farthest_m = 5.9});  // 10 frames, 100 detections a tag
  const double begin = cpu_s();
  std::string stage = "start";
  double since = begin;
  int steps = 0;
  const auto stage_ends = [&] {
    std::printf("  %-24s %7.1f s %4d steps\n", stage.c_str(), cpu_s() - since, steps);
    since = cpu_s();
    steps = 0;
  };
  const auto progress = [&](const std::string& name, int, double) {
    if (name != stage) {
      stage_ends();
      stage = name;
    }
    ++steps;
    return true;
  };
  const auto map = map_by_bundle(house.lap, {}, {}, progress);
  if (!map) {
    std::fprintf(stderr, "%s\n", to_string(map.error()).c_str());
    return false;
  }
  stage_ends();
  const std::size_t said = check_map(house.lap, *map).size();
  const double seconds = cpu_s() - begin;
  double worst = 0;
  int fewest = 0;
  for (const auto& [id, tag] : map->map.tags) {
    const double off = (tag.map_T_tag.translation() - house.truth.tags.at(id).map_T_tag.translation()).norm();
    if (off > worst) fewest = map->observations.at(id);
    worst = std::max(worst, off);
  }
  std::printf(
      "%6d tags %7zu frames %8zu detections: %7.1f s, %6.0f MiB so far, %zu mapped, worst %.2f m (seen %d "
      "times), %zu said\n",
      tags, house.lap.frames.size(), house.detections, seconds, peak_mib(), map->map.tags.size(), worst,
      fewest, said);
  std::fflush(stdout);
  rows.push_back({static_cast<double>(house.detections), seconds});
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<int> sizes;
  for (int i = 1; i < argc; ++i) sizes.push_back(std::atoi(argv[i]));
  if (sizes.empty()) sizes = {250, 500, 1000, 2000};
  std::vector<Row> rows;
  for (int tags : sizes) {
    if (tags < 1 || !measure(tags, rows)) return 1;
  }
  if (rows.size() > 1)
    std::printf("exponent of time over detections: %.2f\n",
                std::log(rows.back().seconds / rows.front().seconds) /
                    std::log(rows.back().detections / rows.front().detections));
  return 0;
}
