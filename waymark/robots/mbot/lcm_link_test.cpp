#include "waymark/robots/mbot/lcm_link.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

TEST(LcmAddress, AcceptsOnlyUdpMulticastGroups) {
  EXPECT_EQ(lcm_address("").value(), kLcmDefaultAddress);
  EXPECT_EQ(lcm_address("udpm://239.255.76.67:7668").value(), "udpm://239.255.76.67:7668");
  EXPECT_EQ(lcm_address("udpm://239.255.76.67:7668?ttl=1").value(), "udpm://239.255.76.67:7668?ttl=1");
  for (const char* bad :
       {"udpm://10.0.0.1:7667", "udpm://239.255.76.667:7667", "udpm://239.255.76.67:0",
        "udpm://239.255.76.67:99999", "udpm://239.255.76.67:7667?ttl=256", "file:///etc/passwd",
        "tcpq://localhost:7700", "239.255.76.67:7667", "udpm://239.255.76.67:7667?ttl=0&x=1"}) {
    const auto address = lcm_address(bad);
    ASSERT_FALSE(address) << bad;
    EXPECT_THAT(address.error().hint, HasSubstr("ttl=1"));
    testing::expect_on_page("robots", address.error());
  }
}

}  // namespace
}  // namespace waymark
