// Duplicate tags, and what looks like them: a tag that was moved, a misread id, a tag seen twice.
#include "waymark/mapping/scene/tag_identity.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/rig_scene.hpp"
#include "waymark/mapping/scene/moved_tags.hpp"

namespace waymark {
namespace {

using test::at;
using test::rig_scene;
using test::rig_tag;
using test::RigScene;
using test::RigShape;
using test::true_scene_map;

constexpr std::size_t kId = 2, kOther = 5;  // the second tag carries the id of the first one
constexpr double kSeparated = 1e4;          // chi-square

/// These frames show another tag with the id 2, and no frame shows it with its own id.
void give_id(RigScene& made, std::size_t other, std::size_t from, std::size_t to) {
  for (std::size_t f = 0; f < made.recording.frames.size(); ++f) {
    auto& seen = made.recording.frames[f].views[0].detections;
    if (f < from || f >= to)
      std::erase_if(seen, [&](const TagDetection& d) { return d.tag == rig_tag(other); });
    for (TagDetection& detection : seen) {
      if (detection.tag == rig_tag(other)) detection.tag = rig_tag(kId);
    }
  }
}

/// The scene in which these frames show tag 5 with the id 2, and no frame shows it with its own id.
RigScene with_duplicate(std::size_t from = 0, std::size_t to = 1000, const RigShape& shape = {}) {
  RigScene made = rig_scene(shape);
  give_id(made, kOther, from, to);
  return made;
}

/// These frames do not show the tag 2 itself.
void take_away(RigScene& made, std::size_t from, std::size_t to) {
  for (std::size_t f = from; f < to; ++f) {
    const auto truth = test::rig_corners(made, 0, f, made.tags[kId]);
    std::erase_if(made.recording.frames[f].views[0].detections, [&](const TagDetection& d) {
      return d.tag == rig_tag(kId) && truth && (*truth)[0] == d.corners_px[0];
    });
  }
}

/// The rig moves past the wall once more, with its path displaced by this motion.
void film_again(RigScene& made, const SE3& by) {
  const std::size_t frames = made.rig.size();
  constexpr std::chrono::seconds pause(20);
  for (std::size_t f = 0; f < frames; ++f) {
    made.rig.push_back(by * made.rig[f]);
    SceneFrame frame{.stamp = made.recording.frames[f].stamp + pause};
    SceneView view{.camera = 0};
    for (std::size_t t = 0; t < made.tags.size(); ++t) {
      if (const auto corners = test::rig_corners(made, 0, frames + f, made.tags[t]))
        view.detections.push_back({.tag = rig_tag(t), .corners_px = *corners});
    }
    frame.views.push_back(view);
    made.recording.frames.push_back(frame);
  }
}

/// The true map, which has all detections of the id, and the places of the id.
struct Places {
  SceneMap map;
  ObservationTimes times;
  IdPlaces id{.body = 0, .tag = kId};

