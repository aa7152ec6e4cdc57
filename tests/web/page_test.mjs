// Uses the pages of web/ from their folder: drops images, turns the sliders, reads what they say.
// usage: node page_test.mjs FOLDER_URL IMAGE ...     one object of JSON on standard output; exit code 1 and words when something is wrong
import { readFileSync } from "node:fs";
import { basename } from "node:path";
import { accessible, check, launch, openPage } from "../../viewer/test/browser.mjs";

const [folder, ...paths] = process.argv.slice(2);
const browser = await launch();

/** Drops a file on the page, as a person does. */
const drop = (page, name, bytes, type) => page.evaluate(async ([file, base64, mime]) => {
  const data = new DataTransfer();
  data.items.add(new File([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], file, { type: mime }));
  document.querySelector("#json").textContent = "";
  document.querySelector("#status").textContent = "";
  dispatchEvent(new DragEvent("drop", { dataTransfer: data, cancelable: true }));
}, [name, bytes.toString("base64"), type]);
const said = (page, pattern) => page.waitForFunction((wanted) => new RegExp(wanted).test(document.querySelector("#status").textContent), pattern);
const json = async (page) => JSON.parse(await page.textContent("#json"));

async function detectPage() {
  const { page, troubles } = await openPage(browser, folder);
  await page.goto(`${folder}/detect.html`);
  await said(page, "Drop an image");
  const images = [];
  for (const path of paths) {
    await drop(page, basename(path), readFileSync(path), "image/png");
    await said(page, "Detection [\\d.]+ ms");
    images.push(await json(page));
  }
  const shown = await page.locator("#rows tr").count();
  check(shown === images.at(-1).tags.length, `${shown} rows in the table`);
  for (const family of ["tag36h11", "tag16h5", "tag25h9", "tag36h10", "tagCircle21h7", "tagStandard41h12"]) {
    await page.selectOption("#family", family);
    await page.click("#example");
    const tags = (await json(page)).tags.map((tag) => tag.tag);
    check([0, 1, 2].every((number) => tags.includes(`${family}:${number}`)), `the example of ${family} shows ${tags}`);
  }
  await drop(page, "words.png", Buffer.from("no image"), "image/png");
  await said(page, "cannot read");
  await drop(page, "again.png", readFileSync(paths[0]), "image/png");
  await said(page, "Detection [\\d.]+ ms");
  check(troubles.length === 0, troubles.join("\n"));
  await accessible(page, "detect"); // last: it asks for the style sheet, which a browser refuses to a script of a page from a folder
  return images;
}

async function posesPage() {
  const { page, troubles } = await openPage(browser, folder);
  await page.goto(`${folder}/two_poses.html`);
  await said(page, "Noise number 1");
  const turn = (id, value) => page.$eval(id, (slider, wanted) => { slider.value = wanted; slider.dispatchEvent(new Event("input")); }, String(value));
  const poses = [], wrong = {};
  for (const tilt of [0, 10, 30, 55, 75]) {
    for (const distance of [0.3, 1, 2, 4]) {
      await turn("#tilt", tilt);
      await turn("#distance", distance);
      const answer = await json(page);
      poses.push([`tilt ${tilt} distance ${distance}`, answer]);
      wrong[`${tilt} ${distance}`] = answer.wrong_draws / answer.draws;
    }
  }
  check(wrong["30 0.3"] === 0, `near, noise turns a tag of 30 degrees in ${wrong["30 0.3"]} of the draws`);
  check(wrong["30 4"] > 0.25, `far away, in ${wrong["30 4"]}`);
  check((await page.textContent("#verdict")).includes("draws of the noise"), "no words on the draws");
  await page.click("#noise");
  await said(page, "Noise number 2");
  check(troubles.length === 0, troubles.join("\n"));
  await accessible(page, "two poses");
  return poses;
}

try {
  console.log(JSON.stringify({ images: await detectPage(), poses: await posesPage() }));
} catch (error) {
  console.error(String(error));
  process.exitCode = 1;
} finally {
  await browser.close();
}
