import { clockText, type Playback } from "../data/playback";
import type { Mark } from "../data/scores";

const signs = { start: "◆", stop: "■", go: "▶", blind: "○" } as const;
const byId = <T extends HTMLElement>(id: string): T => document.getElementById(id) as T;

/** Play, step, scrub, speed and the marks; handles the keys of the whole page. */
export class TimelineBar {
  private readonly range = byId<HTMLInputElement>("time");
  private readonly play = byId<HTMLButtonElement>("play");

  constructor(private readonly playback: Playback, private readonly frames: () => ArrayLike<number>, private readonly moved: () => void) {
    this.range.addEventListener("input", () => this.seek(Number(this.range.value)));
    this.play.addEventListener("click", () => this.toggle());
    byId("newest").addEventListener("click", () => { playback.following = true; playback.playing = false; moved(); });
    byId("back").addEventListener("click", () => this.step(-1));
    byId("forth").addEventListener("click", () => this.step(1));
    byId<HTMLSelectElement>("speed").addEventListener("change", (event) => (playback.speed = Number((event.target as HTMLSelectElement).value)));
    document.addEventListener("keydown", (event) => this.key(event));
  }

  seek(t: number): void {
    this.playback.seek(t);
    this.moved();
  }
  private toggle(): void {
    this.playback.toggle();
    this.moved();
  }
  private step(direction: 1 | -1): void {
    this.playback.step(this.frames(), direction);
    this.moved();
  }

  /** Space plays; arrows step, with Shift by five seconds. Ignored if the focused element uses the key. */
  private key(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    const own = target.closest("input, select, button, textarea, summary") !== null && target !== this.range;
    if (event.ctrlKey || event.metaKey || event.altKey || own) return;
    const actions: Record<string, () => void> = {
      " ": () => this.toggle(),
      ArrowLeft: () => (event.shiftKey ? this.seek(this.playback.t - 5) : this.step(-1)),
      ArrowRight: () => (event.shiftKey ? this.seek(this.playback.t + 5) : this.step(1)),
      Home: () => this.seek(0),
      End: () => this.seek(this.playback.duration),
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  update(): void {
    const { t, duration } = this.playback, playing = this.playback.playing || this.playback.following;
    byId("newest").toggleAttribute("disabled", this.playback.following);
    this.range.max = String(duration);
    this.range.value = String(t);
    this.range.setAttribute("aria-valuetext", `${clockText(t)} of ${clockText(duration)}`);
    this.play.textContent = playing ? "❚❚" : "▶";
    this.play.setAttribute("aria-label", playing ? "Pause" : "Play");
    byId("clock").textContent = clockText(t);
  }

  /** Shows at most a hundred marks; more would merge into a stripe. */
  showMarks(marks: readonly Mark[]): void {
    const items = marks.slice(0, 100).map((mark) => {
      const item = document.createElement("li");
      item.style.left = `${(100 * mark.t) / Math.max(this.playback.duration, 1e-9)}%`;
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = signs[mark.kind];
      button.title = `${clockText(mark.t)} ${mark.words}`;
      button.setAttribute("aria-label", button.title);
      button.addEventListener("click", () => this.seek(mark.t));
      item.append(button);
      return item;
    });
    byId("marks").replaceChildren(...items);
    byId("marks").hidden = items.length === 0;
  }
}
