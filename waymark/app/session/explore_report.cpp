#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/session/explore_world.hpp"

namespace waymark {

std::string to_text(const ExploreReport& r) {
  std::string text = fmt::format("{:.0f} s, {:.1f} m, {} turns; {} of {} tags seen\n", r.seconds,
                                 r.distance_m, r.turns, r.seen.size(), r.tags);
  text += fmt::format("{} collisions, ", r.collisions);
  text += std::isfinite(r.nearest_m)
              ? fmt::format("nearest to anything {:.3f} m from the hull\n", r.nearest_m)
              : "nothing in this world to come near to\n";
  if (!r.position_rmse_m) return text + "the place was never known\n";
  return text + fmt::format(
                    "the place was known {:.1f} % of the time; then by the truth:\n"
                    "  position  {:.3f} m rmse, {:.3f} m 95 %, {:.3f} m worst\n"
                    "  heading   {:.2f} deg rmse\n",
                    100 * r.certain_fraction, *r.position_rmse_m, *r.position_p95_m, *r.position_max_m,
                    *r.heading_rmse_deg);
}

nlohmann::ordered_json to_json(const ExploreReport& r) {
  const auto number = [](const std::optional<double>& value) -> nlohmann::ordered_json {
    if (!value) return nullptr;
    return *value;
  };
  return {{"seconds", r.seconds},
          {"distance_m", r.distance_m},
          {"turns", r.turns},
          {"tags_seen", r.seen},
          {"tags", r.tags},
          {"collisions", r.collisions},
          {"nearest_m", r.nearest_m},
          {"certain_fraction", r.certain_fraction},
          {"position_rmse_m", number(r.position_rmse_m)},
          {"position_p95_m", number(r.position_p95_m)},
          {"position_max_m", number(r.position_max_m)},
          {"heading_rmse_deg", number(r.heading_rmse_deg)},
          {"stands", r.stands},
          {"wall_s", r.wall_s}};
}

}  // namespace waymark
