#include "waymark/config/option_layers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/nested_options.hpp"

namespace waymark {
namespace {

using test::Inner;
using test::OptionFile;
using test::Outer;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Parsed {
  Outer outer{.count = 7};  // as set by a robot's file
  Inner inner{};
  std::string error{};
  std::vector<std::string> inner_again{};
};

template <class Options>
OptionLayers::Check reads() {
  return [](const YamlCursor& cursor) {
    Options read;
    return update_fields(cursor, read);
  };
}

Parsed parse(const std::vector<std::string>& sets, const std::string& file = {}) {
  OptionLayers layers({.name = "set"});
  layers.add_section("outer", reads<Outer>());
  layers.add_section("inner", reads<Inner>());
  Parsed parsed;
  Status status = layers.load(file, sets);
  if (status) status = layers.read("outer", parsed.outer);
  if (status) status = layers.read("inner", parsed.inner);
  if (!status) parsed.error = to_string(status.error());
  parsed.inner_again = layers.assignments("inner");
  return parsed;
}

TEST(OptionLayers, SetsEveryTypeOfFieldIncludingNestedStructs) {
  const Parsed parsed = parse({"outer.reach_m=0.25", "outer.word=no", "outer.names=[a, b]",
                               "outer.motion.noise=0.75", "outer.motion.on=true", "inner.noise=0.5"});
  EXPECT_EQ(parsed.error, "");
  EXPECT_EQ(parsed.outer.reach_m, 0.25);
  EXPECT_EQ(parsed.outer.count, 7);  // not set by any layer
  EXPECT_EQ(parsed.outer.word, "no");
  EXPECT_THAT(parsed.outer.names, ElementsAre("a", "b"));
  EXPECT_EQ(parsed.outer.motion.noise, 0.75);
  EXPECT_TRUE(parsed.outer.motion.on);
  EXPECT_EQ(parsed.inner.noise, 0.5);
  EXPECT_FALSE(parsed.inner.on);
}

TEST(OptionLayers, InvalidAssignmentsAreErrorsWithTheArgument) {
  EXPECT_THAT(parse({"outer.reach=1"}).error, HasSubstr("(set outer.reach=1)"));
  testing::expect_on_page("config", parse({"outer.reach=1"}).error);
  EXPECT_THAT(parse({"outr.reach_m=1"}).error, HasSubstr("(set outr.reach_m=1)"));
  testing::expect_on_page("config", parse({"outr.reach_m=1"}).error);
  EXPECT_THAT(parse({"outer.motion.nois=1"}).error, HasSubstr("'noise'"));
  EXPECT_THAT(parse({"outer.reach_m=11"}).error, HasSubstr("(set outer.reach_m=11): 11 is"));
  EXPECT_THAT(parse({"outer.reach_m=far"}).error, HasSubstr("'far'"));
  EXPECT_THAT(parse({"outer.reach_m=.nan"}).error, HasSubstr("'.nan'"));
  EXPECT_THAT(parse({"outer.count=2.5"}).error, HasSubstr("'2.5'"));
  for (const char* invalid : {"outer.motion.nois=1", "outer.reach_m=11", "outer.reach_m=far",
                              "outer.reach_m=.nan", "outer.count=2.5"})
    testing::expect_on_page("config", parse({invalid}).error);
  for (const char* nonsense :
       {"outer", "outer=1", "outer.reach_m", "outer.reach_m=", "outer.=1", ".reach_m=1", "outer.reach_m.x=1",
        "outer.motion=1", "outer.names=a", "=", "outer.reach_m={"})
    EXPECT_THAT(parse({nonsense}).error, HasSubstr(std::string("(set ") + nonsense + ")")) << nonsense;
}

TEST_F(OptionFile, InvalidFilesAreErrorsWithTheirLine) {
  const auto error_of = [&](const std::string& text) { return parse({}, write(text)).error; };
  EXPECT_THAT(error_of("inner:\n  noise: 0.5\nouter:\n  reach: 1\n"), HasSubstr(".yaml:4 (outer.reach)"));
  EXPECT_THAT(error_of("innr: {}\n"), HasSubstr(".yaml:1 (innr)"));
  EXPECT_THAT(error_of("outer:\n  count: 10\n"), HasSubstr(".yaml:2 (outer.count): 10 is"));
  EXPECT_THAT(error_of("outer: [\n"), HasSubstr(".yaml"));
  EXPECT_THAT(parse({}, "no-such.yaml").error, HasSubstr("no-such.yaml"));
  testing::expect_on_page("config", parse({}, "no-such.yaml").error);
  EXPECT_EQ(error_of(""), "");
}

TEST_F(OptionFile, ConvertsASectionToAssignments) {
  const std::string file = write("inner: {noise: 0.2, on: true}\n");
  const Parsed parsed = parse({"inner.noise=0.5"}, file);
  ASSERT_EQ(parsed.inner_again.size(), 3);  // `noise` and `on` from the file, `noise` from --set
  const Parsed again = parse(parsed.inner_again);
  EXPECT_EQ(again.error, "");
  EXPECT_EQ(again.inner.noise, 0.5);
  EXPECT_TRUE(again.inner.on);
  EXPECT_THAT(parse({}).inner_again, IsEmpty());
}

TEST_F(OptionFile, TheLastLayerWins) {
  const std::string file = write("outer: {reach_m: 1, count: 1}\n");
  EXPECT_EQ(parse({}, file).outer.reach_m, 1);
  EXPECT_EQ(parse({"outer.reach_m=2"}, file).outer.reach_m, 2);
  EXPECT_EQ(parse({"outer.reach_m=2", "outer.reach_m=4"}, file).outer.reach_m, 4);
  EXPECT_EQ(parse({"outer.reach_m=2"}, file).outer.count, 1);
}

TEST(OptionLayers, ErrorsUseThePrefixAndTheHintOfTheCaller) {
  OptionLayers layers({.name = "set", .how_to_write = "See the list."});
  const auto error_of = [](const Status& status) { return to_string(status.error()); };
  testing::expect_on_page("config", error_of(layers.load("", {"outer"})));
  testing::expect_on_page("config", error_of(OptionLayers().load("", {"outer"})));
  EXPECT_THAT(error_of(layers.load("", {"outer"})), HasSubstr("(set outer)"));
  EXPECT_THAT(error_of(layers.load("", {"outer"})), HasSubstr("See the list."));
  EXPECT_THAT(error_of(OptionLayers().load("", {"outer"})), HasSubstr("(outer)"));
  EXPECT_THAT(error_of(OptionLayers().load("", {"outer"})), HasSubstr("SECTION.KEY=VALUE"));
}

TEST(OptionLayers, ReportsWhichSectionsAndKeysWereGiven) {
  OptionLayers layers({.name = "set"});
  layers.add_section("outer", reads<Outer>());
  layers.add_section("inner", reads<Inner>());
  ASSERT_TRUE(layers.load("", {"outer.motion.noise=0.5", "outer.count=2"}));
  EXPECT_TRUE(layers.given("outer"));
  EXPECT_TRUE(layers.given("outer.motion"));
  EXPECT_TRUE(layers.given("outer.motion.noise"));
  EXPECT_FALSE(layers.given("outer.reach_m"));
  EXPECT_FALSE(layers.given("inner"));
  EXPECT_EQ(layers.first_assignment("outer"), "set outer.motion.noise=0.5");
  EXPECT_EQ(layers.first_assignment("outer", "count"), "set outer.count=2");
  EXPECT_EQ(layers.first_assignment("inner"), "");
}

}  // namespace
}  // namespace waymark
