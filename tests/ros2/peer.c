// Peers of Waymark on Eclipse Cyclone DDS, with types that idlc generated: nothing here is shared with Waymark.
//   peer robot SECONDS [NAME]     (topics /NAME/odom, …) odometry 50 Hz (y counts up), tf_static, camera_info, a 2 MB picture 5 Hz, IMU; prints commands
//   peer listen SECONDS           prints each command of /cmd_vel with the time of CLOCK_MONOTONIC [ns]
//   peer record SECONDS           counts and sums what a robot publishes: odometry, pictures, tf_static; drives it with /cmd_vel
//   peer best-effort SECONDS      publishes /odom best effort and /imu with the type of /odom
//   peer crowd SECONDS N          N topics
//   peer watch SECONDS            counts what a Waymark node publishes: /waymark/pose, /tf, /diagnostics
//   peer call SECONDS NAME        calls the service /waymark/NAME (std_srvs/Trigger) as rmw_cyclonedds does
//   peer nodes SECONDS 16|24      the node that ros_discovery_info shows, by that size of Gid, and how many of its endpoints exist
//   peer pose SECONDS FRAME X Y YAW   says once on /initialpose where the robot is, as RViz does
//   peer simulated SECONDS        odometry by a /clock of half speed, from 100 s on; paused in the second half; prints TwistStamped commands
//   peer flood SECONDS            odometry and tf at 500 Hz, IMU at 1000 Hz
//   peer compressed SECONDS JPEG  odometry and that picture on /camera/color/image_raw/compressed: whole, cut short, damaged
//   peer view SECONDS             counts the pictures of /waymark/image/compressed
//   peer latency SECONDS          pictures of 640 x 480 at 30 Hz; time from each to the next command: median, p99 [ms]
#include <dds/dds.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "ros.h"

enum { kWidth = 1920, kHeight = 1080 };

static dds_entity_t participant;

