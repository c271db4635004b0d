// The jobs of wasm_hosts.py in node: a line of JSON in, a line of JSON out.
import { createInterface } from "node:readline";
import { carryOut } from "./wasm_job.mjs";

const bytes = (text) => Buffer.from(text, "base64");
const text = (data) => Buffer.from(data).toString("base64");
for await (const line of createInterface({ input: process.stdin })) {
  console.log(JSON.stringify(carryOut(JSON.parse(line), bytes, text)));
}
