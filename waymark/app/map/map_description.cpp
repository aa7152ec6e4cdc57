#include "waymark/app/map/map_description.hpp"

#include <utility>

#include "waymark/app/common/poses.hpp"
#include "waymark/app/map/anchor_words.hpp"
#include "waymark/app/map/map_steps.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/world_file.hpp"

namespace waymark {

Status describe_map(const MapDescription& of, MapJob& job) {
  const Result<MapMethod> method = parse_map_method(of.method);
  if (!method) return tl::unexpected(method.error());
  job.options.method = *method;
  if (!of.extend.empty() && (!of.anchor.empty() || !of.anchor_pose.empty()))
    return fail(ErrorCode::InvalidArgument, "the map that is extended says where its tags stand",
                {.key = of.anchor.empty() ? "--anchor-pose" : "--anchor"}, "Leave it out.");
  const auto sizes = parse_tag_sizes(of.tag_sizes);
  if (!sizes) return tl::unexpected(sizes.error());
  const auto overrides =
      overrides_of({.anchor = of.anchor, .anchor_pose = of.anchor_pose, .tag_size_m = sizes->default_size_m});
  if (!overrides) return tl::unexpected(overrides.error());
  job.overrides = *overrides;
  job.overrides.size_by_tag_m = sizes->size_by_tag_m;
  if (of.world.empty()) return {};
  const auto path = find_shared("worlds", of.world);
  if (!path) return tl::unexpected(path.error());
  Result<World> truth = read_world(*path);
  if (!truth) return tl::unexpected(truth.error());
  job.truth = std::move(*truth);
  return {};
}

Status read_described_maps(const MapDescription& of, MapJob& job) {
  if (!of.prior.empty()) {
    Result<LandmarksFile> older = read_landmarks(of.prior, job.overrides.tag_size_m);
    if (!older) return tl::unexpected(older.error());
    job.prior = std::move(*older);
  }
  return read_extension(of.extend, of.route_name, of.freeze, of.remove, job);
}

}  // namespace waymark
