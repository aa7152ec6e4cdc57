// Measures how old pictures of a robot that runs are when the page has drawn them with their tags; one object of JSON. Run by tools/measure_page.py.
// usage: node age.mjs URL PICTURES     URL with its token
import { launch, openPage } from "./browser.mjs";

const [url, wanted] = process.argv.slice(2);
const browser = await launch();
const { page } = await openPage(browser, new URL(url).origin);
const drawn = () => page.evaluate(() => window.waymark.latencies());
await page.goto(url);
await page.waitForFunction(() => document.body.dataset.phase === "idle");
await page.click("#go");
await page.click("#script");
await page.waitForFunction(() => /Speed0\.[1-9]/.test(document.querySelector("#facts").textContent)); // it drives
const before = (await drawn()).length, start = Date.now();
await page.waitForFunction((count) => window.waymark.latencies().length >= count, before + Number(wanted), { polling: 200 });
const seconds = (Date.now() - start) / 1000;
const ages_ms = (await drawn()).slice(before);
console.log(JSON.stringify({ ages_ms, pictures_per_s: ages_ms.length / seconds }));
await browser.close();
