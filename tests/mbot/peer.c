// A peer of Waymark on LCM, on liblcm with types that lcm-gen generated: nothing here is shared with Waymark.
//   peer robot URL SECONDS [QUIET_AFTER]  an MBot that stands: odometry, speed, IMU at 25 Hz, tags at 30 Hz; prints the commands.
//                                         After QUIET_AFTER seconds it sends nothing more, but still listens
//   peer listen URL SECONDS               prints each MBOT_VEL_CMD: "cmd MONOTONIC_NS vx vy wz utime"
//   peer watch URL SECONDS                prints how many of each message a robot sends, and the last of each in words
//   peer swamp URL SECONDS                an MBot as above between messages of random bytes on its channels
#include <lcm/lcm.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <time.h>

#include "mbot_lcm_msgs_lidar_t.h"
#include "mbot_lcm_msgs_mbot_apriltag_array_t.h"
#include "mbot_lcm_msgs_mbot_encoders_t.h"
#include "mbot_lcm_msgs_mbot_imu_t.h"
#include "mbot_lcm_msgs_pose2D_t.h"
#include "mbot_lcm_msgs_timestamp_t.h"
#include "mbot_lcm_msgs_twist2D_t.h"

static int counts[7];

static long long monotonic_ns(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return 1000000000LL * t.tv_sec + t.tv_nsec;
}

static int64_t now_us(void) {
  struct timeval t;
  gettimeofday(&t, NULL);
  return 1000000LL * t.tv_sec + t.tv_usec;
}

static void on_command(const lcm_recv_buf_t *b, const char *channel, const mbot_lcm_msgs_twist2D_t *m, void *user) {
  (void)b, (void)channel, (void)user;
  printf("cmd %lld %.6f %.6f %.6f %lld\n", monotonic_ns(), m->vx, m->vy, m->wz, (long long)m->utime);
  fflush(stdout);
}

static void send_beat(lcm_t *lcm, int64_t utime) {
  mbot_lcm_msgs_pose2D_t pose = {utime, 1.0f, 2.0f, 0.5f};
  mbot_lcm_msgs_twist2D_t speed = {utime, 0, 0, 0};
  mbot_lcm_msgs_mbot_imu_t imu;
  memset(&imu, 0, sizeof imu);
  imu.utime = utime;
  imu.gyro[2] = 0.25f;
  imu.accel[2] = -9.7f;
  mbot_lcm_msgs_pose2D_t_publish(lcm, "MBOT_ODOMETRY", &pose);
  mbot_lcm_msgs_twist2D_t_publish(lcm, "MBOT_VEL", &speed);
  mbot_lcm_msgs_mbot_imu_t_publish(lcm, "MBOT_IMU", &imu);
}

// Upright, face to face: turned by 180 degrees about x; millimetres and degrees, x y z w.
static void send_tags(lcm_t *lcm, int64_t utime) {
  mbot_lcm_msgs_mbot_apriltag_t tag = {7, {0, 10, 20, 1500, {180, 0, 0}, {1, 0, 0, 0}}};
  mbot_lcm_msgs_mbot_apriltag_array_t array = {utime, 1, &tag};
  mbot_lcm_msgs_mbot_apriltag_array_t_publish(lcm, "MBOT_APRILTAG_ARRAY", &array);
}

static void send_noise(lcm_t *lcm) {
  static const char *channels[] = {"MBOT_ODOMETRY", "MBOT_IMU", "MBOT_APRILTAG_ARRAY", "LIDAR", "MBOT_VEL", "MBOT_VEL_CMD", "MBOT_TIMESYNC"};
  unsigned char bytes[300];
  const int size = rand() % (int)sizeof bytes;
  for (int i = 0; i < size; ++i) bytes[i] = (unsigned char)rand();
  lcm_publish(lcm, channels[rand() % 7], bytes, (unsigned)size);
}

static void robot(lcm_t *lcm, double seconds, double quiet_after, int noisy) {
  mbot_lcm_msgs_twist2D_t_subscribe(lcm, "MBOT_VEL_CMD", on_command, NULL);
  const long long began = monotonic_ns();
  long long beat = began, tags = began;
  while (monotonic_ns() - began < 1e9 * seconds) {
    const long long now = monotonic_ns();
    const int talks = now - began < 1e9 * quiet_after;
    if (talks && now >= beat) { send_beat(lcm, now_us()); beat += 40000000; }
    if (talks && now >= tags) { send_tags(lcm, now_us()); tags += 33000000; }
    if (noisy) send_noise(lcm);
    lcm_handle_timeout(lcm, 2);
  }
}

