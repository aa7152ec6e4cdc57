#include "waymark/app/common/changed_tag_fields.hpp"

#include "waymark/base/angles.hpp"

namespace waymark {

ReportFields fields(const MovedTag& moved) {
  return {{"tag", "Tag", to_string(moved.tag)},
          {"distance_m", "Distance between its two places", moved.distance_m},
          {"angle_deg", "Angle between its two poses", to_degrees(moved.angle_rad)},
          {"last_before_s", "Last observation before the move, since the first frame", moved.last_before_s},
          {"first_after_s", "First observation after the move, since the first frame", moved.first_after_s}};
}

ReportFields fields(const MissingTag& missing) {
  return {
      {"tag", "Tag", to_string(missing.tag)},
      {"expected_images", "Images after its last observation that should show it", missing.expected_images},
      {"passes", "Passes with these images", missing.passes},
      {"last_seen_s", "Its last observation since the first frame; null if the recording has none",
       missing.last_seen_s}};
}

}  // namespace waymark