static dds_qos_t *qos(int reliable, int transient_local, int depth) {
  dds_qos_t *q = dds_create_qos();
  dds_data_representation_id_t xcdr1 = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_reliability(q, reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_MSECS(100));
  dds_qset_durability(q, transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(q, DDS_HISTORY_KEEP_LAST, depth);
  dds_qset_writer_data_lifecycle(q, false);
  dds_qset_data_representation(q, 1, &xcdr1);
  return q;
}

static dds_entity_t endpoint(int writes, const char *name, const dds_topic_descriptor_t *type, dds_qos_t *q) {
  dds_entity_t topic = dds_create_topic(participant, type, name, NULL, NULL);
  dds_entity_t e = topic < 0 ? topic : writes ? dds_create_writer(participant, topic, q, NULL) : dds_create_reader(participant, topic, q, NULL);
  if (e < 0) { printf("%s: %s\n", name, dds_strretcode(-e)); exit(1); }
  return e;
}

static long long monotonic_ns(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return 1000000000LL * t.tv_sec + t.tv_nsec;
}

static builtin_interfaces_msg_dds__Time_ stamp(void) {
  const int64_t now = dds_time();
  builtin_interfaces_msg_dds__Time_ t = {(int32_t)(now / 1000000000), (uint32_t)(now % 1000000000)};
  return t;
}

/// Prints the commands that came: "cmd TIME_NS v w".
static int take_commands(dds_entity_t reader) {
  void *raw = NULL;
  dds_sample_info_t info;
  int count = 0;
  while (dds_take(reader, &raw, &info, 1, 1) == 1) {
    const geometry_msgs_msg_dds__Twist_ *twist = raw;
    if (info.valid_data) { printf("cmd %lld %.6f %.6f\n", monotonic_ns(), twist->linear_.x_, twist->angular_.z_); ++count; }
    dds_return_loan(reader, &raw, 1);
    raw = NULL;
  }
  fflush(stdout);
  return count;
}

static void robot(double seconds, const char *name) {
  char topic[5][128];
  const char *topics[5] = {"odom", "camera/color/image_raw", "camera/color/camera_info", "imu", "cmd_vel"};
  for (int i = 0; i < 5; ++i) snprintf(topic[i], sizeof topic[i], "rt/%s%s", name, topics[i]);
  dds_entity_t odom = endpoint(1, topic[0], &nav_msgs_msg_dds__Odometry__desc, qos(1, 0, 10));
  dds_entity_t tf = endpoint(1, "rt/tf_static", &tf2_msgs_msg_dds__TFMessage__desc, qos(1, 1, 1));
  dds_entity_t image = endpoint(1, topic[1], &sensor_msgs_msg_dds__Image__desc, qos(1, 0, 5));
  dds_entity_t info = endpoint(1, topic[2], &sensor_msgs_msg_dds__CameraInfo__desc, qos(1, 0, 5));
  dds_entity_t imu = endpoint(1, topic[3], &sensor_msgs_msg_dds__Imu__desc, qos(0, 0, 10));
  dds_entity_t commands = endpoint(0, topic[4], &geometry_msgs_msg_dds__Twist__desc, qos(1, 0, 10));

  geometry_msgs_msg_dds__TransformStamped_ link;
  memset(&link, 0, sizeof link);
  link.header_.frame_id_ = "base_link";
  link.child_frame_id_ = "camera_color_optical_frame";
  link.transform_.translation_.z_ = 0.18;
  link.transform_.rotation_.w_ = 1;
  tf2_msgs_msg_dds__TFMessage_ links;
  memset(&links, 0, sizeof links);
  links.transforms_._length = links.transforms_._maximum = 1;
  links.transforms_._buffer = &link;
  dds_write(tf, &links);

  nav_msgs_msg_dds__Odometry_ o;
  memset(&o, 0, sizeof o);
  o.header_.frame_id_ = "odom";
  o.child_frame_id_ = "base_link";
  o.pose_.pose_.orientation_.w_ = 1;
  sensor_msgs_msg_dds__Imu_ i;
  memset(&i, 0, sizeof i);
  i.header_.frame_id_ = "base_link";
  i.angular_velocity_.z_ = 0.25;
  i.orientation_.w_ = 1;
  sensor_msgs_msg_dds__CameraInfo_ c;
  memset(&c, 0, sizeof c);
  c.header_.frame_id_ = "camera_color_optical_frame";
  c.width_ = kWidth;
  c.height_ = kHeight;
  c.distortion_model_ = "plumb_bob";
  c.k_[0] = c.k_[4] = 900;
  c.k_[2] = kWidth / 2;
  c.k_[5] = kHeight / 2;
  c.k_[8] = 1;
  sensor_msgs_msg_dds__Image_ m;
  memset(&m, 0, sizeof m);
  m.header_.frame_id_ = "camera_color_optical_frame";
  m.width_ = m.step_ = kWidth;
  m.height_ = kHeight;
  m.encoding_ = "mono8";
  m.data_._length = m.data_._maximum = kWidth * kHeight;
  m.data_._buffer = malloc(kWidth * kHeight);
  for (int k = 0; k < kWidth * kHeight; ++k) m.data_._buffer[k] = (uint8_t)(7 * k + k / kWidth);

  const int64_t end = dds_time() + (int64_t)(seconds * 1e9);
  for (int n = 0; dds_time() < end; ++n) {
    o.header_.stamp_ = i.header_.stamp_ = c.header_.stamp_ = m.header_.stamp_ = stamp();
    o.pose_.pose_.position_.y_ = 0.001 * n;
    dds_write(odom, &o);
    dds_write(imu, &i);
    if (n % 10 == 0) { dds_write(info, &c); dds_write(image, &m); }
    take_commands(commands);
    dds_sleepfor(DDS_MSECS(20));
  }
}

static void listen_to_commands(double seconds) {
  dds_entity_t commands = endpoint(0, "rt/cmd_vel", &geometry_msgs_msg_dds__Twist__desc, qos(1, 0, 100));
  printf("listening\n");
  fflush(stdout);
  const int64_t end = dds_time() + (int64_t)(seconds * 1e9);
  while (dds_time() < end) { take_commands(commands); dds_sleepfor(DDS_MSECS(1)); }
}

static void record(double seconds) {
  dds_entity_t odom = endpoint(0, "rt/odom", &nav_msgs_msg_dds__Odometry__desc, qos(0, 0, 100));
  dds_entity_t image = endpoint(0, "rt/camera/color/image_raw", &sensor_msgs_msg_dds__Image__desc, qos(1, 0, 5));
  dds_entity_t tf = endpoint(0, "rt/tf_static", &tf2_msgs_msg_dds__TFMessage__desc, qos(1, 1, 10));
  dds_entity_t out = endpoint(1, "rt/cmd_vel", &geometry_msgs_msg_dds__Twist__desc, qos(1, 0, 1));
  geometry_msgs_msg_dds__Twist_ twist;
  memset(&twist, 0, sizeof twist);
  twist.linear_.x_ = 0.2;
  int odometry = 0, pictures = 0, links = 0;
  double first_x = 0, x = 0, y = 0, first_y = 0, link_z = 0;
  unsigned width = 0;
  const int64_t end = dds_time() + (int64_t)(seconds * 1e9);
  while (dds_time() < end) {
    void *raw = NULL;
    dds_sample_info_t info;
    while (dds_take(odom, &raw, &info, 1, 1) == 1) {
      const nav_msgs_msg_dds__Odometry_ *m = raw;
      if (info.valid_data) {
        x = m->pose_.pose_.position_.x_;
        y = m->pose_.pose_.position_.y_;
        if (odometry++ == 0) { first_x = x; first_y = y; }
      }
      dds_return_loan(odom, &raw, 1);
      raw = NULL;
    }
    while (dds_take(image, &raw, &info, 1, 1) == 1) {
      if (info.valid_data) { ++pictures; width = ((const sensor_msgs_msg_dds__Image_ *)raw)->width_; }
      dds_return_loan(image, &raw, 1);
      raw = NULL;
    }
    while (dds_take(tf, &raw, &info, 1, 1) == 1) {
      const tf2_msgs_msg_dds__TFMessage_ *m = raw;
      if (info.valid_data && m->transforms_._length > 0) { ++links; link_z = m->transforms_._buffer[0].transform_.translation_.z_; }
      dds_return_loan(tf, &raw, 1);
      raw = NULL;
    }
    dds_write(out, &twist);
    dds_sleepfor(DDS_MSECS(20));
  }
  printf("odometry %d pictures %d width %u links %d z %.3f moved %.4f %.4f\n", odometry, pictures, width, links, link_z, x - first_x, y - first_y);
}

static void best_effort(double seconds) {
  dds_entity_t odom = endpoint(1, "rt/odom", &nav_msgs_msg_dds__Odometry__desc, qos(0, 0, 10));
  (void)endpoint(1, "rt/imu", &nav_msgs_msg_dds__Odometry__desc, qos(0, 0, 10));
  nav_msgs_msg_dds__Odometry_ o;
  memset(&o, 0, sizeof o);
  o.header_.frame_id_ = o.child_frame_id_ = "odom";
  o.pose_.pose_.orientation_.w_ = 1;
  const int64_t end = dds_time() + (int64_t)(seconds * 1e9);
  while (dds_time() < end) { o.header_.stamp_ = stamp(); dds_write(odom, &o); dds_sleepfor(DDS_MSECS(20)); }
}

static void crowd(double seconds, int count) {
  for (int i = 0; i < count; ++i) {
    char name[64];
    snprintf(name, sizeof name, "rt/crowd/topic_%d", i);
    (void)endpoint(1, name, &sensor_msgs_msg_dds__Joy__desc, qos(1, 0, 10));
  }
  (void)endpoint(1, "rt/odom", &nav_msgs_msg_dds__Odometry__desc, qos(1, 0, 10));
  printf("there\n");
  fflush(stdout);
  dds_sleepfor((int64_t)(seconds * 1e9));
}

static void watch(double seconds) {
  dds_entity_t pose = endpoint(0, "rt/waymark/pose", &geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, qos(1, 0, 100));
  dds_entity_t tf = endpoint(0, "rt/tf", &tf2_msgs_msg_dds__TFMessage__desc, qos(1, 0, 100));
  dds_entity_t diagnostics = endpoint(0, "rt/diagnostics", &diagnostic_msgs_msg_dds__DiagnosticArray__desc, qos(1, 0, 100));
  int poses = 0, links = 0, odom_links = 0, states = 0;
  double largest = 0;
  char phase[64] = "none";
  const int64_t end = dds_time() + (int64_t)(seconds * 1e9);
  while (dds_time() < end) {
    void *raw = NULL;
    dds_sample_info_t info;
    while (dds_take(pose, &raw, &info, 1, 1) == 1) {
      const geometry_msgs_msg_dds__PoseWithCovarianceStamped_ *m = raw;
      if (info.valid_data && strcmp(m->header_.frame_id_, "map") == 0) {
        ++poses;
        const double s = m->pose_.covariance_[0];
        if (s > largest) largest = s;
      }
      dds_return_loan(pose, &raw, 1);
      raw = NULL;
    }
    while (dds_take(tf, &raw, &info, 1, 1) == 1) {
      const tf2_msgs_msg_dds__TFMessage_ *m = raw;
      for (uint32_t i = 0; info.valid_data && i < m->transforms_._length; ++i) {
        const geometry_msgs_msg_dds__TransformStamped_ *link = &m->transforms_._buffer[i];
        if (!strcmp(link->header_.frame_id_, "map") && !strcmp(link->child_frame_id_, "odom")) ++links;
        if (!strcmp(link->header_.frame_id_, "odom") && !strcmp(link->child_frame_id_, "base_link")) ++odom_links;
      }
      dds_return_loan(tf, &raw, 1);
      raw = NULL;
    }
    while (dds_take(diagnostics, &raw, &info, 1, 1) == 1) {
      const diagnostic_msgs_msg_dds__DiagnosticArray_ *m = raw;
      if (info.valid_data && m->status_._length == 1) { ++states; snprintf(phase, sizeof phase, "%s", m->status_._buffer[0].values_._buffer[0].value_); }
      dds_return_loan(diagnostics, &raw, 1);
      raw = NULL;
    }
    dds_sleepfor(DDS_MSECS(5));
  }
  printf("poses %d links %d odom %d states %d phase %s variance %.3g\n", poses, links, odom_links, states, phase, largest);
}

static void call(double seconds, const char *service) {
  char request_name[96], reply_name[96];
  snprintf(request_name, sizeof request_name, "rq/waymark/%sRequest", service);
  snprintf(reply_name, sizeof reply_name, "rr/waymark/%sReply", service);
  dds_entity_t requests = endpoint(1, request_name, &std_srvs_srv_dds__Trigger_Request__desc, qos(1, 0, 10));
  dds_entity_t replies = endpoint(0, reply_name, &std_srvs_srv_dds__Trigger_Response__desc, qos(1, 0, 10));
  const int64_t end = dds_time() + (int64_t)(seconds * 1e9);
  dds_publication_matched_status_t out;
  dds_subscription_matched_status_t in;
  do {
    dds_get_publication_matched_status(requests, &out);
    dds_get_subscription_matched_status(replies, &in);
    dds_sleepfor(DDS_MSECS(20));
  } while (dds_time() < end && (out.current_count == 0 || in.current_count == 0));
  dds_sleepfor(DDS_MSECS(300));
  std_srvs_srv_dds__Trigger_Request_ request = {0x1122334455667788ULL, 42, 0};
  dds_write(requests, &request);
  while (dds_time() < end) {
    void *raw = NULL;
    dds_sample_info_t info;
    if (dds_take(replies, &raw, &info, 1, 1) == 1) {
      const std_srvs_srv_dds__Trigger_Response_ *m = raw;
      if (info.valid_data && m->guid_ == request.guid_ && m->sequence_ == 42) {
        printf("%s: %s\n", m->success_ ? "yes" : "no", m->message_);
        return;
      }
      dds_return_loan(replies, &raw, 1);
    }
    dds_sleepfor(DDS_MSECS(5));
  }
  printf("no reply\n");
}

static void say_pose(double seconds, char **where) {
  dds_entity_t poses = endpoint(1, "rt/initialpose", &geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, qos(1, 0, 1));
  const int64_t end = dds_time() + (int64_t)(seconds * 1e9);
  dds_publication_matched_status_t out;
  do {
    dds_get_publication_matched_status(poses, &out);
    dds_sleepfor(DDS_MSECS(20));
  } while (dds_time() < end && out.current_count == 0);
  dds_sleepfor(DDS_MSECS(1000));
  geometry_msgs_msg_dds__PoseWithCovarianceStamped_ m;
  memset(&m, 0, sizeof m);
  m.header_.stamp_ = stamp();
  m.header_.frame_id_ = where[0];
  m.pose_.pose_.position_.x_ = atof(where[1]);
  m.pose_.pose_.position_.y_ = atof(where[2]);
  m.pose_.pose_.orientation_.z_ = sin(atof(where[3]) / 2);
  m.pose_.pose_.orientation_.w_ = cos(atof(where[3]) / 2);
  m.pose_.covariance_[0] = m.pose_.covariance_[7] = 0.25;
  m.pose_.covariance_[35] = 0.0685;
  dds_write(poses, &m);
  dds_sleepfor(DDS_MSECS(300));
  printf("%u listen\n", out.current_count);
}

/// Whether discovery has found a publisher or subscription with this identity.
static int exists(dds_entity_t builtin, const uint8_t *gid) {
  void *raw[256] = {NULL};
  dds_sample_info_t info[256];
  const int count = dds_read(builtin, raw, info, 256, 256);
  int found = 0;
  for (int i = 0; i < count; ++i) found |= info[i].valid_data && memcmp(((const dds_builtintopic_endpoint_t *)raw[i])->key.v, gid, 16) == 0;
  if (count > 0) dds_return_loan(builtin, raw, count);
  return found;
}

#define COUNT_KNOWN(gids, builtin) \
  for (uint32_t k = 0; k < (gids)._length; ++k) known += exists(builtin, (gids)._buffer[k].data_)

/// Prints the first node of the message and how many of its endpoints are there.
#define SHOW_NODE(type, message) do { \
    const type *m = (message); \
    if (m->node_entities_info_seq_._length != 1) break; \
    known = 0; \
    COUNT_KNOWN(m->node_entities_info_seq_._buffer[0].reader_gid_seq_, subscriptions); \
    COUNT_KNOWN(m->node_entities_info_seq_._buffer[0].writer_gid_seq_, publications); \
    snprintf(line, sizeof line, "%s%s readers %u writers %u known %d\n", m->node_entities_info_seq_._buffer[0].node_namespace_, \
             m->node_entities_info_seq_._buffer[0].node_name_, m->node_entities_info_seq_._buffer[0].reader_gid_seq_._length, \
             m->node_entities_info_seq_._buffer[0].writer_gid_seq_._length, known); \
  } while (0)

