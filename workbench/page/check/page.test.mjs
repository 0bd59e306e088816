// The page as a person uses it.
import assert from "node:assert/strict";
import { readFile, readdir } from "node:fs/promises";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { EXPECTED, RIGS, begin, downloaded, findings, give, open, text, verdict } from "./browser.mjs";

// A number may differ from that of the command line by this part of its standard deviation.
const PART_OF_SIGMA = 1e-3;
let world;
before(async () => (world = await begin()));
after(() => world.end());

const names = (outcome) => outcome.effects.map(({ name }) => name);

function differences(here, there) {
  return there.effects.flatMap(({ name, parameters }, k) =>
    Object.entries(parameters).map(([key, { value, std }]) => {
      const off = Math.abs(here.effects[k].parameters[key].value - value);
      return { key: `${name}.${key}`, off: off === 0 ? 0 : off / (std || Math.abs(value)) };
    }));
}

for (const file of (await readdir(EXPECTED)).filter((name) => name.endsWith(".json")).sort()) {
  const rig = file.slice(0, -5);
  test(`${rig} has the verdict, the names and the numbers of the command line`, async () => {
    const { page, noted, close } = await open(world);
    await give(page, "model-file", join(RIGS, rig, "model.toml"));
    await give(page, "log-file", join(RIGS, rig, "log.csv"));
    await give(page, "held-files", join(RIGS, rig, "holdout.csv"));
    await verdict(page);
    const here = JSON.parse(await downloaded(page, "get-json"));
    const there = JSON.parse(await readFile(join(EXPECTED, file), "utf8"));
    assert.deepEqual([here.verdict, here.grade, names(here)], [there.verdict, there.grade, names(there)]);
    const worst = differences(here, there).reduce((a, b) => (b.off > a.off ? b : a), { key: "no number", off: 0 });
    assert.ok(worst.off <= PART_OF_SIGMA, `${worst.key} is ${worst.off} of its deviation off`);
    console.log(`${rig}: ${here.verdict}, ${names(here).join(" + ") || "–"}; ${worst.key} ${worst.off.toExponential(1)} sigma off; ${here.runtime_s.toFixed(1)} s`);
    assert.deepEqual(noted.complaints, []);
    await close();
  });
}

