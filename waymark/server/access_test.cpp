#include "waymark/server/access.hpp"

#include <set>
#include <string>

#include <gtest/gtest.h>

namespace waymark {
namespace {

using Refusal = AccessRights::Refusal;

const AccessPolicy kHere{.port = 8642, .token = "0123456789abcdef"};
const AccessPolicy kRemote{.port = 8642, .remote = true, .token = "0123456789abcdef"};

AccessClaim from_here(std::string_view target = "/") {
  return {.host = "127.0.0.1:8642", .origin = "http://127.0.0.1:8642", .target = target, .cookie = {}};
}

TEST(Access, LocallyEveryoneMayWatchAndTheTokenCommands) {
  EXPECT_EQ(rights_of(from_here(), kHere).refusal, Refusal::None);
  EXPECT_FALSE(rights_of(from_here(), kHere).token);
  EXPECT_TRUE(rights_of(from_here("/live?a=1&token=0123456789abcdef"), kHere).token);
  AccessClaim claim = from_here();
  claim.cookie = "other=1; waymark_8642=0123456789abcdef";
  EXPECT_TRUE(rights_of(claim, kHere).token);
  claim.cookie = "waymark_8643=0123456789abcdef";  // the cookie of another server on this machine
  EXPECT_FALSE(rights_of(claim, kHere).token);
}

TEST(Access, AWrongTokenGivesNoRights) {
  for (const char* token : {"", "0", "0123456789abcdeF", "0123456789abcdef0", "0123456789abcde"}) {
    const std::string target = std::string("/?token=") + token;
    EXPECT_FALSE(rights_of(from_here(target), kHere).token) << token;
    EXPECT_EQ(rights_of(from_here(target), kRemote).refusal, Refusal::NoToken) << token;
  }
  const AccessPolicy without{.port = 8642};  // if no token is set, no request has it
  EXPECT_FALSE(rights_of(from_here("/?token="), without).token);
}

TEST(Access, AForeignPageGetsNoRightsFromTheCookie) {
  AccessClaim claim = from_here();
  claim.cookie = "waymark_8642=0123456789abcdef";
  for (const char* origin : {"http://evil.example", "https://127.0.0.1:8642", "null", "http://127.0.0.1:8643",
                             "http://127.0.0.1:8642.evil.example"}) {
    claim.origin = origin;
    EXPECT_EQ(rights_of(claim, kHere).refusal, Refusal::ForeignPage) << origin;
    EXPECT_EQ(rights_of(claim, kRemote).refusal, Refusal::ForeignPage) << origin;
  }
  claim.origin = "https://app.foxglove.dev";  // where the user entered the token
  claim.target = "/?token=0123456789abcdef";
  EXPECT_EQ(rights_of(claim, kHere).refusal, Refusal::None);
}

TEST(Access, RejectsOtherNamesOfThisMachine) {
  AccessClaim claim = from_here("/?token=0123456789abcdef");
  claim.host = "evil.example:8642";
  claim.origin = "http://evil.example:8642";
  EXPECT_EQ(rights_of(claim, kHere).refusal, Refusal::WrongHost);
}

TEST(Access, ARemoteServerRequiresItsToken) {
  AccessClaim claim{
      .host = "robot.local:8642", .origin = "http://robot.local:8642", .target = "/", .cookie = {}};
  EXPECT_EQ(rights_of(claim, kRemote).refusal, Refusal::NoToken);
  claim.cookie = "waymark_8642=0123456789abcdef";
  EXPECT_EQ(rights_of(claim, kRemote).refusal, Refusal::None);
  EXPECT_TRUE(rights_of(claim, kRemote).token);
}

TEST(Access, BrowsersOmitPort80) {
  const AccessPolicy usual{.port = 80};
  EXPECT_TRUE(is_own_host("127.0.0.1", usual));
  EXPECT_TRUE(is_own_host("localhost:80", usual));
  EXPECT_FALSE(is_own_host("localhost:8080", usual));
  EXPECT_FALSE(is_own_host("evil.example", usual));
  EXPECT_EQ(rights_of({.host = "localhost", .origin = "http://localhost", .target = "/", .cookie = {}}, usual)
                .refusal,
            Refusal::None);
  EXPECT_FALSE(is_own_host("localhost", kHere));
}

TEST(Access, AcceptsTheAddressItListensAt) {
  const AccessPolicy second{.port = 8642, .address = "127.0.0.2"};
  EXPECT_TRUE(is_own_host("127.0.0.2:8642", second));
  EXPECT_FALSE(is_own_host("127.0.0.2:8642", kHere));
  EXPECT_FALSE(is_own_host("127.0.0.2:8643", second));
}

TEST(Access, TokensAreLongAndUnique) {
  std::set<std::string> tokens;
  for (int i = 0; i < 100; ++i) tokens.insert(make_token());
  EXPECT_EQ(tokens.size(), 100u);
  EXPECT_EQ(tokens.begin()->size(), 32u);
  EXPECT_TRUE(check_token(*tokens.begin()));
  for (const char* bad : {"", "short", "with space 123456", "0123456789abcde;", "0123456789abcd\"f"})
    EXPECT_FALSE(check_token(bad)) << bad;
  EXPECT_EQ(token_cookie(kHere), "waymark_8642=0123456789abcdef; Path=/; HttpOnly; SameSite=Strict");
}

}  // namespace
}  // namespace waymark