static void show_nodes(double seconds, int gid_bytes) {
  static const char *name = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";
  dds_topic_descriptor_t *humble = malloc(sizeof *humble);  // another layout under the same name; its members are constant
  memcpy((void *)humble, &rmw_dds_common_humble_msg_dds__ParticipantEntitiesInfo__desc, sizeof *humble);
  memcpy((char *)humble + offsetof(dds_topic_descriptor_t, m_typename), &name, sizeof name);
  dds_entity_t subscriptions = dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, NULL, NULL);
  dds_entity_t publications = dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, NULL, NULL);
  dds_entity_t nodes = endpoint(0, "ros_discovery_info", gid_bytes == 24 ? humble : &rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc, qos(1, 1, 100));
  char line[512] = "none\n";
  const int64_t end = dds_time() + (int64_t)(seconds * 1e9);
  while (dds_time() < end) {
    enum { MOST = 100 };  // the depth of the reader: all that came, of which the newest counts
    void *raw[MOST] = {NULL};
    dds_sample_info_t info[MOST];
    const int count = dds_read(nodes, raw, info, MOST, MOST);
    int known = 0;
    if (count > 0) {
      const int newest = count - 1;
      if (info[newest].valid_data && gid_bytes == 24) SHOW_NODE(rmw_dds_common_humble_msg_dds__ParticipantEntitiesInfo_, raw[newest]);
      if (info[newest].valid_data && gid_bytes == 16) SHOW_NODE(rmw_dds_common_msg_dds__ParticipantEntitiesInfo_, raw[newest]);
      dds_return_loan(nodes, raw, count);
    }
    if (known > 1) break;
    dds_sleepfor(DDS_MSECS(20));
  }
  fputs(line, stdout);
}

