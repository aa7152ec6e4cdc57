import { GuidePanel, type GuideStatus } from "./guide_panel";

/** State of a live camera that is shown without a robot (docs/formats/live.md, camera.json). */
export interface CameraStatus {
  readonly camera: string;
  readonly rate_hz?: number;
  readonly age_ms?: number;
  readonly dropped?: number;
  readonly lost?: number;
  readonly damaged?: number;
  readonly recording?: string;
  readonly message?: string;
  readonly tags?: readonly CameraTag[];
  readonly controls?: readonly CameraControl[];
  readonly guide?: GuideStatus;
}
export interface CameraControl {
  readonly name: string;
  readonly value: number;
  readonly min: number;
  readonly max: number;
  readonly step: number;
  readonly automatic: boolean;
  readonly writable: boolean;
}
export interface CameraTag {
  readonly tag: string;
  readonly pose?: { readonly cam_t_tag_m: readonly number[]; readonly sigma_t_m?: readonly number[]; readonly ambiguity_ratio: number };
}

const shownControls = ["exposure_ms", "gain", "focus", "white_balance_k"];
const steps = 1000; // steps of a slider

/** The position of a value on its slider, 0 to 1; exposures are logarithmic. */
export const placeOf = ({ name, min, max }: CameraControl, value: number): number =>
  name === "exposure_ms" && min > 0 ? Math.log(value / min) / Math.log(max / min) : (value - min) / (max - min);
/** The value at a slider position, rounded to the control's steps. */
export function valueAt(control: CameraControl, place: number): number {
  const { name, min, max, step } = control;
  const value = name === "exposure_ms" && min > 0 ? min * (max / min) ** place : min + place * (max - min);
  return Math.min(max, Math.max(min, Number((min + Math.round((value - min) / step) * step).toFixed(6))));
}

export function factsOf(status: CameraStatus): string {
  const parts = [status.camera];
  if (status.rate_hz) parts.push(`${status.rate_hz.toFixed(1)} Hz`);
  if (status.age_ms !== undefined) parts.push(`tags ${status.age_ms.toFixed(0)} ms after the exposure`);
  const counts = ([["dropped", status.dropped], ["lost by the driver", status.lost], ["damaged", status.damaged]] as const).filter(([, count]) => count);
  return [...parts, ...counts.map(([name, count]) => `${count} ${name}`)].join("; ");
}

/** Text of a tag's row: distance and standard deviations. */
export function rowOf({ tag, pose }: CameraTag): string[] {
  if (!pose) return [tag, "", "", ""];
  const sigma = pose.sigma_t_m?.map((s) => (1000 * s).toFixed(1)).join(", ") ?? "";
  return [tag, Math.hypot(...pose.cam_t_tag_m).toFixed(3), pose.cam_t_tag_m.map((x) => x.toFixed(3)).join(", "), sigma];
}

const byId = <T extends HTMLElement>(id: string): T => document.getElementById(id) as T;

/** Rate, latency, tags and controls of a camera, next to its image. */
export class CameraPanel {
  private readonly sliders = new Map<string, HTMLInputElement>();
  private controls = new Map<string, CameraControl>();
  private readonly guide = new GuidePanel();
  private may = false;

  constructor(private readonly send: (message: object) => void) {
    byId("snapshot").addEventListener("click", () => this.order({ do: "snapshot" }));
    byId("record").addEventListener("click", () => this.order({ do: "record" }));
  }

  allow(may: boolean): void {
    this.may = may;
    for (const id of ["snapshot", "record"]) byId<HTMLButtonElement>(id).disabled = !may;
    for (const [name, slider] of this.sliders) slider.disabled = !may || this.controls.get(name)?.writable === false;
  }

  show(status: CameraStatus): void {
    document.body.classList.add("device");
    byId("device").hidden = false;
    byId("devicefacts").textContent = factsOf(status);
    if (byId("devicemessage").textContent !== (status.message ?? "")) byId("devicemessage").textContent = status.message ?? "";
    const record = byId("record");
    record.setAttribute("aria-pressed", String(Boolean(status.recording)));
    record.textContent = status.recording ? "End the recording" : "Record";
    for (const control of status.controls ?? []) if (shownControls.includes(control.name)) this.showControl(control);
    if (status.guide) this.guide.show(status.guide);
    const posed = (status.tags ?? []).some((tag) => tag.pose);
    byId("devicetags").hidden = !posed;
    if (posed) byId("devicerows").replaceChildren(...status.tags!.map((tag) => row(rowOf(tag))));
  }

  private order(what: object): void {
    this.send({ op: "camera", ...what });
  }

  private showControl(control: CameraControl): void {
    this.controls.set(control.name, control);
    const slider = this.sliders.get(control.name) ?? this.addSlider(control.name);
    if (document.activeElement !== slider) slider.value = String(Math.round(steps * placeOf(control, control.value)));
    const words = `${Number(control.value.toPrecision(6))}${control.automatic ? " (automatic)" : ""}`;
    slider.setAttribute("aria-valuetext", words);
    slider.nextElementSibling!.textContent = words;
  }

  private addSlider(name: string): HTMLInputElement {
    const label = document.createElement("label"), slider = document.createElement("input"), value = document.createElement("output");
    label.textContent = name;
    Object.assign(slider, { type: "range", min: "0", max: String(steps), step: "1", name, disabled: !this.may });
    slider.addEventListener("change", () => {
      const control = this.controls.get(name);
      if (control) this.order({ do: "set", control: name, value: valueAt(control, Number(slider.value) / steps) });
      slider.blur(); // show the value that the camera set
    });
    label.append(slider, value);
    byId("controls").append(label);
    this.sliders.set(name, slider);
    return slider;
  }
}

function row(cells: readonly string[]): HTMLElement {
  const line = document.createElement("tr");
  line.append(...cells.map((words, i) => {
    const cell = document.createElement(i === 0 ? "th" : "td");
    if (i === 0) cell.setAttribute("scope", "row");
    cell.textContent = words;
    return cell;
  }));
  return line;
}
