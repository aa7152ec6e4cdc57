// A user of the live page: reads it, presses buttons, and waits for the effects, however slow the machine is. Nothing here has to be quick: a page on a
// busy machine may be silent for so long that it loses control, and the robot stops as it should; control is then taken again.
import { check, drawn, openPage, pixelsNear } from "./browser.mjs";

const patience = 120000; // [ms] timeout of one wait
const again = 15000; // [ms] until a press that did nothing is repeated
const QUAD = [240, 228, 66];

export class LiveUser {
  /** Opens its own page; a token in the URL is used. */
  static async open(browser, url) {
    const user = new LiveUser();
    user.origin = new URL(url).origin;
    Object.assign(user, await openPage(browser, user.origin));
    await user.page.addInitScript(() => {
      window.silence = 0; // [ms] the longest time in which the page did nothing
      let last = performance.now();
      setInterval(() => {
        window.silence = Math.max(window.silence, performance.now() - last);
        last = performance.now();
      }, 100);
    });
    await user.page.goto(url);
    await user.page.waitForSelector("body[data-ready]", { state: "attached", timeout: patience });
    return user;
  }
  lost = 0; // number of times control was lost
  taken = -Infinity;
  resumed = -Infinity;

  text(id) { return this.page.textContent(id); }
  phase() { return this.page.$eval("body", (e) => e.dataset.phase); }
  speed() {
    return this.page.$$eval("#facts div", (rows) => parseFloat(rows.find((r) => r.children[0].textContent === "Speed")?.children[1].textContent ?? "0"));
  }
  /** Waits until `probe` returns something. */
  async until(probe, words) {
    for (const end = Date.now() + patience; ; await this.page.waitForTimeout(50)) {
      await this.keepControl();
      const found = await probe();
      if (found) return found;
      check(Date.now() < end, words);
    }
  }
  untilText(id, pattern) {
    return this.until(async () => pattern.test(await this.text(id)), `${id} never showed ${pattern}`);
  }
  untilPhase(wanted) {
    return this.until(async () => (await this.phase()) === wanted, `the phase never was '${wanted}'`);
  }
  untilSpeed(wanted, words) {
    return this.until(async () => wanted(await this.speed()), words);
  }
  /** Waits for an image with tags; not every image has some. */
  untilQuads(words) {
    return this.until(async () => (await pixelsNear(this.page, "#image", QUAD)) > 100, words);
  }
  /** Presses a button or a key until `probe` returns something; one press must suffice unless the page was silent meanwhile. `may`: whether pressing is meaningful. */
  async press(id, probe, words, may = async () => true) {
    let presses = 0, pressed = -Infinity;
    await this.until(async () => {
      if (await probe()) return true;
      const key = !id.startsWith("#");
      if (Date.now() - pressed < again || !(await may()) || !(key || (await this.page.isEnabled(id)))) return false;
      pressed = Date.now();
      ++presses;
      await (key ? this.page.keyboard.press(id) : this.page.click(id));
      return false;
    }, words);
    check(presses <= 1 || (await this.silence()) > 1000, `${presses} presses of ${id}: ${words}`);
  }
  /** Presses the button of the session. */
  async go(wanted) {
    this.drives = false;
    const from = await this.phase();
    await this.press("#go", async () => (await this.phase()) === wanted, `'${from}' never became '${wanted}'`, async () => (await this.phase()) === from);
    this.drives = wanted === "replaying";
  }
  silence() { return this.page.evaluate(() => window.silence); }
  /** Takes control back, and resumes a replay that was paused because of it. */
  async keepControl() {
    if (!this.held) return;
    const [words, phase] = await this.page.evaluate(() => [document.querySelector("#control").textContent, document.body.dataset.phase]);
    if (words !== "Release control") {
      check((await this.silence()) > 1000, "control was lost by a page that was awake");
      if (Date.now() - this.taken < 3000) return; // perhaps a key has taken it meanwhile, and the press gave it back
      this.taken = Date.now();
      ++this.lost;
      await this.page.click("#control");
    } else if (this.drives && phase === "paused" && Date.now() - this.resumed > again) {
      this.resumed = Date.now();
      await this.page.click("#go");
    }
  }
  async takes() {
    await this.until(async () => (await this.text("#control")) === "Release control", "control is never held");
    this.held = true;
  }
  /** Scrubs to `t`; returns whether tags are in the image of that time. */
  async seesTagsAt(t) {
    await this.page.$eval("#time", (e, value) => { e.value = value; e.dispatchEvent(new Event("input")); }, String(t));
    await drawn(this.page);
    check(Math.abs((await this.page.$eval("#time", (e) => Number(e.value))) - t) < 0.1, "looking back stays there");
    for (const end = Date.now() + patience / 10; Date.now() < end; await this.page.waitForTimeout(50))
      if ((await pixelsNear(this.page, "#image", QUAD)) > 100) return true;
    return false;
  }
  /** Scrubs back and returns. At one time no tag may be in view, or its message may have been dropped for a slow page; then tries an earlier time. */
  async looksBack(seconds) {
    const now = await this.page.$eval("#time", (e) => Number(e.value));
    let seen = false;
    for (let back = seconds; !seen && back < seconds + 3; back += 0.4) seen = await this.seesTagsAt(now - back);
    check(seen, "looking back shows the image of that time");
    await this.page.click("#newest");
    await this.until(async () => (await this.page.$eval("#time", (e) => Number(e.value))) > now, "it never came back to now");
  }
}
