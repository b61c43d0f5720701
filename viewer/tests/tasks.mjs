// How long the page is deaf to a finger: the longest task of its main thread while a wall loads.
//
// A task's time by the clock (PerformanceObserver's "longtask") says little here: the machine that
// tests has other things to do, and frames are drawn in software, for which the browser's main thread
// waits. So it is the processor time of the task that counts, from Chromium's own trace. A phone that
// is `SLOWER` times slower takes that many times longer; Chromium's own throttling is not used, as it
// slows down by the clock too.

import assert from "node:assert/strict";
import { open, ready } from "./browser.mjs";
import { fine } from "./checks.mjs";

const SLOWER = 4;
const MOST = 200; // milliseconds
const TASK = "ThreadControllerImpl::RunTask"; // as Chromium calls one
const MARK = "the page under test";
const TRIES = 3; // other work makes tasks longer, never shorter

/** Milliseconds of processor time of each task of a page's main thread until its finer tier stands, longest first. */
export async function tasksOf(browser, url, size = {}) {
  const prepare = (page) => browser.startTracing(page, { categories: ["toplevel", "blink.user_timing"] });
  const { page, log, close } = await open(browser, url, { prepare, ...size });
  await ready(page, "detail");
  await page.evaluate((name) => performance.mark(name), MARK);
  const { traceEvents: events } = JSON.parse((await browser.stopTracing()).toString());
  fine(log);
  await close();
  const own = events.find(({ name }) => name === MARK); // the browser has pages of its own
  const tasks = events.filter(({ name, pid, tid }) => name === TASK && pid === own.pid && tid === own.tid);
  return tasks.map(({ tdur = 0 }) => tdur / 1000).sort((one, two) => two - one);
}

export const tasks = {
  async "no task keeps a slow phone from answering"(browser, { disk, odd }) {
    for (const url of [disk, odd.many]) {
      let least = Infinity;
      for (let k = 0; k < TRIES && least > MOST / SLOWER; k++) {
        const [longest, next] = await tasksOf(browser, url);
        assert.ok(next > 0, "the trace holds no tasks");
        least = Math.min(least, longest);
      }
      assert.ok(SLOWER * least <= MOST, `a task of ${least} ms, which is ${SLOWER * least} ms on a phone`);
    }
  },
};
