// Lost, uncertain, certain: what a look makes of it.
#include <span>

#include "waymark/geometry/uncertainty.hpp"
#include "waymark/localization/tracker.hpp"

namespace waymark {

void Tracker::restart_from(const GivenPose& given) {
  restarts_ += state_.starts > 0 ? 1 : 0;
  filter_.start(given.map_T_base, from_coordinate_covariance(given.map_T_base, given.covariance).covariance,
                true);
  state_.mode = TrackMode::Certain;
  state_.given = true;
  state_.contradicted = false;
  state_.contradicting_frames = 0;
  state_.wheels_stuck = false;
  state_.halt = {};
  state_.pose_hypotheses.clear();
  watch_.forget_pending();
  ++state_.starts;
}

void Tracker::search(const FrameObservations& frame) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < frame.count; ++i) {
    if (watch_.usable(frame.seen[i].landmark)) usable_[count++] = frame.seen[i];
  }
  state_.pose_hypotheses.observe(std::span(usable_.data(), count), landmarks_, sensor_);
  const Candidate* found = state_.pose_hypotheses.believable(state_.mode != TrackMode::Lost);
  if (found == nullptr) return;
  filter_.start(found->map_T_base, found->covariance, state_.mode != TrackMode::Lost);
  int used = 0;
  for (std::size_t i = 0; i < count && used < Riekf::kMost; ++i) {
    const auto z = linearise(usable_[i], landmarks_, sensor_, found->map_T_base);
    if (z) batch_[static_cast<std::size_t>(used++)] = *z;
  }
  filter_.start_moved_by_systematic(batch_, used);
  state_.mode = TrackMode::Certain;
  state_.given = false;
  state_.contradicted = false;
  state_.contradicting_frames = 0;
  ++state_.starts;
  state_.pose_hypotheses.clear();
  watch_.forget_pending();
}

void Tracker::judge_mode(const Verdict& verdict, const FrameObservations& frame) {
  if (verdict.accepted_count == 0 && verdict.rejected_count == 0) return;
  const bool agrees = verdict.accepted_count > 0 && verdict.accepted_count >= verdict.rejected_count;
  if (state_.given) {
    state_.given = false;
    if (!agrees) {
      if (!frame.reported) ++refused_starts_;
      state_.mode = TrackMode::Uncertain;
    }
  }
  agrees ? agree(verdict) : contradict(frame);
}

void Tracker::contradict(const FrameObservations& frame) {
  ++state_.contradicting_frames;
  if (!state_.contradicted) {
    state_.contradicted = true;
    state_.contradicted_since = frame.stamp;
    state_.pose_hypotheses.clear();
  }
  state_.agreeing_frames = 0;
  state_.agreeing_distinct = 0;
  if (to_seconds(frame.stamp - state_.contradicted_since) >= options_.uncertain_after_s)
    state_.mode = TrackMode::Uncertain;
  search(frame);
}

/// Certain is who agreed in several looks, with two tags at least.
void Tracker::agree(const Verdict& verdict) {
  state_.contradicting_frames = 0;
  if (state_.mode == TrackMode::Certain) {
    state_.contradicted = false;
    watch_.confirm();
    return;
  }
  ++state_.agreeing_frames;
  for (std::size_t i = 0; i < verdict.accepted_count; ++i) {
    const int landmark = verdict.accepted[i]->landmark;
    if (state_.agreeing_distinct == 0 || (state_.agreeing_distinct == 1 && state_.agreeing[0] != landmark))
      state_.agreeing[static_cast<std::size_t>(state_.agreeing_distinct++)] = landmark;
  }
  constexpr int kLooks = 3;
  if (state_.agreeing_frames < kLooks || state_.agreeing_distinct < 2) return;
  state_.mode = TrackMode::Certain;
  state_.contradicted = false;
  watch_.confirm();
}

}  // namespace waymark
