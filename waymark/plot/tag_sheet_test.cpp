#include "waymark/plot/tag_sheet.hpp"

#include <cctype>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

#include <rapidcheck.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark::plot {
namespace {

TEST(Paper, IsoSheetsHalveIntoEachOther) {
  for (int i = 0; i < 6; ++i) {
    const Paper larger = parse_paper("A" + std::to_string(i)).value();
    const Paper smaller = parse_paper("A" + std::to_string(i + 1)).value();
    EXPECT_NEAR(smaller.width_mm, larger.height_mm / 2, 0.51) << larger.name;
    EXPECT_EQ(smaller.height_mm, larger.width_mm);
  }
}

TEST(Paper, AmericanSheetsAreInches) {
  for (const auto& [name, width_in, height_in] :
       {std::tuple("Letter", 8.5, 11.0), std::tuple("Legal", 8.5, 14.0), std::tuple("Tabloid", 11.0, 17.0)}) {
    const Paper paper = parse_paper(name).value();
    EXPECT_DOUBLE_EQ(paper.width_mm, width_in * 25.4);
    EXPECT_DOUBLE_EQ(paper.height_mm, height_in * 25.4);
  }
}

TEST(Paper, NamesAreReadInAnyCase) {
  for (const Paper& paper : known_papers()) {
    std::string name = paper.name;
    for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    EXPECT_EQ(parse_paper(name).value(), paper);
  }
}

TEST(Paper, AreListedFromSmallToLarge) {
  for (std::size_t i = 1; i < known_papers().size(); ++i) {
    const Paper& a = known_papers()[i - 1];
    const Paper& b = known_papers()[i];
    EXPECT_LT(a.width_mm * a.height_mm, b.width_mm * b.height_mm) << a.name << " " << b.name;
  }
}

TEST(Paper, AcceptsACustomSize) {
  EXPECT_EQ(parse_paper("300x400").value(), (Paper{"300x400", 300, 400}));
  EXPECT_EQ(parse_paper("99.5X20mm").value(), (Paper{"99.5x20", 99.5, 20}));
}

TEST(Paper, InvalidPapersAreRejectedWithAHint) {
  const Error unknown = parse_paper("A44").error();
  EXPECT_EQ(unknown.place.key, "paper");
  EXPECT_THAT(unknown.hint, ::testing::HasSubstr("'A4'"));
  EXPECT_THAT(unknown.hint, ::testing::HasSubstr("300x400"));
  testing::expect_on_page("tags", unknown);
  for (const char* text : {"", "x", "300x", "x400", "nanxnan", "infx300", "-300x400", "0x0", "19x300",
                           "300x5001", "1e9x1e9", "300x400x5", "300 x 400", "A4x"}) {
    const auto paper = parse_paper(text);
    ASSERT_FALSE(paper) << text;
    EXPECT_EQ(paper.error().code, ErrorCode::InvalidArgument);
    EXPECT_FALSE(paper.error().hint.empty());
  }
  EXPECT_LT(to_string(parse_paper(std::string(100000, 'q')).error()).size(), 300U);
}

constexpr double kSlackMm = 1e-6;

bool overlap(const Box& a, const Box& b) {
  return a.x_mm < b.right_mm() - kSlackMm && b.x_mm < a.right_mm() - kSlackMm &&
         a.y_mm < b.bottom_mm() - kSlackMm && b.y_mm < a.bottom_mm() - kSlackMm;
}

bool contains(const Box& outer, const Box& inner) {
  return inner.x_mm >= outer.x_mm - kSlackMm && inner.y_mm >= outer.y_mm - kSlackMm &&
         inner.right_mm() <= outer.right_mm() + kSlackMm && inner.bottom_mm() <= outer.bottom_mm() + kSlackMm;
}

std::vector<int> first_numbers(int count) {
  std::vector<int> numbers(static_cast<std::size_t>(count));
  std::iota(numbers.begin(), numbers.end(), 0);
  return numbers;
}

SheetOptions with_size(double tag_size_m) {
  SheetOptions options;
  options.tag_size_m = tag_size_m;
  return options;
}

void expect_lawful(const SheetLayout& layout) {
  const Box sheet{layout.margin_mm, layout.margin_mm, layout.paper.width_mm - 2 * layout.margin_mm,
                  layout.paper.height_mm - 2 * layout.margin_mm};
  RC_ASSERT(contains(sheet, layout.footer.strip));
  RC_ASSERT(contains(layout.footer.strip, layout.footer.ruler));
  const Family& table = family(layout.family);
  for (const auto& tags : layout.pages) {
    RC_ASSERT(!tags.empty() && static_cast<int>(tags.size()) <= layout.tags_per_page);
    for (std::size_t i = 0; i < tags.size(); ++i) {
      const PlacedTag& placed = tags[i];
      RC_ASSERT(contains(sheet, placed.tile));
      RC_ASSERT(contains(placed.tile, placed.cells));
      RC_ASSERT(contains(placed.tile, placed.caption));
      RC_ASSERT(contains(placed.caption, placed.up_mark));
      RC_ASSERT(!overlap(placed.cells, placed.caption));
      RC_ASSERT(!overlap(placed.tile, layout.footer.strip));
      // The size is that of the square where black meets white, centred within all cells.
      RC_ASSERT(std::abs(placed.square.width_mm - layout.tag_size_mm) < kSlackMm);
      RC_ASSERT(std::abs(placed.cells.width_mm * table.width_at_border / table.total_width -
                         layout.tag_size_mm) < kSlackMm);
      RC_ASSERT(std::abs(placed.square.middle_x_mm() - placed.cells.middle_x_mm()) < kSlackMm);
      RC_ASSERT(std::abs(placed.square.middle_y_mm() - placed.cells.middle_y_mm()) < kSlackMm);
      for (std::size_t k = 0; k < i; ++k) RC_ASSERT(!overlap(placed.tile, tags[k].tile));
    }
  }
}

TEST(SheetLayout, NeverOverlapsAndStaysInTheMargins) {
  EXPECT_TRUE(rc::check([] {
    const FamilyId id = *rc::gen::elementOf(kAllFamilies);
    SheetOptions options = with_size(*rc::gen::inRange(20, 3000) / 1e4);
    options.paper = *rc::gen::elementOf(known_papers());
    if (*rc::gen::inRange(0, 4) == 0)
      options.paper = {"own", *rc::gen::inRange(60, 1200) * 1.0, *rc::gen::inRange(60, 1200) * 1.0};
    options.orientation = *rc::gen::element(Orientation::Auto, Orientation::Portrait, Orientation::Landscape);
    options.margin_m = *rc::gen::inRange(0, 20) / 1e3;
    options.per_page = *rc::gen::inRange(0, 4);
    const std::vector<int> numbers = first_numbers(*rc::gen::inRange(1, 31));
    const auto layout = layout_sheet(id, numbers, options);
    if (!layout) {
      RC_ASSERT(!layout.error().hint.empty());
      const auto largest = largest_tag_size_m(id, options);
      RC_ASSERT(!largest || *largest < options.tag_size_m);
      RC_DISCARD("does not fit");
    }
    expect_lawful(*layout);
    // All numbers, in order and without duplicates.
    std::vector<int> placed;
    for (const auto& page : layout->pages) {
      for (const PlacedTag& tag : page) placed.push_back(tag.tag.number);
    }
    RC_ASSERT(placed == numbers);
    if (options.orientation == Orientation::Portrait)
      RC_ASSERT(layout->paper.width_mm <= layout->paper.height_mm);
    if (options.orientation == Orientation::Landscape)
      RC_ASSERT(layout->paper.width_mm >= layout->paper.height_mm);
  }));
}

TEST(SheetLayout, TheLargestSizeFitsAndALargerOneDoesNot) {
  for (const FamilyId id : kAllFamilies) {
    for (const Paper& paper : known_papers()) {
      for (const int per_page : {0, 1, 2, 5}) {
        SheetOptions options;
        options.paper = paper;
        options.per_page = per_page;
        options.tag_size_m = largest_tag_size_m(id, options).value();
        EXPECT_TRUE(layout_sheet(id, {0}, options)) << to_string(id) << paper.name << per_page;
        options.tag_size_m += 0.0001;
        EXPECT_FALSE(layout_sheet(id, {0}, options)) << to_string(id) << paper.name << per_page;
      }
    }
  }
}

TEST(SheetLayout, TheSuggestedPaperIsSufficient) {
  const auto layout = layout_sheet(FamilyId::Tag36h11, {0}, with_size(0.17));
  ASSERT_FALSE(layout);
  EXPECT_EQ(layout.error().place.key, "tag_size_m");
  EXPECT_NE(layout.error().hint.find("0.16 m"), std::string::npos);
  EXPECT_NE(layout.error().hint.find("Tabloid"), std::string::npos);
  testing::expect_on_page("tags", layout.error());
  SheetOptions options = with_size(0.17);
  options.paper = parse_paper("Tabloid").value();
  EXPECT_TRUE(layout_sheet(FamilyId::Tag36h11, {0}, options));
}

TEST(SheetLayout, ATagOf160mmOfTheCommonFamilyFitsOnA4) {
  const auto layout = layout_sheet(FamilyId::Tag36h11, first_numbers(24), with_size(0.16));
  ASSERT_TRUE(layout);
  EXPECT_EQ(layout->pages.size(), 24U);
  EXPECT_EQ(layout->tags_per_page, 1);
}

TEST(SheetLayout, PlacesAsManyAsFitOrPerPage) {
  SheetOptions options = with_size(0.05);
  const auto many = layout_sheet(FamilyId::Tag36h11, first_numbers(30), options);
  ASSERT_TRUE(many);
  EXPECT_EQ(many->tags_per_page, 9);
  EXPECT_EQ(many->pages.size(), 4U);
  EXPECT_EQ(many->pages.back().size(), 3U);
  options.per_page = 1;
  EXPECT_EQ(layout_sheet(FamilyId::Tag36h11, first_numbers(30), options)->pages.size(), 30U);
}

TEST(SheetLayout, RotatesThePaperOnlyIfUseful) {
  SheetOptions options = with_size(0.16);
  EXPECT_EQ(layout_sheet(FamilyId::Tag36h11, {0}, options)->paper.width_mm, 210);
  options.paper = turned(options.paper);
  EXPECT_EQ(layout_sheet(FamilyId::Tag36h11, {0}, options)->paper.width_mm, 210);
  options = with_size(0.075);  // 94 mm wide, 103 mm high with its caption: 2 x 2 in portrait, 3 x 1 rotated
  EXPECT_EQ(layout_sheet(FamilyId::Tag36h11, {0}, options)->paper.width_mm, 210);
  options = with_size(0.1);  // one in portrait, two if rotated
  EXPECT_EQ(layout_sheet(FamilyId::Tag36h11, {0}, options)->paper.width_mm, 297);
}

TEST(SheetLayout, InvalidOptionsAreRejected) {
  using ::testing::HasSubstr;
  const auto expect_error = [](const std::vector<int>& numbers, const SheetOptions& options, const char* key,
                               const char* value) {
    const auto layout = layout_sheet(FamilyId::Tag16h5, numbers, options);
    ASSERT_FALSE(layout) << value;
    EXPECT_EQ(layout.error().code, ErrorCode::InvalidArgument) << value;
    EXPECT_EQ(layout.error().place.key, key);
    EXPECT_THAT(layout.error().message + layout.error().hint, HasSubstr(value));
    testing::expect_on_page("tags", layout.error());
  };
  expect_error({0, 30}, with_size(0.05), "ids", "30");
  expect_error({0, 30}, with_size(0.05), "ids", "0 to 29");
  expect_error({-1}, with_size(0.05), "ids", "-1");
  expect_error({1, 2, 1}, with_size(0.05), "ids", "1");
  expect_error({}, with_size(0.05), "ids", "0-3,7");
  expect_error({0}, with_size(160), "tag_size_m", "160 mm is 0.16");
  for (const double size_m : {0.0, -0.1, 1e-4, 1e9, std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity()}) {
    expect_error({0}, with_size(size_m), "tag_size_m", "m");
  }
  SheetOptions options = with_size(0.05);
  options.margin_m = std::numeric_limits<double>::quiet_NaN();
  expect_error({0}, options, "margin_m", "nan");
  options = with_size(0.05);
  options.per_page = 50;
  expect_error({0}, options, "per_page", "50 tag16h5 tags of 50 mm");
  options = with_size(0.05);
  options.margin_m = 0.1;
  options.paper = {"A5", 148, 210};
  expect_error({0}, options, "tag_size_m", "A5");
}

TEST(Orientation, IsParsedOrSuggested) {
  EXPECT_EQ(parse_orientation("auto").value(), Orientation::Auto);
  EXPECT_EQ(parse_orientation("portrait").value(), Orientation::Portrait);
  EXPECT_EQ(parse_orientation("landscape").value(), Orientation::Landscape);
  const Error unknown = parse_orientation("potrait").error();
  EXPECT_EQ(unknown.place.key, "orientation");
  EXPECT_NE(unknown.hint.find("'portrait'"), std::string::npos);
  testing::expect_on_page("tags", unknown);
}

TEST(SheetLayout, TooManyPagesAreRejected) {
  SheetOptions options = with_size(0.05);
  options.per_page = 1;
  const auto layout = layout_sheet(FamilyId::TagCircle49h12, first_numbers(2001), options);
  ASSERT_FALSE(layout);
  EXPECT_EQ(layout.error().code, ErrorCode::LimitExceeded);
}

}  // namespace
}  // namespace waymark::plot
