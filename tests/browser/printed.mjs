// The page on paper: no figure is cut, and what can be moved stands still.

import { execFileSync } from "node:child_process";
import { join } from "node:path";

/** Pages of a printed file, as text. */
const pages = (file) =>
  execFileSync("pdftotext", ["-raw", file, "-"], { encoding: "utf8", maxBuffer: 1 << 27 }).split("\f");

export async function prints(page, report, folder, fault) {
  await page.emulateMedia({ media: "print" });
  const seen = await page.$$eval(
    "input, button.play, .view-buttons, .choice",
    (all) => all.filter((e) => e.getClientRects().length).length,
  );
  if (seen) fault(`${seen} controls are printed`);
  // Letters that take no room, in the first and in the last corner of each figure.
  const count = await page.evaluate(() => {
    const figures = [...document.querySelectorAll("figure")].filter((f) => f.getClientRects().length);
    figures.forEach((figure, k) => {
      figure.style.position = "relative";
      for (const [end, place] of [
        ["a", "top:0"],
        ["b", "bottom:0"],
      ]) {
        const mark = document.createElement("span");
        mark.className = "mark-of-test";
        mark.textContent = `figure${k}${end}`;
        mark.style.cssText = `position:absolute;left:0;${place};font-size:2px;line-height:1;color:#777`;
        figure.append(mark);
      }
    });
    return figures.length;
  });
  for (const format of ["A4", "Letter"]) {
    const file = join(folder, `${report.name}-${format}.pdf`);
    await page.pdf({ path: file, format, printBackground: true });
    const text = pages(file);
    for (let k = 0; k < count; k++) {
      const [first, last] = ["a", "b"].map((end) => text.findIndex((t) => t.includes(`figure${k}${end}`)));
      const name = await page.evaluate(
        (k) => document.querySelectorAll("figure figcaption")[k]?.textContent.slice(0, 40),
        k,
      );
      if (first < 0 || last < 0) fault(`${format}: figure ${k} (${name}) is not on paper`);
      else if (first !== last)
        fault(`${format}: figure ${k} (${name}) begins on page ${first + 1} and ends on page ${last + 1}`);
    }
  }
  await page.$$eval(".mark-of-test", (all) => all.forEach((e) => e.remove()));
  await page.emulateMedia({ media: "screen" });
}
