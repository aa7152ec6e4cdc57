#include "waymark/app/common/moved_tag_fields.hpp"

#include "waymark/base/angles.hpp"

namespace waymark {

ReportFields fields(const MovedTag& moved) {
  return {{"tag", "Tag", to_string(moved.tag)},
          {"distance_m", "Distance between its two places", moved.distance_m},
          {"angle_deg", "Angle between its two poses", to_degrees(moved.angle_rad)},
          {"last_before_s", "Last observation before the move, since the first frame", moved.last_before_s},
          {"first_after_s", "First observation after the move, since the first frame", moved.first_after_s}};
}

}  // namespace waymark
