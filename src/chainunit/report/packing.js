"use strict";
/* Data of the page, which stands in it packed, see chainunit.report.html. It is unpacked at once, not by the stream
   of the browser, so that a page that is printed as soon as it is loaded has its plots. */
const LENGTHS = [3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 17, 19, 23, 27, 31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258];
const LENGTH_BITS = [0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0];
const WAYS = [1, 2, 3, 4, 5, 7, 9, 13, 17, 25, 33, 49, 65, 97, 129, 193, 257, 385, 513, 769, 1025, 1537, 2049, 3073, 4097, 6145, 8193, 12289, 16385, 24577];
const WAY_BITS = [0, 0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13, 13];
const ORDER = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];
// a code of Huffman by the length of each symbol (RFC 1951)
const codeOf = (lengths) => {
  const counts = new Uint16Array(16), places = new Uint16Array(16), symbols = new Uint16Array(lengths.length);
  for (const length of lengths) counts[length] += 1;
  counts[0] = 0;
  for (let k = 1; k < 16; k++) places[k] = places[k - 1] + counts[k - 1];
  lengths.forEach((length, symbol) => {
    if (length) symbols[places[length]++] = symbol;
  });
  return { counts, symbols };
};
const inflated = (packed) => {
  // a header of 10 bytes without fields of its own, and at the end the size
  let place = 10, held = 0, count = 0, end = 0;
  const out = new Uint8Array(new DataView(packed.buffer).getUint32(packed.length - 4, true));
  const bits = (number) => {
    while (count < number) {
      held |= packed[place++] << count;
      count += 8;
    }
    const value = held & ((1 << number) - 1);
    held >>>= number;
    count -= number;
    return value;
  };
  const symbol = ({ counts, symbols }) => {
    let code = 0, first = 0, index = 0;
    for (let length = 1; length < 16; length++) {
      code |= bits(1);
      if (code - counts[length] < first) return symbols[index + code - first];
      index += counts[length];
      first = (first + counts[length]) << 1;
      code <<= 1;
    }
    throw new Error("a packed text is damaged");
  };
  const fixed = () => [
    codeOf(Array.from({ length: 288 }, (_, k) => (k < 144 ? 8 : k < 256 ? 9 : k < 280 ? 7 : 8))),
    codeOf(Array(30).fill(5)),
  ];
  const own = () => {
    const letters = bits(5) + 257, ways = bits(5) + 1, given = bits(4) + 4, lengths = Array(19).fill(0);
    for (let k = 0; k < given; k++) lengths[ORDER[k]] = bits(3);
    const code = codeOf(lengths), all = [];
    while (all.length < letters + ways) {
      const next = symbol(code);
      if (next < 16) all.push(next);
      else {
        const again = next === 16 ? 3 + bits(2) : next === 17 ? 3 + bits(3) : 11 + bits(7);
        const length = next === 16 ? all[all.length - 1] : 0;
        for (let k = 0; k < again; k++) all.push(length);
      }
    }
    return [codeOf(all.slice(0, letters)), codeOf(all.slice(letters))];
  };
  for (let last = 0; !last; ) {
    last = bits(1);
    const kind = bits(2);
    if (kind === 0) {
      held = count = 0;
      const size = packed[place] | (packed[place + 1] << 8);
      out.set(packed.subarray(place + 4, place + 4 + size), end);
      place += 4 + size;
      end += size;
      continue;
    }
    const [letters, ways] = kind === 1 ? fixed() : own();
    for (let next = symbol(letters); next !== 256; next = symbol(letters)) {
      if (next < 256) out[end++] = next;
      else {
        const length = LENGTHS[next - 257] + bits(LENGTH_BITS[next - 257]), k = symbol(ways);
        const back = WAYS[k] + bits(WAY_BITS[k]);
        for (let n = 0; n < length; n++, end++) out[end] = out[end - back];
      }
    }
  }
  return out;
};
const unpackedBytes = (id) => {
  const text = document.getElementById(id).textContent;
  return inflated(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)));
};
const unpackedData = (id) => {
  const restored = (x) => {
    if (Array.isArray(x)) return x.map(restored);
    if (x === null || typeof x !== "object") return x;
    if (!("+" in x)) return Object.fromEntries(Object.entries(x).map(([name, each]) => [name, restored(each)]));
    const [digits, ...differences] = x["+"], scale = 10 ** digits;
    let whole = 0;
    return differences.map((difference) => (whole += difference) / scale);
  };
  return restored(JSON.parse(new TextDecoder().decode(unpackedBytes(id))));
};
// a script that the page holds packed
const runPacked = (id) => {
  const script = document.createElement("script");
  script.textContent = new TextDecoder().decode(unpackedBytes(id));
  document.head.appendChild(script);
};
