#pragma once

#include "waymark/app/common/report_fields.hpp"
#include "waymark/mapping/solver/tag_sizes.hpp"

namespace waymark {

/// A tag whose given size contradicts the observations, in the reports of laps, scenes and videos.
[[nodiscard]] ReportFields fields(const WrongSize& size);

}  // namespace waymark
