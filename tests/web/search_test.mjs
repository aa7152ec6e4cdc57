// Searches the site, served from this computer: results come without asking anybody else.
// usage: node search_test.mjs SITE_URL     exit code 1 and words when something is wrong
import { check, launch, openPage } from "../../viewer/test/browser.mjs";

const [site] = process.argv.slice(2);
const browser = await launch();
try {
  const { page, troubles } = await openPage(browser, site);
  page.on("response", (answer) => answer.status() >= 400 && troubles.push(`${answer.status()} ${answer.url()}`));
  await page.goto(`${site}/concepts/pose/`);
  await page.click("[for=__search].md-search__icon", { force: true });
  await page.waitForFunction(() => /Type to start/.test(document.querySelector(".md-search-result__meta").textContent)); // before, letters go nowhere
  for (const [word, place] of [["watchdog", "robot-process"], ["estimate_tag_pose", "reference/python"], ["corner refinement", "concepts/corner_refinement"]]) {
    await page.fill(".md-search__input", word);
    await page.press(".md-search__input", "End"); // the page listens to keys
    const link = page.locator(`.md-search-result__link[href*="${place}"]`).first();
    await link.waitFor({ state: "attached" });
    check((await page.locator(".md-search-result__link").count()) > 0, `nothing is found for ${word}`);
  }
  await page.goto(`${site}/cpp/annotated.html`);
  check((await page.textContent("body")).includes("CameraModel"), "the reference of C++ does not list CameraModel");
  check(troubles.length === 0, troubles.join("\n"));
} catch (error) {
  console.error(String(error));
  process.exitCode = 1;
} finally {
  await browser.close();
}
