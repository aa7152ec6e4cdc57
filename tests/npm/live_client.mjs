// Connects to a running robot with Foxglove's own client, under both names of its protocol.
// usage: node live_client.mjs URL TOKEN LAYOUT [TAGS]     URL as ws://127.0.0.1:PORT/; TAGS: the robot has a map with this many tags; only the map is checked.
// Exit code 1 and a message on failure
import { readFileSync } from "node:fs";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import ws from "@foxglove/ws-protocol";

const { FoxgloveClient } = ws;
const [url, token, layoutFile, mapped] = process.argv.slice(2);
const within = (promise, what) => Promise.race([promise, new Promise((_, no) => setTimeout(() => no(new Error(`no ${what} in 30 s`)), 30000))]);
function check(condition, words) {
  if (!condition) throw new Error(words);
}

/** A connection, its channels by topic, and its messages decoded. */
class Studio {
  channels = new Map();
  bySubscription = new Map();
  heard = new Map();
  waiting = [];
  constructor(address, protocol) {
    const socket = new WebSocket(address, [protocol]);
    this.client = new FoxgloveClient({ ws: socket });
    this.info = new Promise((done) => this.client.on("serverInfo", done));
    this.warnings = [];
    this.client.on("status", ({ message }) => { this.warnings.push(message); this.look(); });
    this.client.on("advertise", (channels) => { for (const c of channels) this.channels.set(c.topic, c); this.look(); });
    this.client.on("message", ({ subscriptionId, data, timestamp }) => {
      const { topic, read } = this.bySubscription.get(subscriptionId);
      const list = this.heard.get(topic) ?? [];
      list.push({ timestamp, message: read(data) });
      this.heard.set(topic, list);
      this.look();
    });
    this.protocol = new Promise((done) => socket.addEventListener("open", () => done(socket.protocol)));
    this.open = new Promise((done, no) => { this.client.on("open", done); this.client.on("error", no); });
  }
  look() {
    this.waiting = this.waiting.filter((one) => !one());
  }
  until(condition, what) {
    return within(new Promise((done) => {
      const one = () => { const value = condition(); if (value) done(value); return value; };
      if (!one()) this.waiting.push(one);
    }), what);
  }
  async subscribe(topic) {
    const channel = await this.until(() => this.channels.get(topic), topic);
    let read;
    if (channel.encoding === "json") read = (data) => JSON.parse(new TextDecoder().decode(data));
    else {
      check(channel.encoding === "cdr" && channel.schemaEncoding === "ros2msg", `${topic}: ${channel.encoding}, ${channel.schemaEncoding}`);
      const reader = new MessageReader(parse(channel.schema, { ros2: true }));
      read = (data) => reader.readMessage(data);
    }
    const id = this.client.subscribe(channel.id);
    this.bySubscription.set(id, { topic, read });
    return id;
  }
  first(topic, wanted = () => true) {
    return this.until(() => this.heard.get(topic)?.find(({ message }) => wanted(message)), `message on ${topic}`);
  }
  publish(topic, schemaName, message) {
    const id = this.client.advertise({ topic, encoding: "json", schemaName });
    this.client.sendMessage(id, new TextEncoder().encode(JSON.stringify(message)));
  }
}

async function watches(protocol) {
  const studio = new Studio(url, protocol);
  await within(studio.open, "connection");
  check((await studio.protocol) === protocol, `the server chose ${await studio.protocol}`);
  const info = await within(studio.info, "serverInfo");
  check(info.capabilities.includes("clientPublish"), "without the token a stop can be published");
  for (const topic of ["/odom", "/imu", "/tag_detections", "/camera_info", "/tf", "/tf_static", "/waymark/state"]) await studio.subscribe(topic);
  const odometry = await studio.first("/odom");
  check(Number.isFinite(odometry.message.pose.pose.position.x) && odometry.message.header.frame_id === "odom", "odometry is decoded");
  check(Math.abs(Number(odometry.timestamp) * 1e-6 - Date.now()) < 60000, "stamped by this machine's clock");
  check((await studio.first("/camera_info")).message.width > 0, "the camera is latched");
  check((await studio.first("/tf_static")).message.transforms[0].child_frame_id === "camera_optical", "where the camera sits is latched");
  check((await studio.first("/tf")).message.transforms[0].child_frame_id === "base_link", "frames");
  check((await studio.first("/tag_detections")).message.detections !== undefined, "tags");
  check((await studio.first("/waymark/state")).message.phase === "idle", "the state");
  studio.publish("/waymark/order", "std_msgs/String", { data: "go" });
  await studio.until(() => studio.warnings.some((words) => words.includes("may only watch")), "refusal");
  check(!studio.heard.get("/waymark/state").some(({ message }) => message.phase !== "idle"), "nobody without the token moves the robot");
  studio.client.close();
}

