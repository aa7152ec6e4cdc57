import { compose, inverse, transform, type Pose, type Vec3 } from "./pose";

/** A camera as in ROS (pixel centres at integers), with its mounting on the robot. */
export interface Camera {
  readonly width: number;
  readonly height: number;
  readonly fx: number;
  readonly fy: number;
  readonly cx: number;
  readonly cy: number;
  /** [px] the x coordinate of a pixel is fx x + skew y + cx */
  readonly skew: number;
  readonly model: string;
  readonly distortion: readonly number[];
}

/** Radial and tangential (plumb_bob) or equidistant distortion of normalised coordinates. */
export function distort(camera: Camera, x: number, y: number): [number, number] {
  const d = (i: number): number => camera.distortion[i] ?? 0;
  const r2 = x * x + y * y;
  if (camera.model === "equidistant" || camera.model === "fisheye") {
    const r = Math.sqrt(r2);
    if (r < 1e-12) return [x, y];
    const a = Math.atan(r), a2 = a * a;
    const scale = (a * (1 + a2 * (d(0) + a2 * (d(1) + a2 * (d(2) + a2 * d(3)))))) / r;
    return [x * scale, y * scale];
  }
  const radial =
    (1 + r2 * (d(0) + r2 * (d(1) + r2 * d(4)))) / (1 + r2 * (d(5) + r2 * (d(6) + r2 * d(7))));
  return [
    x * radial + 2 * d(2) * x * y + d(3) * (r2 + 2 * x * x),
    y * radial + d(2) * (r2 + 2 * y * y) + 2 * d(3) * x * y,
  ];
}

/** Distorted normalised coordinates of a pixel. */
export function withoutIntrinsics(camera: Camera, u: number, v: number): [number, number] {
  const y = (v - camera.cy) / camera.fy;
  return [(u - camera.cx - camera.skew * y) / camera.fx, y];
}

/** Undistorted normalised coordinates of a pixel: the inverse of distort(), by fixed-point iteration. */
export function undistort(camera: Camera, u: number, v: number): [number, number] {
  const wanted = withoutIntrinsics(camera, u, v);
  let [x, y]: [number, number] = [...wanted];
  for (let i = 0; i < 50; ++i) {
    const [dx, dy] = distort(camera, x, y);
    x += wanted[0] - dx;
    y += wanted[1] - dy;
  }
  return [x, y];
}

/** The pixel of a point in the camera frame; undefined if the point is behind the camera. */
export function project(camera: Camera, p: Vec3): [number, number] | undefined {
  if (p[2] <= 1e-3) return undefined;
  const [x, y] = distort(camera, p[0] / p[2], p[1] / p[2]);
  return [camera.fx * x + camera.skew * y + camera.cx, camera.fy * y + camera.cy];
}

/** Corners TL, TR, BR, BL of a tag of this size in its own frame: x right, y down, z into the tag. */
export function tagCorners(size: number): Vec3[] {
  const h = size / 2;
  return [[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]];
}

/** Pixels of the corners of a tag; undefined if one of them is behind the camera. */
export function projectTag(camera: Camera, map_T_cam: Pose, map_T_tag: Pose, size: number): [number, number][] | undefined {
  const cam_T_tag = compose(inverse(map_T_cam), map_T_tag);
  const pixels = tagCorners(size).map((corner) => project(camera, transform(cam_T_tag, corner)));
  return pixels.every((pixel) => pixel !== undefined) ? (pixels as [number, number][]) : undefined;
}
