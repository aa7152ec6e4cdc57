#include "waymark/config/yaml_tree.hpp"

#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::StartsWith;

std::string error_of(const std::string& text, const YamlLimits& limits = {}) {
  const auto tree = parse_yaml(text, "f.yaml", limits);
  return tree ? "" : to_string(tree.error());
}

TEST(YamlNode, KeepsLineNumbers) {
  const auto tree = parse_yaml("# head\na: 1\nb:\n  c: [x,\n      'y z']\n  d: ~\n", "f.yaml");
  ASSERT_TRUE(tree);
  EXPECT_EQ(tree->kind, YamlNode::Kind::Map);
  EXPECT_THAT(tree->keys, ElementsAre("a", "b"));
  EXPECT_THAT(tree->key_lines, ElementsAre(2, 3));
  const YamlNode& b = tree->items.at(1);
  EXPECT_EQ(b.items.at(0).line, 4);
  EXPECT_EQ(b.items.at(0).items.at(1).text, "y z");
  EXPECT_EQ(b.items.at(0).items.at(1).line, 5);
  EXPECT_EQ(b.items.at(1).kind, YamlNode::Kind::Null);
}

TEST(YamlNode, AnEmptyDocumentIsNull) {
  for (const char* text : {"", "\n\n", "# only a comment\n", "---\n", "---\n...\n"}) {
    const auto tree = parse_yaml(text, "f.yaml");
    ASSERT_TRUE(tree) << text;
    EXPECT_EQ(tree->kind, YamlNode::Kind::Null) << text;
  }
}

TEST(YamlNode, ReportsThePlaceOfInvalidYaml) {
  EXPECT_THAT(error_of("a: 1\nb: [1, 2\nc: 3\n"), StartsWith("f.yaml:3: not valid YAML: "));
  EXPECT_THAT(error_of("a: 1\n  b: 2\n"), StartsWith("f.yaml:2: not valid YAML: "));
  EXPECT_THAT(error_of("a: \"x"), StartsWith("f.yaml:1: not valid YAML: "));
}

TEST(YamlNode, RejectsDuplicateKeys) {
  EXPECT_TRUE((error_of("a: 1\nb: 2\na: 3\n")).starts_with("f.yaml:3 (a): "));
  EXPECT_NE((error_of("a: 1\nb: 2\na: 3\n")).find("line 1"), std::string::npos);
  testing::expect_on_page("config", error_of("a: 1\nb: 2\na: 3\n"));
  EXPECT_TRUE((error_of("x: {p: 1, q: 1, p: 1}\n")).starts_with("f.yaml:1 (p): "));
  EXPECT_NE((error_of("x: {p: 1, q: 1, p: 1}\n")).find("line 1"), std::string::npos);
  testing::expect_on_page("config", error_of("x: {p: 1, q: 1, p: 1}\n"));
}

TEST(YamlNode, RejectsNonScalarKeys) {
  EXPECT_TRUE((error_of("a: 1\n? [1, 2]\n: 3\n")).starts_with("f.yaml:2: "));
  testing::expect_on_page("config", error_of("a: 1\n? [1, 2]\n: 3\n"));
}

TEST(YamlNode, RejectsAnchorsAndAliases) {
  EXPECT_TRUE((error_of("a: &x [1]\nb: *x\n")).starts_with("f.yaml:1: "));
  testing::expect_on_page("config", error_of("a: &x [1]\nb: *x\n"));
  std::string bomb = "a0: &a0 [x, x]\n";
  for (int i = 1; i < 40; ++i) {
    const auto name = [](int n) { return "a" + std::to_string(n); };
    bomb += name(i) + ": &" + name(i) + " [*" + name(i - 1) + ", *" + name(i - 1) + "]\n";
  }
  EXPECT_THAT(error_of(bomb), StartsWith("f.yaml:1: anchors"));
}

TEST(YamlNode, RejectsASecondDocument) {
  EXPECT_TRUE((error_of("a: 1\n---\nb: 2\n")).starts_with("f.yaml:3: "));
  testing::expect_on_page("config", error_of("a: 1\n---\nb: 2\n"));
  EXPECT_EQ(error_of("a: 1\n---\n"), "") << "the end of the output of `ros2 topic echo`";
}

