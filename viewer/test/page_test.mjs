// Drives the page of `waymark view` in a headless Chromium.
// usage: node page_test.mjs URL FOLDER [IMAGES]     URL serves FOLDER, which `waymark demo` wrote; exit code 1 and a message on failure
import { readFileSync } from "node:fs";
import * as tools from "./browser.mjs";

const { check } = tools;
const [url, folder, images] = process.argv.slice(2);
const started = Date.now();
const browser = await tools.launch();
const launched = Date.now();
const { page, troubles } = await tools.openPage(browser, url);
const pixelsNear = (...what) => tools.pixelsNear(page, ...what);
const accessible = (where) => tools.accessible(page, where);
const drawn = () => tools.drawn(page);

const ready = () => page.waitForSelector("body[data-ready]", { state: "attached", timeout: 60000 });
const status = () => page.textContent("#status");
const time = () => page.$eval("#time", (e) => Number(e.value));
const fact = (name) => page.$$eval("#facts div", (rows, wanted) => rows.find((r) => r.children[0].textContent === wanted)?.children[1].textContent, name);
const pixelOf = (x, y, z) => page.evaluate((p) => window.waymark.pixelOf(...p), [x, y, z]);
const seek = async (t) => {
  await page.$eval("#time", (e, value) => { e.value = value; e.dispatchEvent(new Event("input")); }, String(t));
  await drawn();
};
const TRUTH = [0, 158, 115], QUAD = [240, 228, 66], BLACK = [0, 0, 0], WHITE = [255, 255, 255];

async function replayIsShown() {
  await page.selectOption("#choice", { label: "replay.mcap" });
  await page.waitForFunction(() => document.querySelector("#status").textContent.startsWith("replay.mcap") && document.body.dataset.ready);
  check((await page.$$("#plots .uplot")).length === 5, "five plots: distance, heading, speed, tags, latency");
  const legend = (await page.$$eval("#legend li", (items) => items.map((i) => i.className))).join(" ");
  check(legend === "truth odometry estimate route", `legend: ${legend}`);
}

/** The first view shows every tag and the robot, at any window size. */
async function firstViewFits() {
  for (const [width, height] of [[1280, 800], [1900, 600], [800, 1000], [390, 844]]) {
    await page.setViewportSize({ width, height });
    await page.reload();
    await ready();
    await drawn();
    const tags = await page.evaluate(() => window.waymark.tags());
    check(tags.length === 24, `${tags.length} tags are drawn`);
    await seek(1);
    const robot = (await fact("Truth")).split(",").slice(0, 2).map(parseFloat);
    for (const view of ["#view3d", "#viewtop"]) {
      await page.click(view);
      await drawn();
      const hidden = await tools.outside(page, [...tags, [...robot, 0]]);
      check(hidden === 0, `${width} x ${height}, ${view}: ${hidden} of the tags and the robot are outside the first view`);
    }
  }
  await page.setViewportSize({ width: 1280, height: 800 });
}

async function scrubbingMoves() {
  await seek(20);
  const [x, y] = (await fact("Truth")).split(",").map(parseFloat);
  check(Number(parseFloat(await fact("Error"))) < 10, `the estimate is off by ${await fact("Error")}`);
  check(Number(await fact("Tags in view")) > 0, "a tag is in view");
  check((await pixelsNear("#image", QUAD)) > 100, "quads are drawn");
  await page.click("#viewtop");
  await drawn();
  check((await pixelsNear("#map", TRUTH, await pixelOf(x, y, 0.1), 12)) > 3, "the truth is drawn where it is");
  await seek(40);
  check((await fact("Truth")).split(",").map(parseFloat)[0] !== x, "scrubbing moves the robot");
  await page.click("#view3d");
}

/** In 3-D up close: follows the robot, then a mapped tag shows black and white. */
async function tagsAreReal() {
  await seek(0);
  await drawn();
  const places = readFileSync(`${folder}/map/map.yaml`, "utf8").match(/position_m: \[(.*)\]/g).map((line) => line.match(/\[(.*)\]/)[1].split(",").map(Number));
  let black = 0, white = 0;
  for (const place of places) {
    const [u, v] = await pixelOf(...place);
    if (u < 20 || v < 20) continue;
    black += await pixelsNear("#map", BLACK, [u, v], 6);
    white += await pixelsNear("#map", WHITE, [u, v], 6);
  }
  check(black > 20 && white > 20, `tags are black and white (${black}, ${white} pixels)`);
}

