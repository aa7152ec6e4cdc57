import { describe, expect, it } from "vitest";
import { facingTag } from "../data/map_files";
import { projectTag, undistort, distort, type Camera } from "./camera";
import { compose, fromYaw, inverse, multiply, type Pose } from "./pose";
import { tagPose } from "./tag_pose";

const cameras: Camera[] = [
  { width: 640, height: 480, fx: 500, fy: 505, cx: 319.5, cy: 239.5, skew: 0, model: "plumb_bob", distortion: [-0.2, 0.05, 0.001, -0.002, 0] },
  { width: 640, height: 480, fx: 300, fy: 300, cx: 320, cy: 240, skew: 3, model: "equidistant", distortion: [0.02, -0.01, 0, 0] },
];
const base_T_cam: Pose = { p: [0.1, 0, 0.2], q: [-0.5, 0.5, -0.5, 0.5] }; // optical axis along base x

describe("tagPose", () => {
  for (const camera of cameras) {
    it(`finds the pose that the corners were projected from (${camera.model})`, () => {
      const map_T_cam = compose(fromYaw(0.3, -0.2, 0.1), base_T_cam);
      for (const facing of [2.4, 3.0, 3.5]) {
        const map_T_tag = facingTag(1.9, 0.1, 0.5, facing, 0.2);
        const corners = projectTag(camera, map_T_cam, map_T_tag, 0.16)!;
        const cam_T_tag = tagPose(camera, corners, 0.16)!;
        const off = compose(inverse(map_T_tag), compose(map_T_cam, cam_T_tag));
        expect(Math.hypot(...off.p)).toBeLessThan(1e-6);
        expect(Math.abs(off.q[3])).toBeGreaterThan(1 - 1e-9);
      }
    });
    it(`undistort is the inverse of distort (${camera.model})`, () => {
      for (const [x, y] of [[0, 0], [0.3, -0.2], [-0.4, 0.35]] as const) {
        const [u, v] = distort(camera, x, y);
        const [a, b] = undistort(camera, u * camera.fx + camera.skew * v + camera.cx, v * camera.fy + camera.cy);
        expect(Math.hypot(a - x, b - y)).toBeLessThan(1e-8);
      }
    });
  }
  it("returns undefined for collinear corners", () => {
    expect(tagPose(cameras[0]!, [[10, 10], [20, 10], [30, 10], [40, 10]], 0.16)).toBeUndefined();
  });
  it("keeps the roll of a tag on its side", () => {
    const map_T_tag = { ...facingTag(1.5, 0, 0.4, 2.9, 0), q: multiply(facingTag(0, 0, 0, 2.9, 0).q, [0, 0, Math.SQRT1_2, Math.SQRT1_2]) };
    const cam_T_tag = tagPose(cameras[0]!, projectTag(cameras[0]!, base_T_cam, map_T_tag, 0.2)!, 0.2)!;
    const off = compose(inverse(map_T_tag), compose(base_T_cam, cam_T_tag));
    expect(Math.abs(off.q[3])).toBeGreaterThan(1 - 1e-9);
  });
});
