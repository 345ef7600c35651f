// The reports of all examples in a real browser. Started by `cargo xtask report`:
//   node report.mjs FOLDER BROWSER TRUEAXIS
// FOLDER has reports.json and calibration reports.json, and gets pictures and printed pages; BROWSER has playwright-core and
// axe-core.

import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { certified } from "./certificate.mjs";
import * as checks from "./checks.mjs";
import { agreesEverywhere, pointsRight } from "./positions.mjs";
import { prints } from "./printed.mjs";

const [folder, driver, trueaxis] = process.argv.slice(2);
const drivers = createRequire(join(driver, "package.json"));
const { chromium } = drivers("playwright-core");
const AXE = readFileSync(drivers.resolve("axe-core/axe.min.js"), "utf8");
const reports = JSON.parse(readFileSync(join(folder, "reports.json"), "utf8"));
const certificates = JSON.parse(readFileSync(join(folder, "certificates.json"), "utf8"));
const pictures = join(folder, "pictures");
mkdirSync(pictures, { recursive: true });

const FLAGS = [
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];
/** Widths at which nothing may overflow: a phone, a desk. */
const WIDTHS = [390, 1400];
/** Milliseconds of the processor in which a page is open, at the best of so many times: other work on the computer, which
 * only adds to it through caches, is not counted. */
const MOST_OPEN = 1000;
const OPENINGS = 3;

/** Of these there are pictures, and axe looks at them. */
const SHOWN = ["huron-13", "kolibri-12", "mill-21", "six-axes"];

const faults = [];

/** A page of a report, whose messages and requests are faults. */
async function open(browser, report, { width, scheme, motion = "no-preference" }) {
  const context = await browser.newContext({
    viewport: { width, height: 900 },
    colorScheme: scheme,
    reducedMotion: motion,
  });
  const page = await context.newPage();
  // Other steps may take the processors.
  page.setDefaultTimeout(300_000);
  const address = `file://${report.page}`;
  const fault = (words) => faults.push(`${report.name}, ${width} px, ${scheme}: ${words}`);
  page.on("console", (message) => fault(`console ${message.type()}: ${message.text()}`));
  page.on("pageerror", (error) => fault(`error: ${error.message}`));
  page.on("request", (request) => request.url() === address || fault(`asks for ${request.url()}`));
  page.on("dialog", (dialog) => fault(`dialog: ${dialog.message()}`));
  await page.goto(address);
  await page.waitForFunction(() => document.querySelector("#worst-list li"));
  return { page, context, fault };
}

/** Loads a page again; the processor time (ms) of its main thread until it is open. */
async function opening(page) {
  const session = await page.context().newCDPSession(page);
  await session.send("Performance.enable", { timeDomain: "threadTicks" });
  const spent = async () => {
    const { metrics } = await session.send("Performance.getMetrics");
    return 1000 * metrics.find((metric) => metric.name === "TaskDuration").value;
  };
  const before = await spent();
  await page.reload();
  await page.waitForFunction(() => document.querySelector("#worst-list li"));
  const after = await spent();
  await session.detach();
  return after - before;
}

async function look(browser, report) {
  const figures = {};
  for (const [k, width] of WIDTHS.entries()) {
    const scheme = ["dark", "light"][k];
    const { page, context, fault } = await open(browser, report, { width, scheme });
    // The rest differ from a few in what is on them only.
    const isShown = SHOWN.includes(report.name);
    const schemes = isShown ? ["light", "dark"] : [scheme];
    for (const other of isShown ? schemes : []) {
      await page.emulateMedia({ colorScheme: other });
      await page.screenshot({ path: join(pictures, `${report.name}-${width}-${other}.png`), fullPage: true });
    }
    // What is folded is looked at too.
    await page.$$eval("details", (all) => all.forEach((e) => (e.open = true)));
    for (const other of schemes) {
      await page.emulateMedia({ colorScheme: other });
      const found = await page.evaluate(checks.contrast);
      figures.contrast = Math.min(figures.contrast ?? Infinity, found.least);
      found.faults.forEach((words) => fault(`${other}: ${words}`));
    }
    await page.emulateMedia({ colorScheme: scheme });
    // The contrast of the other scheme has been looked at, and nothing else depends on it.
    const axe = isShown ? await checks.accessible((text) => page.evaluate(text), AXE) : [];
    axe.forEach(fault);
    for (const check of [checks.overflow, checks.figures, checks.hostile])
      (await page.evaluate(check)).forEach(fault);
    if (width === Math.max(...WIDTHS)) {
      figures.open = await opening(page);
      for (let times = 1; times < OPENINGS && figures.open > MOST_OPEN; times++)
        figures.open = Math.min(figures.open, await opening(page));
      if (figures.open > MOST_OPEN) fault(`opening it takes ${figures.open} ms of the processor`);
      await page.waitForFunction(() => document.querySelector("#worst-list li"));
      Object.assign(figures, await agreesEverywhere(page, report, trueaxis, folder, fault));
      await pointsRight(page, report, trueaxis, fault);
      if (await page.isVisible(".disagreement")) fault("the page does not agree with the program");
      await checks.keyboard(page, fault);
      await checks.sliders(page, fault);
      await checks.field(page, fault);
      Object.assign(figures, await prints(page, report, pictures, fault));
    }
    await context.close();
  }
  if (report === reports[0]) await once(browser, report);
  const far = Object.entries(figures).map(
    ([name, value]) => `${name} ${value === undefined ? "-" : value.toPrecision(3)}`,
  );
  console.log(`  ${report.name.padEnd(22)} ${far.join("  ")}`);
}

/** What is the same on every page. */
async function once(browser, report) {
  const calm = await open(browser, report, { width: 1400, scheme: "light", motion: "reduce" });
  await checks.calm(calm.page, calm.fault);
  await calm.context.close();
  const copy = {
    ...report,
    name: `${report.name} falsified`,
    page: join(folder, `${report.name}-falsified.html`),
  };
  writeFileSync(copy.page, checks.falsified(readFileSync(report.page, "utf8")));
  const wrong = await open(browser, copy, { width: 1400, scheme: "light" });
  await checks.alarm(wrong.page, wrong.fault);
  await wrong.context.close();
}

/** Lists by name. */
function grouped(all, name) {
  const lists = new Map();
  for (const one of all) lists.set(name(one), [...(lists.get(name(one)) ?? []), one]);
  return lists;
}

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: FLAGS,
});
console.log("in the browser: least contrast, opens (ms), 1000 positions: mm, rad, corrections that differ; printed pages");
try {
  // Two at a time: a page waits for pictures most of the time.
  const rest = [...reports];
  const worker = async () => {
    for (let report = rest.shift(); report; report = rest.shift()) await look(browser, report);
  };
  await Promise.all([worker(), worker()]);
  for (const one of certificates) await certified(browser, one, pictures, faults);
} finally {
  await browser.close();
}
if (faults.length) {
  // What is the same but for its numbers is told once, with how often.
  const kinds = grouped(faults, (fault) =>
    fault
      .replace(/^[^:]*: /, "")
      .replace(/[\d.]+/g, "#")
      .slice(0, 60),
  );
  const told = [...kinds.values()].map((alike) => `  ${alike.length} × ${alike[0].replace(/\s+/g, " ")}`);
  console.error(`${faults.length} faults:\n${told.slice(0, 60).join("\n")}`);
  process.exit(1);
}
