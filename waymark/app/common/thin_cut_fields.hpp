#pragma once

#include <string_view>
#include <vector>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/mapping/solver/thin_cuts.hpp"

namespace waymark {

inline constexpr std::string_view kThinCutsHelp =
    "Parts of the map that depend on few observations, largest first";

/// A part of a map of tags from one family, in the reports of scenes.
[[nodiscard]] ReportFields fields(const TagCut& cut);

/// A part of a map of tags from any family, in the reports of laps and videos.
struct NamedTagCut {
  TagCut cut{};
};
[[nodiscard]] ReportFields fields(const NamedTagCut& named);
[[nodiscard]] std::vector<NamedTagCut> named_cuts(const std::vector<TagCut>& cuts);

}  // namespace waymark
