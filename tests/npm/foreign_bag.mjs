// Writes a Waymark lap again as another robot's driver would have recorded it: with its names of topics and frames, and its chain
// of transforms. The file is written by @mcap/core, the messages by @foxglove/rosmsg2-serialization.
// usage: node foreign_bag.mjs LAP.mcap ROBOT.json OUT.mcap|OUT.jsonl     .jsonl: topic, type, time and payload a line
import { open, writeFile } from "node:fs/promises";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const load = createRequire(pathToFileURL(process.env.WAYMARK_NODE_MODULES + "/"));
const { McapIndexedReader, McapWriter } = load("@mcap/core");
const { parse } = load("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = load("@foxglove/rosmsg2-serialization");
const { decompress } = load("fzstd");
const [lap, robotFile, out] = process.argv.slice(2);
const robot = JSON.parse(readFileSync(robotFile, "utf8"));

// Transforms as { t: [x, y, z], q: [x, y, z, w] }.
const turn = (q, v) => {
  const [x, y, z, w] = q;
  const c = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const u = c([x, y, z], v).map((n) => 2 * n);
  const p = c([x, y, z], u);
  return v.map((n, i) => n + w * u[i] + p[i]);
};
const times = (a, b) => {
  const [ax, ay, az, aw] = a.q, [bx, by, bz, bw] = b.q;
  return { t: turn(a.q, b.t).map((n, i) => n + a.t[i]),
    q: [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
      aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz] };
};
const inverse = (a) => {
  const q = [-a.q[0], -a.q[1], -a.q[2], a.q[3]];
  return { t: turn(q, a.t).map((n) => -n), q };
};
const identity = { t: [0, 0, 0], q: [0, 0, 0, 1] };

const file = await open(lap, "r");
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, size) => {
    const bytes = new Uint8Array(Number(size));
    await file.read(bytes, 0, Number(size), Number(offset));
    return bytes;
  },
};
const reader = await McapIndexedReader.Initialize({ readable,
  decompressHandlers: { zstd: (bytes, size) => decompress(bytes, new Uint8Array(Number(size))) } });

const definitions = new Map();  // type -> { text, reader, writer }
const codec = (type, text) => {
  if (!definitions.has(type)) {
    const parsed = parse(text, { ros2: true });
    definitions.set(type, { text, reader: new MessageReader(parsed), writer: new MessageWriter(parsed) });
  }
  return definitions.get(type);
};

// Messages to write: [topic, type, log time, message].
const written = [];
let base_T_cam;
let start;
const shift = BigInt(robot.clock_ns ?? 0);
// The reader and the writer name nanoseconds differently.
const time = (ns) => ({ sec: Number(ns / 1000000000n), nanosec: Number(ns % 1000000000n), nsec: Number(ns % 1000000000n) });
const stamp = (message) => {
  const ns = BigInt(message.header.stamp.sec) * 1000000000n + BigInt(message.header.stamp.nanosec ?? message.header.stamp.nsec) + shift;
  return time(ns);
};
const infos = [];
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  const value = codec(schema.name, new TextDecoder().decode(schema.data)).reader.readMessage(message.data);
  if (schema.name === "tf2_msgs/msg/TFMessage") {
    const { translation: t, rotation: q } = value.transforms[0].transform;
    base_T_cam = { t: [t.x, t.y, t.z], q: [q.x, q.y, q.z, q.w] };
    continue;
  }
  if (schema.name === "sensor_msgs/msg/CameraInfo") {
    infos.push([schema.name, value]);
    continue;
  }
  const topic = robot.topics[channel.topic];
  if (topic === undefined) continue;
  start ??= message.logTime + shift;
  if (value.header) {
    value.header.stamp = stamp(value);
    value.header.frame_id = robot.frames[value.header.frame_id] ?? value.header.frame_id;
  }
  if (schema.name === "sensor_msgs/msg/Imu" && robot.imu) {
    value.header.frame_id = robot.imu.frame;
    for (const key of ["angular_velocity", "linear_acceleration"]) {
      const v = value[key];
      const [x, y, z] = turn(inverse({ t: [0, 0, 0], q: robot.imu.base_q_imu }).q, [v.x, v.y, v.z]);
      value[key] = { x, y, z };
    }
  }
  if (value.child_frame_id) value.child_frame_id = robot.frames[value.child_frame_id] ?? value.child_frame_id;
  if (schema.name === "sensor_msgs/msg/JointState" && robot.joints) value.name = robot.joints;
  written.push([topic, schema.name, message.logTime + shift, value]);
}

