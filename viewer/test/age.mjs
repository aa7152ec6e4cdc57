// Measures the latency of images of a running robot on the page; prints one JSON object. Run by tools/measure_page.py.
// usage: node age.mjs URL IMAGES     URL with its token: first lets the script teach the robot; without: only watches
// drawn_ms: until the page had drawn an image with its tags; painted_ms: until the browser had put it on the screen. Both are measured from the
// time at which the robot's program had the image, by the same clock.
import { launch, openPage } from "./browser.mjs";

const [url, wanted] = process.argv.slice(2);
const browser = await launch();
const { page } = await openPage(browser, new URL(url).origin);
await page.goto(url);
if (new URL(url).searchParams.has("token")) {
  await page.waitForFunction(() => document.body.dataset.phase === "idle");
  await page.click("#go");
  await page.click("#script");
  await page.waitForFunction(() => /Speed0\.[1-9]/.test(document.querySelector("#facts").textContent)); // the robot drives
}
await page.waitForFunction(() => window.waymark.latencies().length > 30); // the page is fully loaded
const measured = await page.evaluate((count) => new Promise((done) => {
  const painted_ms = [], before = window.waymark.latencies().length, start = performance.now();
  const { port1, port2 } = new MessageChannel();
  let last = 0n, frames = 0;
  port1.onmessage = ({ data: host }) => painted_ms.push(performance.timeOrigin + performance.now() - Number(host) * 1e-6); // after the frame
  const frame = () => {
    ++frames;
    const host = window.waymark.imageHostTime();
    if (host !== last) port2.postMessage((last = host));
    const all = window.waymark.latencies();
    if (all.length < before + count) return requestAnimationFrame(frame);
    done({ drawn_ms: all.slice(before), painted_ms, images_per_s: (1000 * (all.length - before)) / (performance.now() - start), frames_per_s: (1000 * frames) / (performance.now() - start) });
  };
  requestAnimationFrame(frame);
}), Number(wanted));
console.log(JSON.stringify(measured));
await browser.close();
