// Carries out a job of wasm_hosts.py in this engine; `bytes` and `text` turn base64 into bytes and back.
export const carryOut = ({ module, steps }, bytes, text) => {
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
      results.push(text(new Uint8Array(exports.memory.buffer, rest[0], 8 * rest[1])));
    }
  }
  return results;
};
