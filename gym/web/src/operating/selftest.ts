/** Measure the abilities of this browser. The results name no person, gym or wall. */

import { createStore, get, set } from "idb-keyval";

export const CHECKS = [
  "browser", "screen", "graphics", "frames", "storage", "quota", "worker", "sync", "locks", "camera", "push", "network", "clock",
] as const;

export type Check = (typeof CHECKS)[number];
/** "limited": the app works, with less; "missing": a part of it does not work. */
export type State = "ok" | "limited" | "missing";

export interface Outcome {
  check: Check;
  state: State;
  value: string;
}

type Found = [State, string];

const SIDE = 316; // of the test scene's grid: twice its square are 200,000 triangles
const FRAMES = 40;
const LONGEST_MS = 3_000; // a slow phone draws fewer of them
const FLUENT_MS = 33;
const REQUESTS = 5;
const CLOCK_S = 60;

const VERTEX = `#version 300 es
in vec2 place;
uniform float turn;
out vec2 at;
void main() {
  at = place;
  vec2 seen = 2.0 * place - 1.0;
  gl_Position = vec4(seen.x * cos(turn), seen.y, 0.1 * sin(9.0 * seen.x + turn), 1.0);
}`;

const FRAGMENT = `#version 300 es
precision mediump float;
in vec2 at;
uniform sampler2D picture;
out vec4 colour;
void main() {
  colour = texture(picture, at) * 0.9 + 0.1;
}`;

const median = (values: number[]): number => values.toSorted((a, b) => a - b)[values.length >> 1] ?? NaN;

function graphics(): Found {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) return ["missing", "no WebGL 2"];
  const side = gl.getParameter(gl.MAX_TEXTURE_SIZE) as number;
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return [side >= 4096 ? "ok" : "limited", `WebGL 2, textures up to ${side} px`];
}

function shader(gl: WebGL2RenderingContext, kind: number, source: string): WebGLShader {
  const made = gl.createShader(kind)!;
  gl.shaderSource(made, source);
  gl.compileShader(made);
  return made;
}

/** Prepare the test scene; return how to draw it at an angle and wait until it is drawn. */
function scene(gl: WebGL2RenderingContext): (turn: number) => void {
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl, gl.VERTEX_SHADER, VERTEX));
  gl.attachShader(program, shader(gl, gl.FRAGMENT_SHADER, FRAGMENT));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? "no program");
  gl.useProgram(program);
  const places = new Float32Array(2 * (SIDE + 1) ** 2);
  const corners = new Uint32Array(6 * SIDE ** 2);
  for (let row = 0, n = 0, m = 0; row <= SIDE; row++) {
    for (let column = 0; column <= SIDE; column++, n++) {
      places.set([column / SIDE, row / SIDE], 2 * n);
      if (row < SIDE && column < SIDE) {
        corners.set([n, n + 1, n + SIDE + 1, n + 1, n + SIDE + 2, n + SIDE + 1], m);
        m += 6;
      }
    }
  }
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, places, gl.STATIC_DRAW);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
  const place = gl.getAttribLocation(program, "place");
  gl.enableVertexAttribArray(place);
  gl.vertexAttribPointer(place, 2, gl.FLOAT, false, 0, 0);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, 2048, 2048);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  const turn = gl.getUniformLocation(program, "turn");
  const pixel = new Uint8Array(4);
  return (angle) => {
    gl.uniform1f(turn, angle);
    gl.drawElements(gl.TRIANGLES, corners.length, gl.UNSIGNED_INT, 0);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // waits until the frame is drawn
  };
}

async function frames(): Promise<Found> {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 1024;
  const gl = canvas.getContext("webgl2");
  if (!gl) return ["missing", "no WebGL 2"];
  const draw = scene(gl);
  const times: number[] = [];
  const first = performance.now();
  while (times.length < FRAMES && performance.now() - first < LONGEST_MS) {
    const begun = performance.now();
    draw(times.length / 10);
    times.push(performance.now() - begun);
    await new Promise((resolve) => setTimeout(resolve));
  }
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  const typical = median(times);
  return [typical <= FLUENT_MS ? "ok" : "limited", `${typical.toFixed(1)} ms for 200,000 triangles`];
}

