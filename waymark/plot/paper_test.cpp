#include "waymark/plot/paper.hpp"

#include <cctype>
#include <tuple>

#include <gtest/gtest.h>

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

TEST(Paper, TakesASizeOfOnesOwn) {
  EXPECT_EQ(parse_paper("300x400").value(), (Paper{"300x400", 300, 400}));
  EXPECT_EQ(parse_paper("99.5X20mm").value(), (Paper{"99.5x20", 99.5, 20}));
}

TEST(Paper, RefusesWhatIsNoPaperWithAWayOut) {
  EXPECT_EQ(
      to_string(parse_paper("A44").error()),
      "(paper): unknown paper 'A44'. Did you mean 'A4'? Or give WIDTHxHEIGHT in millimetres, as in 300x400.");
  for (const char* text : {"", "x", "300x", "x400", "nanxnan", "infx300", "-300x400", "0x0", "19x300",
                           "300x5001", "1e9x1e9", "300x400x5", "300 x 400", "A4x"}) {
    const auto paper = parse_paper(text);
    ASSERT_FALSE(paper) << text;
    EXPECT_EQ(paper.error().code, ErrorCode::InvalidArgument);
    EXPECT_FALSE(paper.error().hint.empty());
  }
  EXPECT_LT(to_string(parse_paper(std::string(100000, 'q')).error()).size(), 300U);
}

}  // namespace
}  // namespace waymark::plot
