import "./style.css";
import { clockText, Playback } from "./data/playback";
import type { Answer } from "./data/protocol";
import { marksOf, poseBetween, scoresOf } from "./data/scores";
import { compose, identity } from "./math/pose";
import { drawnTagsOf, emptyContent, Reader, tagsOf, takeRows, takeText, type Offer } from "./session";
import { CameraView, quadsAt } from "./view/camera_view";
import { factsAt, warningAt } from "./view/facts";
import { MapView } from "./view/map_view";
import { figuresOf, Plots } from "./view/plots";
import { TimelineBar } from "./view/timeline_bar";
import { WorldView } from "./view/world_view";
import type { LiveMode } from "./live/live_mode";

const byId = <T extends HTMLElement>(id: string): T => document.getElementById(id) as T;
const colour = (name: string): string => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

const sessionRequest = fetch("session.json", { cache: "no-store" }).catch(() => undefined); // requested while the page is set up
const reader = new Reader(receive);
let content = emptyContent();
let offers: Offer[] = [];
let offered = false; // the server offers the open recording
let tagsByName = new Map(tagsOf(content).map((tag) => [`${tag.family}:${tag.id}`, tag]));
const playback = new Playback();
const map = new MapView(byId<HTMLCanvasElement>("map"));
const world = new WorldView(map);
const camera = new CameraView(byId<HTMLCanvasElement>("image"), byId("seen"));
const bar = new TimelineBar(playback, () => content.tracks.tags.column(0), update);
const plots = new Plots(byId("plots"), (t) => bar.seek(t));
let live: LiveMode | undefined;

function showStatus(words: string, bad = false): void {
  byId("status").textContent = words;
  byId("status").classList.toggle("bad", bad);
}

let imageShown = NaN; // recording: time of the last image shown
let shownPast = NaN; // running robot: past time that is shown

/** Updates everything that depends on the time. */
function update(): void {
  const { t } = playback;
  if (content.info?.hasImages) reader.image(t);
  else if (live && !playback.following && t !== shownPast) void live.seek((shownPast = t));
  world.moveTo(content, t);
  drawCamera();
  plots.at(t);
  bar.update();
  const poses = world.posesAt(content, t), robot = poses.get("estimate") ?? poses.get("truth") ?? poses.get("odometry");
  if (byId("follow").ariaPressed === "true" && robot) map.follow(robot.p[0], robot.p[1]);
  const quads = quadsAt(content.tracks, content.families, t), inView = quads.filter((quad) => !quad.unreliable).length;
  byId("facts").replaceChildren(...factsAt(content, poses, t, inView, quads.length - inView).map(([name, value]) => {
    const row = document.createElement("div"), term = document.createElement("dt"), words = document.createElement("dd");
    term.textContent = name;
    words.textContent = value;
    row.append(term, words);
    return row;
  }));
  byId("warning").textContent = warningAt(content, t, inView);
}

function drawCamera(): void {
  const { info } = content;
  const { tags, estimate, truth } = content.tracks;
  const t = live?.imageTime ?? playback.t;
  const frame = tags.indexAt(t); // the pose of the robot at the time of the image
  const base = frame >= 0 ? poseBetween(estimate.length > 0 ? estimate : truth, tags.time(frame)) : undefined;
  const map_T_cam = base && info?.base_T_cam ? compose(base, info.base_T_cam) : undefined;
  camera.draw(info?.camera, quadsAt(content.tracks, content.families, t), tagsByName, map_T_cam, live !== undefined || tags.length > 0);
}

/** Updates everything that changes only when a file is opened. */
function rebuild(reframe: boolean): void {
  tagsByName = new Map(tagsOf(content).map((tag) => [`${tag.family}:${tag.id}`, tag]));
  world.build(content, colour);
  if (reframe) map.frame();
  const { tracks } = content;
  if (!content.info && !live) playback.duration = Math.max(0, ...[tracks.truth, tracks.estimate].map((s) => (s.length > 0 ? s.time(s.length - 1) : 0)));
  if (content.complete) {
    plots.show(figuresOf(scoresOf(tracks, content.route, world.map_T_odom ?? identity)));
    bar.showMarks(marksOf(tracks));
  }
  const shown = [["truth", "truth", tracks.truth.length], ["odometry", "odometry, aligned at its start", tracks.odometry.length],
                 ["estimate", "estimate, with 3 sigma", tracks.estimate.length], ["route", "route", content.route ? 1 : 0],
                 ["other", `route ${[...content.otherRoutes.keys()].join(", ")}`, content.otherRoutes.size]] as const;
  byId("legend").replaceChildren(...shown.filter(([, , count]) => count > 0).map(([name, words]) => {
    const item = document.createElement("li");
    item.className = name;
    item.textContent = words;
    return item;
  }));
  showTagTable();
  byId("legend").hidden = byId("legend").children.length === 0;
  update();
}

