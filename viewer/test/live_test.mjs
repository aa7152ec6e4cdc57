// Clicks through teach, map and replay of a simulated robot, on the page of `waymark run --view`.
// usage: node live_test.mjs URL [PICTURES]     URL with its token; exit code 1 and words when something is wrong
import { accessible, check, drawn, launch, openPage, pixelsNear } from "./browser.mjs";

const [url, pictures] = process.argv.slice(2);
const origin = new URL(url).origin;
const started = Date.now();
const browser = await launch();
const { page, troubles } = await openPage(browser, origin);
const phase = (wanted, seconds = 120) =>
  page.waitForFunction((w) => document.body.dataset.phase === w, wanted, { timeout: seconds * 1000 });
const speed = () => page.$$eval("#facts div", (rows) => parseFloat(rows.find((r) => r.children[0].textContent === "Speed")?.children[1].textContent ?? "0"));
const speedIs = async (wanted, words) => {
  for (const end = Date.now() + 30000; !wanted(await speed()); await page.waitForTimeout(50)) check(Date.now() < end, `${words}: ${await speed()} m/s`);
};
const QUAD = [240, 228, 66];
/** Pictures come and go: one with tags is among the next. */
const quadsAreDrawn = async (words) => {
  for (const end = Date.now() + 30000; (await pixelsNear(page, "#picture", QUAD)) < 100; await page.waitForTimeout(20)) check(Date.now() < end, words);
};

/** On a busy machine the page may have been silent for so long that it lost control, and the robot stands: as it should. */
async function holdsControl() {
  if ((await page.textContent("#control")) === "Take control") await page.click("#control");
  await page.waitForFunction(() => document.querySelector("#control").textContent === "Give control back");
}

async function opens() {
  await page.goto(url);
  await page.waitForSelector("body[data-ready]", { state: "attached" });
  await phase("idle");
  check(page.url() === `${origin}/`, `the token left the address: ${page.url()}`);
  check((await page.textContent("#go")) === "Teach a lap", "the button says what it does");
  check((await page.getAttribute("#story [aria-current]", "aria-current")) === "step" && (await page.textContent("#story [aria-current]")) === "idle", "where the story is");
  await page.waitForFunction(() => /● odometry: \d+ a second/.test(document.querySelector("#lights").textContent));
  await accessible(page, "idle");
}

async function teaches() {
  await page.click("#go");
  await phase("teaching");
  await page.selectOption("#drivespeed", "0.1");
  await page.click("h1"); // the keys of a list are its own
  await page.keyboard.down("w"); // somebody drives by hand
  await speedIs((v) => v > 0.05, "w drives");
  await page.keyboard.press("Space");
  await speedIs((v) => v < 0.02, "space stops");
  await page.keyboard.up("w");
  check(await page.$eval("body", (e) => e.dataset.phase === "teaching"), "the lap goes on");
  await page.click("#script");
  await speedIs((v) => v > 0.1, "the script drives");
  await page.waitForFunction(() => window.waymark.latencies().length > 5); // pictures that were drawn with their tags
  await page.waitForFunction(() => /tag36h11:\d+/.test(document.querySelector("#seen").textContent));
  await quadsAreDrawn("quads are drawn into the picture");
  const grey = await page.$eval("#picture", (canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const seen = new Set();
    for (let i = 0; i < data.length; i += 4) seen.add(data[i]);
    return [canvas.width, canvas.height, seen.size];
  });
  check(grey[0] === 640 && grey[1] === 480 && grey[2] > 50, `a picture of ${grey}`);
  await accessible(page, "teaching");
  await holdsControl();
  await phase("ready");
  check((await page.textContent("#legend")).includes("route"), "the route is there");
}

async function replays() {
  await page.click("#go");
  await phase("replaying");
  await speedIs((v) => v > 0.1, "it drives by itself");
  await page.waitForFunction(() => /● localisation/.test(document.querySelector("#lights").textContent));
  await page.click("#go");
  await phase("paused");
  await speedIs((v) => v < 0.02, "pause stands");
  await page.click("#go");
  await phase("replaying");
  await page.waitForFunction(() => document.querySelector("#legend .estimate"));
  await page.waitForFunction(() => /residual [\d.]+ px/.test(document.querySelector("#seen").textContent));
  await page.waitForFunction(() => parseFloat(document.querySelector("#phase").textContent.split(";")[1]) > 1.2); // metres of the way
  if (pictures) await page.screenshot({ path: `${pictures}/live.png` });
  await page.click("h1");
  await page.keyboard.press("Space");
  await phase("stopped");
  await speedIs((v) => v < 0.02, "space stops a replay");
  check((await page.textContent("#phase")).includes("stopped by the operator"), "why it stopped");
  await looksBack(); // now that it stands: the way is short, and a page on a busy machine takes its time
}

/** Scrubs, and returns. */
async function looksBack() {
  const now = await page.$eval("#time", (e) => Number(e.value));
  await page.$eval("#time", (e, value) => { e.value = value; e.dispatchEvent(new Event("input")); }, String(now - 2));
  await drawn(page);
  check(Math.abs((await page.$eval("#time", (e) => Number(e.value))) - now + 2) < 0.1, "looking back stays there");
  await quadsAreDrawn("with the picture of that time");
  await page.click("#newest");
  await page.waitForFunction((t) => Number(document.querySelector("#time").value) > t, now);
}

/** A second viewer, without the token, watches; the first gives the control to nobody by being closed. */
async function onlyWatches() {
  const { page: other } = await openPage(browser, origin);
  await other.goto(origin);
  await other.waitForFunction(() => document.body.dataset.phase === "stopped");
  check(!(await other.isVisible("#go")) && (await other.textContent("#viewers")).includes("You only watch"), "no buttons without the token");
  await other.close();
}

async function phoneAndDark() {
  await page.setViewportSize({ width: 390, height: 844 });
  await drawn(page);
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  check(wide <= 390, `on a phone the page is ${wide} px wide`);
  await accessible(page, "phone");
  await page.click("#theme");
  await accessible(page, "phone, dark");
  await page.setViewportSize({ width: 1280, height: 800 });
}

try {
  await opens();
  await teaches();
  await replays();
  await onlyWatches();
  await phoneAndDark();
  check(troubles.length === 0, troubles.join("; "));
  const ages = (await page.evaluate(() => window.waymark.latencies())).sort((a, b) => a - b);
  console.log(`${ages.length} pictures, from the robot's program to the screen: median ${ages[ages.length >> 1].toFixed(0)} ms, ` +
    `95 % ${ages[Math.floor(ages.length * 0.95)].toFixed(0)} ms; all in ${Date.now() - started} ms`);
} catch (error) {
  console.error(`${error.message}\nphase: ${await page.textContent("#phase").catch(() => "")}\nstatus: ${await page.textContent("#status").catch(() => "")}\ntroubles: ${troubles.join("; ")}`);
  if (process.env.WAYMARK_FAILED) await page.screenshot({ path: process.env.WAYMARK_FAILED }).catch(() => {});
  process.exitCode = 1;
} finally {
  await browser.close();
}
