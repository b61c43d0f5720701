// Three engines by WebDriver's commands: Firefox hears them on a socket of its own (Marionette), WebKitGTK by HTTP from its driver,
// Chromium from Playwright. Playwright 1.65 speaks to neither of the others: its Firefox channel needs a newer Firefox than Debian's,
// its WebKit is a build of its own.

import { spawn } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { connect, createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { setTimeout as sleep } from "node:timers/promises";
import { chromium as playwright } from "@playwright/test";
import { LAUNCH } from "../../../../viewer/tests/browser.mjs";

const PATIENCE_MS = 60_000;
const PAUSE_MS = 150;
const CLICK_MS = 5_000; // then the element is looked for again
const WINDOW = { width: 500, height: 900 }; // WebKit's MiniBrowser gets no narrower
const ELEMENT = "element-6066-11e4-a52e-4f735466cecf";

/** Wait until `what` returns something that counts as true, and return it. */
export async function until(what, hint = String(what)) {
  let last;
  for (const end = Date.now() + PATIENCE_MS; Date.now() < end; await sleep(PAUSE_MS)) {
    try {
      const found = await what();
      if (found) return found;
    } catch (error) {
      last = error;
    }
  }
  throw new Error(`not so after ${PATIENCE_MS / 1000} s: ${hint}`, { cause: last });
}

const FIREFOX = process.env.WALLTOPO_FIREFOX ?? "/usr/bin/firefox-esr";
const WEBKIT = process.env.WALLTOPO_WEBKIT ?? "/usr/bin/WebKitWebDriver";

/** Commands as Marionette names them: `[name, method, path]` of each in WebDriver's HTTP. */
const HTTP = {
  NewSession: ["POST", ""],
  DeleteSession: ["DELETE", ""],
  Navigate: ["POST", "/url"],
  SetTimeouts: ["POST", "/timeouts"],
  SetWindowRect: ["POST", "/window/rect"],
  FindElement: ["POST", "/element"],
  ElementClick: ["POST", "/element/{id}/click"],
  ElementClear: ["POST", "/element/{id}/clear"],
  ElementSendKeys: ["POST", "/element/{id}/value"],
  ExecuteAsyncScript: ["POST", "/execute/async"],
  TakeScreenshot: ["GET", "/screenshot"],
};

/** A running Firefox; `command(name, parameters)` resolves to its value. */
async function firefox() {
  const profile = mkdtempSync(join(tmpdir(), "walltopo-firefox-"));
  const preferences = {
    "marionette.port": 0, "browser.shell.checkDefaultBrowser": false, "browser.aboutwelcome.enabled": false, "datareporting.policy.dataSubmissionEnabled": false,
    "app.update.enabled": false, "network.captive-portal-service.enabled": false, "intl.accept_languages": "en-GB", "webgl.force-enabled": true,
    "ui.prefersReducedMotion": 1, "dom.disable_open_during_load": false,
  };
  writeFileSync(join(profile, "user.js"), Object.entries(preferences).map(([name, value]) => `user_pref("${name}", ${JSON.stringify(value)});\n`).join(""));
  const child = spawn(FIREFOX, ["--marionette", "--no-remote", "--profile", profile], { stdio: "ignore" });
  const file = join(profile, "MarionetteActivePort");
  const port = await until(() => existsSync(file) && Number(readFileSync(file, "utf8")), "Firefox opened its port");
  const socket = connect(port, "127.0.0.1");
  const waiting = new Map();
  let text = Buffer.alloc(0);
  socket.on("data", (piece) => {
    text = Buffer.concat([text, piece]);
    // Each message comes as its length in bytes, a colon, and JSON.
    for (let at; (at = text.indexOf(":")) > 0; ) {
      const end = at + 1 + Number(text.subarray(0, at));
      if (text.length < end) return;
      const message = JSON.parse(text.subarray(at + 1, end));
      text = text.subarray(end);
      if (Array.isArray(message)) waiting.get(message[1])?.(message);
    }
  });
  let last = 0;
  const command = async (name, parameters = {}) => {
    const number = ++last;
    const sent = JSON.stringify([0, number, `WebDriver:${name}`, parameters]);
    const [, , error, result] = await new Promise((resolve) => {
      waiting.set(number, resolve);
      socket.write(`${Buffer.byteLength(sent)}:${sent}`);
    });
    waiting.delete(number);
    if (error) throw new Error(`${name}: ${error.error}: ${error.message}`);
    return result && "value" in result ? result.value : result;
  };
  const end = async () => {
    socket.destroy();
    await ended(child);
    rmSync(profile, { recursive: true, force: true, maxRetries: 5 });
  };
  return { command, end, capabilities: { acceptInsecureCerts: true } };
}

async function webkit() {
  const port = await freePort();
  const child = spawn(WEBKIT, [`--port=${port}`], { stdio: "ignore", env: { ...process.env, LANG: "en_GB.UTF-8", LANGUAGE: "en_GB" } });
  let session = "/session";
  const command = async (name, { id, ...parameters } = {}) => {
    const [method, path] = HTTP[name];
    const body = method === "POST" ? JSON.stringify(parameters) : undefined;
    const answer = await fetch(`http://127.0.0.1:${port}${session}${path.replace("{id}", id)}`, { method, body });
    const { value } = await answer.json();
    if (!answer.ok) throw new Error(`${name}: ${value.error}: ${value.message}`);
    if (name === "NewSession") session = `/session/${value.sessionId}`;
    return value;
  };
  await until(() => fetch(`http://127.0.0.1:${port}/status`), "WebKit's driver answers");
  const binary = process.env.WALLTOPO_MINIBROWSER ?? "/usr/lib/x86_64-linux-gnu/webkit2gtk-4.1/MiniBrowser";
  const options = { binary, args: ["--automation"] };
  const end = async () => {
    await command("DeleteSession").catch(() => undefined);
    await ended(child);
  };
  return { command, end, capabilities: { acceptInsecureCerts: true, "webkitgtk:browserOptions": options } };
}

/** A running Chromium: the commands as Playwright has them. */
async function chromium() {
  // With this option alone a service worker comes over a certificate of our own.
  const browser = await playwright.launch({ ...LAUNCH, args: [...LAUNCH.args, "--ignore-certificate-errors"] });
  const context = await browser.newContext({ ignoreHTTPSErrors: true, locale: "en-GB", reducedMotion: "reduce" });
  const page = await context.newPage();
  const elements = new Map();
  const handleOf = (value) => elements.get(value?.[ELEMENT]) ?? value;
  const commands = {
    NewSession: () => undefined,
    SetTimeouts: ({ pageLoad }) => context.setDefaultTimeout(pageLoad),
    SetWindowRect: (size) => page.setViewportSize(size),
    Navigate: ({ url }) => page.goto(url),
    async FindElement({ value }) {
      const found = await page.$(`xpath=${value}`);
      if (!found) throw new Error(`no such element: ${value}`);
      const id = String(elements.size + 1);
      elements.set(id, found);
      return { [ELEMENT]: id };
    },
    ElementClick: ({ id }) => elements.get(id).click({ timeout: CLICK_MS }),
    ElementClear: ({ id }) => elements.get(id).fill(""),
    async ElementSendKeys({ id, text }) {
      const element = elements.get(id);
      const isFile = await element.evaluate((at) => at.type === "file");
      await (isFile ? element.setInputFiles(text.split("\n")) : element.pressSequentially?.(text) ?? element.type(text));
    },
    ExecuteAsyncScript({ script, args }) {
      const act = new Function("args", `return new Promise((done) => (function () { ${script} })(...args, done))`);
      return page.evaluate(act, args.map(handleOf));
    },
    TakeScreenshot: async () => (await page.screenshot()).toString("base64"),
  };
  const command = async (name, parameters = {}) => commands[name](parameters);
  return { command, end: () => browser.close(), capabilities: {} };
}

async function ended(child) {
  if (child.exitCode !== null || child.signalCode !== null) return;
  const gone = new Promise((resolve) => child.once("exit", resolve));
  child.kill();
  await gone;
}

export function freePort() {
  return new Promise((resolve) => {
    const server = createServer().listen(0, "127.0.0.1", () => {
      const { port } = server.address();
      server.close(() => resolve(port));
    });
  });
}

const ENGINES = { chromium, firefox, webkit };

/** A browser of an engine with one page, on a server at `address`. */
export async function open(engine, address) {
  const { command, end, capabilities } = await ENGINES[engine]();
  const asked = engine === "firefox" ? capabilities : { capabilities: { alwaysMatch: capabilities } };
  try {
    await command("NewSession", asked);
    await command("SetTimeouts", { script: PATIENCE_MS, pageLoad: PATIENCE_MS, implicit: 0 });
    await command("SetWindowRect", WINDOW);
  } catch (error) {
    await end();
    throw error;
  }
  return new Page(command, end, address);
}

/** XPaths of what people see. Both engines' drivers find elements by them. */
const NAME = (text) => `normalize-space()="${text}" or @aria-label="${text}"`;
export const button = (text) => `//main//button[${NAME(text)}] | //dialog//button[${NAME(text)}]`;
export const link = (text) => `//a[contains(normalize-space(), "${text}")]`;
export const field = (label) => `//input[@id=//label[normalize-space()="${label}"]/@for]`;
export const saying = (text) => `//*[not(self::script) and contains(text(), "${text}")]`;

export class Page {
  constructor(command, end, address) {
    Object.assign(this, { command, end, address });
  }

  async go(path) {
    await this.command("Navigate", { url: this.address + path });
    await this.find("//h1");
  }

  /** Go to the same address again. WebDriver's refresh would bypass the service worker in Firefox. */
  async reload() {
    await this.go(await this.evaluate(() => location.pathname + location.search));
  }

  /** Call a function in the page with values as arguments; waits for what it promises. */
  async evaluate(act, ...args) {
    const script = `
      const [args, done] = [[...arguments].slice(0, -1), arguments[arguments.length - 1]];
      Promise.resolve().then(() => (${act})(...args)).then((value) => done({ value }), (error) => done({ failed: String(error) }));`;
    const { value, failed } = await this.command("ExecuteAsyncScript", { script, args });
    if (failed) throw new Error(failed);
    return value;
  }

  /** Wait until something is there; returns how the driver names it. */
  find(xpath) {
    return until(async () => (await this.command("FindElement", { using: "xpath", value: xpath }))[ELEMENT], `${xpath} is there`);
  }

  /** Wait for words. */
  says(text) {
    return this.find(saying(text));
  }

  async click(xpath) {
    await until(async () => {
      const id = await this.find(xpath); // again: pages replace what they show
      await this.evaluate((at) => at.scrollIntoView({ block: "center" }), { [ELEMENT]: id }); // from below bars
      await this.command("ElementClick", { id });
      return true;
    }, `${xpath} can be clicked`);
  }

  async fill(xpath, text) {
    const id = await this.find(xpath);
    await this.command("ElementClear", { id });
    await this.command("ElementSendKeys", { id, text });
  }

  /** Give files to a file chooser. */
  async choose(xpath, files) {
    const id = await this.find(xpath);
    await this.command("ElementSendKeys", { id, text: files.join("\n") });
  }

  /** Wait until a function in the page returns something that counts as true. */
  becomes(act, ...args) {
    return until(() => this.evaluate(act, ...args), String(act));
  }

  async screenshot() {
    return Buffer.from(await this.command("TakeScreenshot"), "base64");
  }
}
