// Uses the page of `waymark calibrate camera v4l2:… --view`: covered and missing parts of the image and tilts.
// usage: node guided_test.mjs URL [SCREENSHOT]     URL with its token; exit code 1 and a message on failure; else the last panel as JSON
import { accessible, check, launch, openPage } from "./browser.mjs";

const [url, screenshot] = process.argv.slice(2);
const browser = await launch();
const { page, troubles } = await openPage(browser, new URL(url).origin);

/** The present state of the panel, read at once. */
const read = () => page.evaluate(() => {
  const cell = (element) => ({ name: element.querySelector("span").textContent.replace(", board here", ""), words: element.querySelector("strong").textContent,
                               covered: element.classList.contains("covered"), missing: element.classList.contains("missing"), here: element.classList.contains("here") });
  const all = (selector) => [...document.querySelectorAll(selector)].map(cell);
  return { facts: document.querySelector("#guidefacts").textContent, message: document.querySelector("#devicemessage").textContent,
           rows: document.querySelectorAll("#guideparts tr").length, parts: all("#guideparts td"), tilts: all("#guidetilts li") };
});
const viewsOf = ({ facts }) => Number(/^(\d+) of/.exec(facts)?.[1]);
const countOf = ({ words }) => Number(/\d+/.exec(words)[0]);
const total = (cells) => cells.reduce((sum, cell) => sum + countOf(cell), 0);
const untilViews = (count) => page.waitForFunction((least) => Number(/^(\d+) of/.exec(document.querySelector("#guidefacts")?.textContent ?? "")?.[1]) >= least, count);
const names = ["top left", "top", "top right", "left", "middle", "right", "bottom left", "bottom", "bottom right"];

try {
  await page.goto(url);
  await untilViews(1);
  const first = await read();
  check(first.rows === 3 && first.parts.map(({ name }) => name).join() === names.join(), `three rows of three parts: ${JSON.stringify(first.parts)}`);
  check(first.tilts.map(({ name }) => name).join() === "left edge nearer,right edge nearer,upper edge nearer,lower edge nearer", `four tilts: ${JSON.stringify(first.tilts)}`);
  for (const cell of [...first.parts, ...first.tilts]) {
    check(cell.covered !== cell.missing, `covered or missing: ${JSON.stringify(cell)}`);
    check(cell.covered === cell.words.startsWith("✓"), `words as the colour: ${JSON.stringify(cell)}`);
  }
  await page.waitForSelector("#guideparts td.here");
  await accessible(page, "guided calibration");
  const box = await page.locator("#image").boundingBox();
  check(box.height > 120, `the image is seen beside the panel: ${JSON.stringify(box)}`);
  for (const id of ["#guideparts", "#guidetilts"]) {
    const { y, height } = await page.locator(id).boundingBox();
    check(y >= 0 && y + height <= 800, `${id} is within the window: ${y} ${height}`);
  }
  await untilViews(viewsOf(first) + 3);
  const later = await read();
  check(total(later.parts) > total(first.parts), `corners are added: ${total(first.parts)}, ${total(later.parts)}`);
  check(later.parts.every((part, i) => countOf(part) >= countOf(first.parts[i])), "no part loses corners");
  await page.waitForFunction(() => /focal length ± [\d.]+ %/.test(document.querySelector("#guidefacts").textContent));
  const fitted = await read();
  check(total(fitted.tilts) >= 1 && total(fitted.tilts) <= viewsOf(fitted), `tilts are counted from the fourth view on: ${JSON.stringify(fitted.tilts)}`);
  const missing = fitted.tilts.filter((tilt) => tilt.missing).map(({ name }) => name.split(" ")[0]);
  const wanted = /tilt the board so that its (.*) edge is nearer/.exec(fitted.message)?.[1] ?? "";
  check(missing.every((edge) => wanted.includes(edge)), `the message matches the panel: ${fitted.message} ${missing}`);
  if (screenshot) await page.screenshot({ path: screenshot });
  check(troubles.length === 0, troubles.join("; "));
  console.log(JSON.stringify(await read()));
} catch (error) {
  console.error(`${error.message}\n${JSON.stringify(await read().catch(() => ""))}\ntroubles: ${troubles.join("; ")}`);
  if (screenshot) await page.screenshot({ path: screenshot });
  process.exitCode = 1;
} finally {
  await browser.close();
}
