import type { Playback } from "../data/playback";
import { figuresOf, type Plots } from "../view/plots";
import { marksOf, scoresOf, type Mark } from "../data/scores";
import { compressedImageOf } from "../data/images";
import { identity } from "../math/pose";
import { tagsOf, takeRows, takeText, type Content } from "../session";
import type { CameraView } from "../view/camera_view";
import type { TimelineBar } from "../view/timeline_bar";
import type { WorldView } from "../view/world_view";
import type { RobotState } from "./frames";
import type { LiveImage, Updates, ShownImage, ToLink } from "./link_protocol";
import { CameraPanel, type CameraStatus } from "./camera_panel";
import { LivePage } from "./live_page";
import { SeenTags } from "./seen_tags";

export interface LiveParts {
  readonly content: Content;
  readonly playback: Playback;
  readonly world: WorldView;
  readonly camera: CameraView;
  readonly plots: Plots;
  readonly bar: TimelineBar;
  showStatus(words: string, bad?: boolean): void;
  rebuild(reframe: boolean): void;
  refit(): void;
  update(): void;
  drawCamera(): void;
  colour(name: string): string;
}

const keptImages = 300; // ten seconds of history
const phaseWords: Readonly<Record<string, string>> = {
  teaching: "teaching a lap", mapping: "making the map", ready: "map is ready", replaying: "replay", paused: "paused", done: "done", stopped: "stopped",
  localizing: "localisation",
};

/** The page of a running robot: new data are shown at once, and kept to look back. */
export class LiveMode {
  private readonly link = new Worker(new URL("./link_worker.ts", import.meta.url), { type: "module" });
  private readonly alive: ReturnType<typeof setInterval>;
  private readonly page: LivePage;
  private readonly panel: CameraPanel;
  private readonly seen = new SeenTags();
  private readonly images: LiveImage[] = [];
  private readonly phases: Mark[] = [];
  private phase = "";
  private dirty = false;
  private rebuilt = 0;
  private framed = false;
  private streams = 0; // number of streams with data
  /** Time of the image on the screen; undefined without images. */
  imageTime: number | undefined;
  /** Time at which the robot's program received it [ns of its clock]. */
  imageHostTime = 0n;

  constructor(private readonly parts: LiveParts) {
    parts.playback.following = true;
    this.page = new LivePage((message) => this.send({ send: message }));
    this.panel = new CameraPanel((message) => this.send({ send: message }));
    this.link.onmessage = ({ data }: MessageEvent<Updates>) => this.receive(data);
    this.link.onerror = (event) => parts.showStatus(event.message || "the connection did not start", true);
    this.alive = setInterval(() => this.send({ send: { op: "alive" } }), 500); // sent from the page, so that a blocked page loses control
    this.send({ next: true });
  }

  private send(message: ToLink): void {
    this.link.postMessage(message);
  }

  private receive(updates: Updates): void {
    this.send({ next: true });
    const { content, showStatus } = this.parts;
    takeRows(content, updates.rows);
    content.families = updates.families;
    if (updates.name !== undefined) { showStatus(`${updates.name}: live`); document.body.dataset["ready"] = "true"; }
    if (updates.lost) { showStatus("No connection to the robot's program.", true); this.page.lost(); }
    updates.words.forEach((words) => showStatus(words, true));
    if (updates.camera || updates.base_T_cam) this.takeCamera(updates);
    updates.states.forEach((state) => this.takeState(state));
    if (updates.control) { this.page.showControl(updates.control); this.panel.allow(updates.control.may); }
    const texts = updates.texts.filter(({ name }) => name !== "camera.json");
    const device = updates.texts.find(({ name }) => name === "camera.json");
    if (device) this.panel.show(JSON.parse(device.text) as CameraStatus);
    for (const { name, text } of texts) {
      const wrong = takeText(content, name, text);
      if (wrong) showStatus(wrong, true);
    }
    if (texts.length > 0) this.parts.rebuild(true);
    this.images.push(...updates.images);
    if (this.images.length > keptImages) this.images.splice(0, this.images.length - keptImages);
    if (updates.shown) this.show(updates.shown);
    this.dirty = true;
  }

