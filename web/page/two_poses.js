// @ts-check
// Both poses that explain the corners of one tag, for the tilt and the distance of two sliders.
"use strict";

/** @typedef {[number, number]} Point */
/** @typedef {{tilt_deg: number, rms_px: number, chi2: number, cam_t_tag_m: number[], cam_z_tag: number[], corners_px: Point[]}} Solution */
/** @typedef {{error?: string, observed_px: Point[], exact_px: Point[], solutions: Solution[], ambiguity_ratio: number, likelihood_ratio: number, draws: number, wrong_draws: number}} Answer */

const element = (/** @type {string} */ id) => /** @type {HTMLElement} */ (document.getElementById(id));
const slider = (/** @type {string} */ id) => Number(/** @type {HTMLInputElement} */ (element(id)).value);
const NAMES = ["fits better", "other"], DASHES = [[], [10, 6]];
let seed = 1;
/** @type {WaymarkModule | undefined} */
let waymark;

function colours() {
  const style = getComputedStyle(document.documentElement);
  return { poses: [style.getPropertyValue("--first"), style.getPropertyValue("--second")], truth: style.getPropertyValue("--truth") };
}

/** A cleared canvas. */
function begin(/** @type {string} */ id) {
  const canvas = /** @type {HTMLCanvasElement} */ (element(id)), context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.clearRect(0, 0, canvas.width, canvas.height);
  return context;
}

function stroke(/** @type {CanvasRenderingContext2D} */ context, /** @type {string} */ colour, /** @type {number[]} */ dash, /** @type {number} */ width, /** @type {Point[]} */ points, closed = false) {
  context.strokeStyle = colour;
  context.setLineDash(dash);
  context.lineWidth = width;
  context.beginPath();
  points.forEach(([x, y], i) => (i === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
  if (closed) context.closePath();
  context.stroke();
}

/** Observed corners, and from each a line towards where a pose has it, magnified so that the longest is 70 px. */
function drawCorners(/** @type {Answer} */ answer) {
  const context = begin("corners"), { poses, truth } = colours(), all = answer.exact_px;
  const side = Math.max(...[0, 1].map((k) => Math.max(...all.map((p) => p[k])) - Math.min(...all.map((p) => p[k]))));
  const scale = 280 / side, middle = [0, 1].map((k) => all.reduce((sum, p) => sum + p[k], 0) / 4);
  const place = (/** @type {Point} */ p) => /** @type {Point} */ ([320 + (p[0] - middle[0]) * scale, 240 + (p[1] - middle[1]) * scale]);
  const errors = answer.solutions.flatMap((s) => s.corners_px.map((p, i) => Math.hypot(p[0] - answer.observed_px[i][0], p[1] - answer.observed_px[i][1])));
  const magnified = 70 / Math.max(1e-9, ...errors);
  stroke(context, truth, [], 1, answer.observed_px.map(place), true);
  answer.solutions.forEach((solution, k) => solution.corners_px.forEach((p, i) => {
    const observed = answer.observed_px[i], from = place(observed);
    stroke(context, poses[k], DASHES[k], 3, [from, [from[0] + (p[0] - observed[0]) * magnified, from[1] + (p[1] - observed[1]) * magnified]]);
  }));
  context.fillStyle = truth;
  for (const p of answer.observed_px) context.fillRect(place(p)[0] - 4, place(p)[1] - 4, 8, 8);
  element("cornerscaption").textContent = `In the image: a tag of ${side.toFixed(0)} px. Squares: the observed corners. Lines: the reprojection errors of both poses, ` +
    `${magnified.toFixed(0)} canvas pixels per image pixel.`;
}

function drawAbove(/** @type {Answer} */ answer) {
  const context = begin("above"), { poses, truth } = colours();
  const furthest = Math.max(slider("distance"), ...answer.solutions.map((s) => s.cam_t_tag_m[2]));
  const scale = 300 / furthest, tilt = slider("tilt") * Math.PI / 180;
  stroke(context, truth, [], 2, [[170, 200], [320, 450], [470, 200]]);
  const tag = (/** @type {number[]} */ t, /** @type {number[]} */ z, /** @type {string} */ colour, /** @type {number[]} */ dash, /** @type {number} */ width) => {
    const at = [320 + t[0] * scale, 450 - t[2] * scale];
    stroke(context, colour, dash, width, [[at[0] - 60 * z[2], at[1] - 60 * z[0]], [at[0] + 60 * z[2], at[1] + 60 * z[0]]]);
    stroke(context, colour, dash, Math.min(width, 2), [[at[0], at[1]], [at[0] - 50 * z[0], at[1] + 50 * z[2]]]); // direction in which the tag faces
  };
  tag([0, 0, slider("distance")], [Math.sin(tilt), 0, Math.cos(tilt)], truth, [], 10);
  answer.solutions.forEach((s, k) => tag(s.cam_t_tag_m, s.cam_z_tag, poses[k], DASHES[k], 4));
}

function showVerdict(/** @type {Answer} */ answer) {
  element("rows").replaceChildren(...answer.solutions.map((s, k) => {
    const row = document.createElement("tr");
    const dashes = k === 0 ? "red, solid" : "blue, dashed";
    for (const text of [`${NAMES[k]} (${dashes})`, `${s.tilt_deg.toFixed(1)}°`, `${s.cam_t_tag_m[2].toFixed(3)} m`, `${s.rms_px.toFixed(3)} px`, s.chi2.toFixed(2)]) row.insertCell().textContent = text;
    return row;
  }));
  const other = answer.solutions.length < 2 ? "There is only one pose: both starting points converge to it. " : `The ratio of the errors is 1 to ${(1 / answer.ambiguity_ratio).toFixed(2)}. `;
  const share = `In ${answer.wrong_draws} of ${answer.draws} draws of the noise the better-fitting pose is tilted in the wrong direction.`;
  element("verdict").textContent = other + (slider("tilt") === 0 ? "" : share);
}

function solve() {
  element("tilttext").textContent = `${slider("tilt")}°`;
  element("distancetext").textContent = `${slider("distance").toFixed(2)} m`;
  if (!waymark) return;
  /** @type {Answer} */
  const answer = JSON.parse(waymark.ccall("waymark_two_poses", "string", ["number", "number", "number"], [slider("tilt"), slider("distance"), seed]));
  element("json").textContent = answer.error ? "" : JSON.stringify(answer, null, 1);
  element("status").textContent = answer.error ?? `Noise number ${seed}.`;
  if (answer.error) return;
  drawCorners(answer);
  drawAbove(answer);
  showVerdict(answer);
}

for (const id of ["tilt", "distance"]) element(id).addEventListener("input", solve);
element("noise").addEventListener("click", () => { ++seed; solve(); });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", solve);
loadWaymark().then((module) => { waymark = module; solve(); }, (error) => { element("status").textContent = `This browser does not run WebAssembly: ${error}`; });
solve();
