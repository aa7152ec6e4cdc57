#pragma once

#include "waymark/app/common/report_fields.hpp"
#include "waymark/mapping/scene/scene_map.hpp"

namespace waymark {

/// A tag whose given size contradicts the observations, in the reports of scenes and videos.
[[nodiscard]] ReportFields fields(const WrongSize& size);

}  // namespace waymark