/** The round trip of an entry through the phone's storage, as a tick takes it before it is sent. */
async function storage(): Promise<Found> {
  const store = createStore("walltopo-selftest", "values");
  const begun = performance.now();
  const value = String(Math.random());
  await set("value", value, store);
  const same = (await get<string>("value", store)) === value;
  indexedDB.deleteDatabase("walltopo-selftest");
  return [same ? "ok" : "missing", `${(performance.now() - begun).toFixed(0)} ms`];
}

async function quota(): Promise<Found> {
  const { quota: most = 0, usage = 0 } = (await navigator.storage?.estimate?.()) ?? {};
  const persisted = (await navigator.storage?.persisted?.()) ?? false;
  const words = `${(usage / 1e6).toFixed(0)} of ${(most / 1e6).toFixed(0)} MB, ${persisted ? "kept" : "may be evicted"}`;
  return [most > 200e6 ? "ok" : "limited", words];
}

async function worker(): Promise<Found> {
  if (!("serviceWorker" in navigator)) return ["missing", "no service worker"];
  const registration = await navigator.serviceWorker.getRegistration();
  return registration?.active ? ["ok", "active"] : ["limited", "not active yet"];
}

async function sync(): Promise<Found> {
  const registration = await navigator.serviceWorker?.getRegistration();
  return registration && "sync" in registration ? ["ok", "in the background"] : ["limited", "while the app is open"];
}

async function camera(): Promise<Found> {
  const devices = (await navigator.mediaDevices?.enumerateDevices?.()) ?? [];
  return devices.some(({ kind }) => kind === "videoinput") ? ["ok", "there"] : ["limited", "none"];
}

async function network(): Promise<Found> {
  const times: number[] = [];
  for (let number = 0; number < REQUESTS; number++) {
    const begun = performance.now();
    const answer = await fetch("/health", { cache: "no-store" });
    if (!answer.ok) return ["missing", `status ${answer.status}`];
    times.push(performance.now() - begun);
  }
  const typical = median(times);
  return [typical < 1000 ? "ok" : "limited", `${typical.toFixed(0)} ms a request`];
}

async function clock(): Promise<Found> {
  const date = (await fetch("/health", { cache: "no-store" })).headers.get("date");
  if (date === null) return ["limited", "the server tells no time"];
  const off = Math.round((Date.now() - Date.parse(date)) / 1000);
  return [Math.abs(off) <= CLOCK_S ? "ok" : "limited", `${off} s from the server's`];
}

const has = (name: string, scope: object): Found => (name in scope ? ["ok", "there"] : ["limited", "none"]);

const PROBES: Record<Check, () => Found | Promise<Found>> = {
  browser: () => ["ok", navigator.userAgent],
  screen: () => ["ok", `${innerWidth} x ${innerHeight} px, ${devicePixelRatio} device pixels each`],
  graphics,
  frames,
  storage,
  quota,
  worker,
  sync,
  locks: () => has("locks", navigator),
  camera,
  push: () => has("PushManager", globalThis),
  network,
  clock,
};

/** Run one check; a browser that throws lacks the part. */
export async function run(check: Check): Promise<Outcome> {
  try {
    const [state, value] = await PROBES[check]();
    return { check, state, value };
  } catch (error) {
    return { check, state: "missing", value: error instanceof Error ? error.message : String(error) };
  }
}

/** The outcomes as text, to be sent to who runs the server. */
export function report(outcomes: Outcome[]): string {
  return ["walltopo self-test", ...outcomes.map(({ check, state, value }) => `${check}: ${state} (${value})`)].join("\n");
}
