#include "waymark/tags/code_index.hpp"

#include <bit>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark::search {
namespace {

TEST(CodeIndex, FindsWhatALookAtEveryCodeFinds) {
  Random random(11);
  for (const FamilyId id : kAllFamilies) {
    const Family& kind = family(id);
    const auto bits = static_cast<unsigned>(kind.bits.size());
    for (int most = 0; most <= 3; ++most) {
      const CodeIndex index(kind, most);
      for (int round = 0; round < 40; ++round) {
        std::uint64_t code = kind.codes[random.index(kind.codes.size())];
        const std::uint64_t flips = random.index(5);
        for (std::uint64_t i = 0; i < flips; ++i) code ^= std::uint64_t{1} << random.index(bits);
        int best = 99;
        int number = -1;
        for (std::size_t i = 0; i < kind.codes.size(); ++i) {
          const int distance = std::popcount(kind.codes[i] ^ code);
          if (distance < best) {
            best = distance;
            number = static_cast<int>(i);
          }
        }
        const auto found = index.find(code);
        ASSERT_EQ(found.has_value(), best <= most) << kind.name;
        if (!found) continue;
        EXPECT_EQ(found->distance, best) << kind.name;
        EXPECT_EQ(found->number, number) << kind.name;
      }
    }
  }
}

TEST(CodeIndex, FindsTheOnlyCodeWithTheKnownBits) {
  Random random(12);
  const Family& kind = family(FamilyId::Tag36h11);
  const CodeIndex index(kind, 0);
  for (int round = 0; round < 40; ++round) {
    const auto number = static_cast<int>(random.index(kind.codes.size()));
    const std::uint64_t code = kind.codes[static_cast<std::size_t>(number)];
    std::uint64_t known = (std::uint64_t{1} << 36U) - 1;
    for (int i = 0; i < 6; ++i) known &= ~(std::uint64_t{1} << random.index(36));  // fewer than the 11 apart
    EXPECT_EQ(index.find_exact(code ^ ~known, known), number);
    EXPECT_FALSE(index.find_exact(code ^ (known & ~(known - 1)), known)) << "a known bit is wrong";
  }
  EXPECT_FALSE(index.find_exact(0, 0)) << "every code has no known bit wrong";
}

}  // namespace
}  // namespace waymark::search
