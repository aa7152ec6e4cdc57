#include "waymark/cli/settings.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/cli/options_flags.hpp"

namespace waymark::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Inner {
  double noise = 0.1;
  bool on = false;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.noise, Field{"noise", "Noise.", 0, 1});
    visit(self.on, Field{"on", "Whether at all."});
  }
};

struct Outer {
  double reach_m = 0.5;
  int count = 3;
  std::string word = "yes";
  std::vector<std::string> names = {};
  Inner motion = {};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.reach_m, Field{"reach_m", "Reach.", 0, 10});
    visit(self.count, Field{"count", "How many.", 1, 9});
    visit(self.word, Field{"word", "Any word."});
    visit(self.names, Field{"names", "A list."});
    visit(self.motion, Field{"motion", "Noise of the motion."});
  }
};

/// A verb with a section whose fields are flags and one without flags.
struct Args {
  explicit Args(CLI::App& app)
      : settings(app),
        outer(app, settings, "outer", "Outside"),
        inner(app, settings, "inner", "Inside", Reach::SettingsOnly) {}
  Settings settings;
  OptionFlags<Outer> outer;
  OptionFlags<Inner> inner;
};

struct Parsed {
  Outer outer{.count = 7};  // as a robot's file might say
  Inner inner{};
  std::string error{};
  bool outer_given = false;
  std::string first_argument{};
  std::vector<std::string> inner_again{};
};

Parsed parse(std::vector<std::string> words) {
  CLI::App app;
  const Args args(app);
  Parsed parsed;
  std::ranges::reverse(words);
  try {
    app.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    parsed.error = error.what();
    return parsed;
  }
  Status status = args.outer.apply(parsed.outer);
  if (status) status = args.inner.apply(parsed.inner);
  if (!status) parsed.error = to_string(status.error());
  parsed.outer_given = args.outer.given();
  parsed.first_argument = args.outer.first_argument();
  parsed.inner_again = args.settings.assignments("inner");
  return parsed;
}

class SettingsFile : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::temp_directory_path() /
            ("settings-" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) +
             ".yaml");
  }
  void TearDown() override { std::filesystem::remove(path_); }
  std::string write(const std::string& text) {
    std::ofstream(path_) << text;
    return path_.string();
  }

 private:
  std::filesystem::path path_;
};

TEST(Settings, SetReachesEveryTypeOfFieldAlsoOfNestedStructs) {
  const Parsed parsed =
      parse({"--set", "outer.reach_m=0.25", "--set", "outer.word=no", "--set", "outer.names=[a, b]", "--set",
             "outer.motion.noise=0.75", "--set", "outer.motion.on=true", "--set", "inner.noise=0.5"});
  EXPECT_EQ(parsed.error, "");
  EXPECT_EQ(parsed.outer.reach_m, 0.25);
  EXPECT_EQ(parsed.outer.count, 7);  // nobody said otherwise
  EXPECT_EQ(parsed.outer.word, "no");
  EXPECT_THAT(parsed.outer.names, ElementsAre("a", "b"));
  EXPECT_EQ(parsed.outer.motion.noise, 0.75);
  EXPECT_TRUE(parsed.outer.motion.on);
  EXPECT_EQ(parsed.inner.noise, 0.5);
  EXPECT_FALSE(parsed.inner.on);
}

TEST_F(SettingsFile, AFlagGoesBeforeSetAndSetBeforeTheFile) {
  const std::string file = write("outer: {reach_m: 1, count: 1, motion: {noise: 0.2}}\n");
  const Parsed all = parse({"--reach-m", "3", "--set", "outer.reach_m=2", "--config", file, "--set",
                            "outer.motion.noise=0.3", "--noise", "0.4"});
  EXPECT_EQ(all.error, "");
  EXPECT_EQ(all.outer.reach_m, 3);
  EXPECT_EQ(all.outer.count, 1);
  EXPECT_EQ(all.outer.motion.noise, 0.4);
  EXPECT_EQ(parse({"--set", "outer.reach_m=2", "--config", file}).outer.reach_m, 2);
  EXPECT_EQ(parse({"--set", "outer.reach_m=2", "--set", "outer.reach_m=4"}).outer.reach_m,
            4);  // the last one
  EXPECT_EQ(parse({"--config", file}).outer.reach_m, 1);
  EXPECT_EQ(parse({"--reach-m", "0.5", "--config", file}).outer.reach_m, 0.5);  // also a flag of the default
}

