#include "waymark/server/replies.hpp"

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/server/assets.hpp"

namespace waymark {
namespace {

constexpr std::uint16_t kPort = 8642;
const AccessPolicy kPolicy{.port = kPort};

HttpRequest get(std::string_view target) {
  return {.method = "GET",
          .target = target,
          .host = "127.0.0.1:8642",
          .origin = {},
          .cookie = {},
          .range = {},
          .accepts_gzip = true};
}

std::string text_of(const HttpReply& reply) {
  if (const auto* text = std::get_if<std::string>(&reply.body)) return *text;
  const auto* view = std::get_if<std::string_view>(&reply.body);
  return view != nullptr ? std::string(*view) : std::string();
}

std::string header(const HttpReply& reply, std::string_view name) {
  for (const auto& [key, value] : reply.headers) {
    if (key == name) return value;
  }
  return {};
}

/// Offers a file of ten bytes.
class Replies : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "a \"lap\".mcap") << "0123456789";
    offered_.files.push_back({"a \"lap\".mcap", folder_ / "a \"lap\".mcap", OfferedFile::Kind::Recording});
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_ = testing::fresh_folder("replies");
  OfferedThings offered_;
};

TEST(Range, ParsesPartsOfAFile) {
  using Kind = ByteRange::Kind;
  const auto is = [](std::string_view text, Kind kind, std::uint64_t first, std::uint64_t length) {
    const ByteRange range = parse_range(text, 10);
    return range.kind == kind && range.first == first && range.length == length;
  };
  EXPECT_TRUE(is("bytes=0-3", Kind::Part, 0, 4));
  EXPECT_TRUE(is("bytes=9-9", Kind::Part, 9, 1));
  EXPECT_TRUE(is("bytes=4-", Kind::Part, 4, 6));
  EXPECT_TRUE(is("bytes=-3", Kind::Part, 7, 3));
  EXPECT_TRUE(is("bytes=-99", Kind::Part, 0, 10));
  EXPECT_TRUE(is("bytes=2-18446744073709551615", Kind::Part, 2, 8));
  for (const char* text : {"bytes=10-", "bytes=10-11", "bytes=-0"})
    EXPECT_EQ(parse_range(text, 10).kind, Kind::Unsatisfiable) << text;
  for (const char* text : {"", "bytes", "bytes=", "bytes=-", "bytes=3-1", "bytes=a-b", "bytes=0-1,4-5",
                           "lines=0-1", "bytes=99999999999999999999-", "bytes= 1-2", "bytes=1-2x"})
    EXPECT_EQ(parse_range(text, 10).kind, Kind::Whole) << text;
}

TEST(Range, AnEmptyFileHasNoRanges) {
  EXPECT_EQ(parse_range("bytes=0-", 0).kind, ByteRange::Kind::Unsatisfiable);
  EXPECT_EQ(parse_range("bytes=-5", 0).kind, ByteRange::Kind::Unsatisfiable);
}

TEST(Host, OnlyThisMachineAndThisPort) {
  for (const char* host : {"127.0.0.1:8642", "localhost:8642", "[::1]:8642"})
    EXPECT_TRUE(is_own_host(host, kPolicy));
  for (const char* host :
       {"", "localhost", "localhost:86420", "evil.example:8642", "127.0.0.1.evil.example:8642", ":8642"})
    EXPECT_FALSE(is_own_host(host, kPolicy)) << host;
}

TEST_F(Replies, RefusesForeignHostsAndPages) {
  HttpRequest request = get("/session.json");
  request.host = "evil.example:8642";
  EXPECT_EQ(reply_to(request, offered_, kPolicy).status, 421);
  request = get("/session.json");
  for (const char* origin : {"http://evil.example", "https://127.0.0.1:8642", "null", "http://127.0.0.1:1"}) {
    request.origin = origin;
    const HttpReply reply = reply_to(request, offered_, kPolicy);
    EXPECT_EQ(reply.status, 403) << origin;
    EXPECT_EQ(text_of(reply).find("lap"), std::string::npos);
  }
  request.origin = "http://localhost:8642";
  EXPECT_EQ(reply_to(request, offered_, kPolicy).status, 200);
}

TEST_F(Replies, RefusesWrites) {
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "BREW"}) {
    HttpRequest request = get("/files/0/x");
    request.method = method;
    EXPECT_EQ(reply_to(request, offered_, kPolicy).status, 405) << method;
  }
}

TEST_F(Replies, SessionListsTheOfferedFiles) {
  const HttpReply reply = reply_to(get("/session.json?x=1"), offered_, kPolicy);
  EXPECT_EQ(text_of(reply), R"({"files":[{"name":"a \"lap\".mcap","url":"files/0/a%20%22lap%22.mcap",)"
                            R"("kind":"recording","size_bytes":10}],"live":false})");
}

