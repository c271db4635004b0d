"use strict";
/* Data of the page, which stands in it packed, see chainunit.report.packing. */
const unpackedBytes = (id) => {
  const text = document.getElementById(id).textContent, packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
};
const unpackedData = async (id) => {
  const restored = (x) => {
    if (Array.isArray(x)) return x.map(restored);
    if (x === null || typeof x !== "object") return x;
    if (!("+" in x)) return Object.fromEntries(Object.entries(x).map(([name, each]) => [name, restored(each)]));
    const [digits, ...differences] = x["+"], scale = 10 ** digits;
    let whole = 0;
    return differences.map((difference) => (whole += difference) / scale);
  };
  return restored(JSON.parse(new TextDecoder().decode(await unpackedBytes(id))));
};
