#pragma once

#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/cli/pose_flags.hpp"
#include "waymark/plot/annotate.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark::cli {

/// The pose of each detection, in their order; an error where there is none (size unknown, corners beyond the
/// lens …).
using PoseList = std::vector<Result<TagPose>>;

[[nodiscard]] PoseList poses_of(std::span<const TagDetection> detections, const PoseSetup& setup);

/// A table for people: position and distance with standard deviations, both solutions; ends with an end of
/// line.
[[nodiscard]] std::string to_text(std::span<const TagDetection> detections, const PoseList& poses);

/// The keys "pose" and "pose_error" of docs/reference/cli.md.
void add_to_json(nlohmann::ordered_json& detection, const Result<TagPose>& pose);

/// The axes of each tag, half a side long, where the camera sees them.
[[nodiscard]] std::vector<plot::FrameAxes> axes_of(std::span<const TagDetection> detections,
                                                   const PoseList& poses, const PoseSetup& setup);

}  // namespace waymark::cli