/** Lists every mapped tag with its data in the map. */
function showTagTable(): void {
  const millimetres = (value: number | undefined): string => (value === undefined ? "" : (value * 1000).toFixed(1));
  byId("tags").hidden = content.tags.length === 0;
  byId("tagrows").replaceChildren(...content.tags.map((tag) => {
    const row = document.createElement("tr");
    const { p } = tag.map_T_tag;
    const cells = [`${tag.family}:${tag.id}`, ...p.map((v) => v.toFixed(3)), ...[0, 1, 2].map((i) => millimetres(tag.sigma?.[i])), String(tag.observations ?? "")];
    row.append(...cells.map((words, i) => {
      const cell = document.createElement(i === 0 ? "th" : "td");
      if (i === 0) cell.setAttribute("scope", "row");
      cell.textContent = words;
      return cell;
    }));
    return row;
  }));
}

function receive(answer: Answer): void {
  switch (answer.type) {
    case "failed": return showStatus(answer.words, true);
    case "image":
      void camera.show(answer.image).then(() => { drawCamera(); imageShown = answer.t; }).catch((error: unknown) => showStatus(String(error), true));
      return;
    case "opened": {
      const { info } = answer;
      content.info = info;
      for (const [name, text] of Object.entries(info.texts)) if (name !== "options.yaml") takeText(content, name, text);
      playback.duration = info.duration;
      showStatus(`${info.name}: ${clockText(info.duration)}, ${info.messages} messages; reading …`);
      rebuild(true);
      void addOfferedMap();
      return;
    }
    case "tracks": {
      const first = content.tracks.odometry.length === 0;
      takeRows(content, answer.rows);
      content.families = answer.families;
      content.complete = answer.complete;
      const { info } = content;
      if (info) showStatus(`${info.name}: ${clockText(info.duration)}, ${info.messages} messages${answer.complete ? "" : `; reading ${Math.round(100 * answer.progress)} %`}`);
      if (answer.complete || first) rebuild(true);
      if (answer.complete) document.body.dataset["ready"] = "true";
      return;
    }
  }
}

function openRecording(source: File | string): void {
  delete document.body.dataset["ready"];
  live?.close();
  live = undefined;
  content = emptyContent();
  offered = offers.some((offer) => offer.url === source);
  playback.playing = false;
  playback.seek(0);
  void camera.show(undefined);
  reader.open(source);
}

/** A recording replaces the open one; a map or a route is added to it. */
async function openFiles(files: readonly File[]): Promise<void> {
  for (const file of files) {
    if (!/\.(ya?ml|txt)$/.test(file.name)) { openRecording(file); continue; }
    const wrong = takeText(content, file.name, await file.text());
    showStatus(wrong ?? `${file.name} opened`, wrong !== undefined);
    rebuild(true);
  }
}

async function openOffered(): Promise<void> {
  const wanted = new URLSearchParams(location.search).get("recording");
  const answer = await sessionRequest;
  const session = answer?.ok ? ((await answer.json()) as { files: Offer[]; live: boolean }) : { files: [], live: false };
  offers = session.files;
  const recordings = offers.filter((offer) => offer.kind === "recording");
  const choice = byId<HTMLSelectElement>("choice");
  choice.replaceChildren(...recordings.map((offer) => new Option(offer.name, offer.url)));
  choice.parentElement!.hidden = recordings.length < 2;
  if (session.live && wanted === null) return startLive();
  if (wanted !== null) { choice.value = wanted; return openRecording(wanted); }
  if (recordings.length > 0) { choice.value = recordings[0]!.url; return openRecording(recordings[0]!.url); }
  await takeOfferedTexts();
  document.body.dataset["ready"] = "true";
}

