import { AxesHelper, Group } from "three";
import { ellipseOf } from "../math/plane";
import { compose, identity, type Pose } from "../math/pose";
import { placeOdometry, poseAt, poseOf } from "../data/scores";
import type { Series } from "../data/series";
import { drawnTagsOf, type Content } from "../session";
import { disposeOf, type MapView } from "./map_view";
import { boxObject, ellipseObject, PathObject, place, polygonObject, robotObject, routeObject, setEllipse, tagObject } from "./shapes";

type Name = "truth" | "odometry" | "estimate";
const dashes: Record<Name, number> = { truth: 0, odometry: 0.03, estimate: 0.12 };
const widths: Record<Name, number> = { truth: 7, odometry: 3, estimate: 3 }; // the truth is drawn wide below the others
const heights: Record<Name, number> = { truth: 0.004, odometry: 0.006, estimate: 0.008 };

/** Draws the open content in the map: built once, then moved with the time. */
export class WorldView {
  private readonly paths = new Map<Name, PathObject>();
  private readonly robots = new Map<Name, Group>();
  private readonly moving = new Group(); // trajectories and robots
  private readonly axes = new Group(); // of every fixed frame
  private ellipse: ReturnType<typeof ellipseObject> | undefined;
  map_T_odom: Pose | undefined;

  constructor(private readonly view: MapView) {
    this.axes.visible = false;
  }

  build(content: Content, colour: (name: string) => string): void {
    this.view.clear();
    const add = this.view.content;
    for (const box of content.world?.boxes ?? []) add.add(boxObject(box));
    for (const polygon of content.world?.keepOuts ?? []) add.add(polygonObject(polygon, 0xd55e00));
    for (const tag of drawnTagsOf(content)) {
      add.add(tagObject(tag, () => this.view.draw()));
      if (!tag.sigma) continue;
      const ring = ellipseObject(colour("--estimate"));
      setEllipse(ring, ellipseOf(tag.sigma[0] ** 2, 0, tag.sigma[1] ** 2), tag.map_T_tag.p[0], tag.map_T_tag.p[1]);
      add.add(ring);
    }
    if (content.route) add.add(routeObject(content.route, colour("--route")));
    for (const route of content.otherRoutes.values()) add.add(routeObject(route, colour("--other")));
    this.ellipse = ellipseObject(colour("--estimate"));
    this.ellipse.visible = false;
    add.add(this.ellipse, this.moving, this.axes);
    this.rebuildTracks(content, colour);
  }

  /** Rebuilds only the trajectories and the robots. */
  rebuildTracks(content: Content, colour: (name: string) => string): void {
    disposeOf(this.moving);
    this.paths.clear();
    this.robots.clear();
    this.map_T_odom = placeOdometry(content.tracks);
    for (const name of ["truth", "odometry", "estimate"] as const) this.addTrack(content, name, colour(`--${name}`));
    this.buildAxes(content);
  }

  showAxes(shown: boolean): void {
    this.axes.visible = shown;
    this.view.draw();
  }

  /** Axes of map, odom and the tags; those of the robot and its camera are part of the robot. Red x, green y, blue z. */
  private buildAxes(content: Content): void {
    disposeOf(this.axes);
    const frame = (pose: Pose, length: number): void => {
      const helper = new AxesHelper(length);
      place(helper, pose);
      this.axes.add(helper);
    };
    frame(identity, 0.5);
    if (content.tracks.odometry.length > 0 && this.map_T_odom) frame(this.map_T_odom, 0.35);
    for (const tag of drawnTagsOf(content)) frame(tag.map_T_tag, tag.size);
  }

  private addTrack(content: Content, name: Name, color: string): void {
    const series = content.tracks[name];
    if (series.length === 0) return;
    const points = new Float32Array(3 * series.length);
    for (let row = 0; row < series.length; ++row) points.set(this.inMap(name, poseOf(series, row)).p, 3 * row);
    const path = new PathObject(points, color, widths[name], dashes[name], heights[name]);
    const eye = name === "odometry" ? undefined : content.info;
    const robot = robotObject(color, content.hull, eye?.camera, eye?.base_T_cam);
    this.moving.add(path.object, robot);
    this.paths.set(name, path);
    this.robots.set(name, robot);
  }

  private inMap(name: Name, pose: Pose): Pose {
    return name === "odometry" && this.map_T_odom ? compose(this.map_T_odom, pose) : pose;
  }

  /** Poses of the robots at t in the map frame. */
  posesAt(content: Content, t: number): Map<Name, Pose> {
    const poses = new Map<Name, Pose>();
    for (const name of this.robots.keys()) {
      const pose = poseAt(content.tracks[name], t);
      if (pose) poses.set(name, this.inMap(name, pose));
    }
    return poses;
  }

  moveTo(content: Content, t: number): void {
    const poses = this.posesAt(content, t);
    for (const [name, robot] of this.robots) {
      const pose = poses.get(name);
      robot.visible = pose !== undefined;
      if (pose) place(robot, pose);
      this.paths.get(name)!.until(content.tracks[name].indexAt(t));
    }
    this.moveEllipse(content.tracks.estimate, t);
    this.view.draw();
  }

  private moveEllipse(estimate: Series, t: number): void {
    const row = estimate.indexAt(t);
    if (!this.ellipse) return;
    this.ellipse.visible = row >= 0 && estimate.at(row, 8) > 0;
    if (this.ellipse.visible)
      setEllipse(this.ellipse, ellipseOf(estimate.at(row, 8), estimate.at(row, 9), estimate.at(row, 10)), estimate.at(row, 1), estimate.at(row, 2));
  }
}