async function commands() {
  const studio = new Studio(`${url}?token=${token}`, "foxglove.sdk.v1");
  await within(studio.open, "connection");
  check((await within(studio.info, "serverInfo")).capabilities.includes("clientPublish"), "with the token it may publish");
  await studio.subscribe("/waymark/state");
  await studio.subscribe("/odom");
  studio.publish("/waymark/order", "std_msgs/String", { data: "go" });
  await studio.first("/waymark/state", ({ phase }) => phase === "teaching");
  const id = studio.client.advertise({ topic: "/cmd_vel", encoding: "json", schemaName: "geometry_msgs/Twist" });
  const twist = new TextEncoder().encode(JSON.stringify({ linear: { x: 0.2, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0.1 } }));
  const driving = setInterval(() => studio.client.sendMessage(id, twist), 100);
  await studio.first("/odom", ({ twist: { twist: { linear } } }) => linear.x > 0.1);
  clearInterval(driving);
  studio.heard.set("/odom", []);
  await studio.first("/odom", ({ twist: { twist: { linear } } }) => linear.x > 0.1);
  studio.heard.set("/odom", []);
  await studio.first("/odom", ({ twist: { twist: { linear } } }) => Math.abs(linear.x) < 0.01); // no commands: it stops
  studio.publish("/waymark/order", "std_msgs/String", { data: "stop" });
  await studio.until(() => studio.heard.get("/waymark/state").at(-1).message.phase === "idle", "end of the lap");
  studio.client.close();
}

/** A robot with a map: its tags and its route are sent as markers, also to later viewers. */
async function map(tags) {
  const studio = new Studio(url, "foxglove.sdk.v1");
  await within(studio.open, "connection");
  await studio.subscribe("/waymark/map");
  const { markers } = (await studio.first("/waymark/map")).message;
  const of = (ns) => markers.filter((marker) => marker.ns === ns);
  check(markers.every((marker) => marker.header.frame_id === "map" && Number.isFinite(marker.pose.position.x)), "markers are in frame map");
  const numbers = new Set(of("numbers").map((marker) => Number(marker.text)));
  check(numbers.size === tags && [...numbers].every((n) => n >= 0 && n < tags), `of ${tags} tags the numbers ${[...numbers]}`);
  check(of("tags").length === tags && of("tags").every((marker) => marker.points.length > 60 && marker.points.length === marker.colors.length), "each tag is drawn cell by cell");
  check(of("route").length === 1 && of("route")[0].points.length > 20, "the route is a line");
  studio.client.close();
}

/** The layout contains only existing topics, or those of a lidar or a replay. */
function layout() {
  const topics = JSON.stringify(JSON.parse(readFileSync(layoutFile, "utf8"))).match(/"\/[a-z_/]+/g).map((text) => text.slice(1));
  const known = ["/waymark/pose", "/waymark/map", "/truth/pose", "/scan", "/image_raw/compressed", "/camera_info", "/odom", "/cmd_vel", "/waymark/state", "/waymark/order"];
  const strange = topics.filter((topic) => !known.includes(topic));
  check(topics.length > 5 && strange.length === 0, `the layout names ${strange}`);
}

try {
  if (mapped) await map(Number(mapped));
  else {
    layout();
    await watches("foxglove.websocket.v1");
    await watches("foxglove.sdk.v1");
    await commands();
  }
  console.log(`Foxglove's client: ${mapped ? "the map as shapes" : "both protocols, read-only without the token, publishing with it"}`);
  process.exit(0);
} catch (error) {
  console.error(error.stack);
  process.exit(1);
}
