// The digests of digest.c of the same run in WebAssembly: a line of JSON in, a line for each digest out.
import { readFileSync } from "node:fs";

const bytes = (text) => Buffer.from(text, "base64");
const job = JSON.parse(readFileSync(0, "utf8"));
const { exports } = new WebAssembly.Instance(new WebAssembly.Module(bytes(job.module)), {});
const { memory } = exports;
const row = 8 * job.results;
const lacking = job.into + row * (job.steps + 1) - memory.buffer.byteLength;
if (lacking > 0) memory.grow(Math.ceil(lacking / 65536));
const write = (address, data) => new Uint8Array(memory.buffer).set(data, address);
for (const [address, text] of job.writes) write(address, bytes(text));
const given = bytes(job.given);
const take = (piece) => {
  for (const [k, address] of job.inputs.entries()) {
    const at = 8 * (piece * job.inputs.length + k);
    write(address, given.subarray(at, at + 8));
  }
};
take(0);
exports.derive?.();
exports.start();
let [a, b] = [0x811c9dc5, 0x9747b28c];
for (let piece = 0; piece < job.pieces; ++piece) {
  take(piece);
  const begin = piece * job.steps * job.step;
  const rows = exports.run(begin, job.step, 0, job.steps + 1, 0, job.chosen, job.into, job.groups);
  if (rows !== job.steps + 1) throw new Error(`${rows} rows in piece ${piece}`);
  const words = new Uint32Array(memory.buffer, job.into + row, (row * job.steps) / 4);
  for (const word of words) {
    a = Math.imul(a ^ word, 0x01000193);
    b = Math.imul(b ^ word, 0x85ebca6b);
    b ^= b >>> 13;
  }
  if ((piece + 1) % job.every === 0) {
    console.log([a, b].map((x) => (x >>> 0).toString(16).padStart(8, "0")).join(""));
  }
}
