// Carries out the jobs of wasm_hosts.py in this engine: a line of JSON in, a line of JSON out.
import { createInterface } from "node:readline";

const bytes = (text) => Buffer.from(text, "base64");
for await (const line of createInterface({ input: process.stdin })) {
  const { module, steps } = JSON.parse(line);
  const { exports } = new WebAssembly.Instance(new WebAssembly.Module(bytes(module)), {});
  const results = [];
  for (const [what, ...rest] of steps) {
    if (what === "write") {
      const data = bytes(rest[1]);
      const lacking = rest[0] + data.length - exports.memory.buffer.byteLength;
      if (lacking > 0) exports.memory.grow(Math.ceil(lacking / 65536));
      new Uint8Array(exports.memory.buffer).set(data, rest[0]);
    } else if (what === "call") {
      results.push(exports[rest[0]](...rest[1]) ?? null);
    } else if (what === "time") {
      // rounds of so many calls each: the least time of a call [us]
      const [name, given, rounds, calls] = rest;
      const call = exports[name];
      let least = Infinity;
      for (let k = 0; k < rounds; ++k) {
        const begin = performance.now();
        for (let n = 0; n < calls; ++n) call(...given);
        least = Math.min(least, (1e3 * (performance.now() - begin)) / calls);
      }
      results.push(least);
    } else {
      results.push(Buffer.from(exports.memory.buffer, rest[0], 8 * rest[1]).toString("base64"));
    }
  }
  console.log(JSON.stringify(results));
}