TEST_F(Replies, ServesFilesByRanges) {
  HttpRequest request = get("/files/0/whatever");
  HttpReply reply = reply_to(request, offered_, kPolicy);
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(reply.length(), 10u);
  request.range = "bytes=2-4";
  reply = reply_to(request, offered_, kPolicy);
  EXPECT_EQ(reply.status, 206);
  EXPECT_EQ(header(reply, "Content-Range"), "bytes 2-4/10");
  EXPECT_EQ(std::get<FilePart>(reply.body).first, 2u);
  EXPECT_EQ(reply.length(), 3u);
  request.range = "bytes=10-";
  EXPECT_EQ(reply_to(request, offered_, kPolicy).status, 416);
}

TEST_F(Replies, ServesOnlyOfferedFiles) {
  for (const char* target : {"/files/1/x", "/files/-1/x", "/files/", "/files/0x/y", "/files/../../etc/passwd",
                             "/../etc/passwd", "/etc/passwd", "//etc/passwd", "/%2e%2e/etc/passwd",
                             "/index.html/..", "/files/18446744073709551616/x", "/tags/", "/tags/tag36h11",
                             "/tags/tag36h11/587", "/tags/tag36h11/-1", "/tags/../../x/1"})
    EXPECT_EQ(reply_to(get(target), offered_, kPolicy).status, 404) << target;
  EXPECT_EQ(reply_to(get("x"), offered_, kPolicy).status, 400);
  EXPECT_EQ(reply_to(get(""), offered_, kPolicy).status, 400);
  std::filesystem::remove(offered_.files[0].path);
  EXPECT_EQ(reply_to(get("/files/0/x"), offered_, kPolicy).status, 404);
}

TEST_F(Replies, DoesNotFollowLinksOutOfAnOfferedFolder) {
  namespace fs = std::filesystem;
  const fs::path folder = testing::fresh_folder("offered");
  fs::create_directories(folder / "map");
  std::ofstream(folder / "map" / "map.yaml") << "tags: []";
  fs::create_symlink("/etc/passwd", folder / "map" / "robot.yaml");
  fs::create_symlink(folder / "map" / "map.yaml", folder / "route.yaml");
  fs::create_directory_symlink("/etc", folder / "etc");
  EXPECT_TRUE(lies_within(folder / "map" / "map.yaml", folder));
  EXPECT_TRUE(lies_within(folder / "route.yaml", folder)) << "a link inside the folder";
  for (const char* name : {"map/robot.yaml", "etc/passwd", "nothing.yaml", "map/../../waymark-offered.txt"})
    EXPECT_FALSE(lies_within(folder / name, folder)) << name;
  EXPECT_FALSE(lies_within(folder, folder / "map"));
  OfferedThings offered;
  for (const char* name : {"map/map.yaml", "map/robot.yaml"})
    offered.files.push_back({name, folder / name, OfferedFile::Kind::Text, folder});
  EXPECT_EQ(reply_to(get("/files/0/x"), offered, kPolicy).status, 200);
  EXPECT_EQ(reply_to(get("/files/1/x"), offered, kPolicy).status, 404);
  offered.files[1].within.clear();  // as for a file specified by the user
  EXPECT_EQ(reply_to(get("/files/1/x"), offered, kPolicy).status, 200);
  fs::remove_all(folder);
}

TEST_F(Replies, ServesTheCellsOfAPrintedTag) {
  const std::string text = text_of(reply_to(get("/tags/tag36h11/0"), offered_, kPolicy));
  const std::string start = R"({"total_width":10,"width_at_border":8,"cells":")";
  ASSERT_TRUE(text.starts_with(start));
  const std::string cells = text.substr(start.size(), 100);
  EXPECT_EQ(cells.substr(0, 10), "1111111111");   // the white margin
  EXPECT_EQ(cells.substr(10, 10), "1000000001");  // the black border inside it
}

TEST_F(Replies, EveryReplyForbidsForeignScripts) {
  for (const char* target : {"/", "/nothing", "/session.json", "/files/0/x"}) {
    const HttpReply reply = reply_to(get(target), offered_, kPolicy);
    EXPECT_NE(header(reply, "Content-Security-Policy").find("default-src 'none'; script-src 'self'"),
              std::string::npos);
    EXPECT_EQ(header(reply, "X-Content-Type-Options"), "nosniff");
  }
}

TEST_F(Replies, ServesThePageOrBuildInstructions) {
  const HttpReply reply = reply_to(get("/"), offered_, kPolicy);
  ASSERT_EQ(reply.status, 200);
  if (viewer_assets().empty()) {
    EXPECT_NE(text_of(reply).find("tools/build_viewer.sh"), std::string::npos);
    return;
  }
  EXPECT_EQ(header(reply, "Content-Encoding"), "gzip");
  EXPECT_EQ(text_of(reply).substr(0, 2), "\x1f\x8b");
  HttpRequest plain = get("/");
  plain.accepts_gzip = false;
  EXPECT_EQ(reply_to(plain, offered_, kPolicy).status, 406);
  EXPECT_EQ(reply_to(get("/app.js"), offered_, kPolicy).status, 200);
}

}  // namespace
}  // namespace waymark
