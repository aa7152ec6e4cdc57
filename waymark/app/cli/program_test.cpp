#include "waymark/app/cli/program.hpp"

#include <array>
#include <cstdio>
#include <memory>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/app/cli/flags.hpp"
#include "waymark/app/cli/help_text.hpp"

namespace waymark::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

struct SomeOptions {
  double tag_size_m = 0.5;
  int count = 3;
  bool careful = true;
  std::string word = "yes";
  std::vector<int> list = {};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.tag_size_m, Field{"tag_size_m", "Side of the tag.", 0.1, 2});
    visit(self.count, Field{"count", "How many.", 1});
    visit(self.careful, Field{"careful", "Look twice."});
    visit(self.word, Field{"word", "Any word."});
    visit(self.list, Field{"list", "Has no flag."});
  }
};

/// A verb that prints its options, applied to a configuration with count = 7.
Run prepare_show(CLI::App& app) {
  const auto settings = std::make_shared<Settings>(app);
  const auto flags = std::make_shared<OptionFlags<SomeOptions>>(*settings, "some", "Some");
  return [settings, flags](Console& console) {
    SomeOptions options{.count = 7};
    if (const Status applied = flags->apply(options); !applied)
      return console.failed(applied.error(), ExitCode::Usage);
    console.print(
        fmt::format("{} {} {} {}\n", options.tag_size_m, options.count, options.careful, options.word));
    return ExitCode::Ok;
  };
}

Run prepare_count(CLI::App& app) {
  const auto last = std::make_shared<int>(0);
  app.add_option("--up-to", *last, "The last number");
  return [last](Console& console) {
    console.print(fmt::format("1 to {}\n", *last));
    return ExitCode::Ok;
  };
}

struct PlaceJob {
  std::vector<double> start = {};
  std::vector<std::string> logs = {};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.start, JobField("start NUMBER", "Where it begins.").parts(3));
    visit(self.logs, JobField("logs LOG", "Recordings.").input());
  }
};

ExitCode place(const PlaceJob& job, Console& console) {
  console.print(fmt::format("{}: {}\n", fmt::join(job.start, " "), fmt::join(job.logs, " ")));
  return ExitCode::Ok;
}

Run prepare_throw(CLI::App& /*app*/) {
  return [](Console&) -> ExitCode { throw std::runtime_error("from a library"); };
}

struct Outcome {
  int code = 0;
  std::string out;
  std::string err;
};

std::string contents(std::FILE* file) {
  std::rewind(file);
  std::string text;
  std::array<char, 4096> block{};
  while (const std::size_t got = std::fread(block.data(), 1, block.size(), file))
    text.append(block.data(), got);
  return text;
}

Outcome run(std::vector<std::string> words, std::FILE* out_or_null = nullptr) {
  const Verb program{
      .name = "prog",
      .sentence = "A program.",
      .help = "",
      .verbs = {
          {.name = "show", .sentence = "Shows.", .help = "Example:\n  prog show\n", .prepare = prepare_show},
          {.name = "throw", .sentence = "Throws.", .help = "", .prepare = prepare_throw},
          {.name = "deep",
           .sentence = "Leads on.",
           .help = "",
           .verbs = {{.name = "show", .sentence = "S.", .help = "", .prepare = prepare_show}}},
          {.name = "usual",
           .sentence = "Reads a line by what it holds.",
           .help = "",
           .verbs = {{.name = "show", .sentence = "S.", .help = "", .prepare = prepare_show},
                     {.name = "count", .sentence = "C.", .help = "", .prepare = prepare_count}},
           .usual_verb = [](const auto& words) { return has_word(words, "--up-to") ? "count" : "show"; }},
          {.name = "beside",
           .sentence = "Leads on to verbs of which the first may mean the second.",
           .help = "",
           .verbs = {{.name = "show",
                      .sentence = "S.",
                      .help = "",
                      .prepare = prepare_show,
                      .usual_verb =
                          [](const auto& words) { return has_word(words, "--up-to") ? "count" : "show"; }},
                     {.name = "count", .sentence = "C.", .help = "", .prepare = prepare_count}}},
          {.name = "place", .sentence = "Takes a place.", .help = "", .prepare = prepared_job(place)}}};
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> out(std::tmpfile(), std::fclose);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> err(std::tmpfile(), std::fclose);
  Outcome outcome;
  outcome.code =
      run_program(program, std::move(words), out_or_null != nullptr ? out_or_null : out.get(), err.get());
  outcome.out = contents(out.get());
  outcome.err = contents(err.get());
  return outcome;
}

