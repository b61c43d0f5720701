// node tests/weak.mjs INDEX.html [CPU slowdown 4] [Mbit/s 9] [round trip ms 170]
//
// How long until the wall is seen on a weak device, simulated: Chromium's own throttling slows the
// page's main thread and its network (by default four times slower, 9 Mbit/s and 170 ms: a cheap phone
// on common 4G; 0 Mbit/s: no limit). The page is served over HTTP, text compressed as any web server does.
// Prints, from the request of the page: when the viewer runs, when the first tier is drawn, when the
// trees for picking are built, when the finer tier is drawn; then what other work on this machine changes
// least: the processor time, without the throttling, times the slowdown (tests/work.mjs), of the page and of
// its workers until each tier is drawn, and of the longest task; that task by the clock; the bytes of the bodies over the wire: what the first tier needs, and
// all; and this machine's load: beyond the number of its processors times by the clock say little.
//
// It does NOT say how fast a phone draws: here a frame is drawn in software by this computer, which
// is slower than any phone's GPU, and that drawing is not slowed down. What it shows is the work of
// the page itself (download, unpacking, decoding, handing over) and regressions of it.

import { createReadStream, statSync } from "node:fs";
import { createServer } from "node:http";
import { loadavg } from "node:os";
import { dirname, extname, join, resolve } from "node:path";
import { createGzip } from "node:zlib";
import { open, start } from "./browser.mjs";
import { workOf } from "./work.mjs";

const [source, slowdown = "4", megabits = "9", latency = "170"] = process.argv.slice(2);
if (!source) {
  process.stderr.write("usage: node tests/weak.mjs INDEX.html [CPU slowdown] [Mbit/s] [round trip ms]\n");
  process.exit(2);
}
const limited = Number(megabits) > 0;
const root = dirname(resolve(source));
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".glb": "model/gltf-binary" };
const sent = {};
const server = createServer((request, response) => {
  const name = new URL(request.url, "http://here").pathname;
  const path = join(root, name === "/" ? "index.html" : name);
  const type = TYPES[extname(path)];
  const small = [".html", ".js"].includes(extname(path));
  const headers = { "Content-Type": type, "Cache-Control": "no-store" };
  if (small) headers["Content-Encoding"] = "gzip";
  else headers["Content-Length"] = statSync(path).size;
  response.writeHead(200, headers);
  const file = createReadStream(path);
  const body = small ? file.pipe(createGzip({ level: 9 })) : file;
  body.on("data", (part) => (sent[name] = (sent[name] ?? 0) + part.length));
  body.pipe(response);
}).listen(0, "127.0.0.1");

/** Notes times in the page. */
function watch() {
  window.times = { longest: 0 };
  const note = () => {
    const wall = document.querySelector("wall-topo");
    if (wall?.shadowRoot) window.times.script ??= performance.now();
    const tier = wall?.getAttribute("data-ready");
    if (tier) window.times[tier] ??= performance.now();
    if (wall?.stage?.picking?.trees.length) window.times.pick ??= performance.now();
  };
  new MutationObserver(note).observe(document, { subtree: true, attributes: true, childList: true });
  setInterval(note, 5);
  new PerformanceObserver((list) => {
    for (const { duration } of list.getEntries()) {
      window.times.longest = Math.max(window.times.longest, duration);
    }
  }).observe({ type: "longtask", buffered: true });
}

const browser = await start();
try {
  const prepare = async (page) => {
    const client = await page.context().newCDPSession(page);
    await client.send("Network.enable");
    await client.send("Network.emulateNetworkConditions", {
      offline: false,
      latency: limited ? Number(latency) : 0,
      downloadThroughput: limited ? (Number(megabits) * 1e6) / 8 : -1,
      uploadThroughput: limited ? 1e6 / 8 : -1,
    });
    await client.send("Emulation.setCPUThrottlingRate", { rate: Number(slowdown) });
  };
  const url = `http://127.0.0.1:${server.address().port}/`;
  const size = { width: 390, height: 844, phone: true, wait: false, before: watch, prepare };
  const { page } = await open(browser, url, size);
  const stands = (tier) => page.waitForSelector(`wall-topo[data-ready=${tier}]`, { timeout: 120_000 });
  await stands("detail");
  await page.waitForFunction(() => window.times.pick);
  const times = await page.evaluate(() => window.times);
  const all = Object.values(sent).reduce((sum, count) => sum + count, 0);
  const later = Object.entries(sent).find(([name]) => name.endsWith("detail.glb"))?.[1] ?? 0;
  // A second load, after its bytes were counted.
  const work = await workOf(browser, url, { width: 390, height: 844, phone: true });
  const slowed = (milliseconds) => `${Math.round(milliseconds * slowdown)} ms`;
  const both = ({ page, beside }) => `${slowed(page)} and ${slowed(beside)} beside`;
  const seconds = (milliseconds) => `${(milliseconds / 1000).toFixed(1)} s`;
  const megabytes = (bytes) => `${(bytes / 1e6).toFixed(2)} MB`;
  const network = limited ? `${megabits} Mbit/s, ${latency} ms` : "no limit of the network";
  process.stdout.write(
    `${slowdown} times slower, ${network}, load ${loadavg()[0].toFixed(0)}:\n` +
      `viewer runs after ${seconds(times.script)}, first tier drawn after ${seconds(times.first)}, ` +
      `picking ready after ${seconds(times.pick)}, finer tier drawn after ${seconds(times.detail)}\n` +
      `processor time: ${both(work.first)} until the first tier, ${both(work.detail)} until the finer one\n` +
      `longest task ${slowed(work.tasks[0])} of processor time, by the clock ${Math.round(times.longest)} ms\n` +
      `${megabytes(all - later)} before the wall is seen, ${megabytes(all)} in all\n`,
  );
} finally {
  await browser.close();
  server.close();
}
