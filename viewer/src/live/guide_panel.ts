/** Progress of a guided calibration (docs/formats/live.md, camera.json). */
export interface GuideStatus {
  readonly image: string;
  readonly views: number;
  readonly views_wanted: number;
  readonly held_out_rms_px?: number;
  readonly focal_sigma_share?: number;
  readonly focal_sigma_share_wanted: number;
  readonly parts: readonly GuidePart[];
  readonly tilts: readonly GuideTilt[];
  readonly missing: readonly string[];
  readonly good_enough: boolean;
}
export interface GuidePart {
  readonly part: string;
  readonly corners: number;
  readonly corners_wanted: number;
  readonly corners_in_image: number;
}
export interface GuideTilt {
  readonly nearer_edge: string;
  readonly views: number;
  readonly views_wanted: number;
}

/** A part of the image or a tilt: text in addition to the colour, for viewers who cannot distinguish the colours. */
export interface Cell {
  readonly name: string;
  readonly words: string;
  readonly covered: boolean;
  readonly here: boolean; // the board is there now
}

const cell = (name: string, count: number, wanted: number, here: boolean): Cell =>
  ({ name, words: count >= wanted ? `✓ ${count}` : `${count} of ${wanted}`, covered: count >= wanted, here });

export const cellOfPart = (part: GuidePart): Cell => cell(part.part, part.corners, part.corners_wanted, part.corners_in_image > 0);
export const cellOfTilt = (tilt: GuideTilt): Cell => cell(`${tilt.nearer_edge} edge nearer`, tilt.views, tilt.views_wanted, false);

/** Rows of three, arranged as in the image. */
export const rowsOf = (parts: readonly GuidePart[]): Cell[][] =>
  [0, 3, 6].map((first) => parts.slice(first, first + 3).map(cellOfPart));

const percent = (share: number): string => `${Number((100 * share).toPrecision(2))} %`;

export function guideFacts(status: GuideStatus): string {
  const facts = [`${status.views} of ${status.views_wanted} views`];
  if (status.focal_sigma_share !== undefined)
    facts.push(`focal length ± ${percent(status.focal_sigma_share)}, ${percent(status.focal_sigma_share_wanted)} wanted`);
  if (status.held_out_rms_px !== undefined) facts.push(`held-out error ${status.held_out_rms_px.toFixed(2)} px`);
  facts.push(status.good_enough ? "good enough" : status.image);
  return facts.join("; ");
}

const byId = (id: string): HTMLElement => document.getElementById(id)!;

/** Shows which parts of the image and which tilts of the board are covered, and which are missing. */
export class GuidePanel {
  show(status: GuideStatus): void {
    document.body.classList.add("guided");
    byId("guide").hidden = false;
    byId("guidefacts").textContent = guideFacts(status);
    byId("guideparts").replaceChildren(...rowsOf(status.parts).map((cells) => {
      const row = document.createElement("tr");
      row.append(...cells.map((each) => element("td", each)));
      return row;
    }));
    byId("guidetilts").replaceChildren(...status.tilts.map((tilt) => element("li", cellOfTilt(tilt))));
  }
}

function element(kind: "td" | "li", { name, words, covered, here }: Cell): HTMLElement {
  const made = document.createElement(kind), label = document.createElement("span"), count = document.createElement("strong");
  made.className = `${covered ? "covered" : "missing"}${here ? " here" : ""}`;
  label.textContent = here ? `${name}, board here` : name;
  count.textContent = words;
  made.append(label, " ", count);
  return made;
}
