import type { Playback } from "../data/playback";
import { figuresOf, type Plots } from "../view/plots";
import { marksOf, scoresOf, type Mark } from "../data/scores";
import { compressedPictureOf, type Picture } from "../data/pictures";
import { identity } from "../math/pose";
import { takeText, type Content } from "../session";
import type { CameraView } from "../view/camera_view";
import type { TimelineBar } from "../view/timeline_bar";
import type { WorldView } from "../view/world_view";
import { LiveLink } from "./live_link";
import { LivePage } from "./live_page";

export interface LiveParts {
  readonly content: Content;
  readonly playback: Playback;
  readonly world: WorldView;
  readonly camera: CameraView;
  readonly plots: Plots;
  readonly bar: TimelineBar;
  say(words: string, bad?: boolean): void;
  rebuild(reframe: boolean): void;
  update(): void;
  drawCamera(): void;
  colour(name: string): string;
}

const keptPictures = 300; // ten seconds, to look back
const phaseWords: Readonly<Record<string, string>> = {
  teaching: "a lap is taught", mapping: "the map is made", ready: "there is a map", replaying: "replay", paused: "paused", done: "done", stopped: "stopped",
};

/** The page of a robot that runs: what comes in is shown as soon as it is there, and kept to look back. */
export class LiveMode {
  private readonly link: LiveLink;
  private readonly page: LivePage;
  private readonly pictures: { t: number; picture: Picture }[] = [];
  private waiting: { t: number; hostTime: bigint; bitmap: ImageBitmap } | undefined; // for its tags
  private readonly phases: Mark[] = [];
  private phase = "";
  private dirty = false;
  private rebuilt = 0;
  private framed = false;
  /** When the picture that is shown was taken; nothing where there are none. */
  pictureTime: number | undefined;

  constructor(private readonly parts: LiveParts) {
    const { content, playback } = parts;
    playback.following = true;
    this.page = new LivePage((message) => this.link.say(message));
    this.link = new LiveLink(content.tracks, {
      opened: (name) => { parts.say(`${name}: live`); document.body.dataset["ready"] = "true"; },
      closed: () => { parts.say("The robot's program does not answer.", true); this.page.lost(); },
      said: (words) => parts.say(words, true),
      rows: () => { this.dirty = true; this.showWaiting(); },
      camera: (camera, base_T_cam) => {
        content.info = { name: "live", duration: 0, messages: 0, topics: [], metadata: {}, texts: {}, hasPictures: false,
                         ...(camera ? { camera } : {}), ...(base_T_cam ? { base_T_cam } : {}) };
        this.rebuilt = 0;
      },
      picture: (t, hostTime, picture) => void this.take(t, hostTime, picture),
      state: (state) => {
        this.page.show(state);
        if (state.phase === this.phase) return;
        this.phase = state.phase;
        const words = phaseWords[state.phase];
        if (words) this.phases.push({ t: playback.duration, kind: state.phase === "replaying" ? "go" : state.phase === "teaching" ? "start" : "stop", words });
      },
      control: (control) => this.page.showControl(control),
      text: (name, text) => {
        const wrong = takeText(content, name, text);
        if (wrong) parts.say(wrong, true);
        parts.rebuild(true);
      },
    });
    content.families = this.link.families.names;
    this.link.connect();
  }

  private async take(t: number, hostTime: bigint, picture: Picture): Promise<void> {
    this.pictures.push({ t, picture });
    if (this.pictures.length > keptPictures) this.pictures.shift();
    if (picture.kind !== "file" || !this.parts.playback.following) return;
    const bitmap = await createImageBitmap(new Blob([picture.bytes], { type: picture.mime }));
    this.waiting?.bitmap.close();
    this.waiting = { t, hostTime, bitmap };
    this.showWaiting();
  }

  /** The picture goes on the screen when its tags are known, so that both belong together. */
  private showWaiting(): void {
    const { waiting } = this;
    const { tracks } = this.parts.content;
    const newest = tracks.tags.length > 0 ? tracks.tags.time(tracks.tags.length - 1) : -Infinity;
    if (!waiting || newest < waiting.t - 1e-6 || !this.parts.playback.following) return;
    this.waiting = undefined;
    this.pictureTime = waiting.t;
    this.parts.camera.showBitmap(waiting.bitmap);
    this.parts.drawCamera();
    const age = performance.timeOrigin + performance.now() - Number(waiting.hostTime) * 1e-6;
    const last = tracks.latency.length > 0 ? tracks.latency.time(tracks.latency.length - 1) : -Infinity;
    if (waiting.t >= last) tracks.latency.push(waiting.t, age);
  }

  /** Something else is looked at from now on. */
  close(): void {
    this.link.close();
    this.parts.playback.following = false;
    document.body.classList.remove("live");
    document.getElementById("live")!.hidden = true;
  }

  /** Looking back: the picture of that time, if it is kept. */
  async seek(t: number): Promise<void> {
    const kept = this.pictures.filter((one) => one.t <= t + 1e-6).at(-1);
    if (!kept) { this.pictureTime = this.pictures.length > 0 ? t : undefined; await this.parts.camera.show(undefined); }
    else { this.pictureTime = kept.t; await this.parts.camera.show(kept.picture.kind === "file" ? compressedPictureOf(kept.picture.bytes) : kept.picture); }
    this.parts.drawCamera();
  }

  /** Before each frame of the screen. */
  tick(now: number): void {
    if (!this.dirty) return;
    this.dirty = false;
    const { content, playback, world, plots, bar } = this.parts;
    const { tracks } = content;
    const ends = [tracks.odometry, tracks.tags, tracks.estimate, tracks.truth].map((s) => (s.length > 0 ? s.time(s.length - 1) : 0));
    playback.duration = Math.max(...ends);
    if (playback.following) playback.t = playback.duration;
    if (now - this.rebuilt > 1000) {
      this.rebuilt = now;
      world.rebuildTracks(content, this.parts.colour);
      if (!this.framed && tracks.odometry.length > 1) { this.framed = true; this.parts.rebuild(true); }
      plots.refresh(figuresOf(scoresOf(tracks, content.route, world.map_T_odom ?? identity, 0.2)));
      bar.showMarks([...marksOf(tracks), ...this.phases].sort((a, b) => a.t - b.t));
    }
    this.parts.update();
  }
}
