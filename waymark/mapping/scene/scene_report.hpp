#pragma once

#include <set>
#include <string>
#include <vector>

#include "waymark/mapping/scene/scene_map.hpp"
#include "waymark/mapping/solver/bundle.hpp"

namespace waymark {

/// Fills in what came out: covariance, reprojection, what was left out and what hangs apart.
void report_scene(const SceneRecording& recording, SceneMap& map);

/// Mean and median distance of the corners in use from where they project.
void measure_reprojection(SceneMap& map);

/// What to say of a scene's map, a sentence each: given facts that the rest contradicts, with the residual in
/// standard deviations; tags most of whose observations contradict the rest, known ones first; tags that rest
/// on what was given alone; parts that hang on a few observations, and those that were left out for it; tags
/// whose place nothing determines.
[[nodiscard]] std::vector<std::string> scene_warnings(const SceneMap& map);

/// Tags that are tied to the rest by so few observations that a wrong one among them would move them all.
struct ThinCut {
  std::vector<PoseIndex> beyond{};  ///< tags, ascending
  std::vector<PoseIndex> by{};      ///< the tags whose observations tie them, ascending
  int observations = 0;             ///< of those tags
};

/// Cuts of at least two tags that at most `most` observations in use cross, the largest part first, none
/// within another of as many observations. `moves`: of each pose, it is of one frame; `root` is never beyond
/// a cut. Candidates are the edges of a maximum spanning tree of the tags by how often they are seen
/// together; motion that was measured ties frames, so with it there is none. O(observations * tags of a
/// view), and the tags for each cut.
[[nodiscard]] std::vector<ThinCut> thin_cuts(const Bundle& bundle, const std::vector<char>& moves,
                                             const std::set<PoseIndex>& roots, int most = 3);

/// The sum of squared residuals of corners over their own covariances as the detector gave them, by degree of
/// freedom, of views in use with at least two tags in use: about 1 when those covariances are true and errors
/// of tags are independent. 0 where there is no such view, or no covariance was given.
[[nodiscard]] double corner_chi2_per_dof(const SceneMap& map);

}  // namespace waymark