TEST(Program, FlagsAreMadeFromFieldsAndOverrideTheConfiguration) {
  EXPECT_EQ(run({"show"}).out, "0.5 7 true yes\n");
  EXPECT_EQ(run({"show", "--tag-size-m", "0.25", "--count=3", "--no-careful", "--word", "no"}).out,
            "0.25 3 false no\n");
  EXPECT_EQ(run({"deep", "show", "--careful"}).out, "0.5 7 true yes\n");
}

TEST(Program, ValuesOutsideTheirRangeAreUsageErrors) {
  const Outcome outcome = run({"show", "--tag-size-m", "7"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("prog show: (--tag-size-m): 7"));
  EXPECT_THAT(outcome.err, HasSubstr("[0.1, 2]"));
  testing::expect_on_page("cli", outcome.err);
  EXPECT_EQ(run({"show", "--tag-size-m", "nan"}).code, 2);
  EXPECT_EQ(run({"show", "--tag-size-m", "wide"}).code, 2);
  EXPECT_EQ(run({"show", "--count", "2.5"}).code, 2);
  EXPECT_EQ(run({"show", "--count"}).code, 2);
}

/// Expects a usage error: nothing on standard output, and a message that contains each of the parts. The
/// golden page contains the full text.
void expect_usage(const std::vector<std::string>& words, const std::vector<std::string>& parts) {
  const Outcome outcome = run(words);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_EQ(outcome.out, "");
  for (const std::string& part : parts) EXPECT_THAT(outcome.err, HasSubstr(part));
  testing::expect_on_page("cli", outcome.err);
}

TEST(Program, SuggestsTheNearestVerbOrFlagForAMisspeltOne) {
  expect_usage({"shwo"}, {"prog: ", "'shwo'", "'show'?", "`prog --help`"});
  expect_usage({"xyzzy"}, {"show, throw, deep, usual, beside, place."});
  expect_usage({"deep", "sow"}, {"prog deep: ", "'sow'", "'show'?", "`prog deep --help`"});
  expect_usage({"show", "--tag-size", "1"}, {"prog show: ", "'--tag-size'", "'--tag-size-m'?"});
  expect_usage({"show", "--cuont=3"}, {"prog show: ", "'--cuont'", "'--count'?", "`prog show --help`"});
  for (const auto& words :
       {std::vector<std::string>{"shwo"}, {"deep"}, {"deep", "sow"}, {"show", "--x"}, {}, {"--x"}}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_EQ(outcome.out, "");
    EXPECT_NE(outcome.err, "");
  }
}

TEST(Program, TheFlagsOfALineImplyItsVerb) {
  EXPECT_EQ(run({"usual", "--count", "3"}).out, "0.5 3 true yes\n");
  EXPECT_EQ(run({"usual", "--up-to", "5"}).out, "1 to 5\n");
  EXPECT_EQ(run({"usual", "--up-to=5"}).out, "1 to 5\n");
  EXPECT_EQ(run({"usual"}).out, run({"show"}).out);
  EXPECT_EQ(run({"usual", "count", "--up-to", "5"}).out, "1 to 5\n");
  expect_usage({"usual", "show", "--up-to", "5"}, {"prog usual show: ", "'--up-to' of `prog usual show`",
                                                   "`prog usual count`", "`prog usual count --help`"});
  EXPECT_EQ(run({"usual", "--count", "x"}).err.substr(0, 12), "prog usual: ")
      << "the verb as the user typed it";
  EXPECT_THAT(run({"usual", "--help"}).out, HasSubstr("count"));
  EXPECT_THAT(run({"help", "usual", "count"}).out, HasSubstr("--up-to"));
  EXPECT_EQ(run({"usual", "--count=2", "--up-to", "5"}).code, 2) << "the flags belong to two verbs";
}

TEST(Program, AVerbMayFollowFlags) {
  EXPECT_EQ(run({"usual", "--up-to", "5", "count"}).out, "1 to 5\n");
  EXPECT_EQ(run({"deep", "--count", "3", "--careful", "show"}).out, "0.5 3 true yes\n");
  EXPECT_EQ(run({"usual", "--word", "count"}).out, "0.5 7 true count\n")
      << "the value of a flag is not a verb";
  expect_usage({"deep", "--word", "no", "sow"}, {"prog deep: ", "'sow'", "'show'?", "`prog deep --help`"});
  expect_usage({"deep", "--careful"}, {"prog deep: ", "show", "`prog deep --help`"});
  expect_usage({"--count", "3", "show"}, {"prog: ", "'--count'", "`prog show`", "`prog --help`"});
}

TEST(Program, AMisspeltVerbIsNotTakenForAnInput) {
  for (const auto& words : {std::vector<std::string>{"usual", "coutn"},
                            {"usual", "coutn", "lap.mcap"},
                            {"usual", "--up-to", "5", "coutn", "lap.mcap"}}) {
    expect_usage(words, {"prog usual: ", "'coutn'", "`prog usual count`?", "`prog usual --help`"});
  }
  EXPECT_THAT(run({"usual", "./coutn"}).err, HasSubstr("./coutn")) << "a path is an input";
  EXPECT_THAT(run({"usual", "./coutn"}).err, Not(HasSubstr("`prog usual count`")));
}

TEST(Program, AFlagWithoutItsValueIsReported) {
  expect_usage({"show", "--count"}, {"prog show: --count", "(INTEGER)", "`prog show --help`"});
  for (const auto& words : {std::vector<std::string>{"show", "--word", "--count", "3"},
                            {"show", "--word", ""},
                            {"show", "--word=", "--count", "3"},
                            {"show", "--word", "--"}}) {
    expect_usage(words, {"prog show: --word", "(TEXT)", "`prog show --help`"});
  }
  expect_usage({"show", "--count", "-3"}, {"(--count): -3"});  // a number rather than a flag
  expect_usage({"place", ""}, {"prog place: ", "`prog place --help`"});
}

TEST(Program, AFlagWithAFixedNumberOfValuesTakesNoMore) {
  EXPECT_EQ(run({"place", "--start", "1", "-2", "3", "lap.mcap", "b"}).out, "1 -2 3: lap.mcap b\n");
  EXPECT_EQ(run({"place", "lap.mcap", "--start", "1", "-2", "3"}).out, "1 -2 3: lap.mcap\n");
  expect_usage({"place", "--start", "1", "2", "lap.mcap"}, {"(--start): 'lap.mcap'"});
  expect_usage({"place", "lap.mcap", "--start", "1", "2"},
               {"prog place: --start", " 3 ", "(NUMBER)", "`prog place --help`"});
  expect_usage({"place", "--start", "1", "2", "3", "--start", "1", "2", "3"}, {"(--start): "});
}

TEST(Program, AnUnusableConfigFileIsAFailure) {
  const Outcome missing = run({"show", "--config", "none.yaml"});
  EXPECT_EQ(missing.code, 1);
  EXPECT_THAT(missing.err, HasSubstr("prog show: none.yaml: "));
  testing::expect_on_page("cli", missing.err);
  EXPECT_EQ(run({"show", "--set", "some.cuont=3"}).code, 2) << "an error in the command line";
}

TEST(Program, ALineMayImplyASiblingOfItsVerb) {
  EXPECT_EQ(run({"beside", "show", "--count", "3"}).out, "0.5 3 true yes\n");
  EXPECT_EQ(run({"beside", "show", "--up-to", "5"}).out, "1 to 5\n");
  EXPECT_EQ(run({"beside", "count", "--up-to", "5"}).out, "1 to 5\n");
  expect_usage({"beside", "show", "--up-to", "x"},
               {"prog beside show: (--up-to): 'x'", "`prog beside count --help`"});
  expect_usage({"beside", "show", "--up-to", "5", "--word", "no"},
               {"prog beside show: ", "'--word' of `prog beside count`", "`prog beside show`",
                "`prog beside show --help`"});
  EXPECT_THAT(run({"beside", "show", "--help"}).out, HasSubstr("prog beside show"));
  EXPECT_THAT(run({"beside", "show", "--up-to", "5", "--help"}).out, HasSubstr("prog beside count"));
  EXPECT_THAT(run({"show", "--up-to", "5"}).err, Not(HasSubstr("' of `")))
      << "other verbs of the program are not suggested";
}

TEST(Program, InputsAreNeitherFlagsNorTheirValues) {
  const std::vector<Verb> verbs = {{.name = "show", .sentence = "", .help = "", .prepare = prepare_show},
                                   {.name = "count", .sentence = "", .help = "", .prepare = prepare_count}};
  using Words = std::vector<std::string>;
  EXPECT_EQ(inputs_of({"a", "--up-to", "5", "b", "--word=c", "d"}, verbs), Words({"a", "b", "d"}));
  EXPECT_EQ(inputs_of({"--careful", "a", "--no-careful", "b"}, verbs), Words({"a", "b"})) << "switches";
  EXPECT_EQ(inputs_of({"--count", "-3", "a", "--unknown", "b"}, verbs), Words({"a", "b"}));
  EXPECT_EQ(inputs_of({"--set", "some.count=1", "a", "--", "--up-to"}, verbs), Words({"a", "--up-to"}));
  EXPECT_EQ(inputs_of({}, verbs), Words());
}

TEST(Program, HelpShowsTheFirstGroupAndCountsTheOthers) {
  for (const auto& words : {std::vector<std::string>{"show", "--help"}, {"show", "-h"}, {"help", "show"}}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.err, "");
    for (const char* part : {"Usage: prog show", "--set SECTION.KEY=VALUE", "--help-all",
                             "4 more: --help-all", "Example:\n  prog show"}) {
      EXPECT_THAT(outcome.out, HasSubstr(part));
    }
    EXPECT_EQ(outcome.out.find("--tag-size-m"), std::string::npos);
  }
}

