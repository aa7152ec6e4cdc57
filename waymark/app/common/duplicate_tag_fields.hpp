#pragma once

#include "waymark/app/common/report_fields.hpp"
#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// Two tags with one id, in the reports of scenes and videos.
[[nodiscard]] ReportFields fields(const DuplicateTag& duplicate);

}  // namespace waymark
