#pragma once

#include "waymark/app/common/report_fields.hpp"
#include "waymark/mapping/solver/changed_tags.hpp"

/// Tags that were moved, taken away or hidden, in the reports of laps, scenes and videos.
namespace waymark {

[[nodiscard]] ReportFields fields(const MovedTag& moved);
[[nodiscard]] ReportFields fields(const MissingTag& missing);

}  // namespace waymark
