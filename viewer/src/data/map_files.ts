import { load } from "js-yaml";
import { compose, fromYaw, multiply, type Pose, type Quat, type Vec3 } from "../math/pose";

export interface MapTag {
  readonly family: string;
  readonly id: number;
  readonly size: number;
  readonly map_T_tag: Pose;
  /** One-sigma of the position along x, y, z [m]; absent if the file has no covariance. */
  readonly sigma?: Vec3;
  readonly observations?: number;
}
export interface Route {
  readonly closed: boolean;
  readonly xy: Float64Array;
}
export interface Wall {
  readonly x: number;
  readonly y: number;
  readonly z: number;
  readonly yaw: number;
  readonly length: number;
  readonly width: number;
  readonly height: number;
}
export interface World {
  readonly tags: readonly MapTag[];
  readonly boxes: readonly Wall[];
  readonly keepOuts: readonly (readonly [number, number][])[];
}

type Node = Record<string, unknown>;

function object(text: string, what: string): Node {
  const value: unknown = load(text);
  if (typeof value !== "object" || value === null || Array.isArray(value)) throw new Error(`${what}: not a table of keys`);
  return value as Node;
}
const list = (value: unknown): Node[] => (Array.isArray(value) ? (value as Node[]) : []);
function number(node: Node, key: string, fallback?: number): number {
  const value = node[key] ?? fallback;
  if (typeof value !== "number" || !Number.isFinite(value)) throw new Error(`'${key}' is not a number`);
  return value;
}
function numbers(value: unknown, count: number, key: string): number[] {
  if (!Array.isArray(value) || value.length !== count || !value.every((v) => typeof v === "number" && Number.isFinite(v)))
    throw new Error(`'${key}' is not ${count} numbers`);
  return value as number[];
}

/** Fails if a file that declares its number of entries is truncated: its last key `end` has the same number. */
function checkEnd(root: Node, key: string, entries: string, count: number): void {
  const declared = root[key];
  const end = root["end"];
  if (declared === undefined && end === undefined) return; // written by hand
  if (declared !== end)
    throw new Error(`truncated: ${count} of ${String(declared)} ${entries}, and the last key 'end' is missing. Copy the file again`);
  if (declared !== count) throw new Error(`'${key}' is ${String(declared)}, but the file contains ${count} ${entries}`);
}

/** map.yaml (docs/formats/map.md). */
export function parseMap(text: string): MapTag[] {
  const root = object(text, "map");
  if (root["format"] !== "waymark-map-1") throw new Error("not a map: 'format: waymark-map-1' is missing");
  checkEnd(root, "tag_count", "tags", list(root["tags"]).length);
  return list(root["tags"]).map((node) => {
    const [family, id] = String(node["tag"]).split(":");
    if (!family || !/^\d+$/.test(id ?? "")) throw new Error(`'${String(node["tag"])}' is not a tag`);
    const tag: MapTag = {
      family, id: Number(id), size: number(node, "size_m"),
      map_T_tag: {
        p: numbers(node["position_m"], 3, "position_m") as unknown as Vec3,
        q: numbers(node["quaternion_xyzw"], 4, "quaternion_xyzw") as unknown as Quat,
      },
    };
    const extra: { sigma?: Vec3; observations?: number } = {};
    if (node["covariance"] !== undefined) {
      const c = numbers(node["covariance"], 21, "covariance"); // upper triangle of 6x6: rows begin at 0, 6, 11
      extra.sigma = positionSigma(c, tag.map_T_tag.p);
    }
    if (typeof node["observations"] === "number") extra.observations = node["observations"];
    return { ...tag, ...extra };
  });
}

/** Sigma of the tag's centre: the tangent of a map's covariance rotates about the map origin (docs/conventions.md). */
function positionSigma(upper: number[], p: Vec3): Vec3 {
  const at = (i: number, j: number): number => {
    const [a, b] = i <= j ? [i, j] : [j, i];
    return upper[a * 6 - (a * (a - 1)) / 2 + (b - a)]!;
  };
  // position' = position + v + w × p, hence the rows of [I, -[p]×]
  const rows = [
    [1, 0, 0, 0, p[2], -p[1]],
    [0, 1, 0, -p[2], 0, p[0]],
    [0, 0, 1, p[1], -p[0], 0],
  ];
  const variance = (r: number[]): number => {
    let sum = 0;
    for (let i = 0; i < 6; ++i) for (let j = 0; j < 6; ++j) sum += r[i]! * at(i, j) * r[j]!;
    return Math.sqrt(Math.max(0, sum));
  };
  return [variance(rows[0]!), variance(rows[1]!), variance(rows[2]!)];
}

