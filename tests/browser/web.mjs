// The page of `cargo xtask web` in real browsers, beside the command. Started by `cargo xtask web --check`:
//   node web.mjs PAGE FOLDER DRIVER TRUEAXIS FIRMWARE
// FOLDER has the blobs of all examples as the command makes them, and gets pictures. FIRMWARE is the firmware for QEMU.

import { execFileSync, spawn, spawnSync } from "node:child_process";
import { mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { connect, createServer } from "node:net";
import { availableParallelism } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { Worker } from "node:worker_threads";
import * as checks from "./checks.mjs";

const [page, folder, driver, trueaxis, firmware] = process.argv.slice(2);
const { resolve } = createRequire(join(driver, "package.json"));
const { default: puppeteer } = await import(pathToFileURL(resolve("puppeteer-core")));
const AXE = readFileSync(resolve("axe-core/axe.min.js"), "utf8");

const BROWSERS = {
  chromium: {
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"],
  },
  firefox: { browser: "firefox", executablePath: process.env.FIREFOX ?? "/usr/bin/firefox-esr" },
};
/** All checks run in the first browser. */
const FIRST = "chromium";
/** Examples that are compiled in the others, too: of `exact`, of `grid3d`, and the largest. */
const FURTHER = ["huron-13", "mill-21-grid", "hu40-84"];
/** Milliseconds from opening to the verdict of the Huron, at the best of so many times. This and the next three limits are
 * for an idle computer on which the loop of `slowness` takes `LOOP` milliseconds; while it is slower, they are longer. */
const [MOST_OPEN, OPENINGS] = [4500, 5];
const LOOP = 210;
/** Milliseconds from opening to the first view, at the best of as many times. */
const MOST_FIRST = 1000;
/** Longest pause between two pictures while a command runs, and until it is cancelled: milliseconds. */
const [MOST_PAUSE, MOST_CANCEL] = [400, 1000];
/** The example with the most parameters, and how many times as long as the command of the development build it may take in the
 * page: that one takes a third longer than the README's, of which four times are allowed. */
const [LARGEST, MOST_TIMES] = ["hu40-84", 3];
/** Longest command: milliseconds. */
const MOST_WAIT = 300_000;

const faults = [];
const examples = JSON.parse(
  /<script type="application\/json" id="examples">([^]*?)<\/script>/.exec(readFileSync(page, "utf8"))[1],
);

/** A new page; what it asks for and complains about is a fault. */
async function open(browser, name, width = 1400, before = () => {}) {
  const tab = await browser.newPage();
  // Other steps may take the processors: what takes too long by itself is measured, not waited for.
  tab.setDefaultTimeout(MOST_WAIT);
  const fault = (words) => faults.push(`${name}: ${words}`);
  await tab.setViewport({ width, height: 900 });
  tab.on("console", (message) => fault(`console: ${message.text()}`));
  tab.on("pageerror", (error) => fault(`error: ${error.message}`));
  tab.on("request", (request) => {
    const url = request.url();
    // Firefox reports its own font and icon.
    if (url.split("#")[0] !== `file://${page}` && !/^(blob|data):/.test(url)) fault(`asks for ${url}`);
  });
  await tab.evaluateOnNewDocument(before);
  await tab.goto(`file://${page}`);
  return { tab, fault };
}

/** A fixed amount of work, and the milliseconds that it takes. */
const WORK = `
  const start = performance.now();
  let x = 0;
  for (let i = 0; i < 2e7; i++) x = Math.sqrt(x + i);
  require("node:worker_threads").parentPort.postMessage(performance.now() - start + (x < 0));
`;

/** How much slower than that computer this one is now, by that work on every processor at once, as a browser works; at least 1. */
async function slowness() {
  const one = () => new Promise((done) => new Worker(WORK, { eval: true }).on("message", done));
  const taken = await Promise.all(Array.from({ length: availableParallelism() }, one));
  return Math.max(1, Math.max(...taken) / LOOP);
}

/** The least of what some measurements take, in milliseconds of that computer; ends with the first that is at most `most`. */
async function least(most, measure) {
  let best = Infinity;
  for (let k = 0; k < OPENINGS && best > most; k++) {
    const before = await slowness();
    const taken = await measure();
    best = Math.min(best, Math.round(taken / Math.max(before, await slowness())));
  }
  return best;
}

const text = (tab, selector) => tab.$eval(selector, (e) => e.textContent);

async function ended(tab) {
  await tab.waitForFunction(() => document.querySelector("#cancel").disabled, { timeout: MOST_WAIT });
  return text(tab, "#state");
}

async function press(tab, selector) {
  await tab.$eval(selector, (button) => button.click());
  return ended(tab);
}

/** Drops files, names to texts. */
const drop = (tab, files) =>
  tab.evaluate(
    (all) => window.trueaxisPage.take(Object.entries(all).map(([name, content]) => new File([content], name))),
    files,
  );

/** A file that the page offers, or has. */
async function bytes(tab, name) {
  const list = await tab.evaluate((name) => {
    const { made, files } = window.trueaxisPage;
    const found = made()[name] ?? files.get(name)?.bytes;
    return found ? btoa(Array.from(found, (b) => String.fromCharCode(b)).join("")) : null;
  }, name);
  return list === null ? null : Buffer.from(list, "base64");
}

/** An empty folder with these files, for the command. */
function place(name, files) {
  const where = join(folder, name);
  rmSync(where, { recursive: true, force: true });
  mkdirSync(where, { recursive: true });
  for (const [file, content] of Object.entries(files)) writeFileSync(join(where, file), content);
  return where;
}

/** What the command says and writes. */
function native(where, args, more = {}) {
  const { status, stdout, stderr } = spawnSync(trueaxis, args, { cwd: where, encoding: "utf8", env: { ...process.env, ...more } });
  return { status, stdout, stderr, file: (name) => readFileSync(join(where, name)) };
}

async function same(tab, fault, what, name, wanted) {
  const found = await bytes(tab, name);
  if (!found) fault(`${what}: there is no ${name}: ${await text(tab, "#problem")}`);
  else if (!found.equals(wanted)) fault(`${what}: ${name} differs from the command's`);
}

/** The page takes a few times as long as the command on one thread. */
function times(fault, name, page) {
  const { files, options } = examples[name];
  const where = place("timed", files);
  const start = Date.now();
  const args = ["compile", ...Object.keys(files), "-o", "machine.trax", "--report", "report.html", ...options.split(" ").filter(Boolean)];
  const { status, stderr } = native(where, args, { RAYON_NUM_THREADS: "1" });
  const own = (Date.now() - start) / 1e3;
  if (status > 1) fault(stderr);
  console.log(`  ${name}: ${page.toFixed(1)} s in the page, ${own.toFixed(1)} s by the command on one thread: ${(page / own).toFixed(1)} times`);
  if (page > MOST_TIMES * own) fault(`${name} takes ${(page / own).toFixed(1)} times as long as the command`);
}

/** Every example gives the bytes of the command; in a further browser, which runs the same instructions, those of FURTHER. */
async function compiles(browser, kind) {
  const { tab, fault } = await open(browser, kind);
  for (const name of kind === FIRST ? Object.keys(examples) : FURTHER) {
    await tab.select("#example", name);
    const start = Date.now();
    const state = await press(tab, "#compile");
    await same(tab, fault, name, "machine.trax", readFileSync(join(folder, `${name}.trax`)));
    const agrees = await tab.waitForSelector("#agreement:not(.disagreement)").catch(() => null);
    if (!agrees) fault(`${name}: no report, or one that does not agree`);
    console.log(`  ${kind} ${name.padEnd(22)} ${Date.now() - start} ms  ${state}`);
    if (name === LARGEST) times(fault, name, Number(/in ([\d.]+) s/.exec(state)[1]));
  }
  await tab.close();
}

/** From opening to the verdict of the Huron. */
async function opens(browser, kind) {
  const best = await least(MOST_OPEN, async () => {
    const start = Date.now();
    const { tab } = await open(browser, kind);
    await tab.select("#example", "huron-13");
    await tab.$eval("#compile", (button) => button.click());
    // Printed before the report is made.
    await tab.waitForFunction(() => /the tables reduce/.test(document.querySelector("#said").textContent));
    const taken = Date.now() - start;
    await tab.close();
    console.log(`  ${kind}: from opening to the verdict ${taken} ms`);
    return taken;
  });
  if (best > MOST_OPEN) faults.push(`${kind}: from opening to the verdict ${best} ms`);
}

/** An error is marked at its line, with the words of the command. */
async function marks(browser, kind) {
  const { tab, fault } = await open(browser, kind);
  const good = examples["huron-13"].files;
  const wrong = [
    ["machine.toml", (t) => t.replace('branch = "tool"', 'branch = "toool"')],
    ["machine.toml", (t) => t.replace("range", "rnage")],
    ["errors-13.toml", (t) => t.replace("EB0A", "EB0Q")],
    ["errors-13.toml", (t) => `${t}\n[[[`],
  ];
  for (const [file, change] of wrong) {
    const files = { ...good, [file]: change(good[file]) };
    await tab.$eval("#clear", (button) => button.click());
    if (await tab.$("#problem pre")) fault("a problem remains without files");
    await drop(tab, files);
    await tab.waitForFunction(() => document.querySelector("#problem pre"));
    const { status, stderr } = native(place("wrong", files), ["explain", "machine.toml", "errors-13.toml"]);
    const [said, marked] = [await text(tab, "#problem"), await text(tab, "#numbers b").catch(() => "")];
    const line = / --> .*:(\d+):\d+$/m.exec(stderr)?.[1];
    if (status !== 2 || said.trim() !== stderr.trim()) fault(`${file}: says\n${said}\nnot\n${stderr}`);
    if (!line || marked !== line) fault(`${file}: marks line “${marked}”, not ${line}`);
  }
  // Put right in the editor.
  await tab.evaluate((t) => {
    const box = document.querySelector("#text");
    box.value = t;
    box.dispatchEvent(new Event("input"));
  }, good["errors-13.toml"]);
  await tab.waitForFunction(() => !document.querySelector("#problem pre"));
  await tab.close();
}

/** A long command leaves the page alive, and can be cancelled. */
async function cancels(browser, kind) {
  const { tab, fault } = await open(browser, kind);
  await tab.select("#example", "hu40-84");
  const { pause, stages } = await tab.evaluate(async () => {
    document.querySelector("#compile").click();
    const stages = new Set();
    let [pause, before] = [0, performance.now()];
    for (const end = before + 2500; before < end; ) {
      await new Promise(requestAnimationFrame);
      const now = performance.now();
      pause = Math.max(pause, now - before);
      before = now;
      stages.add(document.querySelector("#state").textContent);
    }
    return { pause, stages: [...stages] };
  });
  const start = Date.now();
  const state = await press(tab, "#cancel");
  console.log(`  ${kind}: longest pause ${pause.toFixed(0)} ms, cancelled in ${Date.now() - start} ms (${stages.join("; ")})`);
  const taken = Date.now() - start;
  const slow = await slowness();
  if (pause > MOST_PAUSE * slow) fault(`the page does not move for ${pause} ms`);
  if (!/Cancelled/.test(state) || taken > MOST_CANCEL * slow) fault(`not cancelled: ${state}`);
  if (!stages.some((stage) => /\w/.test(stage) && stage !== "Compiling")) fault("no progress is shown");
  await tab.select("#example", "router-10");
  await press(tab, "#compile");
  await same(tab, fault, "after cancelling", "machine.trax", readFileSync(join(folder, "router-10.trax")));
  await tab.close();
}

/** Names and texts of files are words, never markup or options. */
async function hostile(browser, kind) {
  const { tab, fault } = await open(browser, kind);
  const evil = '<img src=x onerror="window.ran=1"><script>window.ran=1</script>';
  const quoted = JSON.stringify(evil);
  const { "machine.toml": machine, "errors-10.toml": errors } = examples["router-10"].files;
  const files = {
    [`--help ${evil.replaceAll("/", "")}.toml`]: machine.replace('"Router"', quoted),
    "-o.toml": errors.replace('"Router"', quoted),
    [`${evil.replaceAll("/", "")}.ngc`]: `(${evil})\nM2\n`,
  };
  await drop(tab, files);
  await press(tab, "#compile");
  if (!(await bytes(tab, "machine.trax"))) fault(`hostile names: ${await text(tab, "#problem")}`);
  await drop(tab, { "-o.toml": `[parameters]\n${evil} = 1\n` });
  await tab.waitForFunction(() => document.querySelector("#problem pre"));
  const [ran, elements] = await tab.evaluate(() => [window.ran ?? null, document.querySelectorAll("img").length]);
  if (ran !== null || elements) fault("something from a file was run or became markup");
  const violated = await tab.evaluate(
    () =>
      new Promise((done) => {
        document.addEventListener("securitypolicyviolation", () => done(true));
        const script = document.createElement("script");
        script.textContent = "window.ran = 1";
        document.body.append(script);
        setTimeout(() => done(false), 1000);
      }),
  );
  if (!violated || (await tab.evaluate(() => window.ran)) !== undefined) fault("the policy lets foreign scripts run");
  // The console reports the violation that was asked for.
  faults.splice(0, faults.length, ...faults.filter((f) => !/Content.Security.Policy|inline script/i.test(f)));
  await tab.evaluate(() =>
    window.trueaxisPage.take([new File([new Uint8Array(100e6)], "large.csv")]),
  );
  if (!/large\.csv is not opened: 100 MB/.test(await text(tab, "#problem"))) fault("100 MB are not refused");
  if (await tab.evaluate(() => window.trueaxisPage.files.has("large.csv"))) fault("100 MB are taken");
  await tab.close();
}

/** Waits until tables belong to the errors as they are. */
const settled = (tab) => tab.waitForFunction(() => window.trueaxisPage.settled(), { timeout: MOST_WAIT });

const slide = (tab, id, value) =>
  tab.$eval(
    id,
    (e, value) => {
      e.value = value ?? e.max;
      e.dispatchEvent(new Event("input"));
      e.dispatchEvent(new Event("change"));
    },
    value,
  );

/** The first view: a machine that moves, a circle that deforms, tables that make it round, a sentence. */
async function firstView(browser, kind) {
  const best = await least(MOST_FIRST, async () => {
    const { tab } = await open(browser, kind);
    const taken = await tab.evaluate(() => performance.getEntriesByName("first view")[0].startTime);
    await tab.close();
    console.log(`  ${kind}: the first view after ${taken.toFixed(0)} ms`);
    return taken;
  });
  if (best > MOST_FIRST) faults.push(`${kind}: the first view after ${best} ms`);
  // Nothing pressed, and before the command is there.
  const { tab, fault } = await open(browser, kind);
  await tab.waitForSelector("#stage-machine polygon");
  if (!/^20 µm out of round\./.test(await text(tab, "#sentence"))) fault(`it begins with “${await text(tab, "#sentence")}”`);
  const picture = () => tab.$eval("#stage-machine", (e) => e.innerHTML);
  const still = await picture();
  await tab.waitForFunction((old) => document.querySelector("#stage-machine").innerHTML !== old, {}, still);
  await tab.click("#pause");
  // What it is drawn from is what the command answers.
  await settled(tab);
  const answers = await tab.evaluate(async () => {
    const { answer } = JSON.parse(document.querySelector("#first-model").textContent);
    const found = structuredClone(window.trueaxisPage.known());
    found.model.checks = [];
    return [JSON.stringify(answer), JSON.stringify(found)];
  });
  if (answers[0] !== answers[1]) {
    writeFileSync(join(folder, "model.json"), `${answers[1]}\n`);
    fault(`web/first/model.json is not what the command answers: copy ${join(folder, "model.json")}`);
  }
  // Radius times the angle, and nothing with tables.
  const round = () => tab.evaluate(() => { const { stage } = window.trueaxisPage; return [0, 1].map((acts) => stage.figures(stage.trace(acts)).round); });
  for (const angle of [400, -350, 0]) {
    await slide(tab, "#squareness", angle);
    await settled(tab);
    const [off, on] = await round();
    // The radius of 100 mm times the angle, to second order.
    if (Math.abs(off - 0.1 * Math.abs(angle)) > 0.01) fault(`${angle} µm/m make ${off} µm out of round`);
    if (on > 0.05) fault(`with tables, ${angle} µm/m leave ${on} µm`);
  }
  if (!/^A perfect circle/.test(await text(tab, "#sentence"))) fault("without errors it does not say so");
  await slide(tab, "#squareness", 400);
  await settled(tab);
  await tab.click("#tables-switch");
  await tab.waitForFunction(() => /^Round to/.test(document.querySelector("#sentence").textContent));
  await tab.waitForFunction(() => window.trueaxisPage.stage.acts === 1);
  if (!(await tab.$("#stage-circle .ghost"))) fault("the error that was there is not seen any more");
  await tab.click("#in-arcsec");
  const arcsec = await tab.$eval("#squareness-number", (e) => e.value);
  if (arcsec !== "82.5") fault(`400 µm/m are ${arcsec} arcsec`);
  // Everything is there after a reload, and in the link elsewhere.
  await tab.waitForFunction(() => location.hash.startsWith("#1."));
  await new Promise((resolve) => setTimeout(resolve, 800));
  const link = await tab.evaluate(() => location.href);
  await tab.reload();
  const isThere = async (place) => {
    await settled(place);
    const value = await place.$eval("#squareness-number", (e) => e.value);
    const on = await place.$eval("#tables-switch", (e) => e.getAttribute("aria-checked"));
    if (value !== "82.5" || on !== "true") fault(`after a reload: ${value} arcsec, tables ${on}`);
  };
  await isThere(tab);
  // A page that is not in front is not drawn.
  const other = await browser.newPage();
  other.setDefaultTimeout(MOST_WAIT);
  await other.goto(link);
  await isThere(other);
  await other.close();
  await tab.bringToFront();
  // Another machine, and back.
  await tab.click('#cards button[data-of="mill-21"]');
  await settled(tab);
  if (!(await tab.evaluate(() => window.trueaxisPage.files.has("errors-21.toml")))) fault("the card brings no machine");
  await new Promise((resolve) => setTimeout(resolve, 800));
  await tab.goBack();
  await tab.waitForFunction(() => document.querySelector("#squareness-number")?.value === "82.5");
  await tab.close();
}

/** A machine from nothing to a blob; what was entered stays. */
async function builds(browser, kind) {
  const { tab, fault } = await open(browser, kind);
  await slide(tab, "#squareness", 100);
  await tab.$eval("#builder", (e) => (e.open = true));
  await tab.$eval("#layout", (e) => {
    e.value = "wCAYFXZSt";
    e.dispatchEvent(new Event("input"));
  });
  await tab.$eval("#build", (button) => button.click());
  await settled(tab);
  const kept = await text(tab, "#parameters");
  if (!/EC0X/.test(kept) || /EXX1/.test(kept)) fault(`the built machine has the errors “${kept}”`);
  await tab.$eval("#add", (e) => (e.value = "EXX1"));
  await tab.$eval("#add-it", (button) => button.click());
  await settled(tab);
  if ((await tab.$eval("#error-EXX1-number", (e) => e.value)) !== "0") fault("an added error is not 0");
  const before = await tab.$eval("#stage-circle", (e) => e.innerHTML);
  // With a decimal comma.
  await tab.$eval("#error-EXX1-number", (e) => {
    e.value = "150,0";
    e.dispatchEvent(new Event("input"));
  });
  await settled(tab);
  if (before === (await tab.$eval("#stage-circle", (e) => e.innerHTML))) fault("an error does not change the circle");
  await tab.waitForFunction(() => /laser/.test(document.querySelector("#error-EXX1-note").textContent));
  await tab.$eval("#error-EXX1-number", (e) => {
    e.value = "many";
    e.dispatchEvent(new Event("input"));
  });
  if (!/“many” is not a number/.test(await text(tab, "#error-EXX1-note"))) fault("a number that is none is not named");
  const files = {};
  for (const name of ["machine.toml", "errors.toml"]) files[name] = await bytes(tab, name);
  if (!/EXX1 = 1\.5e-4/.test(files["errors.toml"])) fault("the field does not write the error file");
  await press(tab, "#compile");
  const where = place("built", files);
  const { status, stderr } = native(where, ["compile", "machine.toml", "errors.toml", "-o", "machine.trax"]);
  if (status !== 0) fault(`the built machine: ${stderr}`);
  else await same(tab, fault, "the built machine", "machine.trax", readFileSync(join(where, "machine.trax")));
  // With its tables on, the drawn machine lies on the one without errors: every dashed outline is a drawn face. An angle about the
  // tool would stay.
  await slide(tab, "#squareness", 0);
  await settled(tab);
  const apart = () =>
    tab.evaluate(() => {
      const all = (style) => [...document.querySelectorAll(`#stage-machine polygon${style}`)];
      const corners = (e) => e.getAttribute("points").split(/[ ,]/).map(Number);
      const drawn = all(":not(.ideal):not(.head)").map(corners);
      const far = (a) => Math.min(...drawn.map((b) => (a.length === b.length ? Math.max(...a.map((v, k) => Math.abs(v - b[k]))) : Infinity)));
      return Math.max(...all(".ideal").map(corners).map(far));
    });
  await tab.$eval("#pause", (button) => button.click());
  // Where X is farthest out, which shows its scale best.
  await tab.evaluate(() => {
    // It moves only where it is seen.
    scrollTo(0, 0);
    const { stage } = window.trueaxisPage;
    stage.turn = 0;
    stage.draw();
  });
  const off = await apart();
  await tab.$eval("#tables-switch", (button) => button.click());
  await tab.waitForFunction(() => window.trueaxisPage.stage.acts === 1);
  const on = await apart();
  if (!(off > 5) || !(on < 0.2 * off)) fault(`drawn with tables off ${off} px from the ideal machine, on ${on} px`);
  await tab.close();
}

/** Files that are not for this page are named, with what to do. */
async function names(browser, kind) {
  const { tab, fault } = await open(browser, kind);
  for (const [name, content, wanted] of [
    ["Rahmen.xlsx", "PK\u0003\u0004", /Rahmen\.xlsx is a workbook[^]*save the sheet as CSV/],
    ["p.csv", "ball;x;y\n1;0,5;2\n", /p\.csv separates its columns by semicolons and writes 0,5 for 0\.5[^]*p\.csv:2/],
    ["q.csv", "ball\tx\n1\t0,5\n", /q\.csv writes numbers with a decimal comma/],
  ]) {
    await drop(tab, { [name]: content });
    const said = await text(tab, "#problem");
    if (!wanted.test(said)) fault(`${name}: says ${said}`);
    if (await tab.evaluate((name) => window.trueaxisPage.files.has(name), name)) fault(`${name} is taken`);
  }
  const why = await text(tab, "#identify-why");
  if (!/probings of balls/.test(why)) fault(`a disabled button says “${why}”`);
  await tab.close();
}

/** Identification, runs, and everything that is made from tables: the files of the command. */
async function others(browser, kind) {
  const { tab, fault } = await open(browser, kind);
  const root = new URL("../../", import.meta.url).pathname;
  const example = (name) => readFileSync(join(root, "examples", name), "utf8");
  const { "machine.toml": machine, "errors-10.toml": errors } = examples["kolibri-10"].files;
  const where = place("identify", {
    "machine.toml": machine,
    "errors-10.toml": errors,
    "artefact.toml": example("kolibri/artefact.toml"),
    "plan.csv": example("kolibri/plan.csv"),
  });
  const simulate = "simulate probings machine.toml errors-10.toml --artefact artefact.toml --plan plan.csv --noise 1 -o p.csv";
  execFileSync(trueaxis, simulate.split(" "), { cwd: where });
  // One row that a probe did not touch well.
  const rows = readFileSync(join(where, "p.csv"), "utf8").split("\n");
  rows[20] = rows[20].replace(/^([^,]*,)([^,]*)/, (_, ball, x) => `${ball}${(Number(x) + 0.2).toFixed(4)}`);
  const probings = rows.join("\n");
  writeFileSync(join(where, "p.csv"), probings);
  const said = native(where, "identify machine.toml p.csv -o errors.toml".split(" "));
  await drop(tab, { "machine.toml": machine, "p.csv": probings });
  await press(tab, "#identify");
  await same(tab, fault, "identify", "errors.toml", said.file("errors.toml"));
  const shown = await text(tab, "#said");
  if (!shown.includes(said.stdout.trim())) fault(`identify says\n${shown}\nnot\n${said.stdout}`);
  if (!shown.includes("line 21")) fault("identify does not name the outlier");
  await press(tab, "#compile");
  const args = ["compile", "machine.toml", "errors.toml", "-o", "machine.trax"];
  const made = native(where, args);
  if (made.status > 1) fault(made.stderr);
  await same(tab, fault, "identified", "machine.trax", made.file("machine.trax"));

  const program = "G21 G90 G53 G0 X0 Y0 Z100 A0 C0\nG53 G1 X50 Y20 F1000\nM2\n";
  writeFileSync(join(where, "part.ngc"), program);
  await drop(tab, { "part.ngc": program });
  const conversions = [
    ["#rust", "corrections.rs", "generate machine.trax -o corrections.rs"],
    ["#c", "corrections.c", "generate machine.trax -o corrections.c"],
    [
      "#cec",
      "cec.mpf",
      "export cec machine.trax --axes C=AX1,A=AX2,Y=AX3,X=AX4,Z=AX5 --factor-tables not-added --machine machine.toml -o cec.mpf",
    ],
    [
      "#gcode",
      "corrected-part.ngc",
      "gcode part.ngc --compensation machine.trax --machine machine.toml --units mm -o corrected-part.ngc",
    ],
  ];
  await tab.$eval("#cec-axes", (e) => (e.value = "C=AX1,A=AX2,Y=AX3,X=AX4,Z=AX5"));
  for (const [button, name, words] of conversions) {
    const { status, stderr } = native(where, words.split(" "));
    await press(tab, button);
    if (status === 0) await same(tab, fault, words, name, readFileSync(join(where, name)));
    else if (status === 2 && !(await text(tab, "#problem")).includes(stderr.trim())) fault(`${words}: says other than\n${stderr}`);
  }

  // Runs of a laser.
  const runs = {
    "x.csv": '# axis = "X"\n# reads = "tool +X"\n# unit = "um"\n# at = { Y = 600.0, Z = -100.0 }\ntarget,+1,-1\n0,0.2,-3.9\n200,3.1,-1.2\n400,7.4,3.0\n600,9.8,5.9\n',
    "pitch.csv": '# axis = "X"\n# reads = "tool +Z to +X"\n# unit = "arcsec"\ntarget,+1,-1\n0,0.0,0.2\n200,1.1,1.0\n400,2.4,2.6\n600,3.3,3.4\n',
  };
  await tab.$eval("#clear", (button) => button.click());
  const router = examples["router-10"].files["machine.toml"];
  await drop(tab, { "machine.toml": router, ...runs });
  await press(tab, "#measured");
  const bench = place("runs", { "machine.toml": router, ...runs });
  const measured = native(bench, "measured machine.toml x.csv pitch.csv -o errors.toml".split(" "));
  if (measured.status > 1) fault(measured.stderr);
  await same(tab, fault, "measured", "errors.toml", measured.file("errors.toml"));
  await tab.close();
}

/** A port that nobody listens to. */
const freePort = () =>
  new Promise((resolve) => {
    const server = createServer().listen(0, "127.0.0.1", () => {
      const { port } = server.address();
      server.close(() => resolve(port));
    });
  });

/** Connects to a TCP port as soon as it is open. */
async function dial(port) {
  for (const end = Date.now() + 20_000; ; ) {
    const socket = connect(port, "127.0.0.1").setNoDelay(true);
    const isOpen = await new Promise((resolve) => socket.once("connect", () => resolve(true)).once("error", () => resolve(false)));
    if (isOpen) return socket;
    if (Date.now() > end) throw new Error("QEMU does not open its port");
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
}

/** In the page: what Web Serial gives, on the line of the emulated board. After so many writes it is unplugged. */
function standIn() {
  let [into, isOpen] = [null, false];
  window.unplugAfter = Infinity;
  const gone = () => new DOMException("The device has been lost.", "NetworkError");
  const port = {
    readable: null,
    writable: null,
    async open({ baudRate }) {
      if (isOpen || !(baudRate > 0)) throw new DOMException("The port is already open.", "InvalidStateError");
      isOpen = true;
      port.readable = new ReadableStream({ start: (controller) => (into = controller) });
      port.writable = new WritableStream({
        write: (bytes) => {
          if (--window.unplugAfter < 0) {
            window.unplugAfter = Infinity;
            into.error(gone());
            port.readable = null;
            throw gone();
          }
          return window.toBoard([...bytes]);
        },
      });
    },
    async close() {
      if (port.readable?.locked || port.writable.locked) throw new TypeError("The port is in use.");
      isOpen = false;
      into = port.readable = port.writable = null;
    },
  };
  window.fromBoard = (bytes) => into?.enqueue(new Uint8Array(bytes));
  Object.defineProperty(navigator, "serial", { value: { requestPort: async () => port } });
}

/** Tables are flashed from the page into the emulated board, also after the cable was pulled; it is asked and switched. */
async function flashes(browser, kind) {
  const where = place("board", {});
  const number = await freePort();
  const serial = `tcp:127.0.0.1:${number},server=on,wait=off,nodelay=on`;
  const words = "-machine mps2-an386 -nographic -monitor none -semihosting-config enable=on,target=native,arg=qemu";
  const board = spawn("qemu-system-arm", [...words.split(" "), "-serial", serial, "-kernel", firmware], { cwd: where, stdio: "ignore" });
  const tab = await browser.newPage();
  tab.setDefaultTimeout(MOST_WAIT);
  const fault = (words) => faults.push(`${kind}, flashing: ${words}`);
  tab.on("pageerror", (error) => fault(error.message));
  try {
    const line = await dial(number);
    await tab.exposeFunction("toBoard", (bytes) => void line.write(Buffer.from(bytes)));
    await tab.evaluateOnNewDocument(standIn);
    await tab.goto(`file://${page}`);
    line.on("data", (bytes) => tab.evaluate((all) => window.fromBoard(all), [...bytes]));
    await tab.select("#example", "huron-13");
    await press(tab, "#compile");
    await tab.$eval("#connect", (button) => button.click());
    await tab.waitForFunction(() => !document.querySelector("#flash").disabled);
    const says = async (selector, wanted) => {
      await press(tab, selector);
      const said = (await text(tab, "#said")) + (await text(tab, "#problem"));
      if (!wanted.test(said)) fault(`${selector}: says\n${said}`);
    };
    await says("#capacity", /^axes = 8$/m);
    await tab.evaluate(() => (window.unplugAfter = 6));
    await says("#flash", /the connection is lost[^]*an upload goes on where it was/);
    await tab.waitForFunction(() => document.querySelector("#flash").disabled && !document.querySelector("#connect").disabled);
    await tab.$eval("#connect", (button) => button.click());
    await tab.waitForFunction(() => !document.querySelector("#flash").disabled);
    await says("#flash", /from byte \d+ on, the rest was there\) written to slot [AB] and verified[^]*in use/);
    await says("#enable", /-> enabled, out/);
    await says("#dry-run", /-> enabled, dry run/);
    await tab.$eval("#watch", (button) => button.click());
    await tab.waitForFunction(() => /slot/.test(document.querySelector("#said").textContent));
    if (!/Cancelled/.test(await press(tab, "#cancel"))) fault("watching does not end");
    await says("#show", /dry run/);
    // Once more with the port closed and opened.
    const isOff = (off) => tab.waitForFunction((off) => document.querySelector("#show").disabled === off, {}, off);
    await tab.$eval("#connect", (button) => button.click());
    await isOff(true);
    await tab.$eval("#connect", (button) => button.click());
    await isOff(false);
    await says("#dry-run-off", /-> enabled, out/);
    await tab.$eval("#connect", (button) => button.click());
    await isOff(true);
    line.destroy();
    // The command finds in the board what it would write.
    writeFileSync(join(where, "machine.trax"), await bytes(tab, "machine.trax"));
    const again = () => native(where, ["flash", "machine.trax", "--port", `tcp:127.0.0.1:${number}`, "--json"]);
    let found = again();
    // QEMU listens again a moment after the last connection has ended.
    for (const end = Date.now() + 5000; /Connection refused/.test(found.stderr) && Date.now() < end; ) found = again();
    const { status, stdout, stderr } = found;
    if (status !== 0 || !JSON.parse(stdout).already) fault(`the board has other tables: ${stdout}${stderr}`);
  } finally {
    board.kill();
    await tab.close();
  }
}

/** Without Web Serial the page says so, and what to use. */
async function refusesPorts(browser, kind) {
  const { tab, fault } = await open(browser, kind, 1400, () => delete Navigator.prototype.serial);
  const [note, isOff] = await tab.evaluate(() => [
    document.querySelector("#ports-note").textContent,
    document.querySelector("#connect").disabled,
  ]);
  if (!/trueaxis flash/.test(note) || !isOff) fault(`a browser without Web Serial: ${note}`);
  await tab.close();
}

/** The page can be read, and used without a mouse. */
async function looks(browser, kind) {
  for (const width of [390, 1400]) {
    const { tab, fault } = await open(browser, `${kind}, ${width} px`, width);
    await tab.select("#example", "huron-13");
    await press(tab, "#compile");
    await tab.waitForSelector("#machine-drawing polygon");
    // One looks where the result is.
    const place = await tab.$eval("#summary", (e) => [e.getBoundingClientRect().top, innerHeight - e.getBoundingClientRect().bottom]);
    if (Math.min(...place) < 0) fault(`after compiling, the result is ${place} px outside the window`);
    await tab.$$eval("details", (all) => all.forEach((e) => (e.open = true)));
    for (const scheme of ["light", "dark"]) {
      await tab.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
      const { faults: found } = await tab.evaluate(checks.contrast);
      found.forEach((words) => fault(`${scheme}: ${words}`));
      (await checks.accessible((text) => tab.evaluate(text), AXE)).forEach((words) => fault(`${scheme}: ${words}`));
      await tab.screenshot({ path: join(folder, `page-${width}-${scheme}.png`), clip: { x: 0, y: 0, width, height: 3600 } });
    }
    (await tab.evaluate(checks.overflow)).forEach(fault);
    if (width > 1000) await checks.keyboard(tab, fault);
    await tab.emulateMediaType("print");
    const hidden = await tab.$$eval("main .screen-only", (all) => all.every((e) => !e.checkVisibility()));
    if (!hidden) fault("controls are printed");
    await tab.pdf({ path: join(folder, `page-${width}.pdf`) });
    await tab.close();
  }
}

for (const [kind, options] of Object.entries(BROWSERS)) {
  const browser = await puppeteer.launch({ headless: true, protocolTimeout: MOST_WAIT, ...options });
  try {
    await opens(browser, kind);
    const all = [firstView, names, builds, flashes, refusesPorts, marks, cancels, hostile, compiles];
    if (kind === FIRST) all.push(looks, others);
    for (const check of all) {
      const start = Date.now();
      await check(browser, kind);
      console.log(`  ${kind}: ${check.name} in ${((Date.now() - start) / 1000).toFixed(0)} s`);
    }
  } finally {
    await browser.close();
  }
}
if (faults.length) {
  console.error(`${faults.length} faults:\n${faults.slice(0, 60).join("\n")}`);
  process.exit(1);
}
