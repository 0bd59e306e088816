// Chromium with the page, and the hands of a person on it.
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { chromium } from "playwright-core";
import { serve } from "./serve.mjs";

export const { PAGE, RIGS, EXPECTED, CHROMIUM } = process.env;
// A search on a busy machine.
const PATIENCE_MS = 600_000;
const axe = await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

export async function begin() {
  const server = await serve(PAGE);
  const browser = await chromium.launch({ executablePath: CHROMIUM, args: ["--no-sandbox"] });
  return { address: server.address, browser, end: () => Promise.all([browser.close(), server.close()]) };
}

// The page in a window of its own. What it asks for and complains of is noted.
export async function open({ browser, address }, options = {}) {
  const context = await browser.newContext({ acceptDownloads: true, ...options });
  const page = await context.newPage();
  const noted = { asked: [], complaints: [] };
  context.on("request", (request) => noted.asked.push(`${request.method()} ${request.url()}`));
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && noted.complaints.push(message.text()));
  page.on("pageerror", (error) => noted.complaints.push(String(error)));
  await page.goto(address);
  return { page, noted, close: () => context.close() };
}

export async function give(page, id, ...files) {
  await page.setInputFiles(`#${id}`, files);
}

export const text = (name, text) => ({ name, mimeType: "text/plain", buffer: Buffer.from(text) });

export async function verdict(page) {
  await page.click("#run:enabled");
  await page.waitForSelector("#result:visible, #run-error:visible", { timeout: PATIENCE_MS });
  const error = page.locator("#run-error");
  if (await error.isVisible()) throw new Error(await error.textContent());
}

export async function downloaded(page, id) {
  const [download] = await Promise.all([page.waitForEvent("download"), page.click(`#${id}`)]);
  return readFile(await download.path(), "utf8");
}

// What axe finds in the page and in the report's frame.
export async function findings(page) {
  const found = [];
  for (const frame of page.frames()) {
    await frame.evaluate(axe);
    const { violations } = await frame.evaluate(() => globalThis.axe.run(document, { iframes: false }));
    for (const { id, nodes } of violations) found.push(...nodes.map(({ target, failureSummary }) => `${id} ${target}: ${failureSummary}`));
  }
  return found;
}
