// A map of the tags and a route from a recorded lap: waymark_map RECORDING MAP_FOLDER
#include <cstdio>

#include "waymark/app/map/map_recording.hpp"

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: waymark_map RECORDING MAP_FOLDER\n"), 2;
  // [quoted by docs/howto/cpp.md]
  waymark::JobControl control;
  control.progress = [](const waymark::JobProgress& now) { std::fprintf(stderr, "%s\n", now.text.c_str()); };
  const auto report = waymark::map_recording({.lap = argv[1], .folder = argv[2]}, control);
  if (!report) {
    std::fprintf(stderr, "%s\n", waymark::to_string(report.error()).c_str());
    return 1;
  }
  for (const auto& [id, tag] : report->lap.map.tags) {
    const auto& p = tag.map_T_tag.translation();
    std::printf("%s: %.3f %.3f %.3f m\n", waymark::to_string(id).c_str(), p.x(), p.y(), p.z());
  }
  std::printf("route: %.2f m\n", report->lap.route.length_m);
  // [end]
}
