#pragma once

#include <string_view>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

inline constexpr std::string_view kDuplicateIdsHelp =
    "Ids that two tags carry, with one entry per tag that is not in the map";

/// Two tags with one id, in the reports of scenes and videos.
[[nodiscard]] ReportFields fields(const DuplicateTag& duplicate);

}  // namespace waymark
