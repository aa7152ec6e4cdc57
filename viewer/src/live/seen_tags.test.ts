import { describe, expect, it } from "vitest";
import { facingTag } from "../data/map_files";
import { projectTag, type Camera } from "../math/camera";
import { compose, fromYaw, identity, type Pose } from "../math/pose";
import { emptyContent } from "../session";
import { SeenTags } from "./seen_tags";

const camera: Camera = { width: 640, height: 480, fx: 500, fy: 500, cx: 319.5, cy: 239.5, skew: 0, model: "plumb_bob", distortion: [] };
const base_T_cam: Pose = { p: [0.1, 0, 0.2], q: [-0.5, 0.5, -0.5, 0.5] };

describe("SeenTags", () => {
  it("places each tag by its largest observation", () => {
    const content = emptyContent(), seen = new SeenTags(), map_T_tag = facingTag(3, 0.2, 0.4, Math.PI, 0);
    content.info = { name: "live", duration: 0, messages: 0, topics: [], metadata: {}, texts: {}, hasImages: false, camera, base_T_cam };
    content.families = ["tag36h11"];
    expect(seen.take(content, identity)).toBe(false); // the tag size is still unknown
    content.tagSize = 0.16;
    for (const [t, x] of [[0, 0], [1, 0.7], [2, 1.4]] as const) {
      const odom_T_base = fromYaw(x, 0, 0);
      content.tracks.odometry.push(t, ...odom_T_base.p, ...odom_T_base.q, 0.7, 0);
      const corners = projectTag(camera, compose(odom_T_base, base_T_cam), map_T_tag, 0.16)!;
      content.tracks.tags.push(t, 0, 7, ...corners.map(([u, v]) => [u + (2 - t), v] as const).flat()); // the farthest observation is the worst
    }
    content.tracks.tags.push(2, 0, -1, 0, 0, 0, 0, 0, 0, 0, 0);
    expect(seen.take(content, identity)).toBe(true);
    const [tag, ...others] = seen.tags();
    expect(others).toEqual([]);
    expect(tag).toMatchObject({ family: "tag36h11", id: 7, size: 0.16 });
    expect(Math.hypot(...tag!.map_T_tag.p.map((v, i) => v - map_T_tag.p[i]!))).toBeLessThan(1e-5);
    expect(seen.take(content, identity)).toBe(false);
  });
});
