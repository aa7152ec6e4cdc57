// Positions of the robot in a recording, from the tags of a map: waymark_localize RECORDING MAP_FOLDER
#include <cstdio>

#include "waymark/app/localize/localize_log.hpp"

int fail(const waymark::Error& error) {
  std::fprintf(stderr, "%s\n", waymark::to_string(error).c_str());
  return 1;
}

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: waymark_localize RECORDING MAP_FOLDER\n"), 2;
  // [quoted by docs/howto/cpp.md]
  const auto inputs = waymark::read_localize_inputs({.logs = {argv[1]}, .map = argv[2]}, {});
  if (!inputs) return fail(inputs.error());
  auto localizer = waymark::Localizer::make(inputs->setup);
  if (!localizer) return fail(localizer.error());
  for (const waymark::Sample& sample : inputs->samples) {
    localizer->add(sample);
    const auto estimate = localizer->estimate();
    if (!estimate || !estimate->certain || !std::holds_alternative<waymark::TagFrame>(sample)) continue;
    const auto& at = estimate->map_T_base;
    std::printf("%.3f s: x %.3f m, y %.3f m, yaw %.3f rad\n",
                waymark::to_seconds(estimate->stamp.time_since_epoch()), at.x(), at.y(), at.yaw());
  }
  // [end]
}
