// The pose of a tag from its four corners, for drawing only; the program itself computes more accurate poses.
import { tagCorners, undistort, type Camera } from "./camera";
import type { Pose, Vec3 } from "./pose";

type Pixel = readonly [number, number];

/** Area of a quadrilateral: half the cross product of its diagonals [px²]. */
export const areaOf = ([a, b, c, d]: readonly Pixel[]): number =>
  Math.abs((c![0] - a![0]) * (d![1] - b![1]) - (c![1] - a![1]) * (d![0] - b![0])) / 2;

const cross = (a: Vec3, b: Vec3): Vec3 => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a: Vec3): number => Math.hypot(...a);
const scaled = (a: Vec3, s: number): Vec3 => [a[0] * s, a[1] * s, a[2] * s];

/** Solves a linear system by Gaussian elimination with row pivoting; undefined if it is singular. */
function solve(rows: number[][]): number[] | undefined {
  const n = rows.length;
  for (let i = 0; i < n; ++i) {
    let best = i;
    for (let k = i + 1; k < n; ++k) if (Math.abs(rows[k]![i]!) > Math.abs(rows[best]![i]!)) best = k;
    [rows[i], rows[best]] = [rows[best]!, rows[i]!];
    const pivot = rows[i]![i]!;
    if (Math.abs(pivot) < 1e-12) return undefined;
    for (let k = 0; k < n; ++k) {
      if (k === i) continue;
      const share = rows[k]![i]! / pivot;
      for (let j = i; j <= n; ++j) rows[k]![j]! -= share * rows[i]![j]!;
    }
  }
  return rows.map((row, i) => row[n]! / row[i]!);
}

/** The rotation with these columns, as x y z w. */
function quaternionOf(x: Vec3, y: Vec3, z: Vec3): Pose["q"] {
  const w = Math.sqrt(Math.max(0, 1 + x[0] + y[1] + z[2])) / 2;
  const part = (own: number, rest: number, sign: number): number => Math.sign(sign || 1) * (Math.sqrt(Math.max(0, 1 + own - rest)) / 2);
  const q: Pose["q"] = [part(x[0], y[1] + z[2], y[2] - z[1]), part(y[1], x[0] + z[2], z[0] - x[2]), part(z[2], x[0] + y[1], x[1] - y[0]), w];
  const length = Math.hypot(...q);
  return [q[0] / length, q[1] / length, q[2] / length, q[3] / length];
}

/**
 * cam_T_tag from the corners TL, TR, BR, BL [px, centres at integers] of a tag of this size [m]; undefined if they have no area. Decomposes
 * the homography of the plane (Zhang, "A Flexible New Technique for Camera Calibration", 2000, section 3.1).
 */
export function tagPose(camera: Camera, corners: readonly Pixel[], size: number): Pose | undefined {
  if (!(areaOf(corners) > 1)) return undefined;
  const rows: number[][] = [];
  tagCorners(size).forEach(([X, Y], i) => {
    const [u, v] = undistort(camera, corners[i]![0], corners[i]![1]);
    rows.push([X, Y, 1, 0, 0, 0, -u * X, -u * Y, u], [0, 0, 0, X, Y, 1, -v * X, -v * Y, v]);
  });
  const h = solve(rows);
  if (!h || !h.every(Number.isFinite)) return undefined;
  const a: Vec3 = [h[0]!, h[3]!, h[6]!], b: Vec3 = [h[1]!, h[4]!, h[7]!], scale = 2 / (norm(a) + norm(b));
  const x = scaled(a, 1 / norm(a));
  const along = b[0] * x[0] + b[1] * x[1] + b[2] * x[2];
  const rest: Vec3 = [b[0] - along * x[0], b[1] - along * x[1], b[2] - along * x[2]];
  const y = scaled(rest, 1 / norm(rest));
  return { p: [h[2]! * scale, h[5]! * scale, scale], q: quaternionOf(x, y, cross(x, y)) };
}
