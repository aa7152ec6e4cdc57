// Uses the page of `waymark run --view`: clicks through teach, map and replay, or checks the images of a robot that is taught.
// usage: node live_test.mjs URL session|images [IMAGES]     URL with its token; exit code 1 and a message on failure
import { accessible, check, drawn, launch, openPage, outside } from "./browser.mjs";
import { LiveUser } from "./live_user.mjs";

const [url, what, images] = process.argv.slice(2);
const started = Date.now();
const browser = await launch();
const user = await LiveUser.open(browser, url);
const { page, origin } = user;

async function opens() {
  await user.untilPhase("idle");
  check(!(await page.isVisible("#teach")), "the first lap has one button");
  check(page.url() === `${origin}/`, `the token was removed from the address: ${page.url()}`);
  check((await user.text("#go")) === "Teach a lap", "the button shows its action");
  check((await page.getAttribute("#session [aria-current]", "aria-current")) === "step" && (await user.text("#session [aria-current]")) === "idle", "where the session is");
  await user.untilText("#lights", /● odometry: \d+ per second/);
}

async function drivesByHand() {
  await user.go("teaching");
  await user.takes();
  await page.selectOption("#drivespeed", "0.1");
  await page.click("h1"); // a focused list uses the keys itself
  await page.keyboard.down("w");
  await user.untilSpeed((v) => v > 0.05, "w drives");
  await user.press("Space", async () => (await user.speed()) < 0.02, "space stops");
  await page.keyboard.up("w");
  check((await user.phase()) === "teaching", "the lap continues");
}

async function scriptDrives() {
  await user.press("#script", async () => (await user.speed()) > 0.1, "the script drives", () => page.isVisible("#script"));
  await user.untilText("#seen", /tag36h11:\d+/);
  await user.untilQuads("quads are drawn into the image");
  await user.until(() => page.evaluate(() => window.waymark.tags().length > 1), "tags are drawn before there is a map");
  check((await page.getAttribute("#follow", "aria-pressed")) === "true", "the view follows a running robot");
  await user.until(async () => (await outside(page, await page.evaluate(() => window.waymark.tags()))) === 0, "the tags that were seen are in view");
}

async function replays() {
  await user.go("replaying");
  await user.untilSpeed((v) => v > 0.1, "it drives by itself");
  await user.untilText("#lights", /● localisation/);
  await user.go("paused");
  await user.untilSpeed((v) => v < 0.02, "a paused robot is stationary");
  await user.go("replaying");
  await user.until(() => page.$("#legend .estimate"), "the estimate is never drawn");
  await user.untilText("#seen", /residual [\d.]+ px/);
  await user.until(async () => parseFloat((await user.text("#phase")).split(";")[1]) > 1.2, "it does not progress"); // metres of the route
  if (images) await page.screenshot({ path: `${images}/live.png` });
  user.drives = false;
  await page.click("h1");
  await user.press("Space", async () => (await user.phase()) === "stopped", "space stops the replay");
  await user.untilSpeed((v) => v < 0.02, "space stops a replay");
  check((await user.text("#phase")).includes("stopped by the operator"), "the reason of the stop");
  await user.looksBack(2); // while the robot is stationary, because a page on a busy machine is slow
}

/** A second viewer without the token only watches. */
async function onlyWatches() {
  const { page: other } = await openPage(browser, origin);
  await other.goto(origin);
  await other.waitForFunction(() => document.body.dataset.phase === "stopped");
  check(!(await other.isVisible("#go")) && (await other.textContent("#viewers")).includes("You are watching"), "no buttons without the token");
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

/** Begins another lap although there is a map, and discards it. */
async function teachesAgain() {
  await user.press("#teach", async () => (await user.phase()) === "teaching", "another lap is taught", () => page.isVisible("#teach"));
  check(!(await page.isVisible("#teach")), "while a lap is taught there is no other to begin");
  await user.press("#stop", async () => (await user.phase()) === "idle", "the other lap is dropped");
}

/** Teach, map, replay. */
async function session() {
  await opens();
  await accessible(page, "idle");
  await drivesByHand();
  await scriptDrives();
  await user.untilPhase("ready");
  check((await user.text("#legend")).includes("route"), "the route is there");
  await replays();
  await onlyWatches();
  await phoneAndDark();
  await teachesAgain();
  return "taught, mapped and replayed";
}

/** Checks the camera images of a robot while it is taught. */
async function looks() {
  await opens();
  await user.go("teaching");
  await user.takes();
  await scriptDrives();
  await user.until(() => page.evaluate(() => window.waymark.latencies().length > 5), "no image is drawn with its tags");
  const grey = await page.$eval("#image", (canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const seen = new Set();
    for (let i = 0; i < data.length; i += 4) seen.add(data[i]);
    return [canvas.width, canvas.height, seen.size];
  });
  check(grey[0] === 640 && grey[1] === 480 && grey[2] > 50, `an image of ${grey}`);
  await accessible(page, "teaching");
  await user.looksBack(0.5);
  await user.press("#stop", async () => (await user.phase()) === "idle", "the lap is dropped");
  const ages = (await page.evaluate(() => window.waymark.latencies())).sort((a, b) => a - b);
  return `${ages.length} images, from the robot's program to the screen: median ${ages[ages.length >> 1].toFixed(0)} ms, ` +
    `95 % ${ages[Math.floor(ages.length * 0.95)].toFixed(0)} ms`;
}

try {
  const words = await (what === "session" ? session() : looks());
  check(user.troubles.length === 0, user.troubles.join("; "));
  console.log(`${words}; control was lost ${user.lost} times, the page was silent for ${((await user.silence()) / 1000).toFixed(1)} s at most; ` +
    `total ${((Date.now() - started) / 1000).toFixed(1)} s`);
} catch (error) {
  console.error(`${error.message}\nphase: ${await user.text("#phase").catch(() => "")}\nstatus: ${await user.text("#status").catch(() => "")}\ntroubles: ${user.troubles.join("; ")}`);
  if (process.env.WAYMARK_FAILED) await page.screenshot({ path: process.env.WAYMARK_FAILED }).catch(() => {});
  process.exitCode = 1;
} finally {
  await browser.close();
}
