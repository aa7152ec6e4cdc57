#include "waymark/config/yaml_fields.hpp"

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using ::testing::ElementsAre;

struct Inner {
  double speed_m_s = 0.5;
  bool enabled = true;
  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.speed_m_s, Field{"speed_m_s", "Maximum speed.", 0, 2});
    visit(self.enabled, Field{"enabled", "Whether it is enabled."});
  }
  friend bool operator==(const Inner&, const Inner&) = default;
};

struct Outer {
  std::string name = "limo";
  int count = 3;
  std::uint8_t small = 7;
  Inner inner = {};
  std::vector<double> sizes_m = {0.1, 0.2};
  std::vector<Inner> laps = {};
  std::optional<double> seed = {};
  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.name, Field{"name", "Name of the object."});
    visit(self.count, Field{"count", "Number of objects; 1 to 10.", 1, 10});
    visit(self.small, Field{"small", "Something small."});
    visit(self.inner, Field{"inner", "Nested options."});
    visit(self.sizes_m, Field{"sizes_m", "Sides of tags.", 0.001, 10});
    visit(self.laps, Field{"laps", "One entry per lap."});
    visit(self.seed, Field{"seed", "Seed of the random numbers.", 0});
  }
  friend bool operator==(const Outer&, const Outer&) = default;
};

Outer must(const std::string& text) {
  const auto options = parse_fields<Outer>(text, "o.yaml");
  EXPECT_TRUE(options) << to_string(options.error());
  return options.value();
}
std::string error_of(const std::string& text) {
  const auto options = parse_fields<Outer>(text, "o.yaml");
  return options ? "" : to_string(options.error());
}

TEST(YamlFields, UpdatingKeepsValuesOfMissingKeys) {
  Outer options;
  options.count = 5;
  options.inner.enabled = false;
  const auto root = parse_yaml("name: mbot\ninner: {speed_m_s: 1.5}\n", "o.yaml");
  ASSERT_TRUE(root);
  ASSERT_TRUE(update_fields(YamlCursor(*root, "o.yaml"), options));
  Outer expected;
  expected.name = "mbot";
  expected.count = 5;
  expected.inner = {.speed_m_s = 1.5, .enabled = false};
  EXPECT_EQ(options, expected);
}

TEST(YamlFields, MissingKeysKeepTheirDefaults) {
  EXPECT_EQ(must(""), Outer{});
  EXPECT_EQ(must("{}"), Outer{});
  EXPECT_EQ(must("count: ~\n"), Outer{});
  EXPECT_EQ(must("count: 5\n"), Outer{.count = 5});
}

TEST(YamlFields, ReadsEveryKindOfField) {
  const Outer options = must(
      "name: 'a b'\ncount: 10\nsmall: 255\ninner:\n  speed_m_s: 1\n  enabled: false\nsizes_m: [0.16]\n"
      "laps:\n- speed_m_s: 0.25\n- {}\nseed: 4\n");
  EXPECT_EQ(options.name, "a b");
  EXPECT_EQ(options.small, 255);
  EXPECT_EQ(options.inner, (Inner{1.0, false}));
  EXPECT_THAT(options.sizes_m, ElementsAre(0.16));
  EXPECT_THAT(options.laps, ElementsAre(Inner{0.25, true}, Inner{}));
  EXPECT_EQ(options.seed, 4.0);
}

TEST(YamlFields, SuggestsTheNearestKeyForAnUnknownKey) {
  EXPECT_TRUE((error_of("name: x\ncuont: 3\n")).starts_with("o.yaml:2 (cuont): "));
  testing::expect_on_page("config", error_of("name: x\ncuont: 3\n"));
  EXPECT_TRUE((error_of("inner:\n  sped_m_s: 1\n")).starts_with("o.yaml:2 (inner.sped_m_s): "));
  testing::expect_on_page("config", error_of("inner:\n  sped_m_s: 1\n"));
  EXPECT_TRUE(
      (error_of("laps:\n- enabled: true\n- enabeld: true\n")).starts_with("o.yaml:3 (laps[1].enabeld): "));
  testing::expect_on_page("config", error_of("laps:\n- enabled: true\n- enabeld: true\n"));
}

