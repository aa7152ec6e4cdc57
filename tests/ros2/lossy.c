// A bad network for one program (LD_PRELOAD): some of its UDP datagrams are lost, and each is delayed by a random time,
// so that they arrive out of order.
//   LOSSY_SHARE       share that is lost, 0.1
//   LOSSY_DELAY_MS    maximum delay, 30
#define _GNU_SOURCE
#include <dlfcn.h>
#include <netinet/in.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

enum { kMost = 4096 };

struct datagram {
  int64_t due_ns;
  int socket;
  struct sockaddr_in to;
  size_t size;
  uint8_t *bytes;
};

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static pthread_t sender;
static int running;
static struct datagram held[kMost];
static int held_count;
static uint64_t state = 0x9e3779b97f4a7c15ULL;

static double chance(void) {  // xorshift64
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  return (double)(state >> 11) / 9007199254740992.0;
}

static double setting(const char *name, double otherwise) {
  const char *value = getenv(name);
  return value ? atof(value) : otherwise;
}

static int64_t now_ns(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return 1000000000LL * t.tv_sec + t.tv_nsec;
}

static ssize_t really_send(const struct datagram *one) {
  static ssize_t (*send_to)(int, const void *, size_t, int, const struct sockaddr *, socklen_t);
  if (!send_to) send_to = (ssize_t(*)(int, const void *, size_t, int, const struct sockaddr *, socklen_t))dlsym(RTLD_NEXT, "sendto");
  return send_to(one->socket, one->bytes, one->size, 0, (const struct sockaddr *)&one->to, sizeof one->to);
}

static void *send_held(void *unused) {
  (void)unused;
  for (;;) {
    const struct timespec pause = {0, 500000};
    nanosleep(&pause, NULL);
    pthread_mutex_lock(&mutex);
    const int64_t now = now_ns();
    for (int i = 0; i < held_count;) {
      if (held[i].due_ns > now) { ++i; continue; }
      (void)really_send(&held[i]);
      free(held[i].bytes);
      held[i] = held[--held_count];
    }
    pthread_mutex_unlock(&mutex);
  }
  return NULL;
}

static void hold(int socket, const struct sockaddr_in *to, const struct iovec *parts, size_t count) {
  pthread_mutex_lock(&mutex);
  if (!running) running = pthread_create(&sender, NULL, send_held, NULL) == 0;
  const int lost = chance() < setting("LOSSY_SHARE", 0.1);
  const double delay_ms = chance() * setting("LOSSY_DELAY_MS", 30);
  if (!lost && held_count < kMost) {
    struct datagram *one = &held[held_count++];
    *one = (struct datagram){now_ns() + (int64_t)(delay_ms * 1e6), socket, *to, 0, NULL};
    for (size_t i = 0; i < count; ++i) one->size += parts[i].iov_len;
    one->bytes = malloc(one->size + 1);
    uint8_t *at = one->bytes;
    for (size_t i = 0; i < count; at += parts[i++].iov_len) memcpy(at, parts[i].iov_base, parts[i].iov_len);
  }
  pthread_mutex_unlock(&mutex);
}

ssize_t sendmsg(int socket, const struct msghdr *message, int flags) {
  static ssize_t (*send_message)(int, const struct msghdr *, int);
  if (!send_message) send_message = (ssize_t(*)(int, const struct msghdr *, int))dlsym(RTLD_NEXT, "sendmsg");
  const struct sockaddr_in *to = message->msg_name;
  if (!to || message->msg_namelen < sizeof *to || to->sin_family != AF_INET) return send_message(socket, message, flags);
  ssize_t size = 0;
  for (size_t i = 0; i < message->msg_iovlen; ++i) size += (ssize_t)message->msg_iov[i].iov_len;
  hold(socket, to, message->msg_iov, message->msg_iovlen);
  return size;
}

ssize_t sendto(int socket, const void *bytes, size_t size, int flags, const struct sockaddr *to, socklen_t length) {
  struct iovec part = {(void *)bytes, size};
  struct msghdr message = {.msg_name = (void *)to, .msg_namelen = length, .msg_iov = &part, .msg_iovlen = 1};
  return sendmsg(socket, &message, flags);
}
