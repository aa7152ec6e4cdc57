// Tests the conversion of reports to JSON: keys, values, types, and errors on one line each.
#include "waymark/app/common/report_fields.hpp"

#include <algorithm>
#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(ReportFields, AnErrorContainsOnlyTheKnownPartsOfItsPlace) {
  const auto bare = to_json(fields(Error{ErrorCode::NotFound, "no map"}));
  EXPECT_EQ(bare.dump(), R"({"code":"not_found","message":"no map"})");
  const auto whole =
      to_json(fields(Error{ErrorCode::Unreadable,
                           "cut",
                           {.source = "a.mcap", .line = 3, .byte = 70'000'000'000, .key = "x.y"},
                           "Record again."}));
  EXPECT_EQ(whole["source"], "a.mcap");
  EXPECT_EQ(whole["line"], 3);
  EXPECT_EQ(whole["byte"], 70'000'000'000);
  EXPECT_EQ(whole["key"], "x.y");
  EXPECT_EQ(whole["hint"], "Record again.");
}

struct Leg {
  double length_m = 0;
};
ReportFields fields(const Leg& leg) { return {{"length_m", "Its length", leg.length_m}}; }

struct Trip {
  std::string name{};
  std::optional<double> speed_m_s{};
  std::optional<int> stops{};
  std::vector<Leg> legs{};
  std::optional<Leg> last{};
  bool done = false;
  std::size_t seen = 0;
};
ReportFields fields(const Trip& trip) {
  return {{"name", "What it is called", trip.name},
          {"speed_m_s", "Mean speed", trip.speed_m_s},
          {"stops", "Stops on the way", if_any(trip.stops)},
          {"legs", "One entry a leg", trip.legs},
          {"last", "The last leg", trip.last},
          {"last_m", "Its length", part(trip.last, &Leg::length_m)},
          {"done", "Whether it ended", trip.done},
          {"seen", "Tags on the way", trip.seen},
          {"corner_px", "Two numbers", std::array<double, 2>{1, 2.5}}};
}

TEST(ReportFields, MissingValuesAreNullOrOmitted) {
  EXPECT_EQ(to_json(fields(Trip{})).dump(),
            R"({"name":"","speed_m_s":null,"legs":[],"last":null,"last_m":null,"done":false,"seen":0,)"
            R"("corner_px":[1.0,2.5]})");
  EXPECT_EQ(to_json(fields(Trip{"north", 0.5, 2, {{1}, {2.5}}, Leg{2.5}, true, 3})).dump(),
            R"({"name":"north","speed_m_s":0.5,"stops":2,"legs":[{"length_m":1.0},{"length_m":2.5}],)"
            R"("last":{"length_m":2.5},"last_m":2.5,"done":true,"seen":3,"corner_px":[1.0,2.5]})");
}

TEST(ReportFields, TypesAndKeysAreKnownWithoutValues) {
  for (const Trip& trip : {Trip{}, Trip{"north", 0.5, 2, {{1}}, Leg{1}, true, 3}}) {
    const ReportFields all = fields(trip);
    const auto type = [&](std::size_t i) { return std::string(all.at(i).value.type()); };
    EXPECT_EQ(type(0), "text");
    EXPECT_EQ(type(1), "number");
    EXPECT_EQ(type(2), "integer");
    EXPECT_EQ(type(3), "list");
    EXPECT_EQ(type(4), "object");
    EXPECT_EQ(type(6), "bool");
    EXPECT_TRUE(all.at(1).value.may_be_null());
    EXPECT_FALSE(all.at(2).value.may_be_null()) << "omitted instead";
    for (const std::size_t of_legs : {3U, 4U}) {
      ASSERT_EQ(all.at(of_legs).value.keys().size(), 1U);
      EXPECT_EQ(all.at(of_legs).value.keys().front().name, "length_m");
    }
  }
}

TEST(ReportFields, IsOneLineWhateverItContains) {
  const std::string hostile = std::string("a\nb\"\\\t") + '\xff' + "\xc3\x28" + '\0' + "end";
  const std::string line = json_line(ReportFields{{"name", "", hostile}});
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1);
  EXPECT_EQ(line.back(), '\n');
  const auto read = nlohmann::json::parse(line);
  EXPECT_THAT(read["name"].get<std::string>(),
              AllOf(HasSubstr("a\nb\"\\\t"), HasSubstr("\xEF\xBF\xBD"), HasSubstr("end")));
}

}  // namespace
}  // namespace waymark
