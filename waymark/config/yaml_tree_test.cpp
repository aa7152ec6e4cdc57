#include "waymark/config/yaml_tree.hpp"

#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::StartsWith;

std::string error_of(const std::string& text, const YamlLimits& limits = {}) {
  const auto tree = parse_yaml(text, "f.yaml", limits);
  return tree ? "" : to_string(tree.error());
}

TEST(YamlNode, KeepsTheLinesOfWhatItReads) {
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

TEST(YamlNode, NothingIsNull) {
  for (const char* text : {"", "\n\n", "# only a comment\n", "---\n", "---\n...\n"}) {
    const auto tree = parse_yaml(text, "f.yaml");
    ASSERT_TRUE(tree) << text;
    EXPECT_EQ(tree->kind, YamlNode::Kind::Null) << text;
  }
}

TEST(YamlNode, SaysWhereItIsNotYaml) {
  EXPECT_THAT(error_of("a: 1\nb: [1, 2\nc: 3\n"), StartsWith("f.yaml:3: not valid YAML: "));
  EXPECT_THAT(error_of("a: 1\n  b: 2\n"), StartsWith("f.yaml:2: not valid YAML: "));
  EXPECT_THAT(error_of("a: \"x"), StartsWith("f.yaml:1: not valid YAML: "));
}

TEST(YamlNode, RefusesAKeyGivenTwice) {
  EXPECT_EQ(error_of("a: 1\nb: 2\na: 3\n"),
            "f.yaml:3 (a): 'a' is given twice, first on line 1. Remove one of them.");
  EXPECT_EQ(error_of("x: {p: 1, q: 1, p: 1}\n"),
            "f.yaml:1 (p): 'p' is given twice, first on line 1. Remove one of them.");
}

TEST(YamlNode, RefusesAKeyThatIsNoWord) {
  EXPECT_EQ(error_of("a: 1\n? [1, 2]\n: 3\n"), "f.yaml:2: a key must be a word. Write `key: value`.");
}

TEST(YamlNode, RefusesAnchorsAndAliases) {
  EXPECT_EQ(error_of("a: &x [1]\nb: *x\n"),
            "f.yaml:1: anchors (&name) and aliases (*name) are not supported. Write the value out where it "
            "is needed.");
  std::string bomb = "a0: &a0 [x, x]\n";
  for (int i = 1; i < 40; ++i) {
    const auto name = [](int n) { return "a" + std::to_string(n); };
    bomb += name(i) + ": &" + name(i) + " [*" + name(i - 1) + ", *" + name(i - 1) + "]\n";
  }
  EXPECT_THAT(error_of(bomb), StartsWith("f.yaml:1: anchors"));
}

TEST(YamlNode, RefusesASecondDocument) {
  EXPECT_EQ(error_of("a: 1\n---\nb: 2\n"),
            "f.yaml:3: there is a second document after '---'. Keep one document in a file.");
  EXPECT_EQ(error_of("a: 1\n---\n"), "") << "as `ros2 topic echo` ends its output";
}

TEST(YamlNode, RefusesDepthBombsOfEveryKind) {
  for (const char* bracket : {"[", "{a: ", "- ", "? ", "[[", "{? "}) {
    std::string text;
    for (int i = 0; i < 20'000; ++i) text += bracket;
    EXPECT_THAT(error_of(text), StartsWith("f.yaml:1: nested more than 64 deep")) << bracket;
  }
  std::string blocks;
  for (std::size_t i = 0; i < 500; ++i) blocks += std::string(i, ' ') + "a:\n";
  EXPECT_EQ(error_of(blocks), "f.yaml:65: nested more than 64 deep. Is this the right file?");
}

TEST(YamlNode, RefusesWhatIsTooLarge) {
  EXPECT_EQ(error_of(std::string(101, ' '), {.bytes = 100}),
            "f.yaml: 101 bytes are more than the 100 allowed. Is this the right file?");
  EXPECT_EQ(error_of("[1, 2,\n3, 4]", {.nodes = 3}), "f.yaml:2: more than 3 values. Is this the right file?");
}

TEST(YamlNode, SurvivesBytesThatAreNoText) {
  std::string bytes;
  for (int i = 0; i < 4096; ++i) bytes += static_cast<char>((i * 167 + 13) % 256);
  EXPECT_NE(error_of(bytes), "");
}

TEST(YamlCursor, NamesThePlaceOfEveryError) {
  const auto tree =
      parse_yaml("camera:\n  size: [640, tall]\n  fx: .nan\n  count: 3.5\n  on: maybe\n", "f.yaml");
  ASSERT_TRUE(tree);
  const YamlCursor camera = *YamlCursor(*tree, "f.yaml").find("camera");
  EXPECT_EQ(to_string(camera.at("size")->numbers().error()),
            "f.yaml:2 (camera.size[1]): 'tall' is not a number");
  EXPECT_EQ(to_string(camera.at("fx")->number().error()),
            "f.yaml:3 (camera.fx): '.nan' is not a finite number");
  EXPECT_EQ(to_string(camera.at("count")->integer(0, 9).error()),
            "f.yaml:4 (camera.count): '3.5' is not a whole number");
  EXPECT_EQ(to_string(camera.at("on")->boolean().error()),
            "f.yaml:5 (camera.on): 'maybe' is not true or false");
  EXPECT_EQ(to_string(camera.at("size")->number().error()), "f.yaml:2 (camera.size): a list is not a number");
  EXPECT_EQ(to_string(camera.at("fx")->numbers().error()),
            "f.yaml:3 (camera.fx): '.nan' is not a list of numbers");
  EXPECT_EQ(to_string(camera.at("fy").error()),
            "f.yaml:2 (camera.fy): 'fy' is missing. Add `fy:` with its value.");
  EXPECT_EQ(to_string(camera.check_keys({"size", "fxx", "count", "on"}).error()),
            "f.yaml:3 (camera.fx): unknown key 'fx'. Did you mean 'fxx'?");
}

TEST(YamlCursor, ReadsNumbersAsYamlWritesThem) {
  const auto tree = parse_yaml("[1, -2.5, +3, 1e-3, .5, 7., 1.0e+02]", "f.yaml");
  ASSERT_TRUE(tree);
  EXPECT_THAT(*YamlCursor(*tree, "f.yaml").numbers(), ElementsAre(1, -2.5, 3, 1e-3, 0.5, 7, 100));
  for (const char* bad : {"0x10", "1,5", "1e999", "--1", "+-1", "1 2", "inf", "-.inf", "nan", "''"}) {
    const auto one = parse_yaml(std::string("a: ") + bad, "f.yaml");
    ASSERT_TRUE(one) << bad;
    EXPECT_FALSE(YamlCursor(*one, "f.yaml").at("a")->number()) << bad;
  }
}

TEST(TextFile, ComesBackAsWritten) {
  const auto path = testing::fresh_folder("text") / "a.yaml";
  const std::string text("a: 1\r\nb: \0\xff", 11);
  ASSERT_TRUE(write_text_file(path, text));
  ASSERT_TRUE(write_text_file(path, text)) << "replaces";
  EXPECT_EQ(*read_file(path, 11), text);
  EXPECT_EQ(to_string(read_text_file(path, 11).error()),
            path.string() +
                ": this is binary (it holds zero bytes), and no text. Give a text file here, in UTF-8.");
  EXPECT_EQ(to_string(read_file(path, 10).error()),
            path.string() + ": the file is longer than the 10 bytes allowed. Is this the right file?");
}

TEST(TextFile, SaysWhatIsWrongWithAPath) {
  const auto folder = testing::fresh_folder("text");
  EXPECT_EQ(to_string(read_text_file(folder / "none", 10).error()),
            (folder / "none").string() + ": there is no such file. Check the path.");
  EXPECT_EQ(to_string(read_text_file(folder, 10).error()),
            folder.string() + ": this is a folder. Give a file.");
  EXPECT_EQ(write_text_file(folder / "no" / "where", "x").error().code, ErrorCode::Unwritable);
  EXPECT_EQ(write_text_file(folder, "x").error().code, ErrorCode::Unwritable);
  EXPECT_FALSE(std::filesystem::exists(folder.string() + ".tmp")) << "nothing is left behind";
}

}  // namespace
}  // namespace waymark
