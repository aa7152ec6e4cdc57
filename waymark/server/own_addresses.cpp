#include "waymark/server/own_addresses.hpp"

#include <array>
#include <cstdint>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <netinet/in.h>

namespace waymark {

std::vector<std::string> own_addresses(bool with_ipv6) {
  std::vector<std::string> all;
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) return all;
  for (const ifaddrs* at = first; at != nullptr; at = at->ifa_next) {
    if (at->ifa_addr == nullptr) continue;
    std::array<char, INET6_ADDRSTRLEN> text{};
    if (at->ifa_addr->sa_family == AF_INET) {
      const auto* v4 = reinterpret_cast<const sockaddr_in*>(at->ifa_addr);
      constexpr std::uint32_t kLoopback = 127;
      if (ntohl(v4->sin_addr.s_addr) >> 24U == kLoopback) continue;
      if (::inet_ntop(AF_INET, &v4->sin_addr, text.data(), text.size()) != nullptr)
        all.emplace_back(text.data());
    } else if (with_ipv6 && at->ifa_addr->sa_family == AF_INET6) {
      const auto* v6 = reinterpret_cast<const sockaddr_in6*>(at->ifa_addr);
      if (IN6_IS_ADDR_LINKLOCAL(&v6->sin6_addr) || IN6_IS_ADDR_LOOPBACK(&v6->sin6_addr)) continue;
      if (::inet_ntop(AF_INET6, &v6->sin6_addr, text.data(), text.size()) != nullptr)
        all.push_back(fmt::format("[{}]", text.data()));
    }
  }
  ::freeifaddrs(first);
  return all;
}

}  // namespace waymark
