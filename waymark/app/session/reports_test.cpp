// What is printed and given as JSON of drives: nothing that was not measured becomes a number.
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "waymark/app/session/explore_world.hpp"
#include "waymark/app/session/run_demo.hpp"
#include "waymark/app/session/run_session.hpp"
#include "waymark/app/teach/teach_lap.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TagId tag(int number) { return parse_tag_id("tag36h11:" + std::to_string(number)).value(); }

TEST(TeachReportText, NamesTheTagThatWasSeenLeastAndTheNextCommand) {
  TeachReport report;
  report.summary.seen = {{tag(3), 40}, {tag(7), 4}};
  report.summary.mappable = true;
  const std::string text = to_text(report, "lap.mcap", true);
  EXPECT_THAT(text, HasSubstr("Every tag was seen in 4 frames or more (tag36h11:7 in fewest)."));
  EXPECT_THAT(text, HasSubstr("The loop is not closed."));
  EXPECT_THAT(text, HasSubstr("waymark map lap.mcap -o map"));
}

TEST(TeachReportText, SaysNothingOfALoopWhereTheRouteIsOpenAndNothingOfTagsWhereNoneWasSeen) {
  const std::string text = to_text(TeachReport{}, "lap.mcap", false);
  EXPECT_THAT(text, Not(HasSubstr("loop")));
  EXPECT_THAT(text, Not(HasSubstr("in fewest")));
  EXPECT_THAT(text, HasSubstr("nothing to make a map of"));
}

TEST(TeachReportJson, HoldsWeakLinksByTheirTags) {
  TeachReport report;
  report.summary.weak_links = {{.first = tag(1), .second = tag(2), .frames = 2}};
  const auto json = to_json(report, "lap.mcap");
  EXPECT_EQ(json["file"], "lap.mcap");
  ASSERT_EQ(json["weak_links"].size(), 1U);
  EXPECT_EQ(json["weak_links"][0]["tags"][1], "tag36h11:2");
  EXPECT_EQ(json["weak_links"][0]["frames"], 2);
}

TEST(ExploreReportText, APlaceThatWasNeverKnownHasNoErrors) {
  ExploreReport report{.seconds = 60, .tags = 8};
  report.nearest_m = std::numeric_limits<double>::infinity();
  const std::string text = to_text(report);
  EXPECT_THAT(text, HasSubstr("the place was never known"));
  EXPECT_THAT(text, HasSubstr("nothing in this world to come near to"));
  EXPECT_TRUE(to_json(report)["position_rmse_m"].is_null());
}

TEST(ExploreReportText, ErrorsAreThoseByTheTruth) {
  ExploreReport report{.nearest_m = 0.25, .certain_fraction = 0.5};
  report.position_rmse_m = 0.01;
  report.position_p95_m = 0.02;
  report.position_max_m = 0.03;
  report.heading_rmse_deg = 0.4;
  const std::string text = to_text(report);
  EXPECT_THAT(text, HasSubstr("0.010 m rmse, 0.020 m 95 %, 0.030 m worst"));
  EXPECT_THAT(text, HasSubstr("0.250 m from the hull"));
  EXPECT_THAT(text, HasSubstr("50.0 % of the time"));
  EXPECT_EQ(to_json(report)["heading_rmse_deg"], 0.4);
}

TEST(SessionReportText, GivesEachReplayItsEndAndNamesWhoStoppedIt) {
  SessionReport report{.laps_taught = 1};
  report.replays.resize(2);
  report.replays[0].end.interrupted = true;
  report.replays[0].end.driven_m = 1.5;
  report.replays[0].route_length_m = 10;
  report.replays[1].end.finished = true;
  report.replays[1].judgement = ReplayJudgement{};
  report.replays[1].judgement->cross_track_max_m = 0.02;
  const std::string text = to_text(report, "Ctrl-C");
  EXPECT_THAT(text, HasSubstr("1 lap taught, 2 replays"));
  EXPECT_THAT(text, HasSubstr("stopped by Ctrl-C 1.50 m along a route of 10.00 m: the robot stands"));
  EXPECT_THAT(text,
              HasSubstr("the route was driven to its end; by the truth 0.000 m rmse from the taught way, "
                        "0.020 m worst"));
  const auto json = to_json(report);
  ASSERT_EQ(json["replays"].size(), 2U);
  EXPECT_TRUE(json["replays"][0]["cross_track_rmse_m"].is_null()) << "not judged";
  EXPECT_FALSE(json["replays"][1]["cross_track_rmse_m"].is_null());
}

TEST(ReplayReportText, WhatNeverKnewItsPlaceSaysWhetherTagsWereSeen) {
  ReplayReport report;
  report.end.state = ReplayState::Waiting;
  EXPECT_THAT(ending(report), HasSubstr("nothing was heard of a camera"));
  report.end.frames = 9;
  EXPECT_THAT(ending(report), HasSubstr("no two tags of the map were seen at once"));
  report.end.frames_with_two_tags = 5;
  EXPECT_THAT(ending(report), HasSubstr("contradict the map"));
  report.end.state = ReplayState::Refused;
  report.end.reason = "the start is 3 m away";
  EXPECT_EQ(ending(report), "refused to start: the start is 3 m away");
  EXPECT_FALSE(succeeded(report));
}

TEST(ReplayReportText, SaysOnceThatItStopped) {
  ReplayReport report;
  report.end.state = ReplayState::Stopped;
  report.end.driven_m = 1;
  report.route_length_m = 3;
  const std::string where = "1.00 m along a route of 3.00 m";
  for (const auto& [reason, words] :
       {std::pair{"stopped: a stick was moved", "stopped " + where + ": a stick was moved"},
        {"stopped by the operator", "stopped by the operator " + where},
        {"a tag is near", "stopped " + where + ": a tag is near"}}) {
    report.end.reason = reason;
    EXPECT_EQ(ending(report), words);
  }
  EXPECT_EQ(with_reason("stopped", "stopped: a stick was moved"), "stopped: a stick was moved");
  EXPECT_EQ(with_reason("stopped", "a tag is near"), "stopped: a tag is near");
  EXPECT_EQ(with_reason("done", ""), "done");
}

TEST(DemoReportText, HasRowsOnlyForWhatWasCompared) {
  DemoReport report;
  EXPECT_THAT(to_text(report), Not(HasSubstr("rmse")));
  report.replay.judgement = ReplayJudgement{};
  report.replay.judgement->laps_completed = 2;
  EXPECT_THAT(to_text(report), HasSubstr("laps completed"));
  EXPECT_THAT(to_text(report), HasSubstr("from the taught way, rmse"));
}

}  // namespace
}  // namespace waymark