TEST(Program, OnlyNamedVerbsGetTheirFlags) {
  std::vector<std::string> prepared;
  const auto noted = [&prepared](const char* name) {
    return [&prepared, name](CLI::App& /*app*/) -> cli::Run {
      prepared.emplace_back(name);
      return [](Console&) { return ExitCode::Ok; };
    };
  };
  const Verb program{
      .name = "prog",
      .sentence = "A program.",
      .help = "",
      .verbs = {{.name = "one", .sentence = "One.", .help = "", .prepare = noted("one")},
                {.name = "two",
                 .sentence = "Two.",
                 .help = "",
                 .prepare = noted("two"),
                 .verbs = {{.name = "three", .sentence = "Three.", .help = "", .prepare = noted("three")}}}}};
  EXPECT_EQ(run_program(program, {"two"}), 0);
  EXPECT_EQ(prepared, std::vector<std::string>({"two"}));
  EXPECT_EQ(run_program(program, {"two", "three"}), 0);
  EXPECT_EQ(prepared, std::vector<std::string>({"two", "two", "three"}));
}

TEST(Program, HelpAllShowsAllGroups) {
  for (const auto& words : {std::vector<std::string>{"show", "--help-all"}, {"help", "show", "--help-all"}}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.err, "");
    EXPECT_THAT(outcome.out, HasSubstr("Some (--set some.KEY=VALUE):"));
    EXPECT_THAT(outcome.out, HasSubstr("some.list=[]"));  // the list has no flag
    for (const char* part : {"Usage: prog show", "--tag-size-m", "Side of the tag. From 0.1 to 2.", "=0.5",
                             "Look twice. On", "--no-careful", "Example:\n  prog show"}) {
      EXPECT_THAT(outcome.out, HasSubstr(part));
    }
  }
  EXPECT_THAT(run({"--help"}).out, HasSubstr("Shows."));
  EXPECT_THAT(run({"--version"}).out, HasSubstr("prog "));
}

TEST(Program, LostResultsAreAFailureWithAMessage) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> full(std::fopen("/dev/full", "w"), std::fclose);
  ASSERT_NE(full, nullptr);
  const Outcome outcome = run({"show"}, full.get());
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("No space left on device"));
  testing::expect_on_page("cli", outcome.err);
}

TEST(Program, AnExceptionOfALibraryIsNotACrash) {
  const Outcome outcome = run({"throw"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("from a library"));
  testing::expect_on_page("cli", outcome.err);
}

TEST(HelpText, IsWrappedBetweenWords) {
  EXPECT_EQ(wrapped("one two three", 7), "one two\nthree");
  EXPECT_EQ(wrapped("  one   two ", 3), "one\ntwo");
  EXPECT_EQ(wrapped("incomprehensible", 3), "incomprehensible");
  EXPECT_EQ(wrapped("", 10), "");
}

}  // namespace
}  // namespace waymark::cli