/// Describes a node /slow to show_nodes() twice, as a slow program does: without its publisher at first.
static void announce(double seconds) {
  typedef dds_sequence_rmw_dds_common_msg_dds__Gid_ Gids;
  rmw_dds_common_msg_dds__Gid_ reader, writer;
  dds_guid_t guid;
  dds_get_guid(endpoint(0, "rt/slow_in", &geometry_msgs_msg_dds__Twist__desc, qos(1, 0, 1)), &guid);
  memcpy(reader.data_, guid.v, 16);
  dds_get_guid(endpoint(1, "rt/slow_out", &geometry_msgs_msg_dds__Twist__desc, qos(1, 0, 1)), &guid);
  memcpy(writer.data_, guid.v, 16);
  const dds_entity_t info = endpoint(1, "ros_discovery_info", &rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc, qos(1, 1, 1));
  for (dds_publication_matched_status_t out = {0}; out.current_count == 0; dds_sleepfor(DDS_MSECS(20))) dds_get_publication_matched_status(info, &out);
  for (uint32_t writers = 0; writers < 2; ++writers) {
    rmw_dds_common_msg_dds__NodeEntitiesInfo_ node = {"/", "slow", (Gids){1, 1, &reader, false}, (Gids){1, writers, &writer, false}};
    rmw_dds_common_msg_dds__ParticipantEntitiesInfo_ m;
    memset(&m, 0, sizeof m);
    m.node_entities_info_seq_._maximum = m.node_entities_info_seq_._length = 1;
    m.node_entities_info_seq_._buffer = &node;
    dds_write(info, &m);
    dds_sleepfor(DDS_MSECS(500));
  }
  dds_sleepfor((int64_t)(seconds * 1e9));
}

