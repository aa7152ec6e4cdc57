#pragma once

#include "waymark/app/common/report_fields.hpp"
#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// A tag that was moved during the recording, in the reports of scenes and videos.
[[nodiscard]] ReportFields fields(const MovedTag& moved);

}  // namespace waymark
