import { poseBetween } from "../data/scores";
import type { MapTag } from "../data/map_files";
import { areaOf, tagPose } from "../math/tag_pose";
import { compose, type Pose } from "../math/pose";
import type { Content } from "../session";

interface View {
  readonly tag: MapTag;
  readonly area: number; // [px²] in the image from which it was placed
}

/** Tags before there is a map: each is placed by its largest observation and the odometry. */
export class SeenTags {
  private readonly views = new Map<string, View>();
  private row = 0; // the first row not yet used

  /** Uses new rows of the content; returns whether a tag appeared or moved. */
  take(content: Content, map_T_odom: Pose): boolean {
    const { tracks, info, families, tagSize } = content;
    const { camera, base_T_cam } = info ?? {};
    if (!camera || !base_T_cam || tagSize === undefined) return false;
    let changed = false;
    for (; this.row < tracks.tags.length; ++this.row) {
      const v = tracks.tags.row(this.row), family = families[v[1]!];
      const last = tracks.odometry.length - 1;
      if (last < 0 || tracks.odometry.time(last) < v[0]!) break; // the pose of the robot is still unknown
      const odom_T_base = poseBetween(tracks.odometry, v[0]!);
      if (v[2]! < 0 || family === undefined || !odom_T_base) continue;
      const corners = [0, 1, 2, 3].map((i) => [v[3 + 2 * i]!, v[4 + 2 * i]!] as const);
      const key = `${family}:${v[2]}`, size = areaOf(corners);
      if (size < 1.1 * (this.views.get(key)?.area ?? 0)) continue;
      const cam_T_tag = tagPose(camera, corners, tagSize);
      if (!cam_T_tag) continue;
      const map_T_tag = compose(compose(map_T_odom, odom_T_base), compose(base_T_cam, cam_T_tag));
      this.views.set(key, { tag: { family, id: v[2]!, size: tagSize, map_T_tag }, area: size });
      changed = true;
    }
    return changed;
  }

  tags(): MapTag[] {
    return [...this.views.values()].map(({ tag }) => tag);
  }
}
