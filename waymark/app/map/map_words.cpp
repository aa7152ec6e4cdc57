#include "waymark/app/map/map_words.hpp"

namespace waymark {

Result<MapSceneJob> described_scene(const MapWords& words, const SearchOptions& search) {
  MapSceneJob job = words.scene;
  job.recording = words.job.lap;
  job.folder = words.job.folder;
  if (Status status = describe_scene(words.model, words.free_intrinsics, job); !status)
    return tl::unexpected(status.error());
  job.options.search = search;
  return job;
}

Status check_effects(const MapWords& words, const GivenFlags& given) {
  if (words.job.lap.empty())
    return fail(ErrorCode::InvalidArgument, "LAP is required: a recording, or the verb 'convert'");
  if (words.job.folder.empty()) return fail(ErrorCode::InvalidArgument, "--output is required");
  if (!words.scene.tagslam.empty()) return {};
  const char* of_scenes = "this is about scenes that TagSLAM's files describe";
  const char* tagslam = "Give their folder with --tagslam, or leave it out.";
  FlagRefusals refused(given);
  refused.flags(words.model != "waymark", {"--model"}, of_scenes, tagslam);
  refused.flags(true, {"--against", "--free-intrinsics"}, of_scenes, tagslam);
  refused.flags(words.of.extend.empty(), {"--map-sigma"}, "this is about the map that a lap extends",
                "Give it with --extend.");
  return refused.status();
}

}  // namespace waymark
