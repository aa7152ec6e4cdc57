// Measures the page on a long recording: the time from the start of the server until it is usable in an open browser, and the time of each jump of
// the timeline until its image is drawn; prints one JSON object. Run by tools/measure_page.py.
// usage: node scrub.mjs PROGRAM RECORDING
import { spawn } from "node:child_process";
import { once } from "node:events";
import { drawn, launch, openPage } from "./browser.mjs";

const [program, recording] = process.argv.slice(2);
const browser = await launch();
const { page } = await openPage(browser, "http://127.0.0.1");
const begun = Date.now();
const server = spawn(program, ["view", recording, "--port", "0"]);
const url = String((await once(server.stdout, "data"))[0]).trim();
await page.goto(url, { waitUntil: "commit" });
await page.waitForFunction(() => Number(document.querySelector("#time")?.max) > 0 && !Number.isNaN(window.waymark?.imageShown() ?? NaN), null, { polling: 10 });
const usable = Date.now();
const paint = await page.waitForFunction(() => performance.getEntriesByName("first-contentful-paint")[0]?.startTime);
const painted = (await page.evaluate(() => performance.timeOrigin)) + (await paint.jsonValue());
await page.waitForSelector("body[data-ready]", { state: "attached", timeout: 300000 });
const read = Date.now();
await drawn(page);
const times = [];
for (let i = 1; i <= 60; ++i) {
  times.push(await page.evaluate(async (share) => {
    const bar = document.querySelector("#time");
    const t = Math.round(share * Number(bar.max) * 100) / 100;
    const start = performance.now();
    bar.value = String(t);
    bar.dispatchEvent(new Event("input"));
    while (Math.abs(window.waymark.imageShown() - Number(bar.value)) > 1e-6) await new Promise((done) => setTimeout(done, 1));
    return performance.now() - start;
  }, (i * 0.618034) % 1));
}
console.log(JSON.stringify({ painted_ms: painted - begun, usable_ms: usable - begun, read_ms: read - begun, jumps_ms: times }));
await browser.close();
server.kill("SIGINT");
