// Calibration reports: they are read without scripts, and print on four pages at most.

import { join } from "node:path";
import * as checks from "./checks.mjs";
import { pages as sheets, paper } from "./printed.mjs";

const MOST_PAGES = 4;
const WIDTHS = [390, 1400];

/** Every sheet has the number of the report and its own, and the last one the end mark (ISO/IEC 17025, 7.8.2.1). */
function numbered(file, fault) {
  const all = sheets(file).filter((text) => text.trim());
  all.forEach((text, k) => {
    const wanted = [`page ${k + 1} of ${all.length}`, "Calibration report"];
    for (const words of wanted) if (!text.includes(words)) fault(`sheet ${k + 1} lacks "${words}"`);
    if (text.includes("End of calibration report") !== (k === all.length - 1)) fault(`the end mark is wrong on sheet ${k + 1}`);
  });
}

/** Looks at a certificate; `fault` is told what is wrong with it. */
export async function certified(browser, { name, page: file }, pictures, faults) {
  const address = `file://${file}`;
  let pages;
  for (const [k, width] of WIDTHS.entries()) {
    const context = await browser.newContext({ viewport: { width, height: 900 }, colorScheme: ["dark", "light"][k] });
    const page = await context.newPage();
    // Other steps may take the processors.
    page.setDefaultTimeout(300_000);
    const fault = (words) => faults.push(`${name}, ${width} px: ${words}`);
    page.on("console", (message) => fault(`console ${message.type()}: ${message.text()}`));
    page.on("request", (request) => request.url() === address || fault(`asks for ${request.url()}`));
    page.on("dialog", (dialog) => fault(`dialog: ${dialog.message()}`));
    await page.goto(address);
    if (await page.$$eval("script, b b, link, img", (all) => all.length)) fault("it has more than text and pictures");
    await page.screenshot({ path: join(pictures, `${name}-${width}.png`), fullPage: true });
    const found = await page.evaluate(checks.contrast);
    found.faults.forEach(fault);
    (await page.evaluate(checks.overflow)).forEach(fault);
    if (await page.$("figure")) (await page.evaluate(checks.figures)).forEach(fault);
    if (width === Math.max(...WIDTHS)) ({ pages } = await paper(page, name, pictures, fault, MOST_PAGES));
    await context.close();
    if (width === Math.max(...WIDTHS)) numbered(join(pictures, `${name}-A4.pdf`), fault);
  }
  console.log(`  ${name.padEnd(22)} pages ${pages}`);
}