TEST(YamlFields, ReportsWrongTypes) {
  EXPECT_TRUE((error_of("count: many\n")).starts_with("o.yaml:1 (count): "));
  testing::expect_on_page("config", error_of("count: many\n"));
  EXPECT_TRUE((error_of("count: 2.5\n")).starts_with("o.yaml:1 (count): "));
  EXPECT_NE((error_of("count: 2.5\n")).find("2.5"), std::string::npos);
  testing::expect_on_page("config", error_of("count: 2.5\n"));
  EXPECT_TRUE((error_of("inner: 3\n")).starts_with("o.yaml:1 (inner): "));
  EXPECT_NE((error_of("inner: 3\n")).find("'3'"), std::string::npos);
  testing::expect_on_page("config", error_of("inner: 3\n"));
  EXPECT_TRUE((error_of("inner: {enabled: 1}\n")).starts_with("o.yaml:1 (inner.enabled): "));
  EXPECT_NE((error_of("inner: {enabled: 1}\n")).find("'1'"), std::string::npos);
  testing::expect_on_page("config", error_of("inner: {enabled: 1}\n"));
  EXPECT_TRUE((error_of("sizes_m: 0.1\n")).starts_with("o.yaml:1 (sizes_m): "));
  testing::expect_on_page("config", error_of("sizes_m: 0.1\n"));
  EXPECT_TRUE((error_of("name: [a]\n")).starts_with("o.yaml:1 (name): "));
  testing::expect_on_page("config", error_of("name: [a]\n"));
  EXPECT_TRUE((error_of("[1, 2]\n")).starts_with("o.yaml:1: "));
  testing::expect_on_page("config", error_of("[1, 2]\n"));
}

TEST(YamlFields, ReportsNumbersOutOfRange) {
  EXPECT_TRUE((error_of("count: 11\n")).starts_with("o.yaml:1 (count): "));
  EXPECT_NE((error_of("count: 11\n")).find("11"), std::string::npos);
  testing::expect_on_page("config", error_of("count: 11\n"));
  EXPECT_TRUE((error_of("inner:\n  speed_m_s: -0.5\n")).starts_with("o.yaml:2 (inner.speed_m_s): "));
  EXPECT_NE((error_of("inner:\n  speed_m_s: -0.5\n")).find("-0.5"), std::string::npos);
  testing::expect_on_page("config", error_of("inner:\n  speed_m_s: -0.5\n"));
  EXPECT_TRUE((error_of("sizes_m: [1, 20]\n")).starts_with("o.yaml:1 (sizes_m[1]): "));
  EXPECT_NE((error_of("sizes_m: [1, 20]\n")).find("20"), std::string::npos);
  testing::expect_on_page("config", error_of("sizes_m: [1, 20]\n"));
  EXPECT_EQ(error_of("small: 256\n"), "o.yaml:1 (small): 256 is outside [0, 255]");
  EXPECT_TRUE((error_of("seed: -1\n")).starts_with("o.yaml:1 (seed): "));
  EXPECT_NE((error_of("seed: -1\n")).find("-1"), std::string::npos);
  testing::expect_on_page("config", error_of("seed: -1\n"));
  EXPECT_TRUE((error_of("count: 99999999999999999999\n")).starts_with("o.yaml:1 (count): "));
  EXPECT_NE((error_of("count: 99999999999999999999\n")).find("99999999999999999999"), std::string::npos);
  testing::expect_on_page("config", error_of("count: 99999999999999999999\n"));
}

TEST(YamlFields, WritesTheWholeStruct) {
  EXPECT_EQ(write_fields(Outer{.name = "", .laps = {Inner{}, Inner{2.0, false}}, .seed = 1e-5}),
            "name: \"\"\n"
            "count: 3\n"
            "small: 7\n"
            "inner:\n"
            "  speed_m_s: 0.5\n"
            "  enabled: true\n"
            "sizes_m: [0.1, 0.2]\n"
            "laps:\n"
            "  - speed_m_s: 0.5\n"
            "    enabled: true\n"
            "  - speed_m_s: 2.0\n"
            "    enabled: false\n"
            "seed: 1.0e-05\n");
}

RC_GTEST_PROP(YamlFieldsProperty, RoundTrips, ()) {
  const auto inner = [] {
    return Inner{*rc::gen::inRange(0, 2001) / 1000.0 / 3.0, *rc::gen::arbitrary<bool>()};
  };
  Outer options{.name = *rc::gen::string<std::string>(), .count = *rc::gen::inRange(1, 11), .inner = inner()};
  options.small = *rc::gen::arbitrary<std::uint8_t>();
  options.sizes_m = *rc::gen::container<std::vector<double>>(
      rc::gen::map(rc::gen::inRange(1, 1000), [](int n) { return n / 101.0; }));
  for (int i = *rc::gen::inRange(0, 4); i > 0; --i) options.laps.push_back(inner());
  if (*rc::gen::arbitrary<bool>()) options.seed = *rc::gen::inRange(0, 1 << 30) * 1e-12;
  const std::string text = write_fields(options);
  const auto back = parse_fields<Outer>(text, "o.yaml");
  RC_LOG() << text;
  RC_ASSERT(back.has_value());
  RC_ASSERT(*back == options);
}

}  // namespace
}  // namespace waymark
