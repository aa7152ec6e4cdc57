#pragma once

#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/plot/annotate.hpp"
#include "waymark/pose/tag_pose.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {

/// What poses need: the camera and the sizes of the tags.
struct PoseSetup {
  CameraModel camera;
  TagSizes sizes{};
};

/// "0.16" for all tags, "tag36h11:7=0.08" (or "7=0.08" for tag36h11) for one; several of them.
[[nodiscard]] Result<TagSizes> parse_tag_sizes(const std::vector<std::string>& words);

/// The pose of each detection, in their order; an error where there is none (size unknown, corners beyond the
/// lens …).
using PoseList = std::vector<Result<TagPose>>;

[[nodiscard]] PoseList poses_of(std::span<const TagDetection> detections, const PoseSetup& setup);

/// The keys "pose" and "pose_error" of docs/reference/cli.md.
void add_to_json(nlohmann::ordered_json& detection, const Result<TagPose>& pose);

/// The axes of each tag, half a side long, where the camera sees them.
[[nodiscard]] std::vector<plot::FrameAxes> axes_of(std::span<const TagDetection> detections,
                                                   const PoseList& poses, const PoseSetup& setup);

}  // namespace waymark
