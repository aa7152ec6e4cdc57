import type { Camera } from "../math/camera";
import type { Pose } from "../math/pose";
import type { Tracks } from "./tracks";

/** Decoded ROS 2 messages are plain objects; fields are read with defaults, so that unusual messages do not throw. */
type Message = Record<string, any>; // eslint-disable-line @typescript-eslint/no-explicit-any

/** Kinds of topics that the page shows. Topics are recognised by type; only truth is recognised by name. */
export type Kind = "truth" | "odometry" | "estimate" | "uncertain" | "command" | "tags" | "unreliable" | "nis" | "image" | "camera" | "tf";

export function kindOf(topic: string, type: string): Kind | undefined {
  switch (type) {
    case "geometry_msgs/msg/PoseStamped": return topic.startsWith("/truth") ? "truth" : undefined;
    case "nav_msgs/msg/Odometry": return topic.startsWith("/truth") ? "truth" : "odometry";
    case "geometry_msgs/msg/PoseWithCovarianceStamped": return topic.endsWith("_uncertain") ? "uncertain" : "estimate";
    case "geometry_msgs/msg/TwistStamped":
    case "geometry_msgs/msg/Twist": return "command";
    case "apriltag_msgs/msg/AprilTagDetectionArray": return "tags";
    case "waymark_msgs/msg/UnreliableTags": return "unreliable";
    case "diagnostic_msgs/msg/DiagnosticArray": return topic.endsWith("nis") ? "nis" : undefined;
    case "sensor_msgs/msg/Image":
    case "sensor_msgs/msg/CompressedImage": return "image";
    case "sensor_msgs/msg/CameraInfo": return "camera";
    case "tf2_msgs/msg/TFMessage": return "tf";
    default: return undefined;
  }
}

const finite = (values: number[]): boolean => values.every(Number.isFinite);

/** Seconds of a message's own stamp since `start` [ns]; its log time if it has no stamp. */
export function secondsOf(message: Message, logTime: bigint, start: bigint): number {
  const stamp = message["header"]?.stamp;
  const ns = stamp ? BigInt(stamp.sec) * 1_000_000_000n + BigInt(stamp.nanosec ?? stamp.nsec ?? 0) : logTime;
  return Number((ns === 0n && logTime !== 0n ? logTime : ns) - start) * 1e-9;
}

export const poseRow = (pose: Message): number[] => [
  pose["position"].x, pose["position"].y, pose["position"].z,
  pose["orientation"].x, pose["orientation"].y, pose["orientation"].z, pose["orientation"].w,
];

/** Family names by number; the tracks store the numbers. */
export class FamilyNames {
  readonly names: string[] = [];
  indexOf(name: string): number {
    const full = /^\d/.test(name) ? `tag${name}` : name;
    const index = this.names.indexOf(full);
    return index >= 0 ? index : this.names.push(full) - 1;
  }
}

function keep(series: { push(...row: number[]): void; length: number; time(row: number): number }, row: number[]): void {
  if (!finite(row) || (series.length > 0 && row[0]! < series.time(series.length - 1))) return; // never backward in time
  series.push(...row);
}

/** Adds a message to the tracks; O(1). Messages with non-finite numbers are skipped. */
export function add(tracks: Tracks, families: FamilyNames, kind: Kind, t: number, message: Message): void {
  switch (kind) {
    case "truth": return keep(tracks.truth, [t, ...poseRow(message["pose"].pose ?? message["pose"])]);
    case "odometry": {
      const twist = message["twist"].twist;
      return keep(tracks.odometry, [t, ...poseRow(message["pose"].pose), twist.linear.x, twist.angular.z]);
    }
    case "estimate":
    case "uncertain": {
      const c = message["pose"].covariance;
      return keep(tracks[kind], [t, ...poseRow(message["pose"].pose), c[0], (c[1] + c[6]) / 2, c[7], c[35]]);
    }
    case "command": {
      const twist = message["twist"] ?? message;
      return keep(tracks.command, [t, twist.linear.x, twist.angular.z]);
    }
    case "nis":
      for (const status of message["status"]) {
        const value = (key: string): number => Number(status.values.find((v: Message) => v["key"] === key)?.value);
        keep(tracks.nis, [t, Number(String(status.name).split(":")[1]), value("nis"), value("degrees_of_freedom"), status.level === 0 ? 1 : 0]);
      }
      return;
    case "tags":
    case "unreliable":
      if (kind === "tags" && message["detections"].length === 0) keep(tracks.tags, [t, 0, -1, 0, 0, 0, 0, 0, 0, 0, 0]);
      for (const tag of message["detections"]) {
        const [bl, br, tr, tl] = tag.corners; // in the order of libapriltag
        keep(tracks[kind], [t, families.indexOf(String(tag.family)), tag.id, tl.x, tl.y, tr.x, tr.y, br.x, br.y, bl.x, bl.y]);
      }
      return;
    default: return;
  }
}

/** Time from the middle of the exposure to recording [ms]; both arguments in the clock of the recording [s]. */
export function addLatency(tracks: Tracks, t: number, recorded: number): void {
  keep(tracks.latency, [t, (recorded - t) * 1000]);
}

export function cameraOf(message: Message): Camera | undefined {
  const k = message["k"];
  const camera: Camera = { width: message["width"], height: message["height"], fx: k[0], fy: k[4], cx: k[2], cy: k[5], skew: k[1],
                           model: message["distortion_model"], distortion: Array.from(message["d"] as ArrayLike<number>) };
  return camera.fx > 0 && camera.width > 0 ? camera : undefined;
}

/** base_T_cam from static transforms: the one into a frame that ends with `optical`, if there is one. */
export function mountingOf(message: Message): Pose | undefined {
  for (const { child_frame_id, transform } of message["transforms"]) {
    if (!String(child_frame_id).endsWith("optical")) continue;
    const { translation: t, rotation: r } = transform;
    return { p: [t.x, t.y, t.z], q: [r.x, r.y, r.z, r.w] };
  }
  return undefined;
}