static void on_pose(const lcm_recv_buf_t *b, const char *c, const mbot_lcm_msgs_pose2D_t *m, void *u) {
  (void)b, (void)c, (void)u;
  if (counts[0]++ % 10 == 0) printf("pose %.4f %.4f %.4f\n", m->x, m->y, m->theta);
}
static void on_speed(const lcm_recv_buf_t *b, const char *c, const mbot_lcm_msgs_twist2D_t *m, void *u) {
  (void)b, (void)c, (void)u;
  if (counts[1]++ % 10 == 0) printf("speed %.4f %.4f\n", m->vx, m->wz);
}
static void on_imu(const lcm_recv_buf_t *b, const char *c, const mbot_lcm_msgs_mbot_imu_t *m, void *u) {
  (void)b, (void)c, (void)u;
  if (counts[2]++ % 10 == 0) printf("imu %.4f %.3f\n", m->gyro[2], m->accel[2]);
}
static void on_encoders(const lcm_recv_buf_t *b, const char *c, const mbot_lcm_msgs_mbot_encoders_t *m, void *u) {
  (void)b, (void)c, (void)u;
  if (counts[3]++ % 10 == 0) printf("encoders %lld %lld %d\n", (long long)m->ticks[0], (long long)m->ticks[1], m->delta_time);
}
static void on_tags(const lcm_recv_buf_t *b, const char *c, const mbot_lcm_msgs_mbot_apriltag_array_t *m, void *u) {
  (void)b, (void)c, (void)u;
  if (counts[4]++ % 10 == 0 && m->array_size > 0) {
    const mbot_lcm_msgs_mbot_apriltag_t *tag = &m->detections[0];
    printf("tag %d %.1f %.1f %.1f rpy %.1f %.1f %.1f quat %.4f %.4f %.4f %.4f\n", tag->tag_id, tag->pose.x, tag->pose.y, tag->pose.z,
           tag->pose.angles_rpy[0], tag->pose.angles_rpy[1], tag->pose.angles_rpy[2], tag->pose.angles_quat[0], tag->pose.angles_quat[1],
           tag->pose.angles_quat[2], tag->pose.angles_quat[3]);
  }
}
static void on_lidar(const lcm_recv_buf_t *b, const char *c, const mbot_lcm_msgs_lidar_t *m, void *u) {
  (void)b, (void)c, (void)u;
  if (counts[5]++ % 10 == 0) printf("lidar %d %.3f %.4f\n", m->num_ranges, m->ranges[0], m->thetas[m->num_ranges - 1]);
}
static void on_time(const lcm_recv_buf_t *b, const char *c, const mbot_lcm_msgs_timestamp_t *m, void *u) {
  (void)b, (void)c, (void)u;
  counts[6]++;
  printf("time %lld\n", (long long)(now_us() - m->utime));
}

static void watch(lcm_t *lcm, double seconds) {
  mbot_lcm_msgs_pose2D_t_subscribe(lcm, "MBOT_ODOMETRY", on_pose, NULL);
  mbot_lcm_msgs_twist2D_t_subscribe(lcm, "MBOT_VEL", on_speed, NULL);
  mbot_lcm_msgs_mbot_imu_t_subscribe(lcm, "MBOT_IMU", on_imu, NULL);
  mbot_lcm_msgs_mbot_encoders_t_subscribe(lcm, "MBOT_ENCODERS", on_encoders, NULL);
  mbot_lcm_msgs_mbot_apriltag_array_t_subscribe(lcm, "MBOT_APRILTAG_ARRAY", on_tags, NULL);
  mbot_lcm_msgs_lidar_t_subscribe(lcm, "LIDAR", on_lidar, NULL);
  mbot_lcm_msgs_timestamp_t_subscribe(lcm, "MBOT_TIMESYNC", on_time, NULL);
  const long long began = monotonic_ns();
  while (monotonic_ns() - began < 1e9 * seconds) lcm_handle_timeout(lcm, 20);
  printf("counts odometry %d speed %d imu %d encoders %d tags %d lidar %d timesync %d\n", counts[0], counts[1], counts[2], counts[3], counts[4],
         counts[5], counts[6]);
}

int main(int argc, char **argv) {
  if (argc < 4) return 2;
  lcm_t *lcm = lcm_create(argv[2]);
  if (lcm == NULL) return 1;
  const double seconds = atof(argv[3]);
  srand(1);
  if (strcmp(argv[1], "robot") == 0) robot(lcm, seconds, argc > 4 ? atof(argv[4]) : seconds, 0);
  if (strcmp(argv[1], "swamp") == 0) robot(lcm, seconds, seconds, 1);
  if (strcmp(argv[1], "listen") == 0) robot(lcm, seconds, 0, 0);
  if (strcmp(argv[1], "watch") == 0) watch(lcm, seconds);
  lcm_destroy(lcm);
  return 0;
}