// The chain: the given transforms, then the one that connects it to the camera.
const link = (parent, child, transform, at) => ({ header: { stamp: at, frame_id: parent }, child_frame_id: child,
  transform: { translation: { x: transform.t[0], y: transform.t[1], z: transform.t[2] },
    rotation: { x: transform.q[0], y: transform.q[1], z: transform.q[2], w: transform.q[3] } } });
const at = time(start);
const given = robot.chain.slice(0, -1).reduce((all, step) => times(all, step), identity);
const chain = robot.chain.map((step, i) => i + 1 < robot.chain.length ? step
  : { ...step, ...times(inverse(given), base_T_cam) });
for (const topic of ["/tf_static", "/tf"]) {
  const links = [...chain, ...(robot.others ?? [])].filter((step) => (step.topic ?? "/tf_static") === topic);
  const name = (robot.namespace ?? "") + topic;
  if (links.length > 0) written.push([name, "tf2_msgs/msg/TFMessage", start, { transforms: links.map((s) => link(s.parent, s.child, s, at)) }]);
}
// Moving transforms are not part of the chain: the robot in its odometry frame.
for (const [, type, logTime, value] of [...written]) {
  if (type !== "nav_msgs/msg/Odometry") continue;
  const { position: p, orientation: q } = value.pose.pose;
  written.push([(robot.namespace ?? "") + "/tf", "tf2_msgs/msg/TFMessage", logTime, { transforms:
    [link(value.header.frame_id, value.child_frame_id, { t: [p.x, p.y, p.z], q: [q.x, q.y, q.z, q.w] }, value.header.stamp)] }]);
}
for (const [type, value] of infos) {
  for (const info of robot.infos) {
    const copy = structuredClone(value);
    copy.header = { stamp: info.zero ? time(0n) : at, frame_id: info.frame };
    copy.k = Array.from(copy.k, (n, i) => (i === 0 || i === 4 ? n * (info.focal ?? 1) : n));
    written.push([info.topic, type, info.zero ? 0n : start, copy]);
  }
}
written.sort((a, b) => (a[2] < b[2] ? -1 : a[2] > b[2] ? 1 : 0));

const tfText = definitions.get("tf2_msgs/msg/TFMessage").text;
codec("tf2_msgs/msg/TFMessage", tfText);
const payload = (type, message) => definitions.get(type).writer.writeMessage(message);
if (out.endsWith(".jsonl")) {
  await writeFile(out, written.map(([topic, type, time, message]) => JSON.stringify(
    [topic, type, Number(time / 1000000000n), Number(time % 1000000000n), Buffer.from(payload(type, message)).toString("base64")])).join("\n"));
} else {
  const target = await open(out, "w");
  let position = 0n;
  const writer = new McapWriter({ writable: { position: () => position, write: async (bytes) => {
    await target.write(bytes);
    position += BigInt(bytes.byteLength);
  } } });
  await writer.start({ profile: "ros2", library: "a test" });
  const channels = new Map();
  let sequence = 0;
  for (const [topic, type, time, message] of written) {
    if (!channels.has(topic)) {
      const schemaId = await writer.registerSchema({ name: type, encoding: "ros2msg", data: new TextEncoder().encode(definitions.get(type).text) });
      channels.set(topic, await writer.registerChannel({ topic, schemaId, messageEncoding: "cdr", metadata: new Map() }));
    }
    await writer.addMessage({ channelId: channels.get(topic), sequence: sequence++, logTime: time, publishTime: time, data: payload(type, message) });
  }
  await writer.end();
  await target.close();
}
await file.close();
