// The page on paper: no figure is cut, no heading stands alone, no sheet is half empty, and there are not too many.

import { execFileSync } from "node:child_process";
import { join } from "node:path";

/** Pages of a printed file, as text. */
export const pages = (file) =>
  execFileSync("pdftotext", ["-raw", file, "-"], { encoding: "utf8", maxBuffer: 1 << 27 }).split("\f");

/** Sheets that the report of a machine with five axes takes. */
const MOST_PAGES = 8;
/** Part of a sheet that is written on, of all but the last. */
const LEAST_FILLED = 0.6;

/** The bottom margin (points), where numbers of sheets stand. */
const MARGIN = 34;

/** How much of each page is written on, from its top to its margin. */
function filled(file) {
  const boxes = execFileSync("pdftotext", ["-bbox", file, "-"], { encoding: "utf8", maxBuffer: 1 << 28 });
  return boxes
    .split("<page ")
    .slice(1)
    .map((page) => {
      const height = Number(page.match(/height="([\d.]+)"/)[1]);
      const words = [...page.matchAll(/yMin="([\d.]+)" xMax="[\d.]+" yMax="([\d.]+)"/g)];
      const ends = words.filter((found) => Number(found[1]) < height - MARGIN).map((found) => Number(found[2]));
      return Math.max(0, ...ends) / height;
    });
}

/** Letters that take no room: in the first and in the last corner of each figure, in each heading and in what comes
 * after it. The names of figures and headings. */
function mark() {
  const put = (element, text, place) => {
    const span = document.createElement("span");
    span.className = "mark-of-test";
    span.textContent = `${text};`;
    span.style.cssText = `position:absolute;left:0;${place};font-size:2px;line-height:1;color:#777`;
    element.style.position = "relative";
    element.append(span);
  };
  const isShown = (element) => element.getClientRects().length > 0;
  const name = (element) => element.textContent.trim().slice(0, 40);
  const figures = [...document.querySelectorAll("figure")].filter(isShown);
  const parts = [...document.querySelectorAll("h2, h3, p, figure, caption, th, td, li")].filter(isShown);
  const isHeading = (element) => /^H[23]$/.test(element.tagName);
  const headings = parts.flatMap((element, k) => {
    const after = parts.slice(k + 1).find((other) => !isHeading(other));
    return isHeading(element) && after ? [[element, after]] : [];
  });
  const names = {
    figures: figures.map((figure) => name(figure.querySelector("figcaption"))),
    headings: headings.map(([heading]) => name(heading)),
  };
  figures.forEach((figure, k) => {
    put(figure, `figure${k}a`, "top:0");
    put(figure, `figure${k}b`, "bottom:0");
  });
  headings.forEach(([heading, after], k) => {
    put(heading, `heading${k}a`, "top:0");
    put(after, `heading${k}b`, "top:0");
  });
  return names;
}

export async function prints(page, report, folder, fault) {
  // As it opens: what is folded stays folded.
  await page.$$eval("details", (all) => all.forEach((e) => (e.open = false)));
  await page.emulateMedia({ media: "print" });
  const seen = await page.$$eval(
    "input, button.play, .view-buttons, .choice",
    (all) => all.filter((e) => e.getClientRects().length).length,
  );
  if (seen) fault(`${seen} controls are printed`);
  const axes = await page.evaluate(() => window.trueaxis.machine.model.axes.length);
  return paper(page, report.name, folder, fault, axes === 5 ? MOST_PAGES : Infinity);
}

/** The page as it is printed on `most` pages. */
export async function paper(page, name, folder, fault, most) {
  await page.emulateMedia({ media: "print" });
  const names = await page.evaluate(mark);
  const sheets = [];
  for (const format of ["A4", "Letter"]) {
    const file = join(folder, `${name}-${format}.pdf`);
    await page.pdf({ path: file, format, printBackground: true });
    const text = pages(file);
    const where = (name) => text.findIndex((t) => t.includes(`${name};`));
    for (const [kind, all] of [
      ["figure", names.figures],
      ["heading", names.headings],
    ]) {
      for (const [k, name] of all.entries()) {
        const [first, last] = ["a", "b"].map((end) => where(`${kind}${k}${end}`));
        if (first < 0 || last < 0) fault(`${format}: ${kind} ${k} (${name}) is not on paper`);
        else if (first !== last)
          fault(`${format}: ${kind} ${k} (${name}) begins on page ${first + 1}, its end is on page ${last + 1}`);
      }
    }
    const full = filled(file);
    sheets.push(full.length);
    if (full.length > most) fault(`${format}: it takes ${full.length} pages, more than ${most}`);
    full.slice(0, -1).forEach((part, k) => {
      if (part < LEAST_FILLED) fault(`${format}: page ${k + 1} is filled to ${Math.round(100 * part)} % only`);
    });
  }
  await page.$$eval(".mark-of-test", (all) => all.forEach((e) => e.remove()));
  await page.emulateMedia({ media: "screen" });
  return { pages: Math.max(...sheets) };
}