test("everything is asked of the page's own server, and nothing is sent", async () => {
  const { page, noted, close } = await open(world);
  await page.click("#example");
  await verdict(page);
  assert.match(await downloaded(page, "get-model"), /\[known\./);
  assert.match(await downloaded(page, "get-report"), /<svg/);
  const elsewhere = noted.asked.filter((line) => !line.startsWith(`GET ${world.address}`) && !/^GET blob:/.test(line));
  assert.deepEqual(elsewhere, []);
  assert.deepEqual(noted.complaints, []);
  await close();
});

const LOOKS = {
  light: [{ colorScheme: "light" }, { width: 1100, height: 900 }],
  dark: [{ colorScheme: "dark" }, { width: 1100, height: 900 }],
  narrow: [{ colorScheme: "light" }, { width: 390, height: 844 }],
};

// What axe finds in each look, and whether anything is wider than the window. SHOTS: a folder for pictures.
async function looked(page, when) {
  const found = [];
  for (const [look, [media, size]] of Object.entries(LOOKS)) {
    await page.emulateMedia(media);
    await page.setViewportSize(size);
    await page.waitForTimeout(200);
    if (process.env.SHOTS) await page.screenshot({ path: join(process.env.SHOTS, `${when}-${look}.png`), fullPage: true });
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    found.push(...(await findings(page)).map((finding) => `${look}: ${finding}`), ...(wide > 0 ? [`${look}: ${wide} px too wide`] : []));
  }
  return found;
}

test("axe finds nothing in light, in dark and at 390 px: at first, with a log, with a verdict", async () => {
  const { page, close } = await open(world);
  assert.deepEqual(await looked(page, "before"), []);
  await page.click("#example");
  await page.waitForSelector("#run:enabled");
  for (const box of ["form-box", "rarer", "in-file"]) await page.click(`#${box} > summary`);
  assert.deepEqual(await looked(page, "mapping"), []);
  for (const box of ["form-box", "rarer", "in-file"]) await page.click(`#${box} > summary`);
  await verdict(page);
  await page.frameLocator("#report").locator("figure.live").first().waitFor();
  assert.deepEqual(await looked(page, "verdict"), []);
  await close();
});

test("a search is cancelled, and can be started again", async () => {
  const { page, close } = await open(world);
  await page.click("#example");
  await page.click("#run:enabled");
  await page.click("#stop");
  assert.equal(await page.textContent("#status"), "Cancelled.");
  await verdict(page);
  await close();
});

test("a search is started with the keyboard alone", async () => {
  const { page, close } = await open(world);
  await page.locator("#example").focus();
  await page.keyboard.press("Enter");
  await page.waitForSelector("#run:enabled");
  await page.locator("#run").focus();
  await page.keyboard.press("Enter");
  await page.waitForSelector("#result:visible", { timeout: 600_000 });
  assert.equal(await page.evaluate(() => document.activeElement.id), "result-title");
  await close();
});

test("what is no log is refused in the engine's words, with its place", async () => {
  const { page, close } = await open(world);
  await give(page, "log-file", text("bad.csv", "t_s,u_v,omega_rad_s\n0,1,2\n0.1,one,3\n"));
  await page.waitForSelector("#log-error:visible");
  assert.match(await page.textContent("#log-error"), /bad\.csv.*line 3.*one/);
  assert.ok(await page.isDisabled("#run"));
  await close();
});

test("files that look wrong are told with what mends them, and one may go on", async () => {
  const { page, close } = await open(world);
  await page.click("#example");
  await page.waitForSelector("#run:enabled");
  await page.fill("#columns", "u_v=u_v*-1");
  await page.waitForFunction(() => document.getElementById("column-1").value === "eu_v*-1");
  await verdict(page);
  assert.match(await page.textContent("#verdict"), /looks as if.*To mend it/s);
  assert.ok(await page.isVisible("#accept-data") && (await page.isHidden("#get-model")));
  await page.click("#accept-data");
  await page.click("#stop");
  await close();
});

test("a model that is none is refused, and unknown numbers are told", async () => {
  const { page, close } = await open(world);
  await page.fill("#model-text", "schema = \"truing-model/1\"\n[motor]\nR_ohms = 2\n");
  await page.waitForSelector("#model-error:visible");
  assert.match(await page.textContent("#model-error"), /R_ohms/);
  await page.click("#form-box > summary");
  await page.fill("#form-R_ohm", "2,2");
  await page.click("#form button");
  await page.waitForSelector("#model-error", { state: "hidden" });
  await page.waitForFunction(() => document.getElementById("model-state").textContent.includes("Kt_nm_per_a"));
  assert.match(await page.inputValue("#model-text"), /R_ohm = 2\.2\n/);
  await close();
});

// A log under names that say nothing.
async function foreign() {
  const own = await readFile(join(RIGS, "basebot_drive", "log.csv"), "utf8");
  return text("foreign.csv", own.replace("run,t_s,u_v,omega_rad_s", "k,zeit,spg,a (b)"));
}

test("columns are chosen, written as a line, and read from it", async () => {
  const { page, close } = await open(world);
  await give(page, "log-file", await foreign());
  await page.waitForSelector("#log-error:visible");
  const choose = async (label, column) => page.getByLabel(label, { exact: true }).selectOption({ label: column });
  await page.fill("#columns", "");
  await choose("Time", "zeit");
  await choose("Voltage at the motor", "spg");
  await choose("Separate records", "k");
  await choose("Speed", "a (b)");
  await page.waitForSelector("#log-error", { state: "hidden" });
  assert.equal(await page.inputValue("#columns"), 't_s=zeit,u_v=spg,omega_rad_s="a (b)",run=k');
  await page.getByLabel("Speed: unit").selectOption({ label: "rpm" });
  assert.match(await page.inputValue("#columns"), /omega_rpm="a \(b\)"/);
  await page.fill("#columns", 't_ms=zeit,u_v=spg/2,omega_rad_s="a (b)",run=k');
  await page.waitForFunction(() => document.getElementById("unit-0").value === "t_ms");
  assert.equal(await page.getByLabel("Voltage at the motor", { exact: true }).inputValue(), "espg/2");
  await close();
});

test("a part of the log is chosen with the mouse, and that part is compared", async () => {
  const { page, close } = await open(world);
  await page.click("#example");
  await page.waitForSelector("#run:enabled");
  await page.locator("#curve-input").scrollIntoViewIfNeeded();
  const over = await page.locator("#curve-input .u-over").boundingBox();
  const drag = [0.1, 0.7].map((part) => over.x + part * over.width);
  await page.mouse.move(drag[0], over.y + 60);
  await page.mouse.down();
  await page.mouse.move(drag[1], over.y + 60, { steps: 5 });
  await page.mouse.up();
  const [from, to] = [await page.inputValue("#from"), await page.inputValue("#to")].map(Number);
  assert.ok(from < to && to > 0, `${from} to ${to}`);
  await verdict(page);
  assert.match(await page.textContent("#command"), new RegExp(`--from ${from} --to ${to}`));
  await close();
});