TEST(YamlNode, RejectsExcessiveDepth) {
  for (const char* bracket : {"[", "{a: ", "- ", "? ", "[[", "{? "}) {
    std::string text;
    for (int i = 0; i < 20'000; ++i) text += bracket;
    EXPECT_THAT(error_of(text), StartsWith("f.yaml:1: nested more than 64 deep")) << bracket;
  }
  std::string blocks;
  for (std::size_t i = 0; i < 500; ++i) blocks += std::string(i, ' ') + "a:\n";
  EXPECT_TRUE((error_of(blocks)).starts_with("f.yaml:65: "));
  EXPECT_NE((error_of(blocks)).find("64"), std::string::npos);
  testing::expect_on_page("config", error_of(blocks));
}

TEST(YamlNode, RejectsDocumentsAboveTheLimits) {
  EXPECT_TRUE((error_of(std::string(101, ' '), {.bytes = 100})).starts_with("f.yaml: "));
  EXPECT_NE((error_of(std::string(101, ' '), {.bytes = 100})).find("101"), std::string::npos);
  testing::expect_on_page("config", error_of(std::string(101, ' '), {.bytes = 100}));
  EXPECT_TRUE((error_of("[1, 2,\n3, 4]", {.nodes = 3})).starts_with("f.yaml:2: "));
  EXPECT_NE((error_of("[1, 2,\n3, 4]", {.nodes = 3})).find("3 values"), std::string::npos);
  testing::expect_on_page("config", error_of("[1, 2,\n3, 4]", {.nodes = 3}));
}

TEST(YamlNode, SurvivesBinaryData) {
  std::string bytes;
  for (int i = 0; i < 4096; ++i) bytes += static_cast<char>((i * 167 + 13) % 256);
  EXPECT_NE(error_of(bytes), "");
}

TEST(YamlCursor, AddsThePlaceToEveryError) {
  const auto tree =
      parse_yaml("camera:\n  size: [640, tall]\n  fx: .nan\n  count: 3.5\n  on: maybe\n", "f.yaml");
  ASSERT_TRUE(tree);
  const YamlCursor camera = *YamlCursor(*tree, "f.yaml").find("camera");
  EXPECT_TRUE((to_string(camera.at("size")->numbers().error())).starts_with("f.yaml:2 (camera.size[1]): "));
  testing::expect_on_page("config", to_string(camera.at("size")->numbers().error()));
  EXPECT_TRUE((to_string(camera.at("fx")->number().error())).starts_with("f.yaml:3 (camera.fx): "));
  testing::expect_on_page("config", to_string(camera.at("fx")->number().error()));
  EXPECT_TRUE(
      (to_string(camera.at("count")->integer(0, 9).error())).starts_with("f.yaml:4 (camera.count): "));
  EXPECT_NE((to_string(camera.at("count")->integer(0, 9).error())).find("3.5"), std::string::npos);
  testing::expect_on_page("config", to_string(camera.at("count")->integer(0, 9).error()));
  EXPECT_TRUE((to_string(camera.at("on")->boolean().error())).starts_with("f.yaml:5 (camera.on): "));
  testing::expect_on_page("config", to_string(camera.at("on")->boolean().error()));
  EXPECT_TRUE((to_string(camera.at("size")->number().error())).starts_with("f.yaml:2 (camera.size): "));
  testing::expect_on_page("config", to_string(camera.at("size")->number().error()));
  EXPECT_TRUE((to_string(camera.at("fx")->numbers().error())).starts_with("f.yaml:3 (camera.fx): "));
  testing::expect_on_page("config", to_string(camera.at("fx")->numbers().error()));
  EXPECT_TRUE((to_string(camera.at("fy").error())).starts_with("f.yaml:2 (camera.fy): "));
  testing::expect_on_page("config", to_string(camera.at("fy").error()));
  EXPECT_TRUE((to_string(camera.check_keys({"size", "fxx", "count", "on"}).error()))
                  .starts_with("f.yaml:3 (camera.fx): "));
  testing::expect_on_page("config", to_string(camera.check_keys({"size", "fxx", "count", "on"}).error()));
}

TEST(YamlCursor, ReadsYamlNumbers) {
  const auto tree = parse_yaml("[1, -2.5, +3, 1e-3, .5, 7., 1.0e+02]", "f.yaml");
  ASSERT_TRUE(tree);
  EXPECT_THAT(*YamlCursor(*tree, "f.yaml").numbers(), ElementsAre(1, -2.5, 3, 1e-3, 0.5, 7, 100));
  for (const char* bad : {"0x10", "1,5", "1e999", "--1", "+-1", "1 2", "inf", "-.inf", "nan", "''"}) {
    const auto one = parse_yaml(std::string("a: ") + bad, "f.yaml");
    ASSERT_TRUE(one) << bad;
    EXPECT_FALSE(YamlCursor(*one, "f.yaml").at("a")->number()) << bad;
  }
}

TEST(YamlWrite, WritesNumbersThatEveryReaderAccepts) {
  EXPECT_EQ(yaml_number(1), "1.0");
  EXPECT_EQ(yaml_number(-0.0), "-0.0");
  EXPECT_EQ(yaml_number(0.1), "0.1");
  EXPECT_EQ(yaml_number(1e-5), "1.0e-05") << "PyYAML reads 1e-05 as a string";
  EXPECT_EQ(yaml_number(1.25e300), "1.25e+300");
  EXPECT_EQ(yaml_number(std::numeric_limits<double>::denorm_min()), "5.0e-324");
}

TEST(YamlWrite, TheEndOfAFileIsCheckedAgainstItsHead) {
  constexpr internal::EntryCount kCount{.key = "tag_count", .entries = "tags"};
  const std::string written = internal::yaml_with_end("format: x\n", kCount, 2, "tags: [1, 2]\n");
  EXPECT_EQ(written, "format: x\ntag_count: 2\ntags: [1, 2]\nend: 2\n");
  const auto checked = [&](const std::string& text, std::size_t number) {
    const auto tree = parse_yaml(text, "f.yaml");
    return tree ? internal::check_end(YamlCursor(*tree, "f.yaml"), kCount, number)
                : Status(tl::unexpected(tree.error()));
  };
  EXPECT_TRUE(checked(written, 2));
  EXPECT_TRUE(checked("tags: [1, 2]\n", 2)) << "written by hand";
  for (const char* cut : {"tag_count: 2\n", "tag_count: 2\nend:\n", "tag_count: 12\nend: 1\n"}) {
    const Status status = checked(cut, 1);
    ASSERT_FALSE(status) << cut;
    EXPECT_EQ(status.error().code, ErrorCode::Unreadable);
    EXPECT_THAT(to_string(status.error()), StartsWith("f.yaml:1 (tag_count): "));
    testing::expect_on_page("config", to_string(status.error()));
  }
  const Status added = checked(written, 3);
  ASSERT_FALSE(added);
  EXPECT_EQ(added.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(to_string(added.error()), StartsWith("f.yaml:2 (tag_count): "));
  testing::expect_on_page("config", to_string(added.error()));
  const Status without_count = checked("end: 2\n", 2);
  ASSERT_FALSE(without_count);
  EXPECT_THAT(to_string(without_count.error()), StartsWith("f.yaml:1 (end): "));
  EXPECT_FALSE(checked("tag_count: two\nend: 2\n", 2));
}

TEST(YamlWrite, WritesTextThatReadsBackAsText) {
  EXPECT_EQ(yaml_text("tag36h11"), "tag36h11");
  EXPECT_EQ(yaml_text("/camera/image_raw"), "/camera/image_raw");
  EXPECT_EQ(yaml_text("true"), "\"true\"");
  EXPECT_EQ(yaml_text("12"), "\"12\"");
  EXPECT_EQ(yaml_text("a: b # c"), "\"a: b # c\"");
  EXPECT_EQ(yaml_text("a \"\\\"\n"), "\"a \\\"\\\\\\\"\\x0a\"");
  EXPECT_EQ(yaml_text(""), "\"\"");
}

}  // namespace
}  // namespace waymark
