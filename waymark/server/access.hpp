#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"

/// Permissions to view and to control. A page from another site must not get access, not even through a
/// browser on this machine (OWASP, "WebSocket Security Cheat Sheet", sections on Origin and authentication).
namespace waymark {

/// Access settings of a server.
struct AccessPolicy {
  std::uint16_t port = 0;
  bool remote = false;                ///< whether other machines can reach it, in which case every request
                                      ///< needs the token
  std::string token = {};             ///< if empty, no viewer may send commands
  std::string address = "127.0.0.1";  ///< address to listen on, as in a URL: "127.0.0.2", "[::1]"
};

/// Fields in a request that identify its sender. Fields that were not sent are empty.
struct AccessClaim {
  std::string_view host;    ///< such as "localhost:8642"
  std::string_view origin;  ///< such as "http://localhost:8642"
  std::string_view target;  ///< such as "/live?token=…"
  std::string_view cookie;
};

struct AccessRights {
  /// Why the request is refused: it names another server (DNS rebinding), comes from another page, or lacks a
  /// required token.
  enum class Refusal : std::uint8_t { None, WrongHost, ForeignPage, NoToken };
  Refusal refusal = Refusal::None;
  bool token = false;       ///< whether it has the token, either in the address or in the cookie
  bool own_origin = false;  ///< whether it was sent by a page from this server, or not by a page at all
  bool by_address = false;  ///< whether the token is in the address, where browsers never add it on their own
};

/// Whether the Host field names this server. A local server is named by its address or by localhost, with the
/// port (browsers omit port 80). Any other name that resolves to it may have been used by a foreign page. A
/// remote server may have any name; it is protected by the token.
[[nodiscard]] bool is_own_host(std::string_view host, const AccessPolicy& policy);

/// The rights granted to a request. A foreign page is accepted only if the token is in the address.
[[nodiscard]] AccessRights rights_of(const AccessClaim& claim, const AccessPolicy& policy);

/// The value of `name` in "/path?name=value&…"; empty if missing.
[[nodiscard]] std::string_view query_value(std::string_view target, std::string_view name);

/// Returns "waymark_8642=TOKEN; …", the Set-Cookie field for a page that was opened with the token.
[[nodiscard]] std::string token_cookie(const AccessPolicy& policy);

/// Returns 128 random bits from the system as 32 hexadecimal digits.
[[nodiscard]] std::string make_token();

/// Checks a token set by the user, which must consist of 16 to 128 letters, digits, - and _.
[[nodiscard]] Status check_token(std::string_view token);

}  // namespace waymark