static nav_msgs_msg_dds__Odometry_ standing_still(void) {
  nav_msgs_msg_dds__Odometry_ o;
  memset(&o, 0, sizeof o);
  o.header_.frame_id_ = "odom";
  o.child_frame_id_ = "base_link";
  o.pose_.pose_.orientation_.w_ = 1;
  return o;
}

static void simulated(double seconds) {
  dds_entity_t odom = endpoint(1, "rt/odom", &nav_msgs_msg_dds__Odometry__desc, qos(1, 0, 10));
  dds_entity_t clock = endpoint(1, "rt/clock", &rosgraph_msgs_msg_dds__Clock__desc, qos(0, 0, 1));
  dds_entity_t commands = endpoint(0, "rt/cmd_vel", &geometry_msgs_msg_dds__TwistStamped__desc, qos(1, 0, 10));
  nav_msgs_msg_dds__Odometry_ o = standing_still();
  const int64_t begin = dds_time(), length = (int64_t)(seconds * 1e9);
  for (int n = 0; dds_time() - begin < length; ++n) {
    const int64_t passed = dds_time() - begin, runs = passed < length / 2 ? passed : length / 2;
    const int64_t now = DDS_SECS(100) + runs / 2;
    const rosgraph_msgs_msg_dds__Clock_ c = {{(int32_t)(now / 1000000000), (uint32_t)(now % 1000000000)}};
    o.header_.stamp_ = c.time_;
    dds_write(clock, &c);
    if (n % 2 == 0 && passed < length / 2) dds_write(odom, &o);
    void *raw = NULL;
    dds_sample_info_t info;
    while (dds_take(commands, &raw, &info, 1, 1) == 1) {
      const geometry_msgs_msg_dds__TwistStamped_ *m = raw;
      if (info.valid_data) printf("stamped %d %.3f %s\n", m->header_.stamp_.sec_, m->twist_.linear_.x_, passed < length / 2 ? "runs" : "paused");
      dds_return_loan(commands, &raw, 1);
      raw = NULL;
    }
    dds_sleepfor(DDS_MSECS(10));
  }
}

