#include "waymark/server/background_thread.hpp"

#include <cstddef>

#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace waymark {

void BackgroundThread::note_robot_processor() { robots_.store(sched_getcpu(), std::memory_order_relaxed); }

void BackgroundThread::begin() {
  constexpr int kNice = 10;
  const sched_param none{};
  static_cast<void>(sched_setscheduler(0, SCHED_BATCH, &none));
  static_cast<void>(setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kNice));
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0)
    return;  // fails if there are more processors than
             // a cpu_set_t can hold
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &allowed)) allowed_.push_back(cpu);
  }
}

void BackgroundThread::avoid_robot_processor() {
  const int robot = robots_.load(std::memory_order_relaxed);
  if (robot == left_alone_ || robot < 0) return;
  cpu_set_t others;
  CPU_ZERO(&others);
  for (const int cpu : allowed_) {
    if (cpu != robot) CPU_SET(static_cast<std::size_t>(cpu), &others);
  }
  if (CPU_COUNT(&others) == 0 || sched_setaffinity(0, sizeof others, &others) != 0) return;
  left_alone_ = robot;
}

}  // namespace waymark
