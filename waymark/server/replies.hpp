#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "waymark/server/access.hpp"

namespace waymark {

/// A file the server gives away. Nothing else of the disk can be asked for.
struct OfferedFile {
  enum class Kind : std::uint8_t { Recording, Text };
  std::string name;  ///< as the page shows it
  std::filesystem::path path;
  Kind kind = Kind::Recording;
  /// The folder that was offered: a link that leads out of it is not followed. Empty: the file itself was
  /// named.
  std::filesystem::path within{};
};

/// Whether the file, all links followed, lies in the folder. False where one of them is not there.
[[nodiscard]] bool lies_within(const std::filesystem::path& file, const std::filesystem::path& folder);

struct OfferedThings {
  std::vector<OfferedFile> files{};
  bool live = false;  ///< a robot that runs
};

/// What of a request matters. Header fields that were not sent are empty.
struct HttpRequest {
  std::string_view method;
  std::string_view target;  ///< "/files/0/lap.mcap"
  std::string_view host;    ///< "localhost:8642"
  std::string_view origin;
  std::string_view cookie;
  std::string_view range;  ///< "bytes=0-99"
  bool accepts_gzip = false;
};

/// A part of a file.
struct FilePart {
  std::filesystem::path path;
  std::uint64_t first = 0;   ///< [byte]
  std::uint64_t length = 0;  ///< [byte]
};

struct HttpReply {
  int status = 200;
  std::vector<std::pair<std::string, std::string>> headers;
  std::variant<std::string, std::string_view, FilePart> body;  ///< a view lives as long as the program

  [[nodiscard]] std::uint64_t length() const;
};

/// What a request gets: the page, `session.json` (what is offered), `files/N/NAME` by ranges, or
/// `tags/FAMILY/ID` (how a tag is printed). Who may not ask gets nothing (access.hpp); who opens the page
/// with the token in the address gets it as a cookie, and the address without it. Never fails; reads the size
/// of a file at most.
[[nodiscard]] HttpReply reply_to(const HttpRequest& request, const OfferedThings& offered,
                                 const AccessPolicy& policy);

/// Why an asker gets nothing: status and words.
[[nodiscard]] HttpReply refusal_of(AccessRights::Refusal refusal, const AccessPolicy& policy);

/// First byte and length of "bytes=0-99", "bytes=100-" or "bytes=-50" within `size` bytes.
struct ByteRange {
  enum class Kind : std::uint8_t { Whole, Part, Unsatisfiable };  ///< Whole: nothing that is understood
  Kind kind = Kind::Whole;
  std::uint64_t first = 0;
  std::uint64_t length = 0;
};
[[nodiscard]] ByteRange parse_range(std::string_view header, std::uint64_t size);

}  // namespace waymark