static void flood(double seconds) {
  dds_entity_t odom = endpoint(1, "rt/odom", &nav_msgs_msg_dds__Odometry__desc, qos(1, 0, 10));
  dds_entity_t imu = endpoint(1, "rt/imu", &sensor_msgs_msg_dds__Imu__desc, qos(0, 0, 10));
  dds_entity_t tf = endpoint(1, "rt/tf", &tf2_msgs_msg_dds__TFMessage__desc, qos(1, 0, 100));
  nav_msgs_msg_dds__Odometry_ o = standing_still();
  sensor_msgs_msg_dds__Imu_ i;
  memset(&i, 0, sizeof i);
  i.header_.frame_id_ = "base_link";
  i.orientation_.w_ = 1;
  geometry_msgs_msg_dds__TransformStamped_ link;
  memset(&link, 0, sizeof link);
  link.header_.frame_id_ = "odom";
  link.child_frame_id_ = "base_link";
  link.transform_.rotation_.w_ = 1;
  tf2_msgs_msg_dds__TFMessage_ links;
  memset(&links, 0, sizeof links);
  links.transforms_._length = links.transforms_._maximum = 1;
  links.transforms_._buffer = &link;
  const int64_t begin = dds_time(), end = begin + (int64_t)(seconds * 1e9);
  for (int64_t n = 0; dds_time() < end; ++n) {
    o.header_.stamp_ = i.header_.stamp_ = link.header_.stamp_ = stamp();
    link.transform_.translation_.x_ = o.pose_.pose_.position_.x_ = 0.5 * sin(1e-4 * (double)n);
    dds_write(imu, &i);
    if (n % 2 == 0) { dds_write(odom, &o); dds_write(tf, &links); }
    const int64_t wait = begin + (n + 1) * DDS_MSECS(1) - dds_time();
    if (wait > 0) dds_sleepfor(wait);
  }
}