  private takeCamera({ camera, base_T_cam }: Updates): void {
    this.parts.content.info = { name: "live", duration: 0, messages: 0, topics: [], metadata: {}, texts: {}, hasImages: false,
                                ...(camera ? { camera } : {}), ...(base_T_cam ? { base_T_cam } : {}) };
    this.rebuilt = 0;
  }

  private takeState(state: RobotState): void {
    this.page.show(state);
    if (state.phase === this.phase) return;
    this.phase = state.phase;
    const words = phaseWords[state.phase];
    if (words) this.phases.push({ t: this.newest(), kind: state.phase === "replaying" ? "go" : state.phase === "teaching" ? "start" : "stop", words });
  }

  /** Shows an image together with its own tags. */
  private show({ t, hostTime, bitmap }: ShownImage): void {
    const { camera, content, drawCamera, playback } = this.parts;
    if (!playback.following) return bitmap.close();
    this.imageTime = t;
    this.imageHostTime = hostTime;
    camera.showBitmap(bitmap);
    drawCamera();
    const age = performance.timeOrigin + performance.now() - Number(hostTime) * 1e-6;
    const last = content.tracks.latency.length > 0 ? content.tracks.latency.time(content.tracks.latency.length - 1) : -Infinity;
    if (t >= last) content.tracks.latency.push(t, age);
  }

  private newest(): number {
    const { odometry, tags, estimate, truth } = this.parts.content.tracks;
    return Math.max(...[odometry, tags, estimate, truth].map((s) => (s.length > 0 ? s.time(s.length - 1) : 0)));
  }

  /** Ends the live view. */
  close(): void {
    clearInterval(this.alive);
    this.link.terminate();
    this.parts.playback.following = false;
    document.body.classList.remove("live");
    document.getElementById("live")!.hidden = true;
  }

  /** Shows the image of a past time, if it is still kept. */
  async seek(t: number): Promise<void> {
    const kept = this.images.filter((one) => one.t <= t + 1e-6).at(-1);
    if (!kept) { this.imageTime = this.images.length > 0 ? t : undefined; await this.parts.camera.show(undefined); }
    else { this.imageTime = kept.t; await this.parts.camera.show(compressedImageOf(kept.bytes)); }
    this.parts.drawCamera();
  }

  /** Draws tags from their first observation on, until a map replaces them. */
  private drawSeenTags(): void {
    const { content, world, rebuild } = this.parts;
    if (tagsOf(content).length > 0 || !this.seen.take(content, world.map_T_odom ?? identity)) return;
    content.seen = this.seen.tags();
    rebuild(false);
  }

  /** Call before each screen frame. */
  tick(now: number): void {
    if (!this.dirty) return;
    this.dirty = false;
    const { content, playback, world, plots, bar } = this.parts;
    const { tracks } = content;
    playback.duration = this.newest();
    if (playback.following) playback.t = playback.duration;
    if (now - this.rebuilt > 1000) {
      this.rebuilt = now;
      world.rebuildTracks(content, this.parts.colour);
      if (!this.framed && tracks.odometry.length > 1) { this.framed = true; this.parts.rebuild(true); }
      const streams = [tracks.truth, tracks.odometry, tracks.estimate].filter((one) => one.length > 0).length;
      this.drawSeenTags();
      if (streams !== this.streams) { this.streams = streams; this.parts.rebuild(false); } // the legend lists them
      this.parts.refit();
      plots.refresh(figuresOf(scoresOf(tracks, content.route, world.map_T_odom ?? identity, 0.2)));
      bar.showMarks([...marksOf(tracks), ...this.phases].sort((a, b) => a.t - b.t));
    }
    this.parts.update();
  }
}
