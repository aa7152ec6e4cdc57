#include <string>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/options.hpp"
#include "python/bindings/rooms.hpp"
#include "python/bindings/trajectories.hpp"
#include "waymark/evaluation/map_errors.hpp"
#include "waymark/evaluation/trajectory_scores.hpp"

namespace waymark::python {
namespace {

py::dict dict_of(const ErrorStatistics& s) {
  py::dict answer;
  answer["count"] = s.count;
  answer["rmse"] = s.rmse;
  answer["mean"] = s.mean;
  answer["median"] = s.median;
  answer["p95"] = s.p95;
  answer["max"] = s.max;
  return answer;
}

py::object dict_of(const std::optional<Consistency>& consistency) {
  if (!consistency) return py::none();
  py::dict answer;
  answer["count"] = consistency->count;
  answer["nees_mean"] = consistency->nees_mean;
  answer["nees_median"] = consistency->nees_median;
  answer["inside_95"] = consistency->inside_95;
  answer["refused"] = consistency->refused;
  return answer;
}

Duration seconds(double s) { return Duration(static_cast<std::int64_t>(s * 1e9)); }

py::dict score(const PoseList& estimate, const PoseList& reference, const std::string& alignment,
               const py::kwargs& given) {
  const auto options = options_of<TrajectoryScoreOptions>(given);
  const auto kind = alignment_kind(alignment);
  if (!kind) refuse("alignment", "unknown alignment '" + alignment + "'", "Pass none, se2, se3 or sim3.");
  const auto pairs = pair_by_time(estimate.poses, plain(reference), seconds(options.max_gap_s));
  const TrajectoryScores scores = value_of(score_trajectory(pairs, *kind, options));
  py::dict answer;
  answer["pairs"] = pairs.size();
  answer["ate_m"] = dict_of(scores.ate_m);
  answer["rotation_deg"] = dict_of(scores.rotation_deg);
  answer["heading_deg"] = dict_of(scores.heading_deg);
  answer["relative_m"] = dict_of(scores.relative.translation_m);
  answer["relative_deg"] = dict_of(scores.relative.rotation_deg);
  answer["consistency"] = dict_of(scores.consistency);
  answer["jumps"] = scores.jumps;
  answer["end_error_m"] = scores.end_error_m;
  answer["scale"] = scores.alignment.scale;
  answer["ref_T_est"] = scores.alignment.ref_T_est;
  return answer;
}

py::dict compare_maps(const TagMap& estimated, const TagMap& truth) {
  const TagMapErrors errors = tag_map_errors(estimated, truth);
  if (errors.tags == 0)
    refuse("estimated", "no tag is in both maps", "Compare maps that contain the same tags.");
  py::dict answer;
  answer["tags"] = errors.tags;
  answer["rmse_m"] = errors.rmse_m;
  answer["max_m"] = errors.max_m;
  answer["orientation_rmse_deg"] = errors.orientation_rmse_deg;
  return answer;
}

py::object pose_between(const PoseList& list, std::int64_t stamp_ns, double max_gap_s) {
  if (!(max_gap_s >= 0)) refuse("max_gap_s", fmt::format("{} s is not a duration of at least 0", max_gap_s));
  const auto found = pose_at(plain(list), SensorTime(Duration(stamp_ns)), seconds(max_gap_s));
  return found ? py::cast(*found) : py::object(py::none());
}

}  // namespace

void bind_evaluation(py::module_& m) {
  m.doc() = "Compares estimates with ground truth.";
  m.def(
      "score_trajectory", &score, py::arg("estimate"), py::arg("reference"), py::arg("alignment") = "none",
      ("Absolute and relative errors, jumps and consistency (NEES, expected value 3) of a Trajectory "
       "relative to a reference, as a dictionary. alignment: none, se2, se3, sim3. Options by keyword:\n\n" +
       options_help<TrajectoryScoreOptions>())
          .c_str());
  m.def("map_errors", &compare_maps, py::arg("estimated"), py::arg("truth"),
        "Errors of the tags common to both maps, without alignment, as a dictionary. Raises InvalidArgument "
        "if the maps have no common tag.");
  m.def("pose_at", &pose_between, py::arg("trajectory"), py::arg("stamp_ns"), py::arg("max_gap_s") = 0.5,
        "The pose (SE3) interpolated at a time; None outside the trajectory or in a gap longer than "
        "max_gap_s.");
}

}  // namespace waymark::python