static void compressed(double seconds, const char *path) {
  static uint8_t jpeg[1 << 20], damaged[1 << 20];
  FILE *file = fopen(path, "rb");
  const size_t size = file ? fread(jpeg, 1, sizeof jpeg, file) : 0;
  if (size < 1000) { printf("%s: no picture\n", path); exit(1); }
  memcpy(damaged, jpeg, size);
  for (size_t i = 300; i < size; i += 97) damaged[i] ^= 0x5a;
  dds_entity_t odom = endpoint(1, "rt/odom", &nav_msgs_msg_dds__Odometry__desc, qos(1, 0, 10));
  dds_entity_t image = endpoint(1, "rt/camera/color/image_raw/compressed", &sensor_msgs_msg_dds__CompressedImage__desc, qos(0, 0, 5));
  nav_msgs_msg_dds__Odometry_ o = standing_still();
  sensor_msgs_msg_dds__CompressedImage_ m;
  memset(&m, 0, sizeof m);
  m.header_.frame_id_ = "camera_color_optical_frame";
  m.format_ = "rgb8; jpeg compressed bgr8";
  const int64_t end = dds_time() + (int64_t)(seconds * 1e9);
  for (int n = 0; dds_time() < end; ++n) {
    o.header_.stamp_ = m.header_.stamp_ = stamp();
    dds_write(odom, &o);
    m.data_._length = m.data_._maximum = (uint32_t)(n % 3 == 1 ? size / 2 : size);
    m.data_._buffer = n % 3 == 2 ? damaged : jpeg;
    if (n % 5 == 0) dds_write(image, &m);
    dds_sleepfor(DDS_MSECS(20));
  }
}

static void view(double seconds) {
  dds_entity_t image = endpoint(0, "rt/waymark/image/compressed", &sensor_msgs_msg_dds__CompressedImage__desc, qos(0, 0, 5));
  int pictures = 0, jpegs = 0;
  const int64_t end = dds_time() + (int64_t)(seconds * 1e9);
  while (dds_time() < end) {
    void *raw = NULL;
    dds_sample_info_t info;
    while (dds_take(image, &raw, &info, 1, 1) == 1) {
      const sensor_msgs_msg_dds__CompressedImage_ *m = raw;
      if (info.valid_data) {
        const uint32_t n = m->data_._length;
        ++pictures;
        jpegs += n > 1000 && m->data_._buffer[0] == 0xff && m->data_._buffer[1] == 0xd8 && m->data_._buffer[n - 1] == 0xd9 && !strcmp(m->format_, "jpeg");
      }
      dds_return_loan(image, &raw, 1);
      raw = NULL;
    }
    dds_sleepfor(DDS_MSECS(5));
  }
  printf("pictures %d jpegs %d\n", pictures, jpegs);
}

static int by_size(const void *a, const void *b) { return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b); }