/** route.yaml. */
export function parseRoute(text: string): Route {
  const root = object(text, "route");
  if (root["format"] !== "waymark-route-1") throw new Error("not a route: 'format: waymark-route-1' is missing");
  const points = (Array.isArray(root["points"]) ? root["points"] : []) as unknown[];
  const declared = root["point_count"];
  if (declared !== undefined && declared !== points.length)
    throw new Error(`truncated: ${points.length} of ${String(declared)} points. Copy the file again`);
  if (points.length < 2) throw new Error("a route needs at least two points");
  const xy = new Float64Array(2 * points.length);
  points.forEach((point, i) => xy.set(numbers(point, 6, "points").slice(1, 3), 2 * i));
  return { closed: root["closed"] === true, xy };
}

/** A tag facing this way, tilted up by tilt: x right and y down as seen by a viewer, z into the tag. */
export function facingTag(x: number, y: number, z: number, facing: number, tilt: number): Pose {
  const upright: Quat = [-0.5, -0.5, 0.5, 0.5]; // for a viewer at +x: x to map +y, y to map -z, z to map -x
  const leaning = multiply(upright, [Math.sin(-tilt / 2), 0, 0, Math.cos(tilt / 2)]);
  return { p: [x, y, z], q: multiply(fromYaw(0, 0, facing).q, leaning) };
}

const degrees = Math.PI / 180;

const placed = (node: Node): Pose =>
  facingTag(number(node, "x_m"), number(node, "y_m"), number(node, "z_m"),
            number(node, "facing_deg") * degrees, number(node, "tilt_deg", 0) * degrees);

/** Contents of a simulator world (docs/formats/world.md). */
export function parseWorld(text: string): World {
  const root = object(text, "world");
  checkEnd(root, "path_point_count", "path points", Array.isArray(root["path_m"]) ? root["path_m"].length : 0);
  const family = String(root["tag_family"] ?? "tag36h11");
  const size = number(root, "tag_size_m", 0.16);
  const tags = list(root["tags"]).map((tag): MapTag => ({
    family, id: number(tag, "id"), size: number(tag, "size_m", size),
    map_T_tag: placed(tag),
  }));
  const panels = list(root["panels"]);
  for (const panel of panels) {
    const board = placed(panel);
    for (const tag of list(panel["tags"]))
      tags.push({ family, id: number(tag, "id"), size: number(tag, "size_m", size),
        map_T_tag: compose(board, { p: [number(tag, "right_m", 0), -number(tag, "up_m", 0), 0], q: [0, 0, 0, 1] }) });
  }
  const walls = list(root["walls"]).map((wall): Wall => {
    const [ax, ay] = numbers(wall["from_m"], 2, "from_m") as [number, number];
    const [bx, by] = numbers(wall["to_m"], 2, "to_m") as [number, number];
    const height = number(wall, "height_m", 2.5);
    return { x: (ax + bx) / 2, y: (ay + by) / 2, z: height / 2, yaw: Math.atan2(by - ay, bx - ax),
             length: Math.hypot(bx - ax, by - ay), width: number(wall, "thickness_m", 0.1), height };
  });
  const furniture = list(root["occluders"]).map((box): Wall => {
    const height = number(box, "height_m");
    return { x: number(box, "x_m"), y: number(box, "y_m"), z: number(box, "z_m", height / 2),
             yaw: number(box, "yaw_deg", 0) * degrees, length: number(box, "length_m"), width: number(box, "width_m"), height };
  });
  const keepOuts = (Array.isArray(root["keep_outs"]) ? root["keep_outs"] : []).map((polygon: unknown) =>
    (polygon as unknown[]).map((point) => numbers(point, 2, "keep_outs") as [number, number]));
  return { tags, boxes: [...walls, ...furniture], keepOuts };
}

/** TUM text: stamp x y z qx qy qz qw; lines that begin with # are comments. */
export function parseTum(text: string): number[][] {
  return text.split("\n").map((line) => line.trim()).filter((line) => line !== "" && !line.startsWith("#"))
    .map((line) => numbers(line.split(/\s+/).map(Number), 8, "a line of a trajectory"));
}
