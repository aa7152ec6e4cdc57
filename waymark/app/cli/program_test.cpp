#include "waymark/app/cli/program.hpp"

#include <array>
#include <cstdio>
#include <memory>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

/// What the verb of the test program prints: its options as applied over a configuration that says count = 7.
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

TEST(Program, FlagsComeFromTheFieldsAndOverrideWhatWasConfigured) {
  EXPECT_EQ(run({"show"}).out, "0.5 7 true yes\n");
  EXPECT_EQ(run({"show", "--tag-size-m", "0.25", "--count=3", "--no-careful", "--word", "no"}).out,
            "0.25 3 false no\n");
  EXPECT_EQ(run({"deep", "show", "--careful"}).out, "0.5 7 true yes\n");
}

TEST(Program, ValuesOutsideTheirRangeAreUsageErrors) {
  const Outcome outcome = run({"show", "--tag-size-m", "7"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_EQ(outcome.err, "prog show: (--tag-size-m): 7 is outside [0.1, 2]. Side of the tag.\n");
  EXPECT_EQ(run({"show", "--tag-size-m", "nan"}).code, 2);
  EXPECT_EQ(run({"show", "--tag-size-m", "wide"}).code, 2);
  EXPECT_EQ(run({"show", "--count", "2.5"}).code, 2);
  EXPECT_EQ(run({"show", "--count"}).code, 2);
}

TEST(Program, MisspeltWordsGetTheNearestOne) {
  EXPECT_EQ(run({"shwo"}).err, "prog: unknown verb 'shwo'. Did you mean 'show'? See `prog --help`.\n");
  EXPECT_THAT(run({"xyzzy"}).err, HasSubstr("Known: show, throw, deep, usual, beside, place."));
  EXPECT_EQ(run({"deep", "sow"}).err,
            "prog deep: unknown verb 'sow'. Did you mean 'show'? See `prog deep --help`.\n");
  EXPECT_EQ(run({"show", "--tag-size", "1"}).err,
            "prog show: unknown flag '--tag-size'. Did you mean '--tag-size-m'? See `prog show --help`.\n");
  EXPECT_EQ(run({"show", "--cuont=3"}).err,
            "prog show: unknown flag '--cuont'. Did you mean '--count'? See `prog show --help`.\n");
  for (const auto& words :
       {std::vector<std::string>{"shwo"}, {"deep"}, {"deep", "sow"}, {"show", "--x"}, {}, {"--x"}}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_EQ(outcome.out, "");
    EXPECT_NE(outcome.err, "");
  }
}

TEST(Program, AVerbThatIsLeftOutIsFoundByTheLine) {
  EXPECT_EQ(run({"usual", "--count", "3"}).out, "0.5 3 true yes\n");
  EXPECT_EQ(run({"usual", "--up-to", "5"}).out, "1 to 5\n");
  EXPECT_EQ(run({"usual", "--up-to=5"}).out, "1 to 5\n");
  EXPECT_EQ(run({"usual"}).out, run({"show"}).out);
  EXPECT_EQ(run({"usual", "count", "--up-to", "5"}).out, "1 to 5\n");
  EXPECT_EQ(
      run({"usual", "show", "--up-to", "5"}).err,
      "prog usual show: unknown flag '--up-to' of `prog usual show`: it is one of `prog usual count`. See "
      "`prog usual show --help`.\n");
  EXPECT_EQ(run({"usual", "--count", "x"}).err.substr(0, 12), "prog usual: ") << "named as the user named it";
  EXPECT_THAT(run({"usual", "--help"}).out, HasSubstr("count"));
  EXPECT_THAT(run({"help", "usual", "count"}).out, HasSubstr("--up-to"));
  EXPECT_EQ(run({"usual", "--count=2", "--up-to", "5"}).code, 2) << "of two verbs";
}

TEST(Program, AVerbMayBeNamedAfterFlags) {
  EXPECT_EQ(run({"usual", "--up-to", "5", "count"}).out, "1 to 5\n");
  EXPECT_EQ(run({"deep", "--count", "3", "--careful", "show"}).out, "0.5 3 true yes\n");
  EXPECT_EQ(run({"usual", "--word", "count"}).out, "0.5 7 true count\n") << "the value of a flag is no verb";
  EXPECT_EQ(run({"deep", "--word", "no", "sow"}).err,
            "prog deep: unknown verb 'sow'. Did you mean 'show'? See `prog deep --help`.\n");
  EXPECT_EQ(run({"deep", "--careful"}).err,
            "prog deep: no verb given. Known: show. See `prog deep --help`.\n");
  EXPECT_EQ(run({"--count", "3", "show"}).err,
            "prog: the flag '--count' belongs after `prog show`. See `prog --help`.\n");
}

TEST(Program, AMisspeltVerbIsNotTakenForAnInput) {
  const char* message =
      "prog usual: 'coutn' is neither a verb nor a file. Did you mean `prog usual count`? See `prog usual "
      "--help`.\n";
  for (const auto& words : {std::vector<std::string>{"usual", "coutn"},
                            {"usual", "coutn", "lap.mcap"},
                            {"usual", "--up-to", "5", "coutn", "lap.mcap"}}) {
    EXPECT_EQ(run(words).err, message);
    EXPECT_EQ(run(words).code, 2);
  }
  EXPECT_THAT(run({"usual", "./coutn"}).err, HasSubstr("./coutn")) << "a path is an input";
  EXPECT_THAT(run({"usual", "./coutn"}).err, Not(HasSubstr("Did you mean")));
}

TEST(Program, AFlagWithoutItsValueIsNamed) {
  EXPECT_EQ(run({"show", "--count"}).err,
            "prog show: --count needs a value (INTEGER). See `prog show --help`.\n");
  for (const auto& words : {std::vector<std::string>{"show", "--word", "--count", "3"},
                            {"show", "--word", ""},
                            {"show", "--word=", "--count", "3"},
                            {"show", "--word", "--"}}) {
    EXPECT_EQ(run(words).err, "prog show: --word needs a value (TEXT). See `prog show --help`.\n");
    EXPECT_EQ(run(words).code, 2);
  }
  EXPECT_THAT(run({"show", "--count", "-3"}).err, HasSubstr("(--count): -3 is outside")) << "a number";
  EXPECT_THAT(run({"place", ""}).err, HasSubstr("an input is empty"));
}

TEST(Program, AListOfSoManyPartsTakesNoMore) {
  EXPECT_EQ(run({"place", "--start", "1", "-2", "3", "lap.mcap", "b"}).out, "1 -2 3: lap.mcap b\n");
  EXPECT_EQ(run({"place", "lap.mcap", "--start", "1", "-2", "3"}).out, "1 -2 3: lap.mcap\n");
  EXPECT_THAT(run({"place", "--start", "1", "2", "lap.mcap"}).err,
              HasSubstr("(--start): 'lap.mcap' is not a number."));
  EXPECT_EQ(run({"place", "lap.mcap", "--start", "1", "2"}).err,
            "prog place: --start needs 3 values (NUMBER). See `prog place --help`.\n");
  EXPECT_THAT(run({"place", "--start", "1", "2", "3", "--start", "1", "2", "3"}).err,
              HasSubstr("(--start): given more than once"));
}

TEST(Program, AFileOfOptionsThatIsNotUsableIsAFailure) {
  const Outcome missing = run({"show", "--config", "none.yaml"});
  EXPECT_EQ(missing.code, 1);
  EXPECT_EQ(missing.err, "prog show: none.yaml: there is no such file. Check the path.\n");
  EXPECT_EQ(run({"show", "--set", "some.cuont=3"}).code, 2) << "is on the line";
}

TEST(Program, ALineMayMeanTheVerbBesideTheOneItNames) {
  EXPECT_EQ(run({"beside", "show", "--count", "3"}).out, "0.5 3 true yes\n");
  EXPECT_EQ(run({"beside", "show", "--up-to", "5"}).out, "1 to 5\n");
  EXPECT_EQ(run({"beside", "count", "--up-to", "5"}).out, "1 to 5\n");
  EXPECT_EQ(run({"beside", "show", "--up-to", "x"}).err,
            "prog beside show: (--up-to): 'x' is not a number. See `prog beside count --help`.\n");
  EXPECT_EQ(
      run({"beside", "show", "--up-to", "5", "--word", "no"}).err,
      "prog beside show: unknown flag '--word' of `prog beside count`: it is one of `prog beside show`. "
      "See `prog beside count --help`.\n");
  EXPECT_THAT(run({"beside", "show", "--help"}).out, HasSubstr("prog beside show"));
  EXPECT_THAT(run({"beside", "show", "--up-to", "5", "--help"}).out, HasSubstr("prog beside count"));
  EXPECT_THAT(run({"show", "--up-to", "5"}).err, HasSubstr("prog show: unknown flag '--up-to'."))
      << "the other verbs of the program are not looked through";
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

TEST(Program, OnlyVerbsThatAreNamedGetTheirFlags) {
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

TEST(Program, HelpTeaches) {
  for (const auto& words : {std::vector<std::string>{"show", "--help-all"}, {"help", "show", "--help-all"}}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.err, "");
    EXPECT_THAT(outcome.out, HasSubstr("Some (--set some.KEY=VALUE):"));
    EXPECT_THAT(outcome.out, HasSubstr("some.list=[]"));  // has no flag
    for (const char* part : {"Usage: prog show", "--tag-size-m", "Side of the tag. From 0.1 to 2.", "=0.5",
                             "Look twice. On unless", "--no-careful", "Example:\n  prog show"}) {
      EXPECT_THAT(outcome.out, HasSubstr(part));
    }
  }
  EXPECT_THAT(run({"--help"}).out, HasSubstr("Shows."));
  EXPECT_THAT(run({"--version"}).out, HasSubstr("prog "));
}

TEST(Program, LostResultsAreAFailureInWords) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> full(std::fopen("/dev/full", "w"), std::fclose);
  ASSERT_NE(full, nullptr);
  const Outcome outcome = run({"show"}, full.get());
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("cannot write to standard output: No space left on device"));
}

TEST(Program, AnExceptionOfALibraryIsNotACrash) {
  const Outcome outcome = run({"throw"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("internal error: from a library"));
}

TEST(HelpText, IsWrappedBetweenWords) {
  EXPECT_EQ(wrapped("one two three", 7), "one two\nthree");
  EXPECT_EQ(wrapped("  one   two ", 3), "one\ntwo");
  EXPECT_EQ(wrapped("incomprehensible", 3), "incomprehensible");
  EXPECT_EQ(wrapped("", 10), "");
}

}  // namespace
}  // namespace waymark::cli
