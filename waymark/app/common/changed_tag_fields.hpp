#pragma once

#include <string_view>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/mapping/solver/changed_tags.hpp"

/// Tags that were moved, taken away or hidden, in the reports of laps, scenes and videos.
namespace waymark {

inline constexpr std::string_view kMovedTagsHelp =
    "Tags that were moved during the recording; the map has their last pose";
inline constexpr std::string_view kMissingTagsHelp =
    "Tags that were expected in images since their last observation, if any, but observed in none: taken "
    "away or hidden; the map still contains them";

[[nodiscard]] ReportFields fields(const MovedTag& moved);
[[nodiscard]] ReportFields fields(const MissingTag& missing);

}  // namespace waymark
