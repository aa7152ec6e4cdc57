#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/base/printable.hpp"
#include "waymark/base/random.hpp"
#include "waymark/base/suggest.hpp"
#include "waymark/base/time.hpp"

namespace waymark {
namespace {

template <class A, class B>
concept Subtracts = requires(A a, B b) { a - b; };

TEST(Time, StampsOfDifferentClocksDoNotSubtract) {
  static_assert(Subtracts<SensorTime, SensorTime>);
  static_assert(!Subtracts<SensorTime, HostTime>);
  EXPECT_DOUBLE_EQ(to_seconds(SensorTime(Duration(1'500'000'000)) - SensorTime()), 1.5);
}

TEST(Error, SaysWhatWhereAndHowToMend) {
  const Error error{ErrorCode::InvalidArgument,
                    "negative focal length -3",
                    {.source = "cam.yaml", .line = 12, .key = "fx"},
                    "Give a value in pixels greater than 0."};
  EXPECT_EQ(to_string(error),
            "cam.yaml:12 (fx): negative focal length -3. Give a value in pixels greater than 0.");
  EXPECT_EQ(to_string(Error{ErrorCode::Unreadable, "cut short", {.source = "a.png", .byte = 7}}),
            "a.png at byte 7: cut short");
  EXPECT_EQ(to_string(Error{ErrorCode::NotFound, "nothing here"}), "nothing here");
}

TEST(Error, ResultChains) {
  const Result<int> two = 2;
  const Result<int> four = two.map([](int x) { return 2 * x; });
  ASSERT_TRUE(four);
  EXPECT_EQ(*four, 4);
  const Result<int> none = fail(ErrorCode::NotFound, "no");
  EXPECT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::NotFound);
}

TEST(Random, TheSameSeedGivesTheSameNumbersEverywhere) {
  Random random(1);
  // Fixed by the standard for mt19937_64, seed 1, first two draws.
  EXPECT_DOUBLE_EQ(random.uniform(), static_cast<double>(2469588189546311528ULL >> 11) * 0x1.0p-53);
  EXPECT_DOUBLE_EQ(random.uniform(), static_cast<double>(2516265689700432462ULL >> 11) * 0x1.0p-53);
}

TEST(Random, NormalHasTheMomentsOfTheNormal) {
  Random random(2);
  constexpr int kDraws = 200000;
  std::array<double, 5> moments{};
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.normal();
    for (std::size_t k = 1; k < moments.size(); ++k)
      moments.at(k) += std::pow(x, static_cast<double>(k)) / kDraws;
  }
  EXPECT_NEAR(moments[1], 0.0, 4 * std::sqrt(1.0 / kDraws));
  EXPECT_NEAR(moments[2], 1.0, 4 * std::sqrt(2.0 / kDraws));
  EXPECT_NEAR(moments[3], 0.0, 4 * std::sqrt(15.0 / kDraws));
  EXPECT_NEAR(moments[4], 3.0, 4 * std::sqrt(96.0 / kDraws));
}

TEST(Random, IndexIsUniform) {
  Random random(3);
  std::array<int, 7> counts{};
  constexpr int kDraws = 70000;
  for (int i = 0; i < kDraws; ++i) ++counts.at(random.index(7));
  for (const int count : counts) EXPECT_NEAR(count, kDraws / 7, 4 * std::sqrt(kDraws / 7.0));
}

TEST(Random, ForksAreIndependentOfLaterDraws) {
  Random a(4);
  Random b(4);
  Random fork_a = a.fork();
  Random fork_b = b.fork();
  for (int i = 0; i < 10; ++i) (void)a.normal();
  EXPECT_EQ(fork_a.uniform(), fork_b.uniform());
}

TEST(Suggest, FindsTheNearestWord) {
  const std::vector<std::string> verbs = {"detect", "evaluate", "teach", "tags"};
  EXPECT_EQ(nearest_word("detcet", verbs), "detect");
  EXPECT_EQ(nearest_word("Teach", verbs), "teach");
  EXPECT_EQ(nearest_word("36h11", {"tag16h5", "tag36h11"}), "tag36h11");
  EXPECT_EQ(nearest_word("banana", verbs), "");
  EXPECT_EQ(nearest_word("", verbs), "");
  EXPECT_EQ(suggestion("tech", verbs), "Did you mean 'teach'?");
  EXPECT_EQ(suggestion("xyzzy", {"a", "b"}), "Known: a, b.");
}

struct SomeOptions {
  double scale = 1.0;
  int count = 2;
  std::string word = "yes";
  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.scale, Field{"scale", "Between 0 and 2.", 0, 2});
    visit(self.count, Field{"count", "At least 1.", 1});
    visit(self.word, Field{"word", "Any word."});
  }
};

TEST(Fields, AreNamedOnceAndRangeChecked) {
  EXPECT_EQ(field_names<SomeOptions>(), (std::vector<std::string>{"scale", "count", "word"}));
  EXPECT_TRUE(check_ranges(SomeOptions{}));
  const Status too_large = check_ranges(SomeOptions{.scale = 3});
  ASSERT_FALSE(too_large);
  EXPECT_EQ(to_string(too_large.error()), "(scale): 3 is outside [0, 2]. Between 0 and 2.");
  EXPECT_FALSE(check_ranges(SomeOptions{.scale = std::numeric_limits<double>::quiet_NaN()}));
  EXPECT_FALSE(check_ranges(SomeOptions{.count = 0}));
}

TEST(Angles, DegreesAreRadiansAndBack) {
  EXPECT_DOUBLE_EQ(to_radians(180), std::acos(-1.0));
  for (const double angle_rad : {-7.0, 0.0, 0.3})
    EXPECT_NEAR(to_radians(to_degrees(angle_rad)), angle_rad, 1e-15);
}

TEST(OrderStatistics, AreAsOfTheSortedValues) {
  Random random(5);
  for (std::size_t n = 1; n < 40; ++n) {
    std::vector<double> values(n);
    for (double& value : values) value = std::round(random.uniform(0, 20));
    std::vector<double> sorted = values;
    std::ranges::sort(sorted);
    EXPECT_EQ(median(values), sorted[n / 2]);
    EXPECT_EQ(quantile(values, 0), sorted.front());
    EXPECT_EQ(quantile(values, 1), sorted.back());
    EXPECT_EQ(quantile(values, 0.95), sorted[static_cast<std::size_t>(0.95 * static_cast<double>(n - 1))]);
  }
  EXPECT_EQ(median(std::vector<double>{}), 0);
  EXPECT_EQ(quantile(std::vector<double>{}, 0.5), 0);
}

TEST(Printable, ATerminalObeysNothingOfIt) {
  EXPECT_EQ(printable("battery low: 12.1 V"), "battery low: 12.1 V");
  EXPECT_EQ(printable("\x1b[2Jgone\r\n\tover\x7f"), "\\x1b[2Jgone\\x0d\\x0a\\x09over\\x7f");
  EXPECT_EQ(printable("\x1b]0;title\x07"), "\\x1b]0;title\\x07");
  EXPECT_EQ(printable("Grüße, 日本, 🤖"), "Grüße, 日本, 🤖") << "letters stay";
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            "\\xc2\\x9b31m")
      << "a control character in two bytes";
  EXPECT_EQ(printable("a\x9b"
                      "31m"),
            "a\\x9b31m")
      << "and in one";
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable(""), "");
}

}  // namespace
}  // namespace waymark
