// Prints the events of a log as read by LCM's own library: number TAB channel TAB receive time [us] TAB bytes
// TAB crc32.
#include <cstdio>

#include <zlib.h>
#include <lcm/lcm-cpp.hpp>

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  lcm::LogFile log(argv[1], "r");
  if (!log.good()) return 1;
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    const auto crc = crc32(0, static_cast<const Bytef*>(event->data), static_cast<uInt>(event->datalen));
    std::printf("%lld\t%s\t%lld\t%d\t%08lx\n", static_cast<long long>(event->eventnum),
                event->channel.c_str(), static_cast<long long>(event->timestamp), event->datalen, crc);
  }
  return 0;
}
