#include "waymark/families/family.hpp"

#include <algorithm>
#include <cctype>
#include <set>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class EachFamily : public ::testing::TestWithParam<FamilyId> {};
INSTANTIATE_TEST_SUITE_P(All, EachFamily, ::testing::ValuesIn(kAllFamilies),
                         [](const auto& family_id) { return std::string(to_string(family_id.param)); });

TEST_P(EachFamily, NameContainsTheNumberOfBitsAndTheDistance) {
  const Family& table = family(GetParam());
  EXPECT_EQ(table.id, GetParam());
  EXPECT_EQ(table.name, to_string(GetParam()));
  const std::string ending = std::to_string(table.bits.size()) + "h" + std::to_string(table.min_hamming);
  EXPECT_EQ(table.name.substr(table.name.find_first_of("0123456789")), ending);
}

TEST_P(EachFamily, LayoutFitsTheTag) {
  const Family& table = family(GetParam());
  const int margin = table.total_width - table.width_at_border;
  EXPECT_EQ(margin % 2, 0);
  std::set<std::pair<int, int>> cells;
  for (const BitCell& bit : table.bits) {
    EXPECT_GE(std::min(bit.x, bit.y), -margin / 2);
    EXPECT_LT(std::max(bit.x, bit.y), table.width_at_border + margin / 2);
    cells.emplace(bit.x, bit.y);
  }
  EXPECT_EQ(cells.size(), table.bits.size()) << "two bits share a cell";
  EXPECT_GE(table.codes.size(), 30U);
  for (const std::uint64_t code : table.codes) ASSERT_EQ(code >> table.bits.size(), 0U);
}

TEST_P(EachFamily, BitmapHasTheCodeInsideABorderOfTwoRings) {
  const Family& table = family(GetParam());
  const int last = static_cast<int>(table.codes.size()) - 1;
  const int margin = (table.total_width - table.width_at_border) / 2;
  for (const int number : {0, 1, last / 2, last}) {
    const std::vector<std::uint8_t> cells = bitmap({GetParam(), number});
    ASSERT_EQ(cells.size(), static_cast<std::size_t>(table.total_width * table.total_width));
    const auto at = [&](int x, int y) {
      const auto width = static_cast<std::size_t>(table.total_width);
      return cells.at(static_cast<std::size_t>(y + margin) * width + static_cast<std::size_t>(x + margin));
    };
    std::uint64_t code = 0;
    for (const BitCell& bit : table.bits) code = code << 1U | (at(bit.x, bit.y) == 255 ? 1U : 0U);
    EXPECT_EQ(code, table.codes.at(static_cast<std::size_t>(number)));
    const int inside = table.reversed_border ? 255 : 0;
    for (int i = 0; i < table.width_at_border; ++i) {
      EXPECT_EQ(at(i, 0), inside);
      EXPECT_EQ(at(table.width_at_border - 1, i), inside);
      EXPECT_EQ(at(i, -1), 255 - inside);
      EXPECT_EQ(at(-1, i), 255 - inside);
    }
  }
}

TEST_P(EachFamily, CellsOutsideTheTagLieOutsideTheDiscOrInTheFreeMiddle) {
  const std::vector<std::uint8_t> cells = bitmap({GetParam(), 0});
  const bool circle = std::string(to_string(GetParam())).find("Circle") != std::string::npos;
  EXPECT_EQ(cells.front() == 128, circle);
  // tagCustom48h12 leaves room in its middle for another tag, two cells wide.
  const auto free_cells = std::count(cells.begin(), cells.end(), 128);
  if (!circle) {
    EXPECT_EQ(free_cells, GetParam() == FamilyId::TagCustom48h12 ? 4 : 0);
  }
}

TEST_P(EachFamily, NamesAreParsedInAnyCaseAndWithoutThePrefix) {
  const std::string name(to_string(GetParam()));
  EXPECT_EQ(parse_family(name).value(), GetParam());
  EXPECT_EQ(parse_family(name.substr(3)).value(), GetParam());
  std::string upper = name;
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  EXPECT_EQ(parse_family(upper).value(), GetParam());
}

TEST_P(EachFamily, TagIdsAreParsedUpToTheLastNumber) {
  const int count = static_cast<int>(family(GetParam()).codes.size());
  for (const int number : {0, 7, count - 1}) {
    const TagId tag{GetParam(), number};
    EXPECT_EQ(parse_tag_id(to_string(tag)).value(), tag);
  }
  EXPECT_FALSE(parse_tag_id(to_string(TagId{GetParam(), count})));
  EXPECT_TRUE(bitmap({GetParam(), count}).empty());
  EXPECT_TRUE(bitmap({GetParam(), -1}).empty());
}

