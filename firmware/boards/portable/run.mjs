// Runs the program for WebAssembly: node run.mjs PROGRAM
import { readFileSync, writeSync } from "node:fs";

let memory;
const put = (from, count) => {
  for (let end = from + count; from < end; ) from += writeSync(1, memory, from, end - from);
};
const module = new WebAssembly.Module(readFileSync(process.argv[2]));
const { exports } = new WebAssembly.Instance(module, { console: { put } });
memory = new Uint8Array(exports.memory.buffer);
process.exitCode = exports.run();