static void latency(double seconds) {
  enum { kWide = 640, kHigh = 480, kMost = 100000 };
  dds_entity_t odom = endpoint(1, "rt/odom", &nav_msgs_msg_dds__Odometry__desc, qos(1, 0, 10));
  dds_entity_t image = endpoint(1, "rt/camera/color/image_raw", &sensor_msgs_msg_dds__Image__desc, qos(1, 0, 5));
  dds_entity_t commands = endpoint(0, "rt/cmd_vel", &geometry_msgs_msg_dds__Twist__desc, qos(1, 0, 10));
  nav_msgs_msg_dds__Odometry_ o = standing_still();
  sensor_msgs_msg_dds__Image_ m;
  memset(&m, 0, sizeof m);
  m.header_.frame_id_ = "camera_color_optical_frame";
  m.width_ = m.step_ = kWide;
  m.height_ = kHigh;
  m.encoding_ = "mono8";
  m.data_._length = m.data_._maximum = kWide * kHigh;
  m.data_._buffer = malloc(kWide * kHigh);
  for (int y = 0; y < kHigh; ++y)
    for (int x = 0; x < kWide; ++x) m.data_._buffer[y * kWide + x] = (uint8_t)(((x / 80 + y / 80) % 2 ? 40 : 180) + (x * 7 + y * 13) % 20);
  double *ms = malloc(sizeof(double) * kMost);
  int count = 0, pictures = 0;
  const int64_t begin = dds_time();
  int64_t next = begin, sent = 0;
  while (dds_time() - begin < (int64_t)(seconds * 1e9)) {
    if (dds_time() >= next) {
      next += DDS_SECS(1) / 30;
      o.header_.stamp_ = m.header_.stamp_ = stamp();
      dds_write(odom, &o);
      sent = dds_time();
      dds_write(image, &m);
      ++pictures;
    }
    void *raw = NULL;
    dds_sample_info_t info;
    while (dds_take(commands, &raw, &info, 1, 1) == 1) {
      if (info.valid_data && sent && dds_time() - begin > DDS_SECS(5) && count < kMost) { ms[count++] = (double)(dds_time() - sent) / 1e6; sent = 0; }
      dds_return_loan(commands, &raw, 1);
      raw = NULL;
    }
    dds_sleepfor(DDS_MSECS(1) / 4);
  }
  qsort(ms, (size_t)count, sizeof *ms, by_size);
  if (count > 10) printf("latency of %d of %d pictures: median %.1f ms, p90 %.1f ms, p99 %.1f ms, worst %.1f ms\n", count, pictures, ms[count / 2], ms[count * 9 / 10], ms[count * 99 / 100], ms[count - 1]);
  else printf("%d commands\n", count);
}

int main(int argc, char **argv) {
  const char *domain = getenv("ROS_DOMAIN_ID");
  if (argc < 3) { fputs("usage: peer robot|listen|record|best-effort|crowd SECONDS [N]\n", stderr); return 2; }
  participant = dds_create_participant(domain ? (dds_domainid_t)atoi(domain) : 0, NULL, NULL);
  if (participant < 0) { printf("participant: %s\n", dds_strretcode(-participant)); return 1; }
  const double seconds = atof(argv[2]);
  if (strcmp(argv[1], "robot") == 0) robot(seconds, argc > 3 ? argv[3] : "");
  else if (strcmp(argv[1], "listen") == 0) listen_to_commands(seconds);
  else if (strcmp(argv[1], "record") == 0) record(seconds);
  else if (strcmp(argv[1], "best-effort") == 0) best_effort(seconds);
  else if (strcmp(argv[1], "crowd") == 0 && argc > 3) crowd(seconds, atoi(argv[3]));
  else if (strcmp(argv[1], "watch") == 0) watch(seconds);
  else if (strcmp(argv[1], "call") == 0 && argc > 3) call(seconds, argv[3]);
  else if (strcmp(argv[1], "simulated") == 0) simulated(seconds);
  else if (strcmp(argv[1], "flood") == 0) flood(seconds);
  else if (strcmp(argv[1], "compressed") == 0 && argc > 3) compressed(seconds, argv[3]);
  else if (strcmp(argv[1], "view") == 0) view(seconds);
  else if (strcmp(argv[1], "nodes") == 0 && argc > 3) show_nodes(seconds, atoi(argv[3]));
  else if (strcmp(argv[1], "announce") == 0) announce(seconds);
  else if (strcmp(argv[1], "pose") == 0 && argc > 6) say_pose(seconds, argv + 3);
  else if (strcmp(argv[1], "latency") == 0) latency(seconds);
  else return 2;
  dds_delete(participant);
  return 0;
}