async function keysWork() {
  await page.click("h1"); // no element has the focus
  await seek(10);
  await page.keyboard.press("ArrowRight");
  const stepped = await time();
  check(stepped > 10 && stepped < 10.2, `an arrow steps a frame, not to ${stepped}`);
  await page.keyboard.press("Space");
  await page.waitForFunction((t) => Number(document.querySelector("#time").value) > t + 0.2, stepped);
  await page.keyboard.press("Space");
  const stopped = await time();
  await drawn();
  check((await time()) === stopped, "the space bar stops");
  await page.keyboard.press("End");
  check((await time()) > 50, "End goes to the end");
}

async function measuring() {
  await page.click("#viewtop");
  await page.click("#measure");
  for (const place of [[0, 0, 0], [2, 0, 0]]) {
    const [x, y] = await pixelOf(...place);
    await page.click("#map", { position: { x, y } });
  }
  const words = await page.textContent("#measured");
  check(Math.abs(parseFloat(words) - 2) < 0.05, `two metres are ${words}`);
  await page.click("#measure");
  await page.click("#view3d");
}

async function ownFiles() {
  await page.setInputFiles("#file", `${folder}/lap.mcap`);
  await page.waitForFunction(() => document.querySelector("#status").textContent.startsWith("lap.mcap") && document.body.dataset.ready);
  const legend = (await page.$$eval("#legend li", (items) => items.map((i) => i.className))).join(" ");
  check(legend === "truth odometry", `a recording from elsewhere takes no map or route of the folder: ${legend}`);
  for (const [name, buffer, words] of [
    ["no.mcap", Buffer.from("this is no recording"), "waymark convert no.mcap"],
    ["empty.mcap", Buffer.alloc(0), "empty.mcap: the file is empty"],
    ["photograph.png", Buffer.from([0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10]), "waymark detect photograph.png"],
    ["photograph.jpg", Buffer.from([0xff, 0xd8, 0xff, 0xe0]), "waymark detect photograph.jpg"],
    ["cut.mcap", readFileSync(`${folder}/lap.mcap`).subarray(0, 500000), "waymark recover cut.mcap"],
    ["open.yaml", Buffer.from("tags: [1, 2"), "open.yaml"],
  ]) {
    await page.setInputFiles("#file", { name, mimeType: "", buffer });
    await page.waitForFunction((wanted) => document.querySelector("#status").textContent.includes(wanted), words);
  }
}

async function phone() {
  await page.setViewportSize({ width: 390, height: 844 });
  await drawn();
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  check(wide <= 390, `on a phone the page is ${wide} px wide`);
  await accessible("phone");
}

try {
  await page.goto(url);
  await ready();
  const usable = Date.now() - launched;
  await firstViewFits();
  await replayIsShown();
  await scrubbingMoves();
  await tagsAreReal();
  await keysWork();
  await measuring();
  await accessible("light");
  await seek(30);
  if (images) await page.screenshot({ path: `${images}/view.png` });
  await page.click("#theme");
  check((await page.getAttribute("html", "data-theme")) === "dark", "dark");
  await accessible("dark");
  if (images) await page.screenshot({ path: `${images}/view-dark.png` });
  await ownFiles();
  await phone();
  check(troubles.length === 0, troubles.join("; "));
  console.log(`usable after ${usable} ms, browser started in ${launched - started} ms, total ${Date.now() - started} ms`);
} catch (error) {
  console.error(`${error.message}\nstatus: ${await status().catch(() => "")}\ntroubles: ${troubles.join("; ")}`);
  if (process.env.WAYMARK_FAILED) await page.screenshot({ path: process.env.WAYMARK_FAILED }).catch(() => {});
  process.exitCode = 1;
} finally {
  await browser.close();
}