TEST(ParseFamily, SuggestsTheNearestFamily) {
  const std::vector<std::pair<std::string, std::string>> suggested = {{"tag36h12", "tag36h11"},
                                                                      {"36h12", "tag36h11"},
                                                                      {"36h1", "tag36h11"},
                                                                      {"TAG36H12", "tag36h11"},
                                                                      {"tag35h11", "tag36h11"},
                                                                      {"apriltag36h11", "tag36h11"},
                                                                      {"tag_36h10", "tag36h10"},
                                                                      {"DICT_APRILTAG_16h5", "tag16h5"},
                                                                      {"tag25h8", "tag25h9"},
                                                                      {"21h7", "tagCircle21h7"},
                                                                      {"tag41h12", "tagStandard41h12"},
                                                                      {"standard52h12", "tagStandard52h13"},
                                                                      {"custom48h11", "tagCustom48h12"}};
  for (const auto& [text, name] : suggested) {
    const auto wrong = parse_family(text);
    ASSERT_FALSE(wrong) << text;
    EXPECT_EQ(wrong.error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(wrong.error().hint, fmt::format("Did you mean '{}'?", name)) << text;
  }
  EXPECT_EQ(parse_tag_id("36h12:7").error().hint, "Did you mean 'tag36h11'?");
  testing::expect_on_page("tags", parse_family("tag36h12").error());
}

TEST(ParseFamily, ListsAllFamiliesIfNoneIsNear) {
  const Error unknown = parse_family("chessboard").error();
  for (const FamilyId id : kAllFamilies) EXPECT_THAT(unknown.hint, HasSubstr(std::string(to_string(id))));
  EXPECT_FALSE(parse_family(""));
  EXPECT_FALSE(parse_family(std::string(100000, 'x')));
  EXPECT_LT(parse_family(std::string(100000, 'x')).error().message.size(), 200U);
}

TEST(ParseTagId, RejectsWhatIsNotATagIdOfTheFamily) {
  for (const char* text :
       {"", "7", ":", "tag36h11", "tag36h11:", "tag36h11:587", "tag36h11:-1", "tag36h11:+1", "tag36h11: 1",
        "tag36h11:1 ", "tag36h11:1x", "tag36h11:1:2", "tag36h11:99999999999999999999", "tag36h99:1"}) {
    const auto tag = parse_tag_id(text);
    ASSERT_FALSE(tag) << text;
    EXPECT_EQ(tag.error().code, ErrorCode::InvalidArgument);
    EXPECT_FALSE(tag.error().hint.empty());
  }
  const Error beyond = parse_tag_id("tag36h11:587").error();
  EXPECT_THAT(beyond.message, HasSubstr("587"));
  EXPECT_THAT(beyond.hint, HasSubstr("0 to 586"));
  testing::expect_on_page("tags", beyond);
}

TEST(UsualFamily, HasTheLargestNumber) {
  EXPECT_EQ(usual_family(-1), FamilyId::Tag36h11);
  EXPECT_EQ(usual_family(586), FamilyId::Tag36h11);
  EXPECT_EQ(usual_family(587), FamilyId::TagStandard41h12);
  EXPECT_EQ(usual_family(2114), FamilyId::TagStandard41h12);
  EXPECT_EQ(usual_family(2115), FamilyId::TagStandard52h13);
  EXPECT_TRUE(exists({FamilyId::Tag36h11, 586}));
  EXPECT_FALSE(exists({FamilyId::Tag36h11, 587}));
  EXPECT_FALSE(exists({FamilyId::Tag36h11, -1}));
}

TEST(FamilyTable, ThreadsShareOneTable) {
  std::array<const Family*, 8> seen{};
  std::vector<std::thread> threads;
  threads.reserve(seen.size());
  for (auto& slot : seen) threads.emplace_back([&slot] { slot = &family(FamilyId::TagCircle49h12); });
  for (auto& thread : threads) thread.join();
  for (const Family* table : seen) {
    EXPECT_EQ(table, &family(FamilyId::TagCircle49h12));
    EXPECT_EQ(table->codes.size(), 65535U);
  }
}

TEST(TagNumbers, AreParsedInTheOrderWritten) {
  EXPECT_THAT(parse_tag_numbers(FamilyId::Tag36h11, "0-3,7,9").value(), ElementsAre(0, 1, 2, 3, 7, 9));
  EXPECT_THAT(parse_tag_numbers(FamilyId::Tag36h11, "9, 2-2 ,0").value(), ElementsAre(9, 2, 0));
  EXPECT_THAT(parse_tag_numbers(FamilyId::Tag16h5, "29").value(), ElementsAre(29));
  EXPECT_EQ(parse_tag_numbers(FamilyId::TagCircle49h12, "0-65534").value().size(), 65535U);
}

TEST(TagNumbers, OutsideTheFamilyAreRejectedWithItsRange) {
  for (const char* text : {"30", "0-30", "28-40", "99999999999999999999", "0-99999999999999999999"}) {
    const auto numbers = parse_tag_numbers(FamilyId::Tag16h5, text);
    ASSERT_FALSE(numbers) << text;
    EXPECT_THAT(numbers.error().hint, HasSubstr("0 to 29")) << text;
  }
}

TEST(TagNumbers, InvalidListsAreRejectedWithAnExample) {
  for (const char* text : {"", ",", "1,", ",1", "a", "1-", "-1", "-", "1--2", "1-2-3", "+1", "1.5", "0x1",
                           "1 2", "1;2", "all"}) {
    const auto numbers = parse_tag_numbers(FamilyId::Tag36h11, text);
    ASSERT_FALSE(numbers) << text;
    EXPECT_THAT(numbers.error().hint, HasSubstr("0-3,7,9")) << text;
  }
  const Error descending = parse_tag_numbers(FamilyId::Tag36h11, "7-3").error();
  EXPECT_EQ(descending.place.key, "ids");
  EXPECT_THAT(descending.hint, HasSubstr("3-7"));
  testing::expect_on_page("tags", descending);
  testing::expect_on_page("tags", parse_tag_numbers(FamilyId::Tag36h11, "a").error());
  testing::expect_on_page("tags", parse_tag_numbers(FamilyId::Tag16h5, "30").error());
}

TEST(TagNumbers, HostileListsEndEarly) {
  std::string text = "0-586";
  for (int i = 0; i < 10000; ++i) text += ",0-586";
  EXPECT_EQ(parse_tag_numbers(FamilyId::Tag36h11, text).error().code, ErrorCode::LimitExceeded);
  EXPECT_LT(to_string(parse_tag_numbers(FamilyId::Tag36h11, std::string(100000, 'x')).error()).size(), 200U);
}

}  // namespace
}  // namespace waymark