/** Loaded only if there is a running robot. */
async function startLive(): Promise<void> {
  const { LiveMode } = await import("./live/live_mode");
  byId("choice").parentElement!.hidden = true;
  setFollow(true);
  live = new LiveMode({ content, playback, world, camera, plots, bar, showStatus, rebuild, refit: () => map.refit(), update, drawCamera, colour });
}

/** Adds the offered map to an offered recording without its own map. */
async function addOfferedMap(): Promise<void> {
  if (!offered) return;
  const { info } = content;
  const hasOwn = content.tags.length > 0 || content.route !== undefined;
  for (const offer of offers.filter((o) => (hasOwn ? /^route-.*\.yaml$/ : /^(map|route|route-.*)\.yaml$/).test(o.name))) {
    const text = await fetch(offer.url).then((answer) => (answer.ok ? answer.text() : ""));
    if (content.info !== info) return; // another recording was opened meanwhile
    takeText(content, offer.name, text);
    rebuild(true);
  }
}

async function takeOfferedTexts(): Promise<void> {
  let wrong: string | undefined;
  for (const offer of offers.filter((o) => o.kind === "text")) {
    const text = await fetch(offer.url).then((answer) => (answer.ok ? answer.text() : ""));
    wrong = takeText(content, offer.name, text) ?? wrong;
  }
  if (tagsOf(content).length > 0) showStatus(wrong ?? `Map with ${tagsOf(content).length} tags`, wrong !== undefined);
  else showStatus(wrong ?? "Open a recording with the button, or drop one here.", wrong !== undefined);
  rebuild(true);
}

const press = (id: string, pressed: boolean): void => byId(id).setAttribute("aria-pressed", String(pressed));

function setFollow(on: boolean): void {
  press("follow", on);
  if (on) update();
  else map.follow(undefined);
}

function connect(): void {
  const views = (top: boolean) => () => { press("viewtop", top); press("view3d", !top); map.showTop(top); };
  byId("viewtop").addEventListener("click", views(true));
  byId("view3d").addEventListener("click", views(false));
  byId("follow").addEventListener("click", () => setFollow(byId("follow").ariaPressed !== "true"));
  byId("axes").addEventListener("click", () => {
    const on = byId("axes").ariaPressed !== "true";
    press("axes", on);
    world.showAxes(on);
  });
  byId("measure").addEventListener("click", () => {
    const on = byId("measure").ariaPressed !== "true";
    press("measure", on);
    byId("measured").textContent = on ? "click two points on the floor" : "";
    map.measure(on ? (words) => (byId("measured").textContent = words) : undefined);
  });
  byId("theme").addEventListener("click", () => setTheme(document.documentElement.dataset["theme"] === "dark" ? "light" : "dark"));
  byId("choice").addEventListener("change", (event) => openRecording((event.target as HTMLSelectElement).value));
  byId("address").addEventListener("click", () => {
    const url = prompt("Address of a recording (MCAP) on a server that supports ranges");
    if (url) openRecording(url);
  });
  byId("file").addEventListener("change", (event) => void openFiles([...((event.target as HTMLInputElement).files ?? [])]));
  document.addEventListener("dragover", (event) => { event.preventDefault(); byId("drop").hidden = false; });
  document.addEventListener("dragleave", (event) => { if (!event.relatedTarget) byId("drop").hidden = true; });
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    byId("drop").hidden = true;
    void openFiles([...(event.dataTransfer?.files ?? [])]);
  });
}

function setTheme(theme: string): void {
  document.documentElement.dataset["theme"] = theme;
  map.setBackground(colour("--ground"));
  rebuild(false);
  plots.recolour();
}

let last = performance.now();
function tick(now: number): void {
  live?.tick(now);
  if (playback.advance((now - last) / 1000)) update();
  last = now;
  requestAnimationFrame(tick);
}

connect();
setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
requestAnimationFrame(tick);
void openOffered();
// For tests: canvas position of a point of the map.
Object.assign(window, { waymark: {
  pixelOf: (x: number, y: number, z: number) => map.pixelOf(x, y, z),
  imageShown: () => imageShown,
  imageHostTime: () => live?.imageHostTime ?? 0n,
  drawn: () => map.drawn(),
  tags: () => drawnTagsOf(content).map((tag) => tag.map_T_tag.p),
  latencies: () => Array.from({ length: content.tracks.latency.length }, (_, row) => content.tracks.latency.at(row, 1)),
} });
