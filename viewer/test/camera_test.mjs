// Uses the page of `waymark detect v4l2:… --view`: tags, poses, rate and age, the exposure, an image saved, a recording.
// usage: node camera_test.mjs URL     URL with its token; exit code 1 and a message on failure; else one JSON object
import { accessible, check, launch, openPage } from "./browser.mjs";

const [url] = process.argv.slice(2);
const origin = new URL(url).origin;
const browser = await launch();
const { page, troubles } = await openPage(browser, origin);
const text = (id) => page.textContent(id);
const until = (id, pattern) => page.waitForFunction(([where, wanted]) => new RegExp(wanted).test(document.querySelector(where)?.textContent ?? ""), [id, pattern]);

try {
  await page.goto(url);
  await until("#devicefacts", "Fake camera.*[\\d.]+ Hz; tags \\d+ ms after the exposure");
  await until("#devicerows", "tag36h11:42");
  const cells = await page.$$eval("#devicerows tr:first-child > *", (all) => all.map((cell) => cell.textContent));
  check(cells[0] === "tag36h11:7" && Number(cells[1]) > 0.1 && cells[3].split(", ").length === 3, `a tag with its pose: ${cells}`);
  check(!(await page.isVisible("#stop")) && !(await page.isVisible("#go")), "a camera has no buttons of a robot");
  await until("#seen", "tag36h11:7");
  await accessible(page, "camera");
  const slider = "#controls input[name=exposure_ms]";
  check((await page.getAttribute(slider, "aria-valuetext")).includes("automatic"), "the exposure is automatic at first");
  await page.fill(slider, "500");
  await page.waitForFunction((id) => document.querySelector(id).getAttribute("aria-valuetext") === "7.8", slider, { timeout: 20000 });
  await page.click("#snapshot");
  await until("#devicemessage", "saved snapshot-.*\\.png");
  await page.click("#record");
  await until("#devicemessage", "recording camera-.*\\.mcap");
  check((await page.getAttribute("#record", "aria-pressed")) === "true", "the button shows that it records");
  await page.waitForTimeout(1000);
  await page.click("#record");
  await until("#devicemessage", "recorded camera-.*\\.mcap");
  await page.waitForFunction(() => window.waymark.latencies().length > 30);
  const ages_ms = (await page.evaluate(() => window.waymark.latencies())).sort((a, b) => a - b);
  check(troubles.length === 0, troubles.join("; "));
  console.log(JSON.stringify({ images: ages_ms.length, age_median_ms: ages_ms[ages_ms.length >> 1], age_95_ms: ages_ms[Math.floor(0.95 * ages_ms.length)] }));
} catch (error) {
  console.error(`${error.message}\n${await text("#devicefacts").catch(() => "")}\n${await text("#devicemessage").catch(() => "")}\nexposure: ${await page.getAttribute("#controls input[name=exposure_ms]", "aria-valuetext").catch(() => "")}\ntroubles: ${troubles.join("; ")}`);
  process.exitCode = 1;
} finally {
  await browser.close();
}
