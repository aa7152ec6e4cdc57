#include "waymark/pipeline/lap_mapper.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/base/suggest.hpp"
#include "waymark/mapping/teach_chain.hpp"

namespace waymark {
namespace {

constexpr double kManyWithoutPose = 0.02;

void count_observations(const std::vector<ObservedFrame>& frames, MappedLap& lap) {
  for (const ObservedFrame& frame : frames) {
    for (const TagPoseObservation& seen : frame.tags) {
      if (lap.map.find(seen.tag) != nullptr) ++lap.observations[seen.tag];
    }
  }
}

void warn(const ChainResult& chain, MappedLap& lap) {
  for (const TagId& tag : chain.unconnected) {
    lap.warnings.push_back(
        fmt::format("{} was never seen together with a tag that leads to the anchor: it is not in the map",
                    to_string(tag)));
  }
  if (lap.frames_without_pose > kManyWithoutPose * lap.frames) {
    lap.warnings.push_back(
        fmt::format("{} of {} frames saw no tag that could be trusted", lap.frames_without_pose, lap.frames));
  }
  if (!lap.route.closed)
    lap.warnings.emplace_back("the lap does not come back to its start: the route is open, driven once");
}

}  // namespace

std::vector<std::string> map_methods() { return {"chain"}; }

Result<MappedLap> map_lap(const std::vector<TagFrame>& frames, const TeachSetup& setup,
                          const MapLapOptions& options) {
  const std::vector<std::string> methods = map_methods();
  if (std::ranges::find(methods, options.method) == methods.end()) {
    return fail(ErrorCode::InvalidArgument, fmt::format("there is no method '{}'", options.method),
                {.key = "method"}, suggestion(options.method, methods));
  }
  if (frames.empty())
    return fail(ErrorCode::NotFound, "there is no frame of a camera in this lap", {},
                "Is this a recording of tags seen by a camera? `waymark info` shows its topics.");
  std::vector<ObservedFrame> observed;
  observed.reserve(frames.size());
  for (const TagFrame& frame : frames) observed.push_back(observe(frame, setup.camera, setup.sizes));
  Result<ChainResult> chain =
      map_by_chain(observed, setup.anchor, setup.map_T_anchor, setup.sizes, setup.base_T_cam, options.chain);
  if (!chain) return tl::unexpected(chain.error());
  Result<Route> route = build_route(chain->trajectory, options.route);
  if (!route) return tl::unexpected(route.error());
  MappedLap lap{.map = std::move(chain->map),
                .trajectory = std::move(chain->trajectory),
                .route = std::move(*route),
                .frames = static_cast<int>(frames.size()),
                .frames_without_pose = chain->frames_without_pose};
  count_observations(observed, lap);
  warn(*chain, lap);
  return lap;
}

}  // namespace waymark