TEST(Settings, MistakesOfSetAreRefusedWithTheArgument) {
  EXPECT_THAT(parse({"--set", "outer.reach=1"}).error,
              HasSubstr("(--set outer.reach=1): unknown key 'reach'. Did you mean 'reach_m'?"));
  EXPECT_THAT(parse({"--set", "outr.reach_m=1"}).error,
              HasSubstr("(--set outr.reach_m=1): unknown section 'outr'. Did you mean 'outer'?"));
  EXPECT_THAT(parse({"--set", "outer.motion.nois=1"}).error, HasSubstr("Did you mean 'noise'?"));
  EXPECT_THAT(parse({"--set", "outer.reach_m=11"}).error,
              HasSubstr("(--set outer.reach_m=11): 11 is outside"));
  EXPECT_THAT(parse({"--set", "outer.reach_m=far"}).error, HasSubstr("'far' is not a number"));
  EXPECT_THAT(parse({"--set", "outer.reach_m=.nan"}).error, HasSubstr("not a finite number"));
  EXPECT_THAT(parse({"--set", "outer.count=2.5"}).error, HasSubstr("'2.5' is not a whole number"));
  for (const char* nonsense :
       {"outer", "outer=1", "outer.reach_m", "outer.reach_m=", "outer.=1", ".reach_m=1", "outer.reach_m.x=1",
        "outer.motion=1", "outer.names=a", "=", "outer.reach_m={"})
    EXPECT_THAT(parse({"--set", nonsense}).error, HasSubstr(std::string("(--set ") + nonsense + ")"))
        << nonsense;
}

TEST_F(SettingsFile, MistakesOfTheFileAreRefusedWithTheirLine) {
  const auto error_of = [&](const std::string& text) { return parse({"--config", write(text)}).error; };
  EXPECT_THAT(error_of("inner:\n  noise: 0.5\nouter:\n  reach: 1\n"),
              HasSubstr(".yaml:4 (outer.reach): unknown key 'reach'. Did you mean 'reach_m'?"));
  EXPECT_THAT(error_of("innr: {}\n"), HasSubstr(".yaml:1 (innr): unknown key 'innr'. Did you mean 'inner'?"));
  EXPECT_THAT(error_of("outer:\n  count: 10\n"), HasSubstr(".yaml:2 (outer.count): 10 is outside [1, 9]"));
  EXPECT_THAT(error_of("outer: [\n"), HasSubstr(".yaml"));
  EXPECT_THAT(parse({"--config", "no-such.yaml"}).error, HasSubstr("no-such.yaml: there is no such file"));
  EXPECT_EQ(error_of(""), "");
}

TEST_F(SettingsFile, WhatWasGivenIsKnown) {
  const std::string file = write("outer: {reach_m: 1}\n");
  EXPECT_FALSE(parse({}).outer_given);
  EXPECT_TRUE(parse({"--config", file}).outer_given);
  EXPECT_EQ(parse({"--config", file}).first_argument, "");  // is not on the command line
  EXPECT_EQ(parse({"--set", "outer.count=2"}).first_argument, "--set outer.count=2");
  EXPECT_EQ(parse({"--count", "2"}).first_argument, "--count");
  EXPECT_FALSE(parse({"--set", "inner.noise=0.5"}).outer_given);
}

TEST_F(SettingsFile, ASectionBecomesAssignmentsForAnotherCommandLine) {
  const std::string file = write("inner: {noise: 0.2, on: true}\n");
  const Parsed parsed = parse({"--set", "inner.noise=0.5", "--config", file});
  ASSERT_EQ(parsed.inner_again.size(), 3);  // noise and on of the file, noise of --set
  std::vector<std::string> words;
  for (const std::string& assignment : parsed.inner_again) words.insert(words.end(), {"--set", assignment});
  const Parsed again = parse(words);
  EXPECT_EQ(again.error, "");
  EXPECT_EQ(again.inner.noise, 0.5);
  EXPECT_TRUE(again.inner.on);
  EXPECT_THAT(parse({}).inner_again, IsEmpty());
}

}  // namespace
}  // namespace waymark::cli
