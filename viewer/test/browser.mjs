// Shared by the tests of the page: a headless Chromium, its errors, and pixel counts.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const require = createRequire(pathToFileURL(process.env.WAYMARK_NODE_MODULES + "/"));
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

export function check(condition, words) {
  if (!condition) throw new Error(words);
}

export const launch = () => chromium.launch({
  executablePath: process.env.WAYMARK_CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--enable-unsafe-swiftshader"], // without a graphics card only WebGL is rendered in software
});

/** Opens a page and collects its errors, and its requests to other origins than `origin`. */
export async function openPage(browser, origin, options = {}) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 }, colorScheme: "light", ...options });
  page.setDefaultTimeout(120000); // a busy machine
  const troubles = [];
  page.on("console", (message) => message.type() === "error" && troubles.push(message.text()));
  page.on("pageerror", (error) => troubles.push(String(error)));
  page.on("request", (request) => {
    if (!request.url().startsWith(origin) && !/^(data|blob):/.test(request.url())) troubles.push(`asked ${request.url()}`);
  });
  return { page, troubles };
}

/** Number of pixels of a canvas near a colour, around a point (of the whole canvas unless given). */
export const pixelsNear = (page, id, colour, at, reach) => page.$eval(id, (canvas, [rgb, place, r]) => {
  const copy = document.createElement("canvas");
  copy.width = canvas.width;
  copy.height = canvas.height;
  const context = copy.getContext("2d");
  context.drawImage(canvas, 0, 0);
  const scale = canvas.width / canvas.clientWidth;
  const box = place ? [place[0] * scale - r, place[1] * scale - r, 2 * r + 1, 2 * r + 1] : [0, 0, copy.width, copy.height];
  const { data } = context.getImageData(...box.map(Math.round));
  let count = 0;
  for (let i = 0; i < data.length; i += 4) if (Math.hypot(data[i] - rgb[0], data[i + 1] - rgb[1], data[i + 2] - rgb[2]) < 60) ++count;
  return count;
}, [colour, at, reach]);

/** Checks WCAG 2 A and AA and the best practices of axe-core. */
export async function accessible(page, where) {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run(document, { runOnly: ["wcag2a", "wcag2aa", "best-practice"] }));
  check(violations.length === 0, `${where}: ${violations.map((v) => `${v.id} (${v.nodes[0].html}: ${v.nodes[0].any[0]?.message ?? ""})`).join("; ")}`);
}

/** Waits until the last change is on the screen. */
export const drawn = (page) => page.evaluate(async () => {
  const frame = () => new Promise((done) => requestAnimationFrame(done));
  await frame();
  await window.waymark.drawn();
  await frame();
});

/** Number of points (x y z of the map) outside the image of the scene. */
export const outside = (page, places) => page.evaluate((all) => {
  const { clientWidth, clientHeight } = document.querySelector("#map");
  return all.map((place) => window.waymark.pixelOf(...place)).filter(([u, v]) => !(u >= 0 && u <= clientWidth && v >= 0 && v <= clientHeight)).length;
}, places);
