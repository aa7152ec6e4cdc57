#include "waymark/app/cli/flags.hpp"

#include <gtest/gtest.h>

#include "tests/support/nested_options.hpp"

namespace waymark::cli {
namespace {

using test::Inner;
using test::OptionFile;
using test::Outer;

/// A verb with one section whose fields are flags and one section without flags.
struct Args {
  explicit Args(CLI::App& app)
      : settings(app),
        outer(settings, "outer", "Outside"),
        inner(settings, "inner", "Inside", Reach::SettingsOnly) {}
  Settings settings;
  OptionFlags<Outer> outer;
  OptionFlags<Inner> inner;
};

struct Parsed {
  Outer outer{.count = 7};  // as if read from a robot file
  Inner inner{};
  std::string error{};
  bool outer_given = false;
  std::string first_argument{};
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
  return parsed;
}

TEST_F(OptionFile, AFlagOverridesSetAndSetOverridesTheFile) {
  const std::string file = write("outer: {reach_m: 1, count: 1, motion: {noise: 0.2}}\n");
  const Parsed all = parse({"--reach-m", "3", "--set", "outer.reach_m=2", "--config", file, "--set",
                            "outer.motion.noise=0.3", "--noise", "0.4"});
  EXPECT_EQ(all.error, "");
  EXPECT_EQ(all.outer.reach_m, 3);
  EXPECT_EQ(all.outer.count, 1);
  EXPECT_EQ(all.outer.motion.noise, 0.4);
  EXPECT_EQ(parse({"--set", "outer.reach_m=2", "--config", file}).outer.reach_m, 2);
  EXPECT_EQ(parse({"--set", "outer.reach_m=2", "--set", "outer.reach_m=4"}).outer.reach_m,
            4);  // the last value is used
  EXPECT_EQ(parse({"--config", file}).outer.reach_m, 1);
  EXPECT_EQ(parse({"--reach-m", "0.5", "--config", file}).outer.reach_m, 0.5);  // a flag that sets the
                                                                                // default value counts as
                                                                                // well
}

TEST_F(OptionFile, ReportsWhichOptionsWereGiven) {
  const std::string file = write("outer: {reach_m: 1}\n");
  EXPECT_FALSE(parse({}).outer_given);
  EXPECT_TRUE(parse({"--config", file}).outer_given);
  EXPECT_EQ(parse({"--config", file}).first_argument, "");  // the option is in the file, not on the command
                                                            // line
  EXPECT_EQ(parse({"--set", "outer.count=2"}).first_argument, "--set outer.count=2");
  EXPECT_EQ(parse({"--count", "2"}).first_argument, "--count");
  EXPECT_FALSE(parse({"--set", "inner.noise=0.5"}).outer_given);
}

}  // namespace
}  // namespace waymark::cli