  /// The first place is that of tag 2, the second one that of the other tag.
  explicit Places(const RigScene& made, std::size_t other = kOther)
      : map(true_scene_map(made, 0.5, RepeatedIds::All)), times(times_of(made.recording, map.observations)) {
    id.places.resize(2);
    for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
      const SceneObservation& seen = map.observations.seen[i];
      if (seen.tag != kId) continue;
      const auto truth = test::rig_corners(made, 0, seen.frame, made.tags[kId]);
      const bool here = truth && ((*truth)[0] - seen.factor.corners_px[0]).norm() < 1;
      id.terms.push_back(i);
      id.places[here ? 0 : 1].terms.push_back(i);
    }
    id.places[1].start = made.tags[other];
    separate_places(map, id);
  }
  [[nodiscard]] TagIdentity identity() const { return identity_of(map, times, id, 1, kSeparated); }
};

TEST(TagIdentity, EachPlaceHasItsPoseAndSize) {
  const RigScene made = with_duplicate(12);
  const Places two(made);
  ASSERT_EQ(two.id.places.size(), 2U);
  EXPECT_EQ(two.id.places[0].pose, two.map.problem.tags[0][kId]);
  EXPECT_EQ(two.id.places[0].size, two.map.problem.sizes[0][kId]);
  EXPECT_EQ(two.id.places[1].pose + 1, two.map.problem.bundle.poses.size());
  EXPECT_EQ(two.map.placed.size(), two.map.problem.bundle.poses.size());
  EXPECT_EQ(two.map.problem.moves.size(), two.map.problem.bundle.poses.size());
  for (const IdPlace& place : two.id.places) {
    EXPECT_GT(place.terms.size(), 4U);
    for (const std::size_t i : place.terms) {
      EXPECT_EQ(two.map.problem.bundle.corners[i].tag, place.pose);
      EXPECT_EQ(two.map.problem.bundle.corners[i].size, place.size);
    }
  }
  for (const double chi2 : corner_chi2(two.map.problem.bundle)) EXPECT_LT(chi2, 1e-6);
}

TEST(TagIdentity, ObservationsReturnToThePlaceThatTheyFit) {
  Places two(with_duplicate(12));
  const IdPlaces before = two.id;
  std::swap(two.id.places[0].terms[0], two.id.places[1].terms[0]);
  for (IdPlace& place : two.id.places) {
    std::ranges::sort(place.terms);
    for (const std::size_t i : place.terms) two.map.problem.bundle.corners[i].tag = place.pose;
  }
  EXPECT_TRUE(assign_to_places(two.map, two.id));
  EXPECT_EQ(two.id.places[0].terms, before.places[0].terms);
  EXPECT_EQ(two.id.places[1].terms, before.places[1].terms);
  EXPECT_FALSE(assign_to_places(two.map, two.id));
}

TEST(TagIdentity, OtherObservationsFollowThePlaceThatIsNearestInTime) {
  RigScene made = with_duplicate(12);
  take_away(made, 12, made.recording.frames.size());
  const Places two(made);
  SceneMap map = true_scene_map(made, 0.5, RepeatedIds::All);
  IdPlaces id{.body = 0, .tag = kId, .terms = two.id.terms, .places = two.id.places};
  id.places[0].terms.erase(id.places[0].terms.begin());
  id.places[1].terms.pop_back();
  separate_places(map, id);
  EXPECT_EQ(id.places[0].terms, two.id.places[0].terms);
  EXPECT_EQ(id.places[1].terms, two.id.places[1].terms);
}

TEST(TagIdentity, TagsObservedAlternatelyAreTwo) {
  const RigScene alternate = [] {
    RigScene made = with_duplicate();
    for (std::size_t f = 0; f < made.recording.frames.size(); ++f) {
      auto& seen = made.recording.frames[f].views[0].detections;
      const auto first = std::ranges::find(seen, rig_tag(kId), &TagDetection::tag);
      if (first == seen.end()) continue;
      const auto second =
          std::find_if(first + 1, seen.end(), [](const TagDetection& d) { return d.tag == rig_tag(kId); });
      if (second != seen.end()) seen.erase(f % 4 < 2 ? first : second);
    }
    return made;
  }();
  const Places two(alternate);
  EXPECT_EQ(two.identity(), TagIdentity::TwoTags);
  EXPECT_FALSE(describe_duplicate(two.map, two.id, 1).at_once);
  EXPECT_EQ(identity_of(two.map, two.times, two.id, 1, 10), TagIdentity::OneTag)
      << "within their uncertainty";
  EXPECT_GT(separations_of(two.map, {two.id})[0][1], 1e3);
}

TEST(TagIdentity, ANearPlaceObservedLaterIsThatOfAMovedTag) {
  constexpr std::size_t kNear = 4;  // 0.8 m from the first place
  RigScene made = rig_scene();
  give_id(made, kNear, 12, 1000);
  take_away(made, 12, made.recording.frames.size());
  Places two(made, kNear);
  ASSERT_GT(two.id.places[0].terms.size(), 3U);
  ASSERT_GT(two.id.places[1].terms.size(), 3U);
  EXPECT_EQ(two.identity(), TagIdentity::MovedTag);
  EXPECT_TRUE(describe_duplicate(two.map, two.id, 1).one_after_the_other);
}

/// Two passes. Tag 2 is at its place in the first one and at that of tag 5, 1.2 m away, in the second one.
RigScene moved_between_passes(const SE3& second_pass) {
  RigScene made = rig_scene({.frames = 60});
  film_again(made, second_pass);
  give_id(made, kOther, 60, 1000);
  take_away(made, 60, 120);
  return made;
}

TEST(TagIdentity, AFarTagWasMovedIfItsPlaceWasInViewWithoutIt) {
  const Places moved(moved_between_passes(SE3()));
  EXPECT_EQ(moved.identity(), TagIdentity::MovedTag);
}

TEST(TagIdentity, APlaceThatWasSeenFromElsewhereIsNoEvidenceOfAMove) {
  const Places two(moved_between_passes(test::at(0, 0.6, -0.6)));
  EXPECT_EQ(two.identity(), TagIdentity::TwoTags) << "a wall may hide it from there";
  EXPECT_FALSE(are_proven_two(two.map, two.id));
}

TEST(TagIdentity, ATagThatWasMovedAndReturnedIsOneTag) {
  RigScene made = rig_scene({.frames = 60});
  film_again(made, SE3());
  made.recording.frames.resize(120);
  RigScene third = rig_scene({.frames = 60});
  for (std::size_t f = 0; f < 60; ++f) {
    SceneFrame frame = third.recording.frames[f];
    frame.stamp += std::chrono::seconds(60);
    made.rig.push_back(third.rig[f]);
    made.recording.frames.push_back(frame);
  }
  give_id(made, kOther, 60, 120);
  take_away(made, 60, 120);
  EXPECT_EQ(Places(made).identity(), TagIdentity::MovedTag);
}

TEST(TagIdentity, TagsObservedAtOnceAreProvenToBeTwo) {
  const Places two(with_duplicate());
  EXPECT_EQ(two.identity(), TagIdentity::TwoTags);
  EXPECT_TRUE(are_proven_two(two.map, two.id));
  const DuplicateTag duplicate = describe_duplicate(two.map, two.id, 1);
  EXPECT_TRUE(duplicate.at_once);
  EXPECT_FALSE(duplicate.one_after_the_other);
}

TEST(TagIdentity, PrintsThatWouldOverlapAreOneTag) {
  Places two(with_duplicate());
  SE3& there = two.map.problem.bundle.poses[two.id.places[1].pose].value;
  const SE3 here = two.map.problem.bundle.poses[two.id.places[0].pose].value;
  std::vector<std::size_t> same = two.id.places[0].terms;
  // Half of the observations of the first tag belong to the second place, which is the mirrored pose.
  for (std::size_t k = 0; k < same.size(); k += 2) {
    two.map.problem.bundle.corners[same[k]].tag = two.id.places[1].pose;
    two.id.places[1].terms.push_back(same[k]);
  }
  there = here * SE3(SO3::exp({0, 0.6, 0}), {0.04, 0, 0});
  EXPECT_EQ(two.identity(), TagIdentity::OneTag);
}

TEST(TagIdentity, FewObservationsAreNoTag) {
  Places two(with_duplicate(12));
  two.id.places[1].terms.resize(3);
  EXPECT_EQ(two.identity(), TagIdentity::OneTag);
}

TEST(TagIdentity, APlaceOfAnotherTagWasMisread) {
  Places two(with_duplicate(0, 1000, {.frames = 120}));
  // Tag 6 is at the second place, too, with many more observations.
  SceneMap& map = two.map;
  map.problem.bundle.poses[map.problem.tags[0][6]].value = two.id.places[1].start.value();
  two.id.places[1].terms.resize(4);
  const auto of_other =
      std::ranges::count(map.problem.bundle.corners, map.problem.tags[0][6], &CornerTerm::tag);
  ASSERT_GT(of_other, 20);
  EXPECT_EQ(two.identity(), TagIdentity::OneTag);
  std::swap(two.id.places[0], two.id.places[1]);
  EXPECT_EQ(two.identity(), TagIdentity::OneTag) << "the same holds for the first place";
}

TEST(TagIdentity, GroupsWithEnoughObservationsArePlaces) {
  const RigScene made = with_duplicate(12);
  const SceneMap map = true_scene_map(made);
  std::vector<std::size_t> groups(map.observations.seen.size());
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const SceneObservation& seen = map.observations.seen[i];
    std::size_t first = i;  // one group before frame 12, and one after it
    for (std::size_t k = i; k-- > 0;) {
      const SceneObservation& other = map.observations.seen[k];
      if (other.tag == seen.tag && (other.frame < 12) == (seen.frame < 12)) first = k;
    }
    groups[i] = first;
  }
  const std::vector<IdPlaces> ids = ids_in_groups(map, groups, 4);
  ASSERT_FALSE(ids.empty());
  for (const IdPlaces& id : ids) {
    ASSERT_EQ(id.places.size(), 2U);
    EXPECT_GE(id.places[0].terms.size(), id.places[1].terms.size());
    EXPECT_GE(id.places[1].terms.size(), 4U);
    for (const IdPlace& place : id.places) {
      EXPECT_TRUE(std::ranges::is_sorted(place.terms));
      for (const std::size_t i : place.terms) EXPECT_EQ(map.observations.seen[i].tag, id.tag);
    }
  }
  EXPECT_TRUE(ids_in_groups(map, groups, 1000).empty());
}

TEST(TagIdentity, PlacesOfASizeAreThoseThatObservationsAgreeOn) {
  const RigScene made = with_duplicate(10);
  SceneMap map = true_scene_map(made);
  const auto id = places_of_size(map, map.problem.sizes[0][kId]);
  ASSERT_TRUE(id);
  ASSERT_EQ(id->places.size(), 2U);
  for (const IdPlace& place : id->places) {
    const double off = std::min((place.start->translation() - made.tags[kId].translation()).norm(),
                                (place.start->translation() - made.tags[kOther].translation()).norm());
    EXPECT_LT(off, 0.02);
  }
  for (const std::size_t other : {0U, 1U, 3U, 4U})
    EXPECT_FALSE(places_of_size(map, map.problem.sizes[0][other]));
}

}  // namespace
}  // namespace waymark
