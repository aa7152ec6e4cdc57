#include "waymark/mapping/scene/moved_tags.hpp"

#include <algorithm>

namespace waymark {

ObservationTimes times_of(const SceneRecording& recording, const SceneObservations& observations) {
  ObservationTimes times{.min_move_s = 0.5};
  times.frames.reserve(observations.seen.size());
  for (const SceneObservation& seen : observations.seen) times.frames.push_back(seen.frame);
  times.frame_s.reserve(recording.frames.size());
  for (const SceneFrame& frame : recording.frames)
    times.frame_s.push_back(to_seconds(frame.stamp - recording.frames.front().stamp));
  return times;
}

SeparatedTag separate_earlier(SceneMap& map, const ObservationTimes& times, const LikelyMove& move) {
  const SeparatedTag tag = separate_earlier(map.problem.bundle, map.placed, times, move);
  map.problem.moves.push_back(0);
  return tag;
}

MovedTag describe_move(const SceneMap& map, const ObservationTimes& times, const SeparatedTag& separated) {
  TagId id;
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
    const SceneObservation& seen = map.observations.seen[i];
    if (map.problem.bundle.corners[i].tag == separated.later)
      id = map.scene.bodies[seen.body].tags[seen.tag].id;
  }
  return describe_move(map.problem.bundle, times, separated, id);
}

const MovedTag* find_moved(const SceneMap& map, const TagId& tag) {
  const auto moved = std::ranges::find(map.moved_tags, tag, &MovedTag::tag);
  return moved == map.moved_tags.end() ? nullptr : &*moved;
}

}  // namespace waymark
