// What a page costs its processor while a wall loads, from Chromium's own trace: how long it is deaf to a
// finger (the longest task of its main thread), and how much work comes before each tier is seen.
//
// Times by the clock (PerformanceObserver's "longtask") say little here: the machine that tests has other
// things to do, and frames are drawn in software, for which the browser's main thread waits. So it is
// processor time that counts, without what goes into reading a drawn frame back, which a browser with a GPU
// does not do. Chromium's own throttling is not used, as it slows down by the clock too.

import { fine, open, ready } from "./browser.mjs";

const TASK = "ThreadControllerImpl::RunTask"; // as Chromium calls one
const BACK = "GLES2::ReadPixels"; // a frame drawn in software goes to the screen
const MARK = "the page under test: ";

/** Leaves marks in the trace when a tier stands. */
function watch(mark) {
  const seen = new Set();
  const note = () => {
    const tier = document.querySelector("wall-topo")?.getAttribute("data-ready");
    if (!tier || seen.has(tier)) return;
    seen.add(tier);
    performance.mark(mark + tier);
  };
  new MutationObserver(note).observe(document, { subtree: true, attributes: true, attributeFilter: ["data-ready"] });
}

/** Work that is always the same, to know the machine by; one task of a page. */
function piece(mark) {
  performance.mark(mark);
  const numbers = Array.from({ length: 20_000 }, (_, k) => (k * 7919) % 20_011);
  return numbers.sort((one, two) => one - two)[0];
}

/**
 * Milliseconds of processor time of a page: `tasks` of its main thread until its finer tier stands, longest
 * first; `piece`: what that took in the same page, at best; `first` and `detail`: what of it went by until that
 * tier stood, with the workers' `beside` it.
 */
export async function workOf(browser, url, size = {}) {
  const prepare = async (page) => {
    await page.addInitScript(`(${watch})(${JSON.stringify(MARK)})`);
    await browser.startTracing(page, { categories: ["toplevel", "blink.user_timing", "gpu"] });
  };
  const { page, log, close } = await open(browser, url, { prepare, ...size });
  await ready(page, "detail");
  for (let k = 0; k < 5; k++) await page.evaluate(`(${piece})(${JSON.stringify(`${MARK}piece`)})`);
  const { traceEvents: events } = JSON.parse((await browser.stopTracing()).toString());
  fine(log);
  await close();
  const marks = Object.fromEntries(["first", "detail"].map((tier) => [tier, events.find(({ name }) => name === MARK + tier)]));
  const { pid, tid } = marks.first; // the browser has pages of its own
  const own = events.filter((event) => event.pid === pid && event.tdur !== undefined);
  const back = own.filter((event) => event.name === BACK && event.tid === tid);
  const within = (outer, inner) => inner.ts >= outer.ts && inner.ts < outer.ts + outer.dur;
  const tasks = own
    .filter(({ name }) => name === TASK)
    .map((task) => {
      const lost = task.tid === tid ? back.filter((event) => within(task, event)) : [];
      const took = lost.reduce((rest, { tdur }) => rest - tdur, task.tdur) / 1000;
      return { main: task.tid === tid, thread: task.tid, at: task.ts, until: task.ts + task.dur, took };
    });
  const began = events.filter(({ name, pid: of }) => of === pid && name === `${MARK}piece`);
  const pieces = began.map(({ ts }) => tasks.find(({ main, at, until }) => main && at <= ts && ts < until).took);
  const names = new Map(events.filter(({ name }) => name === "thread_name").map((event) => [`${event.pid} ${event.tid}`, event.args.name]));
  const worker = ({ thread }) => names.get(`${pid} ${thread}`)?.startsWith("DedicatedWorker");
  const sum = (some) => some.reduce((total, { took }) => total + took, 0);
  const until = ({ ts }) => {
    const before = tasks.filter(({ at }) => at < ts);
    return { page: sum(before.filter(({ main }) => main)), beside: sum(before.filter(worker)) };
  };
  return {
    tasks: tasks.filter(({ main, at }) => main && at < marks.detail.ts).map(({ took }) => took).sort((one, two) => two - one),
    piece: Math.min(...pieces),
    first: until(marks.first),
    detail: until(marks.detail),
  };
}

