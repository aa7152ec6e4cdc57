// @ts-check
// Tags in a dropped image: the browser decodes it, this script converts it to grey like the program, waymark.js finds the tags.
"use strict";

/** @typedef {{tag: string, hamming: number, refinement: string, sigma_px: number, corners_px: [number, number][]}} Tag */
/** @typedef {{error?: string, width: number, height: number, detect_ms: number, refine_ms: number, tags: Tag[]}} Answer */

const FAMILIES = ["tag36h11", "tag16h5", "tag25h9", "tag36h10", "tagCircle21h7", "tagStandard41h12"];
const element = (/** @type {string} */ id) => /** @type {HTMLElement} */ (document.getElementById(id));
const canvas = /** @type {HTMLCanvasElement} */ (element("image"));
const family = /** @type {HTMLSelectElement} */ (element("family"));
const showStatus = (/** @type {string} */ text) => { element("status").textContent = text; };
/** @type {CanvasImageSource & {width: number, height: number} | undefined} */
let shown;
/** @type {WaymarkModule | undefined} */
let waymark;

/** Grey bytes (Rec. 601, rounded) of an image in the script's memory; false where it is too large for the detector. */
function putGrey(/** @type {WaymarkModule} */ module, /** @type {Uint8ClampedArray} */ rgba, /** @type {number} */ width, /** @type {number} */ height) {
  const at = module.ccall("waymark_pixels", "number", ["number", "number"], [width, height]);
  if (!at) return false;
  const grey = module.HEAPU8.subarray(at, at + width * height);
  for (let i = 0, j = 0; i < grey.length; ++i, j += 4) grey[i] = Math.floor((299 * rgba[j] + 587 * rgba[j + 1] + 114 * rgba[j + 2] + 500) / 1000);
  return true;
}

function drawTag(/** @type {CanvasRenderingContext2D} */ context, /** @type {Tag} */ tag) {
  const width = Math.max(1.5, canvas.width / 400), corners = tag.corners_px;
  context.lineWidth = width;
  context.strokeStyle = "#e69f00";
  context.beginPath();
  corners.forEach(([x, y], i) => (i === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
  context.closePath();
  context.stroke();
  context.fillStyle = "#d55e00";
  context.beginPath();
  context.arc(corners[0][0], corners[0][1], 2 * width, 0, 2 * Math.PI);
  context.fill();
  const x = corners.reduce((sum, p) => sum + p[0], 0) / 4, y = corners.reduce((sum, p) => sum + p[1], 0) / 4;
  context.font = `bold ${Math.round(canvas.width / 36)}px system-ui, sans-serif`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.lineWidth = canvas.width / 160;
  context.strokeStyle = "#000";
  context.strokeText(tag.tag.split(":")[1], x, y);
  context.fillStyle = "#fff";
  context.fillText(tag.tag.split(":")[1], x, y);
}

function fillTable(/** @type {Tag[]} */ tags) {
  element("table").hidden = tags.length === 0;
  element("rows").replaceChildren(...tags.map((tag) => {
    const row = document.createElement("tr");
    const corners = tag.corners_px.map(([x, y]) => `${x.toFixed(2)}, ${y.toFixed(2)}`);
    for (const text of [tag.tag, ...corners, tag.sigma_px.toFixed(3), String(tag.hamming), tag.refinement]) row.insertCell().textContent = text;
    return row;
  }));
}

function detect() {
  if (!waymark || !shown) return;
  const { width, height } = shown;
  Object.assign(canvas, { width, height });
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: true }));
  context.fillStyle = "#fff"; // below transparent pixels, as in the program
  context.fillRect(0, 0, width, height);
  context.drawImage(shown, 0, 0);
  element("json").textContent = "";
  fillTable([]);
  if (!putGrey(waymark, context.getImageData(0, 0, width, height).data, width, height)) return showStatus(`${width} x ${height} px is too large.`);
  /** @type {Answer} */
  const answer = { width, height, ...JSON.parse(waymark.ccall("waymark_detect", "string", ["number", "number", "string"], [width, height, family.value])) };
  if (answer.error) return showStatus(answer.error);
  for (const tag of answer.tags) drawTag(context, tag);
  fillTable(answer.tags);
  element("json").textContent = JSON.stringify(answer, null, 1);
  const count = answer.tags.length === 1 ? "1 tag" : `${answer.tags.length || "no"} tags`;
  showStatus(`${width} x ${height} px: ${count} of ${family.value}. Detection ${answer.detect_ms.toFixed(1)} ms, refinement of the corners ${answer.refine_ms.toFixed(1)} ms.`);
}

async function openImage(/** @type {Blob | undefined} */ file) {
  if (!file) return;
  try {
    shown = await createImageBitmap(file, { colorSpaceConversion: "none" });
  } catch {
    return showStatus("The browser cannot read this file as an image.");
  }
  detect();
}

/** Three tags of the chosen family, one of them sheared: what an image needs is black on white with a white margin. */
function drawExample() {
  if (!waymark) return;
  const example = document.createElement("canvas");
  Object.assign(example, { width: 640, height: 360 });
  const context = /** @type {CanvasRenderingContext2D} */ (example.getContext("2d"));
  context.fillStyle = "#d8d8d0";
  context.fillRect(0, 0, 640, 360);
  const places = [[1, 0.12, -0.1, 1, 60, 80], [0.9, -0.25, 0.3, 1.1, 260, 110], [0.5, 0.1, 0, 0.8, 480, 70]];
  places.forEach(([a, b, c, d, e, f], number) => {
    /** @type {{width: number, cells: number[]}} */
    const tag = JSON.parse(/** @type {WaymarkModule} */ (waymark).ccall("waymark_tag", "string", ["string", "number"], [family.value, number]));
    const side = 150 / tag.width;
    context.setTransform(a, b, c, d, e, f);
    tag.cells.forEach((grey, i) => {
      if (grey === 128) return; // outside the tag
      context.fillStyle = grey === 0 ? "#181818" : "#f4f4f0";
      context.fillRect((i % tag.width) * side, Math.floor(i / tag.width) * side, side + 0.6, side + 0.6);
    });
  });
  shown = example;
  detect();
}

family.replaceChildren(...FAMILIES.map((name) => new Option(name, name)));
family.addEventListener("change", detect);
element("example").addEventListener("click", drawExample);
element("file").addEventListener("change", (event) => openImage(/** @type {HTMLInputElement} */ (event.target).files?.[0]));
for (const kind of ["dragenter", "dragover"]) addEventListener(kind, (event) => { event.preventDefault(); document.body.classList.add("dropping"); });
addEventListener("dragleave", () => document.body.classList.remove("dropping"));
addEventListener("drop", (event) => {
  event.preventDefault();
  document.body.classList.remove("dropping");
  openImage(event.dataTransfer?.files[0]);
});
loadWaymark().then((module) => { waymark = module; showStatus("Drop an image, or draw an example."); detect(); },
  (error) => showStatus(`This browser does not run WebAssembly: ${error}`));
