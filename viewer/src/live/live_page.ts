import { goWords, placeInSession, sessionPhases, type Control, type RobotState } from "./frames";

const byId = <T extends HTMLElement>(id: string): T => document.getElementById(id) as T;
const signs = { unknown: "○", good: "●", uncertain: "◐", bad: "✖" } as const;
const drives: Readonly<Record<string, readonly [number, number]>> = { // fractions of speed and turn rate
  w: [1, 0], s: [-1, 0], a: [0, 1], d: [0, -1], ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, 1], ArrowRight: [0, -1],
};
const turnRate = 0.8; // [rad/s]

/** Panel of a running robot: phase, buttons, lights, and driving keys while teaching. */
export class LivePage {
  private state: RobotState | undefined;
  private control: Control | undefined;
  private readonly held = new Set<string>();
  private driving: ReturnType<typeof setInterval> | undefined;

  constructor(private readonly send: (message: object) => void) {
    byId("live").hidden = false;
    document.body.classList.add("live");
    byId("session").replaceChildren(...sessionPhases.map((phase) => {
      const item = document.createElement("li");
      item.textContent = phase;
      return item;
    }));
    byId("go").addEventListener("click", () => this.order("go"));
    byId("stop").addEventListener("click", () => this.order("stop"));
    byId("script").addEventListener("click", () => this.order("script"));
    byId("teach").addEventListener("click", () => this.order("teach"));
    byId("control").addEventListener("click", () => this.send({ op: this.control?.yours ? "release" : "take" }));
    // Registered first, so that a key that stops the robot does not press a button as well.
    window.addEventListener("keydown", (event) => this.key(event, true), true);
    window.addEventListener("keyup", (event) => this.key(event, false), true);
    window.addEventListener("blur", () => this.releaseKeys());
    for (const button of byId("pad").querySelectorAll("button")) {
      const key = button.dataset["key"]!;
      button.addEventListener("pointerdown", () => this.press(key));
      for (const end of ["pointerup", "pointerleave", "pointercancel"]) button.addEventListener(end, () => this.release(key));
    }
  }

  show(state: RobotState): void {
    this.state = state;
    if (!this.teaches) this.releaseKeys();
    this.draw();
  }
  showControl(control: Control): void {
    this.control = control;
    this.draw();
  }
  lost(): void {
    this.releaseKeys();
    byId("phase").textContent = "Connection lost; reconnecting …";
  }

  private order(order: string): void {
    this.send({ op: "order", order });
  }
  private get moves(): boolean {
    return this.state !== undefined && ["teaching", "replaying", "paused"].includes(this.state.phase);
  }
  private get teaches(): boolean {
    return this.state?.phase === "teaching" && this.state.page_drives && this.control?.may === true;
  }

  /** Control is held by this viewer, or free to take. */
  private get mine(): boolean {
    return this.control?.may === true && (this.control.yours || !this.control.held);
  }

  private key(event: KeyboardEvent, down: boolean): void {
    const target = event.target as HTMLElement;
    if (target.closest?.("input[type=text], textarea") || event.ctrlKey || event.metaKey || event.altKey) return;
    const mine = (event.key === " " && this.moves) || (this.teaches && event.key in drives && !target.closest?.("select"));
    if (!mine) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (event.key === " ") { if (down && !event.repeat) this.stopRobot(); }
    else if (down) this.press(event.key);
    else this.release(event.key);
  }

  /** Stops the robot: a lap continues when its keys are pressed again, a replay ends. */
  private stopRobot(): void {
    this.releaseKeys();
    if (this.teaches && this.mine) this.send({ op: "drive", speed_m_s: 0, yaw_rate_rad_s: 0 });
    else this.order("stop");
  }
  private press(key: string): void {
    this.held.add(key);
    this.drive();
    this.driving ??= setInterval(() => this.drive(), 100);
  }
  private release(key: string): void {
    if (!this.held.delete(key)) return;
    this.drive();
    if (this.held.size === 0) this.releaseKeys();
  }
  private releaseKeys(): void {
    const drove = this.driving !== undefined;
    clearInterval(this.driving);
    this.driving = undefined;
    this.held.clear();
    if (drove) this.drive();
  }
  private drive(): void {
    let speed = 0, turn = 0;
    for (const key of this.held) { speed += drives[key]?.[0] ?? 0; turn += drives[key]?.[1] ?? 0; }
    const speedLimit = Number(byId<HTMLSelectElement>("drivespeed").value);
    this.send({ op: "drive", speed_m_s: Math.sign(speed) * speedLimit, yaw_rate_rad_s: Math.sign(turn) * turnRate });
  }

  private draw(): void {
    const { state, control } = this;
    if (!state || !control) return;
    const may = this.mine;
    document.body.dataset["phase"] = state.phase;
    setText("phase", [state.phase, state.halted || state.reason].filter(Boolean).join(": ") +
      (state.goal_m > 0 && state.phase !== "idle" ? `; ${state.driven_m.toFixed(1)} of ${state.goal_m.toFixed(1)} m` : ""));
    byId("session").hidden = state.phase === "localizing"; // no session
    [...byId("session").children].forEach((item, i) => i === placeInSession(state.phase) ? item.setAttribute("aria-current", "step") : item.removeAttribute("aria-current"));
    const button = (id: string, order: string, words: string): void => {
      const element = byId<HTMLButtonElement>(id);
      const stops = order === "stop"; // available to every viewer
      element.hidden = (!control.may && !stops) || (order !== "go" && !stops && !state.commands.includes(order));
      element.disabled = (!may && !stops) || !state.commands.includes(order);
      if (element.textContent !== words) element.textContent = words;
    };
    button("go", "go", goWords[state.phase] ?? "Go");
    button("stop", "stop", state.phase === "teaching" ? "Discard the lap" : state.phase === "localizing" ? "End (the robot keeps driving)" : "Stop (space)");
    button("script", "script", "Let the script drive");
    button("teach", "teach", "Teach another lap");
    byId("pad").hidden = !this.teaches || !may;
    const take = byId<HTMLButtonElement>("control");
    take.hidden = !control.may;
    take.disabled = !may;
    setText("control", control.yours ? "Release control" : "Take control");
    setText("viewers", (control.yours ? "You hold control" : !control.may ? "You are watching and may stop the robot. To command it, open the address with the token" :
      control.held ? "Another viewer holds control" : "No viewer holds control") + `; ${control.viewers} ${control.viewers === 1 ? "viewer" : "viewers"}` +
      (control.dropped > 0 ? `; ${control.dropped} frames dropped because this browser is too slow` : ""));
    byId("lights").replaceChildren(...state.lights.map((light) => {
      const item = document.createElement("li");
      item.className = light.level;
      item.textContent = `${signs[light.level]} ${light.name}: ${light.message}`;
      return item;
    }));
  }
}

function setText(id: string, words: string): void {
  if (byId(id).textContent !== words) byId(id).textContent = words; // screen readers announce changes only
}
