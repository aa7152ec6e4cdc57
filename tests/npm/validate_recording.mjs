// Opens a recording with third-party libraries and decodes every message by the schema in the file.
// usage: node validate_recording.mjs FILE.mcap [--foreign]      --foreign: not a Waymark lap, so any frames and values; prints one JSON object; exit code 1 and a message on failure
import { open } from "node:fs/promises";
import { pathToFileURL } from "node:url";

// The libraries are installed into a build folder, not next to this file.
const modules = pathToFileURL(process.env.WAYMARK_NODE_MODULES + "/").href;
const load = async (name) => {
  const { createRequire } = await import("node:module");
  return createRequire(modules)(name);
};
const { McapIndexedReader, McapStreamReader } = await load("@mcap/core");
const { parse } = await load("@foxglove/rosmsg");
const { MessageReader } = await load("@foxglove/rosmsg2-serialization");
const { decompress } = await load("fzstd");

const decompressHandlers = { zstd: (bytes, size) => decompress(bytes, new Uint8Array(Number(size))) };

function check(condition, words) {
  if (!condition) throw new Error(words);
}

/** Checks that every number in a message is finite, at any depth. */
function checkFinite(value, where) {
  if (typeof value === "number") check(Number.isFinite(value), `${where} is ${value}`);
  else if (ArrayBuffer.isView(value) || Array.isArray(value)) value.forEach((v, i) => checkFinite(v, `${where}[${i}]`));
  else if (value && typeof value === "object") for (const key of Object.keys(value)) checkFinite(value[key], `${where}.${key}`);
}

/** Conditions on messages of a type besides decoding. */
const meaning = {
  "apriltag_msgs/msg/AprilTagDetectionArray": (m) => m.detections.forEach((d) => {
    check(d.family === "tag36h11" && d.id >= 0 && d.id < 587, `a tag ${d.family}:${d.id}`);
    check(d.corners.length === 4, "four corners");
  }),
  "sensor_msgs/msg/CameraInfo": (m) => check(m.width === 640 && m.height === 480 && m.k[0] > 0, "a camera of 640 x 480 px"),
  "nav_msgs/msg/Odometry": (m) => check(m.header.frame_id === "odom" && m.child_frame_id === "base_link", "frames of odometry"),
  "sensor_msgs/msg/JointState": (m) => check(m.name.length === 2 && m.position.length === 2, "two wheels"),
  "tf2_msgs/msg/TFMessage": (m) => check(m.transforms[0].child_frame_id === "camera_optical", "the camera's place"),
  "sensor_msgs/msg/Image": (m) => check(m.encoding === "mono8" && m.data.length === m.step * m.height, "a grey image"),
  "sensor_msgs/msg/CompressedImage": (m) => check(m.format === "png" && m.data[1] === 0x50, "a PNG"),
  "sensor_msgs/msg/LaserScan": (m) => {
    const last = m.angle_min + (m.ranges.length - 1) * m.angle_increment;
    check(m.ranges.length > 0 && Math.abs(last - m.angle_max) < 1e-5, "a ray for each direction");
  },
  "sensor_msgs/msg/Joy": (m) => check(m.axes.length === 2 && m.buttons[1] === 1, "sticks and buttons"),
  "nav_msgs/msg/Path": (m) => check(m.poses.length === 2 && m.poses[1].header.frame_id === "map", "two poses"),
  "visualization_msgs/msg/MarkerArray": (m) => check(m.markers.length === 2 && m.markers[1].text === "tag36h11:3" &&
    m.markers[1].mesh_file.filename === "none.stl" && m.markers[1].uv_coordinates[0].v === 0.25, "two markers"),
  "diagnostic_msgs/msg/DiagnosticArray": (m) => check(m.status.length > 0 && m.status.every((s) => s.name && s.values.every((v) => v.key !== "" && typeof v.value === "string")), "a diagnosis"),
  "waymark_msgs/msg/RangeBearing": (m) => check(m.landmark === 17n && m.range_m === 3.25, "a landmark"),
  "waymark_msgs/msg/TagPoseArray": (m) => check(m.tags[0].id === 11 && m.tags[0].pose.position.z === 1, "a tag's pose"),
  "waymark_msgs/msg/UnreliableTags": (m) => check(m.index[0] === 1 && m.detections[0].id === 8 && m.covariance_px2.length === 64, "an unreliable tag"),
  "waymark_msgs/msg/TagCornerCovariances": (m) => check(m.covariance_px2.length === 64 * m.id.length, "8 x 8 a tag"),
};

async function readAll(file) {
  const readable = {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, size) => {
      const bytes = new Uint8Array(Number(size));
      const { bytesRead } = await file.read(bytes, 0, Number(size), Number(offset));
      check(bytesRead === Number(size), `only ${bytesRead} of ${size} bytes at ${offset}`);
      return bytes;
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  check(reader.header.profile === "ros2", `profile ${reader.header.profile}`);
  const readers = new Map();
  const types = {};
  let last = 0n;
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    const schema = reader.schemasById.get(channel.schemaId);
    check(schema.encoding === "ros2msg" && channel.messageEncoding === "cdr", `${channel.topic}: ${schema.encoding}`);
    if (!readers.has(schema.id)) {
      const definitions = parse(new TextDecoder().decode(schema.data), { ros2: true });
      readers.set(schema.id, new MessageReader(definitions));
    }
    const decoded = readers.get(schema.id).readMessage(message.data);
    if (process.argv[3] !== "--foreign") {
      checkFinite(decoded, channel.topic);
      meaning[schema.name]?.(decoded);
    }
    check(message.logTime >= last, `${channel.topic}: time goes back`);
    last = message.logTime;
    types[schema.name] = (types[schema.name] ?? 0) + 1;
  }
  const counted = Object.values(types).reduce((a, b) => a + b, 0);
  check(BigInt(counted) === reader.statistics.messageCount, `${counted} messages, statistics say ${reader.statistics.messageCount}`);
  const metadata = {};
  for await (const block of reader.readMetadata()) metadata[block.name] = Object.fromEntries(block.metadata);
  const attachments = {};
  for await (const attachment of reader.readAttachments()) attachments[attachment.name] = attachment.data.byteLength;
  return { library: reader.header.library, types, metadata, attachments };
}

/** Reads sequentially and verifies every checksum, as from a pipe. */
async function streamThrough(file) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  const bytes = new Uint8Array(1 << 16);
  const records = {};
  for (let at = 0; ; ) {
    const { bytesRead } = await file.read(bytes, 0, bytes.length, at);
    if (bytesRead === 0) break;
    at += bytesRead;
    reader.append(bytes.slice(0, bytesRead));
    for (let record; (record = reader.nextRecord()); ) records[record.type] = (records[record.type] ?? 0) + 1;
  }
  check(reader.done(), "the stream does not end as a recording does");
  return records;
}

try {
  const file = await open(process.argv[2]);
  const indexed = await readAll(file);
  const records = await streamThrough(file);
  await file.close();
  console.log(JSON.stringify({ ...indexed, records }));
} catch (error) {
  console.error(`${process.argv[2]}: ${error.message}`);
  process.exit(1);
}
