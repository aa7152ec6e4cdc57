#pragma once

#include <string>
#include <vector>

namespace waymark {

/// The addresses at which other machines may find this one, as they stand in a URL ("192.168.1.7",
/// "[fd00::7]"): but for loopback and what is valid on one cable only.
[[nodiscard]] std::vector<std::string> own_addresses(bool with_ipv6);

}  // namespace waymark
