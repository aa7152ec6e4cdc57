#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/base/error.hpp"
#include "waymark/pipeline/replayer.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {

/// A pause at a station that a replay made.
struct StationVisit {
  std::string name{};
  double arc_length_m = 0;
  SensorTime arrived{};
  double stood_s = 0;
};

/// What a replay says and writes down while it goes on: where it stands and why, and that it goes on. In
/// words on the terminal for stations; in the recording as /diagnostics, one message each time the state
/// changes.
class ReplayNotes {
 public:
  explicit ReplayNotes(const JobControl& control) : control_(control) {}

  Status add(SensorTime now, const ReplayStep& step, SampleRecorder* recorder);
  [[nodiscard]] const std::vector<StationVisit>& visits() const { return visits_; }

 private:
  void note_station(SensorTime now, const ReplayStep& step);

  const JobControl& control_;
  std::optional<ReplayState> last_{};
  std::string last_station_{};
  std::vector<StationVisit> visits_;
};

}  // namespace waymark
